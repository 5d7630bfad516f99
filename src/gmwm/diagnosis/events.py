"""Spikes and shocks: samples that the noise does not explain; or noise of heavy tails.

Outliers are left out one by one. White noise of heavy tails (Laplace, Student) stays: a robust
variance of it would be too small at fine levels only, which looks like a Gauss-Markov process. The
body of the distribution tells them apart: the better of Student's t and the exponential power law
is compared, by likelihood in bins, with Gaussian noise, part of which has a larger deviation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from gmwm._core.distributions import binom, gennorm, norm, student
from gmwm._core.text import readable
from gmwm._core.typing import FloatArray, inner
from gmwm.diagnosis import tuning
from gmwm.diagnosis.innovations import Examined, Innovations, Spans, innovations, running_scale
from gmwm.diagnosis.motion import runs_of
from gmwm.issues import Notice, Severity, notice

_LISTED = 3


def find_events(errors: Innovations, tails: Tails | None = None) -> Spans:
    """Sample intervals in which prediction errors are too large for noise.

    They pass the quantile for `tuning.FALSE_ALARM` in the whole channel, plus what rounding can
    add. Errors beyond four standard deviations next to one belong to its event; of heavy tails, so
    do more of them next to each other than independent samples have with the same chance.
    """
    n = errors.values.size
    beyond = np.abs(errors.values) - errors.rounding
    known = max(int(np.count_nonzero(errors.known)), 1)
    chance = tuning.FALSE_ALARM / known
    if tails is None:
        limit, longest = float(norm.isf(0.5 * chance)), np.inf
    else:  # the longest chain of weak errors that independent samples have with little chance
        one = float(tails.beyond(np.array([tuning.RINGING]))[0])
        next_is_close = -np.expm1(tuning.JOINED * np.log1p(-one))
        limit = tails.distance(chance)
        longest = 1.0 + float(np.log(tuning.FALSE_ALARM / (known * one)) / np.log(next_is_close))
    weak = np.flatnonzero(beyond > tuning.RINGING * errors.scale)
    if weak.size == 0 or (tails is None and not np.any(beyond > limit * errors.scale)):
        return ()
    groups = np.split(weak, np.flatnonzero(np.diff(weak) > tuning.JOINED) + 1)
    found: list[tuple[int, int]] = []
    for group in groups:
        with np.errstate(divide="ignore"):  # beside a constant stretch anything is infinitely large
            size = beyond[group] / errors.scale[group]
        chain = np.count_nonzero(size > np.max(size) / tuning.CHAIN_FLOOR)
        if not (np.max(size) > limit or chain > longest):
            continue
        # What rings dies away below the noise: as long again is left out.
        after = max(tuning.GUARD, int(group[-1] - group[0]))
        start, stop = max(int(group[0]) - tuning.GUARD, 0), min(int(group[-1]) + after + 1, n)
        if found and start <= found[-1][1]:
            start = found.pop()[0]
        found.append((start, stop))
    return tuple(found)


def with_single_outliers(
    events: Spans, errors: Innovations, values: FloatArray, step: float
) -> Spans:
    """Events and, without any guard, outliers all over the record; of many, these alone.

    Predictions from an outlier are in error too: the first that are left out are those far from
    the level. Where samples are predicted better than by it, predictions without these show more.
    """
    place = np.arange(values.size)
    there = ~np.isnan(values)
    filled = values if np.all(there) else np.interp(place, place[there], values[there])
    level, scale = _level(filled)
    far = np.abs(filled - level) - 0.5 * step > tuning.FAR * scale
    if errors.level < tuning.PREDICTED * np.median(scale):
        rest = innovations(np.where(far & there, level, values), step)
        if rest is not None:
            far |= np.abs(rest.values) - rest.rounding > tuning.FAR * rest.scale
    far &= there
    if sum(stop - start for start, stop in events) < tuning.MUCH_LEFT_OUT * values.size:
        for start, stop in events:
            far[start:stop] = True
    return tuple(runs_of(far))


def _level(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Medians of blocks, joined by lines, and the robust standard deviation from them."""
    place = np.arange(values.size)
    found: list[tuple[FloatArray, FloatArray]] = []
    count = 1
    while values.size >= tuning.NEIGHBOURS * count:
        parts = np.array_split(values, count)
        centres = (np.arange(count) + 0.5) * values.size / count
        level = np.interp(place, centres, [float(np.median(part)) for part in parts])
        found.append((level, running_scale(values - level, 0.0)))
        count *= 8
    usual = [float(np.median(scale)) for _, scale in found]
    longest = next(i for i, size in enumerate(usual) if size <= tuning.AS_CLOSE * min(usual))
    return found[longest]


