"""A filter of one axis: a chain of integrators that is aided, then not, by covariance analysis.

The error of a sensor is integrated once (heading), twice (velocity, position) or three times (tilt,
velocity, position). A filter with given numbers estimates it from fixes of the last integral, and
goes on without them. Transitions and noise over any number of samples are those of the sampled
processes, exactly. Truth and filter are propagated jointly, as in `gmwm.ins.covariance_analysis`,
of which this is the time-invariant case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import factorial

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.filter_numbers import tuning
from gmwm.ins.covariance import CovarianceErrors, LinearStep, aid_jointly
from gmwm.process import Model, StateSpace, block_diagonal


class ChainErrors(CovarianceErrors):
    """Errors of the n integrals of a chain at T times since the last fix."""

    def tightness(self) -> FloatArray:
        """Predicted over true standard deviation of the last integral, (T,)."""
        return np.sqrt(self.predicted[:, -1, -1] / self.actual[:, -1, -1])


@dataclass(frozen=True)
class Chain:
    """What is integrated, and how it is aided.

    order: Number n of integrals.
    fix_sd: Standard deviation of a fix of the last integral, in its unit.
    settled: Time with fixes before they end, s; zero for none.
    interval: Between fixes, s.
    initial_sd: Standard deviations of the integrals at the start.
    is_relative: Whether the last integral starts anew at each fix, as a relative pose at a
        keyframe.
    is_gained: Whether it is counted from the last fix, without the error of that fix.
    """

    order: int
    fix_sd: float
    settled: float = tuning.SETTLING
    interval: float = tuning.FIX_INTERVAL
    initial_sd: tuple[float, ...] = tuning.INITIAL_SD
    is_relative: bool = False
    is_gained: bool = False

    @classmethod
    def usual(cls, quantity: str) -> Chain:
        """The chain of a gyro, an accelerometer or an unknown axis."""
        return cls(tuning.ORDER[quantity], tuning.FIX_SD[quantity])

    @classmethod
    def of_poses(cls, quantity: str, keyframe: float) -> Chain:
        """The chain of relative poses, an interval (s) apart."""
        order, sd = tuning.KEYFRAME_ORDER[quantity], tuning.KEYFRAME_SD[quantity]
        return cls(order, sd, tuning.KEYFRAMES * keyframe, keyframe, is_relative=True)

    @property
    def judged(self) -> list[Chain]:
        """The chain; of one integral, also its gain since the last fix.

        An absolute fix of half a degree hides the gain of a minute, which is what counts for dead
        reckoning, or for a filter without fixes of it.
        """
        gains = self.order == 1 and not self.is_relative
        return [self, replace(self, is_gained=True)] if gains else [self]

    def errors(
        self,
        truth: Model,
        believed: Model,
        dt: float,
        times: Sequence[float],
        true_sd: float = 0.0,
        believed_sd: float = 0.0,
        *,
        every_fix: bool = False,
    ) -> ChainErrors:
        """Predicted and true errors of the integrals after some times without aiding.

        truth, believed: Of the sensor, and in the filter.
        dt: Sampling interval, s.
        times: Rising, s.
        true_sd, believed_sd: Standard deviation of a constant bias, or of the start of a walk.
        every_fix: Whether the errors after every fix come first, with negative times.
        Raises InputError if a term has no state-space form.
        """
        n = self.order
        real, own = (with_constant(truth, true_sd, dt), with_constant(believed, believed_sd, dt))
        q = own.n_states
        start = np.diag(np.square(self.initial_sd[:n]))
        P = block_diagonal([start, _moments(own)])
        J = block_diagonal([start, np.zeros((q, q)), _moments(real)])

        def lasting(duration: float) -> LinearStep:
            samples = max(round(duration / dt), 0)
            of_truth, of_filter = (
                _over(model, sd, dt, n, samples)
                for model, sd in ((truth, true_sd), (believed, believed_sd))
            )
            return _joint_step(of_truth, of_filter, n)

        kept: list[tuple[float, FloatArray, FloatArray]] = []
        fixes = int(self.settled / self.interval)
        if fixes > 0:
            shape = (fixes - 1 if every_fix else 0, n, n)
            after_P, after_J = np.empty(shape), np.empty(shape)
            step, variance = lasting(self.interval), self.fix_sd**2
            P, J = aid_jointly(P, J, step, n, variance, self.is_relative, fixes, after_P, after_J)
            ages = (np.arange(shape[0]) + 1 - fixes) * self.interval
            kept = list(zip(ages, after_P, after_J, strict=True))
        if self.is_gained:
            for each in (P, J):
                each[n - 1], each[:, n - 1] = 0.0, 0.0
        before = 0.0
        for time in times:
            step = lasting(time - before)
            P = step.A @ P @ step.A.T + step.Q
            J = step.B @ J @ step.B.T + step.R
            before = time
            kept.append((time, P[:n, :n], J[:n, :n]))
        columns = list(zip(*kept, strict=True))
        return ChainErrors(*(np.array(column) for column in columns))

    def worse(
        self,
        truth: Model,
        believed: Model,
        dt: float,
        times: Sequence[float],
        true_sd: float,
        believed_sd: float,
    ) -> ChainErrors:
        """Elementwise worst of the errors of a chain and, of one integral, of its gain."""
        whole, *others = (
            each.errors(truth, believed, dt, times, true_sd, believed_sd) for each in self.judged
        )
        for gained in others:
            least = tuning.HIDDEN * np.maximum(whole.nees(), 1.0)[:, None, None]
            worse = (gained.predicted > 0.0) & (gained.actual > least * gained.predicted)
            whole = ChainErrors(
                whole.time,
                np.where(worse, gained.predicted, whole.predicted),
                np.where(worse, gained.actual, whole.actual),
            )
        return whole


def _joint_step(
    real: tuple[FloatArray, FloatArray], own: tuple[FloatArray, FloatArray], n: int
) -> LinearStep:
    """Some samples of the filter, and of the joint vector.

    The joint vector holds the errors of the integrals, the filter's estimates of its states, and
    the true states.
    """
    q, p = len(own[0]) - n, len(real[0]) - n
    true = np.append(np.arange(n), n + q + np.arange(p))
    M, Q = np.zeros((n + q + p, n + q + p)), np.zeros((n + q + p, n + q + p))
    M[np.ix_(true, true)], Q[np.ix_(true, true)] = real
    M[:n, n : n + q] = -own[0][:n, n:]
    M[n : n + q, n : n + q] = own[0][n:, n:]
    return LinearStep(*own, M, Q)


@lru_cache(maxsize=256)
def _over(
    model: Model, sd: float, dt: float, n: int, samples: int
) -> tuple[FloatArray, FloatArray]:
    """Transition and noise of n integrals and the states over some samples.

    Cached: a search for numbers asks for the truth's with every model that it tries.
    """
    return power(*integrated(with_constant(model, sd, dt), dt, n), samples)


@lru_cache(maxsize=64)
def with_constant(model: Model, sd: float, dt: float) -> StateSpace:
    """State-space form of a model and of a constant, which is the start of a walk if it has one.

    Raises InputError if a term has no state-space form.
    """
    forms = []
    variance = sd**2
    for term in model.terms:
        if not term.has_spectrum():
            raise InputError(f"{type(term).__name__} can only be simulated")
        form = term.state_space(dt)
        if term.is_walk and variance > 0.0:
            form = StateSpace.scalar("walk", 1.0, float(form.process_noise[0, 0]), variance)
            variance = 0.0
        forms.append(form)
    if variance > 0.0:
        forms.append(StateSpace.scalar("constant", 1.0, 0.0, variance))
    return StateSpace.stack(forms)


def _moments(form: StateSpace) -> FloatArray:
    """Second moments at the start: a mean that the filter does not know counts as error."""
    return form.initial_covariance + np.outer(form.initial_mean, form.initial_mean)


def integrated(form: StateSpace, h: float, n: int) -> tuple[FloatArray, FloatArray]:
    """Transition and noise of n integrals and the states over one sample, held for h seconds."""
    size = n + form.n_states
    chain, gain = held(h, n)
    M, Q = np.zeros((size, size)), np.zeros((size, size))
    M[:n, :n] = chain
    M[:n, n:] = np.outer(gain, form.output)
    M[n:, n:] = form.transition
    Q[:n, :n] = form.measurement_noise * np.outer(gain, gain)
    Q[n:, n:] = form.process_noise
    return M, Q


def held(h: float, n: int) -> tuple[FloatArray, FloatArray]:
    """Transition of n integrals over h seconds, and their gain from an input that is held."""
    lag = np.subtract.outer(np.arange(n), np.arange(n))
    powers = np.array([h**k / factorial(k) for k in range(n + 1)])
    return np.where(lag >= 0, powers[np.maximum(lag, 0)], 0.0), powers[1:]


def power(M: FloatArray, Q: FloatArray, times: int) -> tuple[FloatArray, FloatArray]:
    """Transition and noise over several samples, by doubling."""
    result, noise = np.eye(len(M)), np.zeros_like(Q)
    while times:
        if times & 1:
            noise = M @ noise @ M.T + Q
            result = M @ result
        Q = M @ Q @ M.T + Q
        M = M @ M
        times >>= 1
    return result, noise
