"""Spikes and shocks: samples that the noise does not explain."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm

from gmwm._core.notices import Notice
from gmwm._core.text import readable
from gmwm._core.typing import FloatArray
from gmwm.diagnosis import tuning
from gmwm.diagnosis.innovations import Innovations

_LISTED = 3


def find_events(errors: Innovations) -> tuple[tuple[int, int], ...]:
    """Sample intervals in which prediction errors are too large for noise.

    An error is too large beyond the quantile of the normal distribution that noise passes with
    `tuning.FALSE_ALARM` in the whole channel, plus what rounding can add. Errors beyond four
    standard deviations next to it belong to the same event.

    Parameters
    ----------
    errors : Innovations

    Returns
    -------
    tuple of (int, int)
        First sample and the one after the last, widened by a guard.
    """
    n = errors.values.size
    beyond = np.abs(errors.values) - errors.rounding
    known = max(int(np.count_nonzero(errors.known)), 1)
    limit = float(norm.isf(0.5 * tuning.FALSE_ALARM / known))
    if not np.any(beyond > limit * errors.scale):
        return ()
    weak = np.flatnonzero(beyond > tuning.RINGING * errors.scale)
    groups = np.split(weak, np.flatnonzero(np.diff(weak) > tuning.JOINED) + 1)
    found: list[tuple[int, int]] = []
    for group in groups:
        if not np.any(beyond[group] > limit * errors.scale[group]):
            continue
        # What rings dies away below the noise: as long again is left out.
        after = max(tuning.GUARD, int(group[-1] - group[0]))
        start, stop = max(int(group[0]) - tuning.GUARD, 0), min(int(group[-1]) + after + 1, n)
        if found and start <= found[-1][1]:
            start = found.pop()[0]
        found.append((start, stop))
    return tuple(found)


def event_notice(
    name: str,
    unit: str,
    dt: float,
    values: FloatArray,
    events: tuple[tuple[int, int], ...],
    scatter: float,
) -> Notice | None:
    """Say when the events are, how large and how long.

    Parameters
    ----------
    name, unit : str
        Of the channel.
    dt : float
        s.
    values : (n,) ndarray
        Samples, NaN where missing.
    events : tuple of (int, int)
    scatter : float
        Usual standard deviation of a prediction error, u.
    """
    if not events:
        return None
    clean = np.array(values)
    for start, stop in events:
        clean[start:stop] = np.nan
    found = [_height(values, clean, *event) for event in events]
    heights = np.array([height for height, _ in found])
    energy = sum(energy for _, energy in found)
    largest = int(np.argmax(np.abs(heights)))
    start, stop = events[largest]
    known = int(np.count_nonzero(~np.isnan(values)))
    # Squares of the noise are among those of the events.
    samples = sum(stop - start for start, stop in events)
    share = max(energy / scatter**2 - samples, 0.0) / known if scatter > 0.0 else np.inf
    # The variance of n samples is known to its (2/n)^(1/2)-th part.
    harmful = share > np.sqrt(2.0 / known)
    length = (stop - start) * dt
    many = len(events) > 1
    which = f"{len(events):,} spikes or shocks, the largest" if many else "a spike or shock"
    height = readable(heights[largest], unit, sign=True)
    text = f"{which} {height} at {start * dt:.6g} s, {length:.2g} s long"
    if 1 < len(events) <= _LISTED + 1:
        others = [f"{a * dt:.6g}" for i, (a, _) in enumerate(events) if i != largest]
        text += f" (others at {', '.join(others)} s)"
    action = (
        "gmwm calibrate leaves it out; in Python: Health.masked, or robust=True"
        if harmful
        else "too small to change the variance; Health.masked leaves it out"
    )
    numbers = {
        "count": float(len(events)),
        "time": start * dt,
        "height": float(heights[largest]),
        "duration": length,
        "samples": float(samples),
        "variance_share": float(share),
    }
    return Notice("event", "warning" if harmful else "note", name, text, numbers, action)


def _height(values: FloatArray, clean: FloatArray, start: int, stop: int) -> tuple[float, float]:
    """Largest departure from the level beside the event, and the sum of squares."""
    beside = np.concatenate(
        [
            clean[max(start - tuning.BESIDE_EVENT, 0) : start],
            clean[stop : stop + tuning.BESIDE_EVENT],
        ]
    )
    beside = beside[~np.isnan(beside)]
    inside = values[start:stop]
    inside = inside[~np.isnan(inside)]
    level = float(np.median(beside)) if beside.size else float(np.median(inside))
    departure = inside - level
    top = float(departure[np.argmax(np.abs(departure))])
    return top, float(np.sum(departure**2))