def event(channel: Examined) -> Iterator[Notice]:
    """Say when the events are, how large and how long."""
    values, events, dt, scatter = channel.values, channel.shocks, channel.dt, channel.scatter
    if not events:
        return
    clean = np.array(values)
    for start, stop in events:
        clean[start:stop] = np.nan
    found = [_height(values, clean, *event) for event in events]
    heights = np.array([height for height, _ in found])
    largest = int(np.argmax(np.abs(heights)))
    start, stop = events[largest]
    known = int(np.count_nonzero(~np.isnan(values)))
    # Squares of the noise are among those of the events.
    samples = sum(b - a for a, b in events)
    energy = sum(each for _, each in found)
    share = max(energy / scatter**2 - samples, 0.0) / known if scatter > 0.0 else np.inf
    numbers = {"count": float(len(events)), "time": start * dt, "height": float(heights[largest])}
    numbers |= {"duration": (stop - start) * dt, "samples": float(samples)}
    numbers["variance_share"] = float(share)
    name, variant = channel.name, "many" if len(events) > 1 else ""
    if 2 * samples > known:
        hint, part = "check the processing between the sensor and the file", samples / known
        yield notice("event", name, numbers, severity="bad", variant="most", hint=hint, part=part)
        return
    others = ""
    if 1 < len(events) <= _LISTED + 1:
        times = ", ".join(f"{a * dt:.6g}" for i, (a, _) in enumerate(events) if i != largest)
        others = f" (others at {times} s)"
    # The variance of n samples is known to its (2/n)^(1/2)-th part.
    shown = readable(heights[largest], channel.unit, sign=True)
    words = {"variant": variant, "shown": shown, "others": others}
    severity: Severity = "warning"
    if share <= np.sqrt(2.0 / known):
        words["hint"] = "too small to change the variance; Health.masked leaves it out"
        severity = "note"
    yield notice("event", name, numbers, severity=severity, **words)


def _height(values: FloatArray, clean: FloatArray, start: int, stop: int) -> tuple[float, float]:
    """Largest departure from the level beside the event, and the sum of squares."""
    reach = tuning.BESIDE_EVENT
    beside = np.append(clean[max(start - reach, 0) : start], clean[stop : stop + reach])
    beside = beside[~np.isnan(beside)]
    inside = values[start:stop]
    inside = inside[~np.isnan(inside)]
    level = float(np.median(beside)) if beside.size else float(np.median(inside))
    departure = inside - level
    top = float(departure[np.argmax(np.abs(departure))])
    return top, float(np.sum(departure**2))


_NOISE = 2.0 * float(norm.sf(tuning.FAR))  # share of Gaussian noise beyond


def contamination(errors: Innovations, events: Spans) -> float:
    """Share of prediction errors beyond four robust standard deviations, each event counted once.
    0 unless it is above one in a thousand, which is 16 times that of Gaussian noise, and more than
    Gaussian noise has in one of a thousand channels.
    """
    outside = errors.known.copy()
    for start, stop in events:
        outside[start:stop] = False
    # What rounding can add to an error is subtracted.
    far = np.abs(errors.values) - errors.rounding > tuning.FAR * errors.scale
    count = int(np.count_nonzero(far & outside)) + len(events)
    known = int(np.count_nonzero(errors.known))
    is_chance = bool(binom.sf(count - 1, known, _NOISE) > tuning.FALSE_ALARM)
    return 0.0 if is_chance or count <= tuning.HARMFUL_OUTLIERS * known else count / known


@dataclass(frozen=True)
class Tails:
    """A law of heavy tails."""

    law: str  # "student" (Student's t) or "power" (exponential power law)
    shape: float  # degrees of freedom, or the exponent: 2 is Gaussian, 1 Laplace
    scale: float  # in robust standard deviations

    def beyond(self, distance: FloatArray) -> FloatArray:
        """Probability of a larger absolute value, of distances in robust standard deviations."""
        return np.asarray(2.0 * _LAWS[self.law].sf(distance / self.scale, self.shape))

    def distance(self, chance: float) -> float:
        """Robust standard deviations that are passed with this probability."""
        return float(self.scale * _LAWS[self.law].isf(0.5 * chance, self.shape))


