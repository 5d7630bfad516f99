"""A filter of one axis: a chain of integrators that is aided, then not, by covariance analysis.

The error of a sensor is integrated once (heading), twice (velocity, position) or three times (tilt,
velocity, position). A filter with given numbers estimates it from fixes of the last integral, and
goes on without them. Transitions and noise over any number of samples are those of the sampled
processes, exactly. Truth and filter are propagated jointly, as in `gmwm.ins.covariance_analysis`,
whose time-invariant case this is. The error of a process without states is integrated by its
spectrum.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import factorial
from typing import Self

import numpy as np
from scipy.special import gamma

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.filter_numbers import tuning
from gmwm.ins.covariance import CovarianceErrors
from gmwm.ins.joint_kernels import LinearStep, aid_jointly
from gmwm.process import (
    BiasInstability,
    Model,
    Process,
    StateSpace,
    block_diagonal,
    evaluated,
    legendre,
)


class ChainErrors(CovarianceErrors):
    """Errors of the n integrals of a chain at T times since the last fix."""

    def tightness(self) -> FloatArray:
        """Predicted over true standard deviation of the last integral, (T,)."""
        return np.sqrt(self.predicted[:, -1, -1] / self.actual[:, -1, -1])


@dataclass(frozen=True)
class Chain:
    """What is integrated, and how it is aided.

    fix_sd: Standard deviation of a fix of the last integral, in its unit.
    settled: Time with fixes before they end, s; zero for none.
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
    def usual(cls, quantity: str) -> Self:
        """The chain of a gyro, an accelerometer or an unknown axis."""
        return cls(tuning.ORDER[quantity], tuning.FIX_SD[quantity])

    @classmethod
    def of_poses(cls, quantity: str, keyframe: float) -> Self:
        """The chain of relative poses, an interval (s) apart."""
        order, sd = tuning.KEYFRAME_ORDER[quantity], tuning.KEYFRAME_SD[quantity]
        return cls(order, sd, tuning.KEYFRAMES * keyframe, keyframe, is_relative=True)

    @property
    def judged(self) -> list[Self]:
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
    """State-space form of a model and of a constant, which is the start of a walk if it has one."""
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


ORDERS = 3
"""Integrals: once, twice and three times."""

_WHOLE = 1e-6  # of a step: a time that close to a multiple of dt is one
_CANCELS = 3e-3  # 2 pi f t below which the difference of the two parts of a gain is all rounding
_DIVERGES = 2.0  # rise of a spectrum over the lowest octaves that makes a simulation start at zero
_RESOLVED = 400.0  # 2 pi f t up to which lobes are resolved
_PANELS, _NODES_PER_PANEL = 16, 8  # an octave
_OCTAVES_BELOW = 26
_SLOWEST = 1e-60  # Hz, of a line that is aliased to a constant
_STEEP_OCTAVES = 20  # below 1/t, the band that must not matter ...
_STEEP_SHARE = 0.01  # ... to more than this share of the variance


def integral_rms(
    process: Process, times: Sequence[float], dt: float, *, known_start: bool
) -> FloatArray:
    """Root mean square of the first, second and third integral of a process from zero to t, (3, T).

    times: Seconds, each at least ``dt``.
    known_start: Whether the states at time zero are known: their initial covariance is then zero,
        and the past of flicker noise is known. The phase of a line is known in neither case, and a
        process that has a spectrum only is treated alike in both. Otherwise the process starts as
        `Process.simulate` starts it.
    Returns: u s, u s^2 and u s^3. A deterministic drift counts by its absolute value.

    With flicker noise S(f) = B^2/(2 pi f) of known past, the integral of order m is the
    Riemann-Liouville process of index m + 1/2 (Mandelbrot & Van Ness 1968, *SIAM Review* 10,
    422-437): its variance is B^2 t^(2m) / (2m Gamma(m + 1/2)^2). A spectrum is
    integrated over 128 frequencies an octave, right from some tens of samples on: a narrower peak
    needs a ``state_space``, or a line in ``lines``.
    """
    t = np.asarray(times, dtype=float)
    if isinstance(process, BiasInstability):
        unknown = _from_spectrum(process, t, dt)
        m = np.arange(1.0, ORDERS + 1.0)[:, None]
        known = process.B * t**m / (np.sqrt(2.0 * m) * gamma(m + 0.5))
        # Within a few samples the continuous-time formula knows less than the first sample shows.
        return np.minimum(known, unknown) if known_start else unknown
    if not process.has_spectrum():
        raise InputError(
            f"{type(process).__name__} can only be simulated and has no error budget: "
            "leave the term out, or simulate and integrate it"
        )
    try:
        form = process.state_space(dt)
    except InputError:
        return _from_spectrum(process, t, dt)
    return _from_states(form, t, dt, known=known_start and not process.lines())


