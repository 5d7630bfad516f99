"""Departures from stationary noise: steps, settling after switching on, slow periods.

A random walk follows all of them, so the chi-square test of a fit passes with a walk of the wrong
size. Block means are therefore explained by white noise and a random walk, with and without the
departure: twice the gain in log likelihood must exceed a limit that this noise passes in one of a
hundred records. Other slow noise passes it as rarely, except Gauss-Markov processes of few blocks
and bias instability, which have bumps that look like slow periods (docs/health.md). What is evident
can be subtracted; the noise that this takes is given back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.linalg import eigh

from gmwm._core.distributions import norm
from gmwm._core.text import brief, readable
from gmwm._core.typing import FloatArray
from gmwm.calibration import tuning
from gmwm.calibration.steadiness import Means
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.issues import Notice, Severity, notice
from gmwm.process import Model
from gmwm.readers import Channel, Recording
from gmwm.variance import WaveletVariance, wavelet_variance

DEPARTURES = ("step", "transient", "drift-at-start", "slow-period")
"""Kinds of departures: the codes of their notices."""

WIDE = float(norm.isf(0.025))
"""Standard errors of half a 95 % interval."""


@dataclass(frozen=True)
class Departure:
    """Something that stationary noise does not have.

    kind: Code of its notice: "step", "transient", "drift-at-start" or "slow-period".
    time: When the step is, the time constant, the end of the drift or the period, and the ends of
        its 95 % interval, s.
    size: Height of the step; of the transient or the drift at the start of the record; amplitude of
        the period; and the ends of its 95 % interval, u.
    evidence: Stationary noise shows as much in about one of so many records.
    share: Largest fraction of the wavelet variance of the model that it accounts for.
    phase: Of a period, ``size cos(2 pi t / time - phase)``, rad.
    """

    kind: str
    time: tuple[float, float, float]
    size: tuple[float, float, float]
    evidence: float
    share: float
    phase: float = 0.0

    def curve(self, time: FloatArray) -> FloatArray:
        """The departure at unit size, at times from the start of the record, s."""
        length = self.time[0]
        if self.kind == "step":
            return np.asarray(time > length, dtype=float)
        if self.kind == "transient":
            return np.exp(-time / length)
        if self.kind == "drift-at-start":
            return np.maximum(1.0 - time / length, 0.0)
        return np.cos(2.0 * np.pi * time / length - self.phase)


def departures(fitted: Fit, wv: WaveletVariance | None = None) -> tuple[Departure, ...]:
    """Find what a recording has that stationary noise does not have.

    They are found one after the other, each beside those before it, and measured beside all others.
    A straight drift of the whole record competes with them but is not reported: the rate ramp of a
    model has a test of its own.

    wv: The recording, where the fit is one of several.
    Returns: clearest first.
    """
    means = Means.of(wv or fitted.wv, tuning.MOST_MEANS)
    known = _known_curves(fitted, means)
    if means.first.size - len(known) < tuning.FEWEST_DIFFERENCES:
        return ()
    data = means.differences(means.blocks)
    if np.max(np.abs(data)) <= tuning.NO_INFORMATION * np.nanmax(np.abs(means.blocks)):
        return ()
    axes = _Axes.of(tuple(np.diff(np.flatnonzero(~np.isnan(means.blocks))).tolist()))
    data, fixed = data @ axes.turn, means.differences(known) @ axes.turn
    shapes = _shapes(means, axes)
    found: list[_Test] = []
    while len(found) < tuning.MOST_DEPARTURES:
        noises = _noises(axes, [fixed, *(each.neighbours for each in found)])
        best = max((_tested(shape, data, noises) for shape in shapes), key=lambda test: test.excess)
        if best.excess <= 0.0:
            break
        if best.shape.kind == "drift":
            fixed = np.vstack([fixed, best.neighbours])
        else:
            found.append(best)
    measured = []
    for each in found:
        others = [other.neighbours for other in found if other is not each]
        again = _tested(each.shape, data, _noises(axes, [fixed, *others]))
        if again.excess > 0.0:
            measured.append(again.departure(fitted, means))
    return tuple(measured)


@dataclass(frozen=True, eq=False)
class _Shape:
    """Departures of one kind that are looked for."""

    kind: str
    times: FloatArray  # (G,), when, how long or how slow each is, s
    curves: FloatArray  # (G, r, B), block means at unit size; cosine and sine of a period
    rows: FloatArray  # (G, r, D), their differences along the axes
    limit: float  # see `tuning.LIMITS`


def _shapes(means: Means, axes: _Axes) -> list[_Shape]:
    """All departures that are looked for, and a straight drift of the whole record.

    Steps at all edges and middles of blocks; transients with a time constant of one block to
    the record; straight drifts that end after four blocks to two thirds of it; periods of
    twice the record to a 24th of it, since faster ones are lines.
    """
    count, length = means.blocks.size, float(means.blocks.size)
    edge = np.arange(count + 1.0)
    at = 0.5 * np.arange(2.0, 2.0 * count - 1.0)
    constants, ends = (
        np.geomspace(low, high, round(np.log(high / low) / np.log(tuning.RATIO_OF_TIMES)) + 1)
        for low, high in ((1.0, length), (4.0, length * 2.0 / 3.0))
    )
    periods = length / np.arange(tuning.FEWEST_CYCLES, tuning.MOST_CYCLES, 0.25)
    tau, end, period = constants[:, None], ends[:, None], periods[:, None]
    phase = 2.0 * np.pi * edge / period
    # Block means are differences of the integral.
    integrals = {
        "step": (at, [np.maximum(edge - at[:, None], 0.0)]),
        "transient": (constants, [-tau * np.exp(-edge / tau)]),
        "drift-at-start": (ends, [-(np.maximum(end - edge, 0.0) ** 2) / (2.0 * end)]),
        "slow-period": (
            periods,
            [each * period / (2.0 * np.pi) for each in (np.sin(phase), -np.cos(phase))],
        ),
        "drift": (np.array([length]), [0.5 * edge[None, :] ** 2 / length]),
    }
    found = []
    for kind, (times, parts) in integrals.items():
        curves = np.diff(np.stack(parts, axis=1))
        rows = means.differences(curves) @ axes.turn
        found.append(_Shape(kind, times * means.step, curves, rows, tuning.LIMITS[kind]))
    return found


def _known_curves(fitted: Fit, means: Means) -> FloatArray:
    """The curves that a model has beside its noise, (k, B)."""
    curves = [np.empty((0, means.blocks.size))]
    if any(term.is_drift for term in fitted.model.terms):
        curves.append(means.time[None, :])
    for frequency, _ in fitted.model.lines():
        phase = 2.0 * np.pi * frequency * means.time
        curves.append(np.array([np.sin(phase), np.cos(phase)]))
    beside = fitted.wv.regressors  # of the first recording, where there are several
    if beside is not None:
        own = beside.parts[0]
        middles = own.block * beside.dt * (np.arange(own.blocks.size) + 0.5)
        curves += [np.interp(means.time, middles, row)[None, :] for row in own.columns]
    return np.vstack(curves)


@dataclass(frozen=True, eq=False)
class _Axes:
    """Axes along which differences of block means are independent for every ratio of noises.

    Both covariances are diagonal along the generalized eigenvectors of the two matrices.
    """

    white: FloatArray  # (D,), variances of white noise, where those of a random walk are one
    turn: FloatArray  # (D, D), from differences to the axes

    @classmethod
    @lru_cache(maxsize=8)
    def of(cls, steps: tuple[int, ...]) -> _Axes:
        """steps: Blocks from each that exists to the next that does."""
        beside = np.eye(len(steps), k=1) + np.eye(len(steps), k=-1)
        white, walk = 2.0 * np.eye(len(steps)) - beside, np.diag(np.array(steps) - 1.0 / 3.0)
        return cls(*eigh(white, walk + beside / 6.0))


@dataclass(frozen=True, eq=False)
class _Noise:
    """White noise beside a random walk, in one ratio, with what is known beside it."""

    scale: FloatArray  # (D,), one over the standard deviation along each axis
    basis: FloatArray  # (k, D), orthonormal, what is known, whitened
    log_weight: float  # logarithm of the likelihood, without the part of the data, up to a constant

    @classmethod
    def of(cls, white: float, walk: float, axes: _Axes, known: FloatArray) -> _Noise:
        """Noise of two sizes.

        white, walk: Variance of a block mean, and of the walk from one block to the next.
        known: (k, D), independent rows.
        """
        scale = 1.0 / np.sqrt(white * axes.white + walk)
        basis, triangle = np.linalg.qr((known * scale).T)
        weight = np.sum(np.log(scale)) - np.sum(np.log(np.abs(np.diag(triangle))))
        return cls(scale, basis.T, float(weight))


def _noises(axes: _Axes, known: Sequence[FloatArray]) -> list[_Noise]:
    """White noise alone, with more and more of a random walk, and a random walk alone.

    known: Rows, (k, D), which need not be independent.
    """
    rows = np.vstack(known)
    norms = np.linalg.norm(rows, axis=1)[:, None]
    _, sizes, spanned = np.linalg.svd(rows / np.where(norms > 0.0, norms, 1.0), full_matrices=False)
    spanned = spanned[sizes > tuning.SPANNED * np.max(sizes, initial=0.0)]
    ratios = [(1.0, 0.0), *((1.0, ratio) for ratio in tuning.WALKS), (0.0, 1.0)]
    return [_Noise.of(white, walk, axes, spanned) for white, walk in ratios]


@dataclass(frozen=True, eq=False)
class _Test:
    """How much better a departure of some shape explains the data."""

    shape: _Shape
    gains: FloatArray  # (G,), twice the gain in log likelihood of each time
    sizes: FloatArray  # (r,), of the best one's curves
    error: float  # standard error of a size

    @property
    def best(self) -> int:
        """Which time gains most."""
        return int(np.argmax(self.gains))

    @property
    def excess(self) -> float:
        """The gain above its limit."""
        return float(self.gains[self.best]) - self.shape.limit

    @property
    def neighbours(self) -> FloatArray:
        """Rows of the best time and of those beside it: one between them is about their sum."""
        near = slice(max(self.best - tuning.NEAR, 0), self.best + tuning.NEAR + 1)
        return self.shape.rows[near].reshape(-1, self.shape.rows.shape[-1])

    def departure(self, fitted: Fit, means: Means) -> Departure:
        """The best one, with 95 % intervals."""
        size, low, phase = float(self.sizes[0]), -np.inf, 0.0
        if self.sizes.size == 2:  # cosine and sine of a period
            size, low = float(np.hypot(*self.sizes)), 0.0
            phase = float(np.arctan2(*self.sizes[::-1]))
        half = WIDE * self.error
        # The likelihood of times that are equally likely beforehand.
        times, weight = self.shape.times, np.exp(0.5 * (self.gains - self.gains[self.best]))
        order = np.argsort(times)
        ordered = times[order]
        edges = np.concatenate([ordered[:1], 0.5 * (ordered[1:] + ordered[:-1]), ordered[-1:]])
        first, last = np.searchsorted(np.cumsum(weight[order]) / np.sum(weight), [0.025, 0.975])
        last = min(last, times.size - 1) + 1
        return Departure(
            self.shape.kind,
            (float(times[self.best]), float(edges[first]), float(edges[last])),
            (size, max(size - half, low), size + half),
            tuning.EVIDENT * float(np.exp(min(0.5 * self.excess, tuning.LARGEST_LOG))),
            _share(self.sizes @ self.shape.curves[self.best], means.step, fitted),
            phase,
        )


def _tested(shape: _Shape, data: FloatArray, noises: Sequence[_Noise]) -> _Test:
    """Compare the likelihoods with and without each departure, each beside its best noise."""
    freedom = data.size - len(noises[0].basis)
    alone, beside, fits = [], [], []
    for noise in noises:
        # Projected, not by differences of squares, which leave gains of what is known already.
        series, curves = (
            white - (white @ noise.basis.T) @ noise.basis
            for white in (data * noise.scale, shape.rows * noise.scale)
        )
        total = float(series @ series)
        score = curves @ series
        information = curves @ np.swapaxes(curves, 1, 2)
        # What is known explains a curve that is part of it.
        least = tuning.NO_INFORMATION * np.max(np.trace(information, axis1=1, axis2=2))
        inverse = np.linalg.inv(information + least * np.eye(information.shape[-1]))
        sizes = (inverse @ score[..., None])[..., 0]
        left = np.maximum(total - np.sum(score * sizes, axis=1), tuning.NO_INFORMATION * total)
        alone.append(noise.log_weight - 0.5 * freedom * np.log(total))
        beside.append(noise.log_weight - 0.5 * freedom * np.log(left))
        fits.append((sizes, left, inverse))
    gains = 2.0 * (np.max(beside, axis=0) - np.max(alone))
    best = int(np.argmax(gains))
    sizes, left, inverse = fits[int(np.argmax(np.array(beside)[:, best]))]
    variance = float(np.mean(np.diag(inverse[best]))) * float(left[best])
    freedom -= shape.rows.shape[1]
    return _Test(shape, gains, sizes[best], float(np.sqrt(variance / freedom)))


def _share(curve: FloatArray, step: float, fitted: Fit) -> float:
    """Largest fraction of the model's wavelet variance that a curve of block means has."""
    edges = step * np.arange(curve.size + 1)
    integral = np.concatenate([[0.0], np.cumsum(curve)]) * step
    shares = [0.0]
    for tau, implied in zip(fitted.wv.tau, fitted.implied, strict=True):
        if step <= tau <= 0.5 * edges[-1] and implied > 0.0:
            begin = np.linspace(0.0, edges[-1] - 2.0 * tau, tuning.SHARE_POINTS)
            parts = [np.interp(begin + k * tau, edges, integral) for k in range(3)]
            coefficient = (parts[2] - 2.0 * parts[1] + parts[0]) / (2.0 * tau)
            shares.append(float(np.mean(coefficient**2) / implied))
    return max(shares)


