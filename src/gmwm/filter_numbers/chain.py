"""A filter of one axis: a chain of integrators that is aided, then not, by covariance analysis.

The error of a sensor is integrated once (heading), twice (velocity, position) or three times (tilt,
velocity, position). A filter with given numbers estimates it from fixes of the last integral, and
goes on without them. Transitions and noise over any number of samples are those of the sampled
processes, exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import factorial

import numpy as np
from scipy.linalg import eigh

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.chain_kernels import settle
from gmwm.process import Model, StateSpace, block_diagonal


@dataclass(frozen=True, eq=False)
class ChainErrors:
    """Errors of the integrals at T times.

    time: (T,), since the last fix, s.
    predicted, actual: (T, n, n), covariance of the errors of the n integrals, the filter's own and
        the true one.
    """

    time: FloatArray
    predicted: FloatArray
    actual: FloatArray

    def nees(self) -> FloatArray:
        """Expected normalised error squared per degree of freedom, (T,).

        Of what the filter does not predict to be exactly known.
        """
        size = np.sqrt(np.diagonal(self.predicted, axis1=1, axis2=2))
        scale = np.where(size > 0.0, size, 1.0)
        outer = scale[:, :, None] * scale[:, None, :]
        ratio = np.linalg.pinv(self.predicted / outer, hermitian=True) @ (self.actual / outer)
        return np.asarray(np.trace(ratio, axis1=1, axis2=2) / self.predicted.shape[1])

    def worst(self) -> FloatArray:
        """Largest eigenvalue of P_predicted^-1 P_actual: the worst direction, (T,)."""
        pairs = zip(self.actual, self.predicted, strict=True)
        return np.array([eigh(a, p, eigvals_only=True)[-1] for a, p in pairs])

    def score(self) -> FloatArray:
        """Expected negative logarithm of the predicted density at the truth, (T,)."""
        size = self.predicted.shape[1]
        log_det = np.linalg.slogdet(self.predicted)[1]
        return np.asarray(0.5 * (size * self.nees() + log_det + size * np.log(2.0 * np.pi)))

    def tightness(self) -> FloatArray:
        """Predicted over true standard deviation of the last integral, (T,)."""
        return np.sqrt(self.predicted[:, -1, -1] / self.actual[:, -1, -1])


@dataclass(frozen=True)
class Chain:
    """What is integrated, and how it is aided.

    order: Number n of integrals.
    fix_sd: Of a fix of the last integral, in its unit.
    settled: Time with fixes before they end, s; zero for none.
    interval: Between fixes, s.
    initial_sd: Of the integrals at the start.
    is_relative: Whether the last integral starts anew at each fix, as a relative pose at a
        keyframe.
    is_gained: Whether it is counted from the last fix, of whose error it has no part.
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
        """That of a gyro, an accelerometer or an unknown axis."""
        return cls(tuning.ORDER[quantity], tuning.FIX_SD[quantity])

    def errors(
        self,
        truth: Model,
        believed: Model,
        dt: float,
        times: Sequence[float],
        *,
        true_sd: float = 0.0,
        believed_sd: float = 0.0,
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
        real, own = _with_constant(truth, true_sd, dt), _with_constant(believed, believed_sd, dt)
        n, q = self.order, own.n_states
        start = np.diag(np.square(self.initial_sd[:n]))
        P = block_diagonal([start, _moments(own)])
        J = block_diagonal([start, np.zeros((q, q)), _moments(real)])
        kept: list[tuple[float, FloatArray, FloatArray]] = []

        def lasting(duration: float) -> _Step:
            samples = max(round(duration / dt), 0)
            return _Step.of(
                _over(truth, true_sd, dt, n, samples),
                _over(believed, believed_sd, dt, n, samples),
                n,
            )

        fixes = int(self.settled / self.interval)
        if fixes > 0:
            step = lasting(self.interval)
            shape = (fixes - 1 if every_fix else 0, n, n)
            after_P, after_J = np.empty(shape), np.empty(shape)
            P, J = settle(
                P, J, *step.filter, *step.joint, n, q, self.fix_sd**2, self.is_relative, fixes,
                after_P, after_J,
            )  # fmt: skip
            ages = (np.arange(shape[0]) + 1 - fixes) * self.interval
            kept = list(zip(ages, after_P, after_J, strict=True))
        if self.is_gained:
            for each in (P, J):
                each[n - 1], each[:, n - 1] = 0.0, 0.0
        before = 0.0
        for time in times:
            P, J = lasting(time - before).over(P, J)
            before = time
            kept.append((time, P[:n, :n], J[:n, :n]))
        columns = list(zip(*kept, strict=True))
        return ChainErrors(*(np.array(column) for column in columns))

    @property
    def judged(self) -> list[Chain]:
        """The chain; of one integral, also what it gains.

        An absolute fix of half a degree hides what it gains in a minute, which is what counts for a
        dead reckoning, or for a filter that has no fixes of it.
        """
        gains = self.order == 1 and not self.is_relative
        return [self, replace(self, is_gained=True)] if gains else [self]

    def worse(
        self,
        truth: Model,
        believed: Model,
        dt: float,
        times: Sequence[float],
        true_sd: float,
        believed_sd: float,
    ) -> ChainErrors:
        """Those of what an integral gains where they are the worse, of the integrals elsewhere."""
        whole, *others = (
            each.errors(truth, believed, dt, times, true_sd=true_sd, believed_sd=believed_sd)
            for each in self.judged
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


@dataclass(frozen=True, eq=False)
class _Step:
    """Some samples of the filter's errors (integrals, bias), and of the joint vector.

    The joint vector holds the errors of the integrals, the filter's estimates of its states, and
    the true states.
    """

    filter: tuple[FloatArray, FloatArray]
    joint: tuple[FloatArray, FloatArray]

    @classmethod
    def of(
        cls, real: tuple[FloatArray, FloatArray], own: tuple[FloatArray, FloatArray], n: int
    ) -> _Step:
        (true_M, true_Q), (own_M, _) = real, own
        q, p = len(own_M) - n, len(true_M) - n
        M, Q = np.zeros((n + q + p, n + q + p)), np.zeros((n + q + p, n + q + p))
        for whole, part in ((M, true_M), (Q, true_Q)):
            whole[:n, :n], whole[:n, n + q :] = part[:n, :n], part[:n, n:]
            whole[n + q :, :n], whole[n + q :, n + q :] = part[n:, :n], part[n:, n:]
        M[:n, n : n + q] = -own_M[:n, n:]
        M[n : n + q, n : n + q] = own_M[n:, n:]
        return cls(own, (M, Q))

    def over(self, P: FloatArray, J: FloatArray) -> tuple[FloatArray, FloatArray]:
        (A, Q), (B, R) = self.filter, self.joint
        return A @ P @ A.T + Q, B @ J @ B.T + R


@lru_cache(maxsize=256)
def _over(
    model: Model, sd: float, dt: float, n: int, samples: int
) -> tuple[FloatArray, FloatArray]:
    """Transition and noise of n integrals and the states over some samples.

    A search for numbers asks for those of the truth with all that it tries, and each chain of
    `Chain.judged` for the same.
    """
    return _power(*_integrated(_with_constant(model, sd, dt), dt, n), samples)


@lru_cache(maxsize=64)
def _with_constant(model: Model, sd: float, dt: float) -> StateSpace:
    """State-space form of a model and of a constant, which is the start of a walk if it has one."""
    forms = []
    variance = sd**2
    for term in model.terms:
        if not term.has_spectrum():
            raise InputError(f"{type(term).__name__} is known by simulation only")
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


def _integrated(form: StateSpace, dt: float, n: int) -> tuple[FloatArray, FloatArray]:
    """Transition and noise of n integrals and the states over one sample."""
    size = n + form.n_states
    lag = np.subtract.outer(np.arange(n), np.arange(n))
    powers = np.array([dt**k / factorial(k) for k in range(n + 1)])
    M, Q = np.zeros((size, size)), np.zeros((size, size))
    M[:n, :n] = np.where(lag >= 0, powers[np.maximum(lag, 0)], 0.0)
    M[:n, n:] = np.outer(powers[1:], form.output)
    M[n:, n:] = form.transition
    Q[:n, :n] = form.measurement_noise * np.outer(powers[1:], powers[1:])
    Q[n:, n:] = form.process_noise
    return M, Q


def _power(M: FloatArray, Q: FloatArray, times: int) -> tuple[FloatArray, FloatArray]:
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
