"""Samples that are missing, stuck or cut off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gmwm._core.distributions import binom
from gmwm._core.notices import Notice, Severity
from gmwm._core.text import brief, readable
from gmwm._core.typing import BoolArray, FloatArray, IntArray, known_of
from gmwm.diagnosis import tuning
from gmwm.diagnosis.innovations import Innovations, Signal
from gmwm.readers import Channel, Missing


class Lost(NamedTuple):
    """What is missing from a channel.

    n, missing: Samples, and those that are missing.
    gaps, longest: How many, and the length of the longest, s.
    """

    n: int
    missing: int
    gaps: int
    longest: float


def gap_notices(channels: Sequence[Channel], dt: float) -> list[Notice]:
    """How much is missing; one notice for the recording where all channels miss the same."""
    found = {channel.name: Missing.of(channel.values) for channel in channels}
    return lost_notices(
        {
            name: Lost(each.n, each.samples, each.gaps, each.longest * dt)
            for name, each in found.items()
        }
    )


def lost_notices(found: Mapping[str, Lost]) -> list[Notice]:
    """Those of `gap_notices`, from what is missing by channel."""
    notices = [_gap_notice(name, each) for name, each in found.items() if each.missing]
    if len(notices) == len(found) > 1 and all(n.values == notices[0].values for n in notices):
        return [replace(notices[0], where="")]
    return notices


def _gap_notice(where: str, found: Lost) -> Notice:
    n, missing, gaps, longest = found
    share = missing / n
    values = {
        "missing": float(missing),
        "share": share,
        "gaps": float(gaps),
        "longest": longest,
    }
    if missing == n:
        return Notice(
            "gap", "bad", where, "all samples missing", values, "look at cable and columns"
        )
    plural = "s" if gaps > 1 else ""
    text = (
        f"{missing:,} of {n:,} samples missing ({share:.2g} of all) in {gaps:,} "
        f"gap{plural}, the longest {longest:.3g} s"
    )
    if share > tuning.TOO_MUCH_MISSING:
        return Notice("gap", "bad", where, text, values, "too few are left: record again")
    severity: Severity = "warning" if share > tuning.MUCH_MISSING else "note"
    hint = "the wavelet variance bridges short gaps and leaves out what others touch"
    return Notice("gap", severity, where, text, values, hint)


def length_notice(n: int, rate: float) -> Notice:
    """Say how long a recording of n samples is, and whether that is short."""
    length = n / rate
    text = f"{n:,} samples at {rate:g} Hz, {length:.6g} s"
    numbers = {"duration": length, "rate": rate}
    if length < tuning.LONG_RECORD:
        return Notice(
            "length",
            "note",
            "",
            f"{text}, too short for slow errors of minutes and more",
            numbers,
            "an hour or more shows them",
        )
    return Notice("length", "good", "", text, numbers)


def dead_notice(channel: Channel) -> Notice | None:
    """Say that a channel never changes."""
    if channel.missing == channel.n or not channel.is_constant:
        return None
    return Notice(
        "dead",
        "bad",
        channel.name,
        f"every sample is {readable(channel.mean, channel.unit, digits=6)}: the channel is dead",
        {"value": channel.mean},
        "check sensor and columns; it is skipped in the calibration",
    )


def is_dithered(values: FloatArray, step: float) -> bool:
    """Whether noise is wide enough for neighbouring samples to differ by more than rounding.

    values: (n,), samples in their order, none missing.
    step: To which they are rounded, u; 0 if they are not.
    """
    free = _outside_runs(run_lengths(values))
    free = free[1:] & free[:-1]
    count = np.count_nonzero(free)
    if count < tuning.LONG_RUN:
        return False
    if step == 0.0:
        return True
    steps = np.diff(values)
    far = free & (np.abs(steps, out=steps) > 1.5 * step)
    return bool(np.count_nonzero(far) > tuning.DITHERED * count)


def _outside_runs(lengths: IntArray) -> BoolArray:
    """Of each sample, whether it is in none of the long runs."""
    return np.repeat(lengths < tuning.LONG_RUN, lengths)


def run_lengths(values: FloatArray) -> IntArray:
    """Lengths of the runs of equal samples, in their order."""
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    return np.diff(changes, prepend=0, append=values.size)


def stuck_notice(signal: Signal, values: FloatArray, errors: Innovations) -> Notice | None:
    """Find runs of equal samples longer than rounding explains.

    Whatever came before, a Gaussian prediction error of standard deviation s keeps a sample in
    the step of the one before with a probability of at most erf(step / (2^(3/2) s)), that of the
    interval around the prediction (Anderson 1955, *Proc. AMS* 6, 170-176). A run of L repetitions
    somewhere in n samples therefore has a probability below n times the L-th power.

    values: (n,), samples, NaN where missing.
    """
    present = ~np.isnan(values)
    series = known_of(values)
    if not is_dithered(series, signal.step):
        return None
    lengths = run_lengths(series)
    longest = _longest_by_chance(series.size, signal.step, _scale_between(errors, present, lengths))
    stuck = np.flatnonzero(lengths > longest)
    if not stuck.size:
        return None
    worst = int(stuck[np.argmax(lengths[stuck])])
    total = int(np.sum(lengths[stuck]))
    share = total / series.size
    start = int(np.sum(lengths[:worst]))
    numbers = {
        "count": float(stuck.size),
        "longest": float(lengths[worst]),
        "time": float(np.flatnonzero(present)[start]) * signal.dt,
        "value": float(series[start]),
        "samples": float(total),
    }
    value = readable(numbers["value"], signal.unit, digits=5)
    many = f"{stuck.size:,} times, the longest" if stuck.size > 1 else ""
    text = (
        f"stuck {many} at {value} for {lengths[worst]:,} samples from "
        f"{numbers['time']:.6g} s on, where rounding explains {longest:,}"
    ).replace("  ", " ")
    severity: Severity = "bad" if share > tuning.MUCH_MISSING else "warning"
    hint = "make such samples missing (NaN) before the fit"
    return Notice("stuck", severity, signal.name, text, numbers, hint)


def _scale_between(errors: Innovations, present: BoolArray, lengths: IntArray) -> float:
    """Usual standard deviation of prediction errors outside long runs."""
    kept = present.copy()
    kept[present] = _outside_runs(lengths)
    kept &= errors.known
    if not np.any(kept):
        return 0.0
    usual = np.median(errors.scale[kept], overwrite_input=True)
    return float(np.sqrt(usual * np.std(errors.values[kept])))


def _longest_by_chance(n: int, step: float, scale: float) -> int:
    from scipy.special import erf

    noise = np.sqrt(max(scale**2 - step**2 / 12.0, 1e-3 * scale**2))
    same = float(erf(step / (2.0**1.5 * noise))) if noise > 0.0 else 1.0
    if same >= 1.0:
        return n
    fewest = 3  # equal numbers of a file with few digits
    if same <= 0.0:
        return fewest
    return max(int(np.ceil(np.log(tuning.FALSE_ALARM / n) / np.log(same))) + 1, fewest)


def saturation_notice(signal: Signal, values: FloatArray, quiet: FloatArray) -> Notice | None:
    """Find more samples at the largest or smallest value than at the one before it.

    A tail falls outwards, and for noise faster and faster: from the last step but one to the last
    by no less than from the one before to it, up to chance (binomial test, with three standard
    errors for that fall).

    values: (n,), samples, none missing.
    quiet: (m,), those outside shocks, whose peaks may be cut off without harm: they are left out.
    """
    step = signal.step
    if not is_dithered(values, step):
        return None
    lowest, highest = float(np.min(values)), float(np.max(values))
    if step == 0.0:
        step = (highest - lowest) / np.sqrt(values.size)
        half = 0.0  # equal numbers are no chance where there are no steps
    else:
        half = 0.5
    ends = {}
    for end, sign in ((lowest, 1.0), (highest, -1.0)):
        distance = sign * (values - end) / step
        last = int(np.count_nonzero(distance <= half))
        next_two = [
            int(np.count_nonzero((distance > half + k) & (distance <= half + k + 1.0)))
            for k in (0.0, 1.0)
        ]
        fall = _slowest_fall(*next_two)
        chance = float(binom.sf(last - 1, last + next_two[0], fall / (1.0 + fall)))
        if last >= tuning.FEWEST_AT_END and chance < 0.5 * tuning.FALSE_ALARM:
            ends[end] = last
    if not ends:
        return None
    count = sum(ends.values())
    share = count / values.size
    where = " and ".join(readable(end, signal.unit, digits=5) for end in ends)
    of_noise = sum(np.count_nonzero(np.abs(quiet - end) <= half * step) for end in ends)
    return Notice(
        "saturation",
        "bad" if of_noise > tuning.FALSE_ALARM * values.size else "warning",
        signal.name,
        f"cut off at {where}: {count:,} samples ({share:.2g} of all) at the end of the scale",
        {"samples": float(count), "share": share, "lowest": lowest, "highest": highest},
        "use a wider range; make such samples missing (NaN) if they are few",
    )


def abrupt_end_notice(signal: Signal, values: FloatArray) -> Notice | None:
    """Find an extreme at which samples end although they are as dense there as before.

    Noise thins out towards its extremes. Numbers that were rectified, wrapped round or sorted out
    end where they are dense: the outer half of the last samples then holds half of them, where a
    density that falls to a fifth leaves a third. Each of `PARTS_OF_END` parts of the record with
    enough samples there has a larger share with a probability of a half at most, however few of
    them a slow process takes to its extreme (sign test). Steps above half of the scatter are not
    looked at: they hide how noise ends.

    values: (n,), samples outside shocks in their order, none missing.
    """
    step, scatter = signal.step, signal.scatter
    count = max(int(tuning.LAST_OF_END * values.size), tuning.FEWEST_OF_END)
    if values.size < 4 * count or 2.0 * step > scatter:
        return None
    found, density = [], 0.0
    for sign in (1.0, -1.0):
        end = sign * float(np.max(sign * values))
        inwards = sign * (end - values)
        width = min(float(np.partition(inwards, count)[count]), scatter)
        if step > 0.0:
            # Both halves have the same number of steps, two at least.
            width = step * 2.0 * max(np.ceil(0.5 * width / step), 2.0)
        near = np.flatnonzero(inwards < width - 0.5 * step)
        if 2 * near.size > values.size:
            continue
        part = near * tuning.PARTS_OF_END // values.size
        is_outer = inwards[near] < 0.5 * (width - step)
        last = np.bincount(part, minlength=tuning.PARTS_OF_END)
        outer = np.bincount(part[is_outer], minlength=tuning.PARTS_OF_END)
        asked = last >= tuning.FEWEST_OF_PART
        dense = int(np.count_nonzero(asked & (3 * (outer - 1) >= last)))
        if binom.sf(dense - 1, int(np.count_nonzero(asked)), 0.5) < 0.5 * tuning.FALSE_ALARM:
            found.append(end)
            density += near.size / values.size / width * float(np.std(values))
    if not found:
        return None
    where = " and ".join(readable(end, signal.unit, digits=5) for end in sorted(found))
    return Notice(
        "abrupt-end",
        "bad" if density > tuning.HARMFUL_END else "warning",
        signal.name,
        f"samples end abruptly at {where}, where noise would thin out: rectified, wrapped round "
        "or sorted out",
        {"lowest": min(found), "highest": max(found), "density": density},
        "look for what wraps, cuts or takes absolute values between the sensor and the file",
    )


def repeated_value_notice(signal: Signal, values: FloatArray) -> Notice | None:
    """Find a value that comes far more often than the ones next to it, in many places.

    Noise above its step has no such value: the two values on either side come nearly as often. A
    driver that puts zero where the sensor did not answer, or a dead band, makes one. Runs of equal
    samples count once: what stays is stuck.

    values: (n,), samples in their order, none missing.
    """
    if signal.step > signal.scatter:
        return None
    begins = values[np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)]
    levels, counts = np.unique(begins, return_counts=True)
    most = int(np.argmax(counts))
    if most in (0, levels.size - 1):
        return None  # the end of the scale: see saturation
    near = np.delete(counts[max(most - 2, 0) : most + 3], min(most, 2))
    count = int(np.count_nonzero(values == levels[most]))
    share = count / values.size
    usual = tuning.BESIDE_REPEATED * np.max(near)
    if counts[most] - usual < max(tuning.FALSE_ALARM * values.size, tuning.LONG_RUN):
        return None
    is_much = share > tuning.MUCH_REPEATED
    text = (
        f"{count:,} samples ({share:.2g} of all) are "
        f"{readable(float(levels[most]), signal.unit, digits=5)}, which comes "
        f"{brief(counts[most] / np.max(near))} times as often as the values next to it"
    )
    return Notice(
        "value-repeated",
        "bad" if is_much else "warning",
        signal.name,
        text,
        {"value": float(levels[most]), "samples": float(count), "share": share},
        "if it stands for no answer or a dead band, make such samples missing (NaN)",
    )


def _slowest_fall(near: int, far: int) -> float:
    """Ratio of the counts of two steps of a tail, plus three standard errors; 1 at most."""
    if near == 0 or far == 0:
        return 1.0
    error = np.sqrt(1.0 / near + 1.0 / far)
    return float(min(near / far * (1.0 + 3.0 * error), 1.0))