_LAWS = {"student": student, "power": gennorm}


def heavy_tails(errors: Innovations) -> Tails | None:
    """The law of the prediction errors, if it has heavy tails rather than outliers.
    None if Gaussian noise with outliers is as likely, large errors cluster, the law has no variance
    or hardly one, or the noise hides in the rounding.
    """
    counted = errors.known
    if errors.rounding > tuning.ROUNDING_OF_BODY * errors.level or not errors.level > 0.0:
        return None
    distance = np.abs(errors.values[counted]) / errors.scale[counted]
    # Mean correlation of large errors with the next ones.
    large = (distance > tuning.LARGE).astype(float)
    large -= np.mean(large)
    products = [inner(large[lag:], large[:-lag]) for lag in range(1, tuning.LAGS + 1)]
    if np.mean(products) / inner(large, large) > tuning.CLUSTERED:
        return None
    edges = np.append(
        np.arange(0.0, tuning.FAR, tuning.BIN_OF_BODY),
        tuning.FAR * 2.0 ** np.arange(0.0, tuning.OCTAVES_OF_TAIL, 0.25),
    )
    counts = np.append(np.histogram(distance, edges)[0], np.count_nonzero(distance >= edges[-1]))
    contaminated, _ = _most_likely(_mixture, counts, edges, _MIXTURE_STARTS)
    found = {law: _most_likely(_with_scale(law), counts, edges, _STARTS[law]) for law in _LAWS}
    law = max(found, key=lambda name: found[name][0])
    likelihood, (shape, scale) = found[law][0], np.exp(found[law][1])
    if likelihood <= contaminated or shape <= tuning.LEAST_SHAPE[law]:
        return None
    return Tails(law, float(shape), float(scale))


def _with_scale(law: str) -> Callable[[FloatArray, FloatArray], FloatArray]:
    return lambda x, logs: Tails(law, *np.exp(logs).tolist()).beyond(x)


def _mixture(x: FloatArray, at: FloatArray) -> FloatArray:
    scale, ratio = np.exp(at[0]), 1.0 + np.exp(at[1])
    share = 1.0 / (1.0 + np.exp(-at[2]))
    return np.asarray(
        2.0 * (1.0 - share) * norm.sf(x / scale) + 2.0 * share * norm.sf(x / (scale * ratio))
    )


_STARTS = {"student": ((np.log(4.0), np.log(0.8)),), "power": ((np.log(1.2), np.log(1.0)),)}
_MIXTURE_STARTS = ((0.0, np.log(2.0), -3.0), (0.0, np.log(20.0), -5.0))


def _most_likely(
    survival: Callable[[FloatArray, FloatArray], FloatArray],
    counts: FloatArray,
    edges: FloatArray,
    starts: tuple[tuple[float, ...], ...],
) -> tuple[float, FloatArray]:
    """Largest logarithm of the likelihood of counts in bins, the last open, and where it is."""

    def loss(at: FloatArray) -> float:
        beyond = np.append(survival(edges, at), 0.0)
        share = np.maximum(beyond[:-1] - beyond[1:], np.finfo(float).tiny)
        return float(-counts @ np.log(share))

    with np.errstate(over="ignore", invalid="ignore"):
        found = [minimize(loss, start, method="Nelder-Mead") for start in starts]
    best = min(found, key=lambda one: float(one.fun))
    return -float(best.fun), np.asarray(best.x)


def outliers_or_tails(channel: Examined) -> Iterator[Notice]:
    """Say how many outliers there are, or that the noise has heavy tails."""
    tails, errors = channel.tails, channel.errors
    if channel.outliers > 0.0:
        yield notice("outliers", channel.name, {"share": channel.outliers}, usual=_NOISE)
    elif tails is not None:
        there = errors.known & (errors.scale > 0.0)  # not where the channel is dead in part
        square = (errors.values[there] / errors.scale[there]) ** 2
        kurtosis = float(np.mean(square**2) / np.mean(square) ** 2 - 3.0)
        numbers = {"law": tails.law, "shape": tails.shape, "scale": tails.scale}
        values = numbers | {"kurtosis": kurtosis}
        yield notice("heavy-tails", channel.name, values, variant=tails.law)