# -- notices --------------------------------------------------------------------------------------


def departure_notices(
    fitted: Fit,
    found: Sequence[Departure],
    removed: Sequence[Departure],
    before: WaveletVariance,
    after: WaveletVariance,
    *,
    removing: bool = False,
) -> list[Notice]:
    """Notices of the departures of a recording; bad if one accounts for much of the noise.

    found, removed: What it has, and what was subtracted before the fit.
    before, after: Its wavelet variances, before that was subtracted and after.
    removing: Whether departures were to be subtracted: those that are left cannot be.
    """
    unit = fitted.wv.unit
    notices = [_departure_notice(each, unit, stays=removing) for each in found]
    notices += [_departure_notice(each, unit, removed=True) for each in removed]
    return notices + (_removal_notices(removed, before, after, fitted.model) if removed else [])


def _departure_notice(
    found: Departure, unit: str, *, stays: bool = False, removed: bool = False
) -> Notice:
    """Say what it is, and whether a fit beside it is valid.

    unit: Of the channel, SI.
    stays: Whether subtracting it was tried, so that the notice does not advise it.
    removed: Whether it was subtracted before the fit.
    """
    size, low, high = (readable(each, unit, sign=True) for each in found.size)
    size = f"{size} ({low} .. {high})"
    time, first, last = (f"{each:.4g}" for each in found.time)
    when = f"{time} s ({first} .. {last})"
    hint: str | None = "subtracted"
    severity: Severity = "note"
    also = ""
    if not removed:
        is_sure = found.evidence >= tuning.SPOILING
        severity = "bad" if is_sure and found.share > tuning.HARMFUL_SHARE else "warning"
        part = f"up to {100.0 * found.share:.0f} %" if found.share < 1.0 else "all"
        also = f"; it accounts for {part} of the model's wavelet variance: slow noise is too large"
        hint = None
    back = "" if stays else ", or subtract it (remove_departures=True)"
    names = ("time", "time_lower", "time_upper", "size", "lower", "upper")
    values: dict[str, Any] = dict(zip(names, (*found.time, *found.size), strict=True))
    values |= {"phase": found.phase, "evidence": found.evidence, "share": found.share}
    values |= {"evident": True, "removable": not stays} | ({"removed": True} if removed else {})
    words = {"height": size, "when": when, "also": also, "back": back}
    return notice(found.kind, "", values, severity=severity, hint=hint, **words)


