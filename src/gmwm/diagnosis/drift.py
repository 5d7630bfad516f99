"""Slow changes: of the level, and of the size of the noise."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.stats import f as f_distribution, norm

from gmwm._core.notices import Notice, Severity
from gmwm._core.text import readable
from gmwm._core.typing import BoolArray, FloatArray
from gmwm.diagnosis import tuning
from gmwm.diagnosis.innovations import Innovations


def part_means(values: FloatArray, parts: int = tuning.PARTS, least: float = 0.5) -> FloatArray:
    """Means of equal parts of a series; NaN where no more than the least fraction is present."""
    size = values.size // parts
    rows = values[: size * parts].reshape(parts, size)
    known = ~np.isnan(rows)
    count = np.count_nonzero(known, axis=1)
    total = np.sum(np.where(known, rows, 0.0), axis=1)
    return np.where(count > least * size, total / np.maximum(count, 1), np.nan)


def drift_notice(name: str, unit: str, dt: float, values: FloatArray) -> Notice | None:
    """Say how far the level wanders, and whether it does so in one direction.

    The variance of the means of 64 parts is compared with what the differences between means of
    64 samples would give if all noise were white (F test). A straight line through the means is a
    drift only where a random walk would hardly have it: 99.9 % of random walks change by less than
    20 times the root mean square of what the line leaves (200,000 simulated).

    Parameters
    ----------
    name, unit : str
        Of the channel.
    dt : float
        s.
    values : (n,) ndarray
        Samples, NaN where missing.
    """
    size = values.size // tuning.PARTS
    if size < 2 * tuning.SHORT_MEAN:
        return None
    means = part_means(values)
    place = np.arange(tuning.PARTS) - 0.5 * (tuning.PARTS - 1)
    known = ~np.isnan(means)
    short = part_means(values, values.size // tuning.SHORT_MEAN)
    steps = np.diff(short)
    steps = steps[~np.isnan(steps)]
    if np.count_nonzero(known) < tuning.PARTS / 2 or steps.size < tuning.PARTS:
        return None
    means, place = means[known], place[known]
    place = place - np.mean(place)
    slope = float(place @ means / (place @ place))
    rest = means - np.mean(means) - slope * place
    freedom = means.size - 2
    wander = float(np.sqrt(rest @ rest / freedom))
    # Differences of means that are not independent have two thirds of the degrees of freedom.
    white = float(np.sqrt(0.5 * np.mean(steps**2) * tuning.SHORT_MEAN / size))
    if not white > 0.0:
        return None
    change = slope * tuning.PARTS
    ratio = wander / white
    ramp = abs(change) > tuning.RAMP * wander
    wanders = ratio**2 > f_distribution.isf(tuning.FALSE_ALARM, freedom, 2.0 / 3.0 * steps.size)
    if not (wanders or ramp):
        return None
    numbers = {"wander": wander, "white": white, "change": change}
    if ramp:
        return Notice(
            "drift",
            "warning",
            name,
            f"drifts by {readable(change, unit, sign=True)} over the record, and wanders about "
            f"that by {readable(wander, unit)} rms",
            numbers,
            "add a RateRamp to the model, or leave out the warm-up",
        )
    text = (
        f"means of {size * dt:.3g} s wander by {readable(wander, unit)} rms, {ratio:.2g} times "
        "what the fast noise leaves"
    )
    action = "estimated as random walk or slow Gauss-Markov process"
    return Notice("drift", "note", name, text, numbers, action)


def variance_notice(
    name: str,
    unit: str,
    dt: float,
    errors: Innovations,
    usable: BoolArray,
    step: float,
) -> Notice | None:
    """Say whether the noise is as large at the end as at the beginning.

    Squares of prediction errors are uncorrelated whatever the spectrum of the noise; their own
    variance gives the error of their means, so tails heavier than Gaussian do no harm.

    Parameters
    ----------
    name, unit : str
        Of the channel.
    dt : float
        s.
    errors : Innovations
    usable : (n,) ndarray of bool
        Prediction errors outside events.
    step : float
        To which samples are rounded, u.
    """
    level = errors.level
    if step > 2.0 * level or np.count_nonzero(usable) < 1000:
        return None  # noise below the step is seen only when the level is between two steps
    squares = [part[keep] ** 2 for part, keep in _tenths(errors.values, usable)]
    if min(part.size for part in squares) < 50:
        return None
    means = np.array([np.mean(part) for part in squares])
    spread = np.array([np.var(part) / part.size for part in squares])
    usual = float(np.median(means))
    halves = np.split(np.arange(tuning.TENTHS), 2)
    if min(np.count_nonzero(means[half]) for half in halves) < 2:
        return None  # half of the record is predicted without any error
    loudest = int(np.argmax(means))
    jump = np.sqrt(means[loudest] / usual) - 1.0
    tail = norm.isf(tuning.FALSE_ALARM / tuning.TENTHS) * np.sqrt(spread[loudest]) / usual
    is_loud = jump > tuning.LARGE_CHANGE and means[loudest] / usual - 1.0 > tail
    # One loud tenth makes its half louder, which is not a trend.
    counted = np.arange(tuning.TENTHS) != loudest if is_loud else np.ones(tuning.TENTHS, dtype=bool)
    first, first_error = _mean_of(
        means, spread, counted & (np.arange(tuning.TENTHS) < tuning.TENTHS // 2)
    )
    second, second_error = _mean_of(
        means, spread, counted & (np.arange(tuning.TENTHS) >= tuning.TENTHS // 2)
    )
    numbers = {
        "first_half": float(np.sqrt(first)),
        "second_half": float(np.sqrt(second)),
        "loudest_tenth": float(loudest),
        "loudest": float(np.sqrt(means[loudest])),
    }
    # On the logarithmic scale the ratio of two variances is nearly normal.
    error = norm.isf(0.5 * tuning.FALSE_ALARM) * np.hypot(
        first_error / first, second_error / second
    )
    growth = np.sqrt(second / first) - 1.0
    if abs(np.log(second / first)) > error and abs(growth) > tuning.CHANGE:
        severity: Severity = "warning" if abs(growth) > tuning.LARGE_CHANGE else "note"
        text = (
            f"the noise is {100.0 * abs(growth):.2g} % {'larger' if growth > 0.0 else 'smaller'} "
            "in the second half than in the first"
        )
        action = "the model is an average: use the part that is like the use"
        return Notice("variance", severity, name, text, numbers, action)
    if is_loud:
        start = loudest * errors.values.size // tuning.TENTHS * dt
        text = (
            f"the noise is {100.0 * jump:.2g} % larger than usual in the tenth of the record that "
            f"begins at {start:.4g} s"
        )
        action = "look for people or machines then, and leave it out if it is none of the sensor"
        return Notice("variance", "warning", name, text, numbers, action)
    return None


def _mean_of(means: FloatArray, spread: FloatArray, which: BoolArray) -> tuple[float, float]:
    """Mean of some tenths and its standard error."""
    count = np.count_nonzero(which)
    return float(np.mean(means[which])), float(np.sqrt(np.sum(spread[which])) / count)


def _tenths(values: FloatArray, usable: BoolArray) -> list[tuple[FloatArray, BoolArray]]:
    edges = np.linspace(0, values.size, tuning.TENTHS + 1).astype(int)
    return [(values[a:b], usable[a:b]) for a, b in pairwise(edges)]
