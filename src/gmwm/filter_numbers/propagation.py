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
    ComplexArray,
    Model,
    Process,
    RateRamp,
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
_RESOLVED_LOBES = 64
_PANELS_PER_OCTAVE = 32
_NODES_PER_PANEL = 8
_OCTAVES_BELOW = 26
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
    422-437): its variance is B^2 t^(2m) / (2m Gamma(m + 1/2)^2). A spectrum is looked at in steps
    of some 1/(16 t): a narrower peak needs a ``state_space``, or a line in ``lines``.
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
    for i, (count, rest) in enumerate(zip(*_steps(t, dt), strict=True)):
        m, P = mean, covariance
        for h, times in ((dt, count), (rest, int(rest > 0.0))):
            step, noise = power(*integrated(form, h, ORDERS), times)
            m, P = step @ m, step @ P @ step.T + noise
        result[:, i] = np.sqrt(m[:ORDERS] ** 2 + np.maximum(np.diag(P)[:ORDERS], 0.0))
    return result


def _steps(t: FloatArray, dt: float) -> tuple[list[int], FloatArray]:
    """Whole steps in each time, and what is left, s."""
    ratio = t / dt
    whole = np.where(np.abs(ratio - np.rint(ratio)) < _WHOLE, np.rint(ratio), np.floor(ratio))
    rest = np.where(ratio - whole > _WHOLE, (ratio - whole) * dt, 0.0)
    return [int(n) for n in whole], rest


def _from_spectrum(process: Process, t: FloatArray, dt: float) -> FloatArray:
    """2 int S(f) |G(f)|^2 df with the gain G of each integral, less G(0) for a start at zero."""
    # The rule by which a simulation decides whether it starts at zero.
    ends = evaluated(process.psd, np.array([2.5e-5, 0.25]) / np.max(t), dt)
    at_zero = bool(ends[0] > _DIVERGES * ends[1])
    lines = [(abs(f * dt - np.rint(f * dt)), a) for f, a in process.lines()]
    counts, rests = _steps(t, dt)
    result = np.empty((ORDERS, t.size))
    moment = _from_states(RateRamp(1.0).state_space(dt), t, dt, known=True)
    for i, (count, rest) in enumerate(zip(counts, rests, strict=True)):
        if at_zero and count == 1 and rest == 0.0:
            result[:, i] = 0.0  # the first sample alone; the sum below would be its rounding
            continue
        frequency, weight, resolved = _nodes(t[i] / dt)
        density = evaluated(process.psd, frequency / dt, dt) / dt
        gain = _squared_gain(frequency, resolved, count, rest, dt, at_zero, moment[:, i])
        share = gain * (weight * density)
        variance = 2.0 * np.sum(share, axis=1)
        low = frequency < 2.0**-_STEEP_OCTAVES * dt / t[i]
        if np.any(2.0 * np.sum(share[:, low], axis=1) > _STEEP_SHARE * variance):
            raise InputError(
                f"the spectrum of {process!r} rises too fast towards zero frequency for an error "
                "budget: give the process a state_space"
            )
        for place, amplitude in lines:
            about = (count, rest, dt, False, moment[:, i])
            line = _squared_gain(np.array([place]), np.ones(1), *about)
            variance += 0.5 * amplitude**2 * line[:, 0]
        result[:, i] = np.sqrt(variance + (process.drift_rate() * moment[:, i]) ** 2)
    return result


def _nodes(n: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Frequencies (cycles per sample), their weights, and whether lobes are resolved there.

    Octaves below half a lobe of width 1/n, then half lobe by half lobe, then parts of octaves,
    where the lobes are averaged over. The cut is at the end of a lobe: what is left out cancels.
    """
    x, w = legendre(_NODES_PER_PANEL)
    cut = min(_RESOLVED_LOBES / n, 0.5)
    octaves = np.geomspace(2.0**-_OCTAVES_BELOW, 0.5, _OCTAVES_BELOW * _PANELS_PER_OCTAVE // 4)
    lobes = np.linspace(0.5 / n, cut, max(int(np.ceil(2.0 * (cut * n - 0.5))), 1) + 1)
    edges = [np.zeros(1), octaves / n, lobes[1:]]
    if cut < 0.5:
        panels = int(np.ceil(np.log2(0.5 / cut) * _PANELS_PER_OCTAVE))
        edges.append(np.geomspace(cut, 0.5, panels + 1)[1:])
    edge = np.concatenate(edges)
    half = 0.5 * np.diff(edge)[:, None]
    frequency = (0.5 * (edge[1:] + edge[:-1])[:, None] + half * x).ravel()
    return frequency, (half * w).ravel(), np.where(frequency < cut, 1.0, 0.0)


def _squared_gain(
    frequency: FloatArray,
    resolved: FloatArray,
    count: int,
    rest: float,
    dt: float,
    at_zero: bool,
    moment: FloatArray,
) -> FloatArray:
    """|G|^2 of the three integrals, or |G - G(0)|^2 for a start at zero, shape (3, K).

    The input q^k with q = exp(2 pi i f dt) gives the integrals q^n a - b: a moves with the input,
    b is left of the start. Where the lobes are not resolved, their mean |a|^2 + |b|^2 is taken.
    ``moment`` is what the input k dt gives: the gain's first derivative at zero frequency.
    """
    turn = 2j * np.pi * frequency
    ratio = np.expm1(turn)
    ratio[ratio == 0.0] = 1.0  # zero frequency itself is taken from the expansion below
    chain, gain = held(dt, ORDERS)
    moving = np.zeros((ORDERS, frequency.size), dtype=complex)
    for row in range(ORDERS):
        moving[row] = (gain[row] + _times(chain[row : row + 1, :row], moving[:row])[0]) / ratio
    left = _times(held(count * dt + rest, ORDERS)[0], moving)
    last_chain, last_gain = held(rest, ORDERS)
    moving = _times(last_chain, moving) + last_gain[:, None]
    total = count * dt + rest
    constant = np.array([total, total**2 / 2.0, total**3 / 6.0])[:, None]
    if at_zero:
        left = left + constant
    exact = np.abs(moving * np.exp(turn * count) - left) ** 2
    mean = np.abs(moving) ** 2 + np.abs(left) ** 2
    squared = resolved * exact + (1.0 - resolved) * mean
    angle = 2.0 * np.pi * frequency * (total / dt)
    slow = angle < _CANCELS
    expansion = (moment[:, None] * 2.0 * np.pi * frequency / dt) ** 2 if at_zero else constant**2
    return np.asarray(np.where(slow, expansion, squared))


def _times(matrix: FloatArray, columns: ComplexArray) -> ComplexArray:
    """Product of a small matrix and long rows, without the threads of a matrix library."""
    return np.asarray(np.einsum("ij,jk->ik", matrix, columns))