def _removal_notices(
    removed: Sequence[Departure], before: WaveletVariance, after: WaveletVariance, model: Model
) -> list[Notice]:
    """Say what a model lacks without what was subtracted, and whether it was noise after all."""
    levels = min(before.tau.size, after.tau.size)  # what is subtracted leaves gaps
    taken = before.variance[:levels] - after.variance[:levels]
    # Over the model: the coarsest level of the rest is one of few, and may be nearly zero.
    implied = model.haar_variance(after.tau[:levels], after.dt)
    ratio = np.divide(taken, implied, out=np.zeros(levels), where=implied > 0.0)
    most = int(np.argmax(ratio))
    notices = []
    if ratio[most] > tuning.HARMFUL_SHARE / (1.0 - tuning.HARMFUL_SHARE):
        values = {"tau": float(after.tau[most]), "ratio": float(np.sqrt(1.0 + ratio[most]))}
        notices.append(notice("departures-removed", "", values, times=brief(values["ratio"])))
    if len(removed) > tuning.MOST_REMOVED:
        notices.append(notice("departures-many", "", {"removed": len(removed)}))
    return notices


def without_departures(recording: Recording, fits: Mapping[str, Fit]) -> Recording:
    """A recording without what its calibration reports as evident departures.

    Steps, transients, drifts at the start and slow periods are subtracted; samples at which a step
    may be are missing (NaN). What is left has one parameter less for each size, which a calibration
    of it does not know; ``gmwm.calibrate(..., remove_departures=True)`` does.

    Parameters
    ----------
    recording : Recording
        That which was calibrated, alone.
    fits : Calibration or mapping of str to Fit

    Returns
    -------
    Recording

    Raises
    ------
    InputError
        If a fit is of a recording of another length.

    Examples
    --------
    >>> import gmwm, numpy as np
    >>> x = gmwm.simulate(gmwm.WhiteNoise(0.01), n=36_000, dt=0.1, seed=1)
    >>> x[20_000:] += 0.05
    >>> rec = gmwm.Recording.from_arrays({"gyro_x": x}, 10.0, {"gyro": "rad/s"})
    >>> found = gmwm.calibrate(rec)
    >>> list(found["gyro_x"].reasons)
    ['stationary']
    >>> again = gmwm.calibrate(gmwm.without_departures(rec, found))
    >>> again["gyro_x"].valid, list(again["gyro_x"].params)
    (True, ['N'])
    """
    for name, fit in fits.items():
        if name in recording and fit.wv.n * fit.wv.dt > recording.duration + recording.dt:
            raise InputError(
                f"{recording.source or 'the recording'} has {recording.duration:g} s, but the fit "
                f"of {name} {fit.wv.n * fit.wv.dt:g} s: give the recording that was calibrated"
            )
    channels = []
    for channel in recording.channels:
        found = []
        for each in fits[channel.name].notices if channel.name in fits else ():
            of = each.values
            if each.code in DEPARTURES and of["evidence"] >= tuning.EVIDENT:
                time = (of["time"], of["time_lower"], of["time_upper"])
                size = (of["size"], of["lower"], of["upper"])
                numbers = (of["evidence"], of["share"], of["phase"])
                found.append(Departure(each.code, time, size, *numbers))
        channels.append(_without(channel, found))
    return replace(recording, channels=tuple(channels))


