"""Slow changes of the level, by themselves or with the temperature, and of the noise."""

from collections.abc import Iterator
from itertools import pairwise, product

import numpy as np

from gmwm._core.distributions import chi2, fisher, norm, student
from gmwm._core.text import brief, readable
from gmwm._core.typing import FloatArray, inner
from gmwm.diagnosis import tuning
from gmwm.diagnosis.innovations import Examined
from gmwm.issues import Notice, Severity, notice
from gmwm.readers import Recording, block_means


def part_means(values: FloatArray, parts: int = tuning.PARTS, least: float = 0.5) -> FloatArray:
    """Means of equal parts of a series; NaN where no more than the least fraction is present."""
    size = values.size // parts
    return block_means([values[: size * parts]], size, least)[:, 0]


def drift(channel: Examined) -> Iterator[Notice]:
    """Say how far the level wanders, and whether it does so in one direction.

    The variance of the means of 64 parts is compared with that of white noise, by the differences
    between means of 64 samples (F test). A straight line is a drift only where a random walk would
    hardly have it: 99.9 % change by less than 20 times the rms of what the line leaves.
    """
    name, unit, quiet = channel.name, channel.unit, channel.quiet
    size = quiet.size // tuning.PARTS
    if size < 2 * tuning.SHORT_MEAN:
        return
    means = part_means(quiet)
    place = np.arange(tuning.PARTS) - 0.5 * (tuning.PARTS - 1)
    known = ~np.isnan(means)
    short = part_means(quiet, quiet.size // tuning.SHORT_MEAN)
    steps = np.diff(short)
    steps = steps[~np.isnan(steps)]
    if np.count_nonzero(known) < tuning.PARTS / 2 or steps.size < tuning.PARTS:
        return
    means, place = means[known], place[known]
    place = place - np.mean(place)
    slope = float(place @ means / (place @ place))
    rest = means - np.mean(means) - slope * place
    freedom = means.size - 2
    wander = float(np.sqrt(rest @ rest / freedom))
    # Differences of means that are not independent have two thirds of the degrees of freedom.
    white = float(np.sqrt(0.5 * np.mean(steps**2) * tuning.SHORT_MEAN / size))
    if not white > 0.0:
        return
    change = slope * tuning.PARTS
    ratio = wander / white
    ramp = abs(change) > tuning.RAMP * wander
    wanders = ratio**2 > fisher.isf(tuning.FALSE_ALARM, freedom, 2.0 / 3.0 * steps.size)
    if not (wanders or ramp):
        return
    values = {"wander": wander, "white": white, "change": change}
    if ramp:
        shown = (readable(change, unit, sign=True), readable(wander, unit))
        words = {"hint": "add a RateRamp to the model, or leave out the warm-up", "variant": "ramp"}
        yield notice("drift", name, values, severity="warning", shown=shown, **words)
        return
    level, times, length = readable(wander, unit), brief(ratio), size * channel.dt
    yield notice("drift", name, values, length=length, shown=level, times=times)


def variance(channel: Examined) -> Iterator[Notice]:
    """Say whether the noise is as large at the end as at the beginning, and all the time between.

    Squares of prediction errors are uncorrelated whatever the spectrum of the noise; their own
    variance gives the error of their means, so tails heavier than Gaussian do no harm.
    """
    if channel.step > 2.0 * channel.scatter:
        return  # noise below the step is seen only when the level is between two steps
    found, values = _change(channel), _unsteadiness(channel)
    if values is not None:
        low, high = (readable(values[each], channel.unit) for each in ("quiet", "loud"))
        before, known = (f"{found.text}; ", found.values) if found is not None else ("", {})
        values = {**known, **values}
        yield notice("variance", channel.name, values, before=before, low=low, high=high)
    elif found is not None:
        yield found


def _change(channel: Examined) -> Notice | None:
    """Compare the second half with the first, and each tenth with the usual one."""
    errors, usable = channel.errors, channel.usable
    if np.count_nonzero(usable) < 1000:
        return None
    edges = np.linspace(0, errors.values.size, tuning.TENTHS + 1).astype(int)
    squares = [errors.values[a:b][usable[a:b]] ** 2 for a, b in pairwise(edges)]
    if min(part.size for part in squares) < 50:
        return None
    means = np.array([np.mean(part) for part in squares])
    spread = np.array([np.var(part) / part.size for part in squares])
    usual = float(np.median(means))
    is_second = np.arange(tuning.TENTHS) >= tuning.TENTHS // 2
    if min(np.count_nonzero(means[half]) for half in (is_second, ~is_second)) < 2:
        return None  # half of the record is predicted without any error
    loudest = int(np.argmax(means))
    jump = np.sqrt(means[loudest] / usual) - 1.0
    tail = norm.isf(tuning.FALSE_ALARM / tuning.TENTHS) * np.sqrt(spread[loudest]) / usual
    is_loud = jump > tuning.LARGE_CHANGE and means[loudest] / usual - 1.0 > tail
    # One loud tenth makes its half louder, which is not a trend.
    counted = np.arange(tuning.TENTHS) != loudest if is_loud else np.ones(tuning.TENTHS, dtype=bool)
    halves = (counted & ~is_second, counted & is_second)
    first, second = (float(np.mean(means[half])) for half in halves)
    numbers = {"first_half": float(np.sqrt(first)), "second_half": float(np.sqrt(second))}
    numbers |= {"loudest_tenth": float(loudest), "loudest": float(np.sqrt(means[loudest]))}
    # On the logarithmic scale the ratio of two variances is nearly normal.
    parts = [np.sqrt(np.sum(spread[h])) / np.count_nonzero(h) for h in halves]
    error = norm.isf(0.5 * tuning.FALSE_ALARM) * np.hypot(parts[0] / first, parts[1] / second)
    growth = np.sqrt(second / first) - 1.0
    if abs(np.log(second / first)) > error and abs(growth) > tuning.CHANGE:
        severity: Severity = "warning" if abs(growth) > tuning.LARGE_CHANGE else "note"
        hint = "calibrate the part that matches how the sensor is used"
        words = {"growth": abs(growth), "word": "larger" if growth > 0.0 else "smaller"}
        when, changed = _jump(channel)
        numbers |= changed
        words |= {"when": when, "level": readable(float(np.sqrt(np.mean(means))), channel.unit)}
        variant = "half"
    elif is_loud:
        severity, variant = "warning", "tenth"
        hint = "look for people or machines then, and leave it out if it is not the sensor"
        start = loudest * errors.values.size // tuning.TENTHS * channel.dt
        words = {"growth": jump, "start": start}
    else:
        return None
    return notice(
        "variance", channel.name, numbers, severity=severity, variant=variant, hint=hint, **words
    )


def _jump(channel: Examined) -> tuple[str, dict[str, float]]:
    """When noise changed from one size to another, in words and values; "gradually" if it did.

    Least squares on the logarithms of the mean squares of parts, against a straight line.
    """
    squares = np.where(channel.usable, channel.errors.values, np.nan) ** 2
    logs = np.log(part_means(squares))
    place = np.flatnonzero(np.isfinite(logs))
    logs, steps = logs[place], []
    if logs.size < tuning.FEWEST_PARTS:
        return "at some time", {}
    for k in range(2, logs.size - 1):
        left, right = logs[:k], logs[k:]
        rest = left.size * float(np.var(left)) + right.size * float(np.var(right))
        steps.append((rest, k))
    rest, k = min(steps)
    line = np.polynomial.Polynomial.fit(place, logs, 1)
    if rest >= float(np.sum((logs - line(place)) ** 2)):
        return "gradually", {}
    time = (place[k - 1] + place[k] + 1) / 2.0 * (squares.size // tuning.PARTS) * channel.dt
    sizes = [float(np.exp(0.5 * np.mean(each))) for each in (logs[:k], logs[k:])]
    before, after = (readable(each, channel.unit) for each in sizes)
    changed = zip(("changed", "size_before", "size_after"), (float(time), *sizes), strict=True)
    return f"at about {time:.4g} s from {before} to {after}", dict(changed)


def _unsteadiness(channel: Examined) -> dict[str, float] | None:
    """By how much noise that comes and goes, or swells and dies, is above that of its quiet parts.

    Sizes of prediction errors, bounded against tails, are averaged over parts of 64, 256, ...
    samples. Those of stationary noise vary by their long-run variance over the length (chi-square),
    which neighbouring means of 16 samples give. What mean squares vary more is noise that changes.
    """
    errors, usable = channel.errors, channel.usable
    size = errors.values[usable]
    np.abs(size, out=size)
    memory = tuning.STEADY_MEAN * (tuning.STEADY_OF_TAILS if channel.tails is not None else 1)
    lengths = 4 * memory * 4 ** np.arange(16)
    lengths = lengths[lengths * tuning.FEWEST_STEADY <= size.size]
    if not lengths.size or not errors.level > 0.0:
        return None
    bounded = np.minimum(size, tuning.LARGE * errors.level)
    # What is far beyond the noise around it is clipped: a shock does not change the noise.
    squares = errors.scale[usable]
    squares *= tuning.CLIP
    np.minimum(size, squares, out=squares)
    squares *= squares
    squares /= np.mean(squares)
    square = bounded - np.mean(bounded)
    square *= square
    kurt = inner(square, square) / (square.size * float(np.mean(square)) ** 2) - 3.0
    del square
    # Variance of long means times their length.
    by_chance = [
        0.5 * memory * float(np.mean(np.diff(_means(each, memory)) ** 2))
        for each in (bounded, squares)
    ]
    if min(by_chance) <= 0.0:
        return None
    found = {"excess": tuning.UNSTEADY}
    for length in lengths.tolist():
        sizes, means = _means(bounded, length), _means(squares, length)
        freedom = 2.0 / (2.0 / (means.size - 1) + kurt / size.size)
        ratio = float(np.var(sizes, ddof=1)) * length / by_chance[0]
        total = float(np.var(means, ddof=1))
        added = total - by_chance[1] / length
        if added <= 0.0 or chi2.sf(freedom * ratio, freedom) * lengths.size > tuning.FALSE_ALARM:
            continue
        # Without what chance spreads them.
        real = np.maximum(1.0 + np.sqrt(added / total) * (means - 1.0), np.min(means))
        quiet, quarter, loud = np.quantile(real, [0.1, 0.25, 0.9])
        excess = float(1.0 / np.sqrt(quarter) - 1.0) if quarter > 0.0 else np.inf
        if excess > found["excess"]:
            usual = float(np.sqrt(np.mean(size**2)))
            low, high = (usual * float(np.sqrt(each)) for each in (quiet, loud))
            found = {"excess": excess, "quiet": low, "loud": high, "part": channel.dt * length}
    return found if "part" in found else None


def _means(values: FloatArray, length: int) -> FloatArray:
    """Means of parts of a length."""
    return np.asarray(values[: values.size // length * length].reshape(-1, length).mean(axis=1))


def temperature_notices(recording: Recording) -> list[Notice]:
    """Find channels that follow a temperature channel, each with the one it follows most closely.

    Changes from one part of the record to the next are correlated, because drift alone is not a
    dependence. Few parts show slow changes above the noise, many parts show fast ones. Either may
    lag behind the other by a part.
    """
    thermometers = [c for c in recording.values() if c.quantity == "temperature"]
    if recording.n < tuning.PARTS * tuning.SHORTEST_PART or not thermometers:
        return []
    ways = [*product(thermometers, tuning.PARTS_OF_TEMPERATURE, (-1, 0, 1))]
    tests, notices = len(ways) * len(recording.inertial), []
    for channel in recording.inertial:
        found = []
        for thermometer, parts, lag in ways:
            # Thermometers are often slower than the other sensors.
            x = np.diff(part_means(thermometer.values, parts, least=0.0))
            y = np.diff(part_means(channel.values, parts))
            x, y = x[max(-lag, 0) : x.size - max(lag, 0)], y[max(lag, 0) : y.size - max(-lag, 0)]
            known = ~np.isnan(x + y)
            x, y, n = x[known], y[known], int(np.count_nonzero(known))
            if n < tuning.FEWEST_PARTS or np.std(x) == 0.0 or np.std(y) == 0.0:
                continue
            r = float(np.corrcoef(x, y)[0, 1])
            p = 2.0 * student.sf(abs(r) * np.sqrt((n - 2) / max(1.0 - r**2, 1e-12)), n - 2)
            if p < tuning.FALSE_ALARM / tests:
                found.append((float(p), r, float(np.polyfit(x, y, 1)[0]), thermometer))
        if found:
            _, r, slope, thermometer = min(found, key=lambda one: one[0])
            values = {"correlation": r, "slope": slope}
            per = f"{readable(slope, channel.unit)} per {thermometer.unit or 'unit'}"
            name = thermometer.name
            notices.append(notice("temperature", channel.name, values, name=name, per=per))
    return notices
