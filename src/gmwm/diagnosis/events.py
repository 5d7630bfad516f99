"""Spikes and shocks: samples that the noise does not explain."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gmwm._core.distributions import norm
from gmwm._core.text import readable
from gmwm._core.typing import FloatArray
from gmwm.diagnosis import tuning
from gmwm.diagnosis.innovations import Examined, Innovations, Spans, innovations, running_scale
from gmwm.diagnosis.motion import runs_of
from gmwm.diagnosis.tails import Tails
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
    """Medians of blocks, joined by lines, and the robust standard deviation from them.

    The blocks are as long as they can be without adding to the distances: samples that are cut off
    on both sides of a short one depend on each other.
    """
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