def variance_without(
    channel: Channel, found: Sequence[Departure], *, robust: bool = False
) -> WaveletVariance:
    """Wavelet variances of a channel less departures whose sizes were estimated from it.

    An estimated curve has followed the noise: what is subtracted with it has, on average, the
    square of the standard error of its size times the wavelet variance of the curve at unit size,
    where the size is estimated by generalized least squares. So much is added again. Errors of
    several sizes are correlated as under white noise: of two opposite steps the level after both is
    known better than that between.
    """
    left = _without(channel, found)
    wv = wavelet_variance(left, robust=robust)
    if not found:
        return wv
    curves, errors = [], []
    for each in found:
        for phase in (0.0, 0.5 * np.pi) if each.kind == "slow-period" else (0.0,):
            curves.append(replace(each, phase=each.phase + phase).curve(_times(channel)))
            errors.append((each.size[2] - each.size[1]) / (2.0 * WIDE))
    there = ~np.isnan(left.values)
    taken = np.zeros_like(wv.variance)
    for error in _independent(np.array(curves)[:, there], np.array(errors)):
        size = float(np.linalg.norm(error))
        # Of the whole curve: a gap that it steps in is filled in what is left.
        unit = wavelet_variance((error / size) @ np.array(curves), dt=channel.dt)
        taken += size**2 * unit.variance[: taken.size]
    return replace(wv, variance=wv.variance + taken)


def _independent(curves: FloatArray, errors: FloatArray) -> FloatArray:
    """Combinations of curves whose sizes have independent errors, in standard errors, (k, k)."""
    centred = curves - np.mean(curves, axis=1)[:, None]
    covariance = np.linalg.pinv(centred @ centred.T)
    scale = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    found = (vectors * np.sqrt(np.maximum(values, 0.0))).T * errors
    return np.asarray(found[values > tuning.NO_INFORMATION])


def _times(channel: Channel) -> FloatArray:
    return channel.dt * np.arange(len(channel.values), dtype=float)


def _without(channel: Channel, found: Sequence[Departure]) -> Channel:
    if not found:
        return channel
    values, time = np.array(channel.values, dtype=float), _times(channel)
    for each in found:
        values -= each.size[0] * each.curve(time)
        if each.kind == "step":
            values[(time > each.time[1]) & (time < each.time[2])] = np.nan
    return replace(channel, values=values)