def _from_states(form: StateSpace, t: FloatArray, dt: float, *, known: bool) -> FloatArray:
    mean = np.concatenate([np.zeros(ORDERS), form.initial_mean])
    covariance = np.zeros((mean.size, mean.size))
    if not known:
        covariance[ORDERS:, ORDERS:] = form.initial_covariance
    result = np.empty((ORDERS, t.size))
    for i, time in enumerate(t.tolist()):
        count = int(time / dt + _WHOLE)
        rest = time - count * dt if time / dt - count > _WHOLE else 0.0
        m, P = mean, covariance
        for h, times in ((dt, count), (rest, int(rest > 0.0))):
            step, noise = power(*integrated(form, h, ORDERS), times)
            m, P = step @ m, step @ P @ step.T + noise
        result[:, i] = np.sqrt(m[:ORDERS] ** 2 + np.maximum(np.diag(P)[:ORDERS], 0.0))
    return result


def _from_spectrum(process: Process, t: FloatArray, dt: float) -> FloatArray:
    """2 int S(f) |G(f)|^2 df with the gain G of each integral, less G(0) for a start at zero."""
    # The rule by which a simulation decides whether it starts at zero.
    ends = evaluated(process.psd, np.array([2.5e-5, 0.25]) / np.max(t), dt)
    at_zero = bool(ends[0] > _DIVERGES * ends[1])
    result = np.empty((ORDERS, t.size))
    # Samples that are held lag by half of one, which what starts at zero shows.
    for i, (time, held_time) in enumerate(zip(t.tolist(), (t - 0.5 * dt).tolist(), strict=True)):
        octaves = _OCTAVES_BELOW + np.log2(time / dt)
        edge = np.geomspace(2.0**-_OCTAVES_BELOW / time, 0.5 / dt, int(octaves * _PANELS) + 1)
        x, w = legendre(_NODES_PER_PANEL)
        half = 0.5 * np.diff(edge, prepend=0.0)[:, None]
        f, weight = (edge[:, None] - half + half * x).ravel(), (half * w).ravel()
        gain = _squared_gain(f, held_time if at_zero else time, dt, at_zero)
        share = gain * weight * evaluated(process.psd, f, dt)
        variance = 2.0 * np.sum(share, axis=1)
        low = f < 2.0**-_STEEP_OCTAVES / time
        if np.any(2.0 * np.sum(share[:, low], axis=1) > _STEEP_SHARE * variance):
            raise InputError(
                f"the spectrum of {process!r} rises too fast towards zero frequency for an error "
                "budget: give the process a state_space"
            )
        for frequency, amplitude in process.lines():
            place = np.array([max(abs(frequency - np.rint(frequency * dt) / dt), _SLOWEST)])
            # In continuous time, whose phase is exact.
            gain = _squared_gain(place, time, 1e-6 * dt, False, np.inf)
            variance += 0.5 * amplitude**2 * gain[:, 0]
        drift = [process.drift_rate() * held_time**k / factorial(k) for k in (2, 3, 4)]
        result[:, i] = np.hypot(np.sqrt(variance), drift)
    return result


def _squared_gain(
    f: FloatArray, time: float, dt: float, at_zero: bool, resolved: float = _RESOLVED
) -> FloatArray:
    """|G|^2 of the three integrals, or |G - G(0)|^2 for a start at zero, shape (3, K).

    With w = 2 sin(pi f dt)/dt, that of held samples, the integral of order m of exp(i w t) is what
    the first m terms of its series leave, over (i w)^m; G(0) is one more of them. Beyond an
    angle, lobes are not resolved, and their mean is taken.
    """
    w, m = 2.0 * np.sin(np.pi * f * dt) / dt, np.arange(1, ORDERS + 1)[:, None]
    x, last = w * time, m + at_zero
    terms = np.array([(1j * x) ** k / factorial(k) for k in range(ORDERS + 2)])
    series = np.cumsum(terms, axis=0)[last[:, 0] - 1]
    lobes = np.where(x < resolved, np.abs(np.exp(1j * x) - series), np.hypot(1.0, np.abs(series)))
    left = np.where(x < _CANCELS, np.abs(terms[last[:, 0]]), lobes)
    return np.asarray((left / w**m) ** 2)
