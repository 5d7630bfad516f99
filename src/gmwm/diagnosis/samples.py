"""Samples that are missing, stuck, cut off or made otherwise than by the sensor."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy import ndimage
from scipy.special import erf

from gmwm._core.distributions import binom
from gmwm._core.text import brief, readable
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.diagnosis import tuning
from gmwm.diagnosis.innovations import Examined
from gmwm.issues import Notice, Severity, notice
from gmwm.readers import Channel, Missing, Recording


def gap_notices(channels: Sequence[Channel], dt: float) -> list[Notice]:
    """Say how much is missing; once for the recording where all channels miss the same."""
    found = []
    for channel in channels:
        missing = Missing.of(channel.values)
        if not missing.samples:
            continue
        share = missing.samples / channel.n
        values = {"missing": float(missing.samples), "share": share}
        values |= {"gaps": float(missing.gaps), "longest": missing.longest * dt}
        severity: Severity = "note"
        hint = "the wavelet variance bridges short gaps and leaves out what others touch"
        if share > tuning.TOO_MUCH_MISSING:
            severity = "bad"
            hint = "too few are left: record again" if share < 1.0 else "check cable and columns"
        elif share > tuning.MUCH_MISSING:
            severity = "warning"
        words = {"variant": "all" if share == 1.0 else "", "hint": hint}
        found.append(notice("gap", channel.name, values, severity=severity, n=channel.n, **words))
    if len(found) == len(channels) > 1 and all(one.values == found[0].values for one in found):
        return [replace(found[0], where="")]
    return found


def length(recording: Recording) -> Iterator[Notice]:
    """Say how long a recording is, and whether that is short."""
    values = {"duration": recording.n / recording.rate, "rate": recording.rate}
    if values["duration"] < tuning.LONG_RECORD:
        yield notice("length", "", values, severity="note", variant="short", n=recording.n)
    else:
        yield notice("length", "", values, severity="good", hint="", n=recording.n)


def is_dithered(values: FloatArray, step: float) -> bool:
    """Whether noise is wide enough for neighbouring samples to differ by more than rounding."""
    lengths = _run_lengths(values)
    free = np.repeat(lengths < tuning.LONG_RUN, lengths)
    free = free[1:] & free[:-1]
    count = np.count_nonzero(free)
    if count < tuning.LONG_RUN:
        return False
    if step == 0.0:
        return True
    steps = np.diff(values)
    far = free & (np.abs(steps, out=steps) > 1.5 * step)
    return bool(np.count_nonzero(far) > tuning.DITHERED * count)


def _run_lengths(values: FloatArray) -> IntArray:
    """Lengths of the runs of equal samples, in their order."""
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    return np.diff(changes, prepend=0, append=values.size)


def stuck(channel: Examined) -> Iterator[Notice]:
    """Find runs of equal samples longer than rounding explains.

    A Gaussian prediction error of standard deviation s keeps a sample in the step of the one before
    with a probability of at most erf(step / (2^(3/2) s)) (Anderson 1955, *Proc. AMS* 6, 170-176); a
    run of L repetitions in n samples has one below n times its L-th power.
    """
    errors, series = channel.errors, channel.present
    if not is_dithered(series, channel.step):
        return
    present, lengths = ~np.isnan(channel.values), _run_lengths(series)
    kept = errors.known.copy()
    kept[present] &= np.repeat(lengths < tuning.LONG_RUN, lengths)
    scale = 0.0
    if np.any(kept):
        usual = np.median(errors.scale[kept], overwrite_input=True)
        scale = float(np.sqrt(usual * np.std(errors.values[kept])))
    longest = 3  # equal numbers of a file with few digits
    noise = np.sqrt(max(scale**2 - channel.step**2 / 12.0, 1e-3 * scale**2))
    same = float(erf(channel.step / (2.0**1.5 * noise))) if noise > 0.0 else 1.0
    if same >= 1.0:
        return
    if same > 0.0:
        chance = np.log(tuning.FALSE_ALARM / series.size)
        longest = max(int(np.ceil(chance / np.log(same))) + 1, longest)
    stuck = np.flatnonzero(lengths > longest)
    if not stuck.size:
        return
    worst = int(stuck[np.argmax(lengths[stuck])])
    total = int(np.sum(lengths[stuck]))
    start = int(np.sum(lengths[:worst]))
    values = {"count": float(stuck.size), "longest": float(lengths[worst])}
    values["time"] = float(np.flatnonzero(present)[start]) * channel.dt
    values |= {"value": float(series[start]), "samples": float(total)}
    severity: Severity = "bad" if total > tuning.MUCH_MISSING * series.size else "warning"
    shown = {"shown": readable(values["value"], channel.unit, digits=5)}
    variant, name = "often" if stuck.size > 1 else "", channel.name
    yield notice("stuck", name, values, severity=severity, variant=variant, chance=longest, **shown)


def cut_off_or_abrupt_end(channel: Examined) -> Iterator[Notice]:
    """Say that samples are cut off at the end of the scale, or else that they end abruptly."""
    found = [*_cut_off(channel)] or [*_abrupt_end(channel)]
    yield from found


def _cut_off(channel: Examined) -> Iterator[Notice]:
    """Find more samples at an extreme than at the value before it, by a binomial test."""
    step, values = channel.step, channel.present
    if not is_dithered(values, step):
        return
    lowest, highest = float(np.min(values)), float(np.max(values))
    half = 0.5
    if step == 0.0:
        step = (highest - lowest) / np.sqrt(values.size)
        half = 0.0  # without steps, equal numbers are not chance
    ends = {}
    for end, sign in ((lowest, 1.0), (highest, -1.0)):
        distance = sign * (values - end) / step
        last, near, far = (
            int(np.count_nonzero((distance > low) & (distance <= high)))
            for low, high in ((-np.inf, half), (half, half + 1.0), (half + 1.0, half + 2.0))
        )
        fall = 1.0
        if near and far:
            fall = min(near / far * (1.0 + 3.0 * float(np.sqrt(1.0 / near + 1.0 / far))), 1.0)
        chance = float(binom.sf(last - 1, last + near, fall / (1.0 + fall)))
        if last >= tuning.FEWEST_AT_END and chance < 0.5 * tuning.FALSE_ALARM:
            ends[end] = last
    if not ends:
        return
    count = sum(ends.values())
    of_noise = sum(np.count_nonzero(np.abs(channel.noise - end) <= half * step) for end in ends)
    severity: Severity = "bad" if of_noise > tuning.FALSE_ALARM * values.size else "warning"
    numbers = {"samples": float(count), "share": count / values.size}
    numbers |= {"lowest": lowest, "highest": highest}
    yield notice("saturation", channel.name, numbers, severity=severity, ends=_ends(channel, ends))


def _abrupt_end(channel: Examined) -> Iterator[Notice]:
    """Find an extreme at which samples end although they are as dense there as before.

    Numbers that were rectified, wrapped round or sorted out end where they are dense: the outer
    half of the last samples then holds half of them, where a density that falls to a fifth leaves
    a third. Each of `PARTS_OF_END` parts of the record has a larger share with a probability of a
    half at most (sign test). Steps above half of the scatter hide how noise ends.
    """
    step, scatter, values = channel.step, channel.scatter, channel.noise
    count = max(int(tuning.LAST_OF_END * values.size), tuning.FEWEST_OF_END)
    if values.size < 4 * count or 2.0 * step > scatter:
        return
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
        return
    severity: Severity = "bad" if density > tuning.HARMFUL_END else "warning"
    numbers = {"lowest": min(found), "highest": max(found), "density": density}
    ends = _ends(channel, sorted(found))
    yield notice("abrupt-end", channel.name, numbers, severity=severity, ends=ends)


def _ends(channel: Examined, ends: Iterable[float]) -> str:
    return " and ".join(readable(end, channel.unit, digits=5) for end in ends)


def repeated_value(channel: Examined) -> Iterator[Notice]:
    """Find a value that comes far more often than the ones next to it, in many places.

    A driver that puts zero where the sensor did not answer, or a dead band, makes one. Runs of
    equal samples count once: what stays is stuck.
    """
    values = channel.present
    if channel.step > channel.scatter:
        return
    begins = values[np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)]
    levels, counts = np.unique(begins, return_counts=True)
    most = int(np.argmax(counts))
    if most in (0, levels.size - 1):
        return  # the end of the scale: see saturation
    near = np.max(np.delete(counts[max(most - 2, 0) : most + 3], min(most, 2)))
    excess = counts[most] - tuning.BESIDE_REPEATED * near
    if excess < max(tuning.FALSE_ALARM * values.size, tuning.LONG_RUN):
        yield from _cut_towards_zero(channel)
        return
    value, count = float(levels[most]), int(np.count_nonzero(values == levels[most]))
    shown, times = readable(value, channel.unit, digits=5), brief(counts[most] / near)
    yield _repeated(channel, value, count, shown=shown, times=times)


def _repeated(channel: Examined, value: float, count: float, **words: str) -> Notice:
    share = float(count) / channel.present.size
    values = {"value": value, "samples": float(count), "share": share}
    severity: Severity = "bad" if share > tuning.MUCH_REPEATED else "warning"
    return notice("value-repeated", channel.name, values, severity=severity, **words)


def _cut_towards_zero(channel: Examined) -> Iterator[Notice]:
    """Find twice as many zeros as noise has, as where numbers are cut instead of rounded."""
    step, values = channel.step, channel.present
    if step == 0.0:
        return
    zeros, one, two = (
        np.count_nonzero(np.abs(np.abs(values) - k * step) < 0.25 * step) / (1.0 if k == 0 else 2.0)
        for k in range(3)
    )
    if min(zeros, one, two) < tuning.FEWEST_AT_END:
        return
    error = np.sqrt(1.0 / zeros + 2.0 / one + 0.5 / two)
    if np.log(zeros * two / one**2) - 3.0 * error < np.log(tuning.CUT_TO_ZERO):
        return
    hint = "round to the nearest step before the conversion to integers"
    yield _repeated(channel, 0.0, zeros, variant="cut", hint=hint)


def thermometer_fails(means: FloatArray, samples: FloatArray) -> BoolArray:
    """Where means of a thermometer jump and return, or stay equal and jump then.

    A temperature does neither: soaks end without a jump or, of steps, with one to another soak.
    """
    there, found = np.flatnonzero(~np.isnan(means)), np.zeros(means.size, dtype=bool)
    if there.size == 0:
        return found
    x, steps = means[there], np.abs(np.diff(samples[: tuning.SAMPLES_OF_STEP]))
    usual = ndimage.median_filter(x, 2 * tuning.WIDEST_SPIKE + 1, mode="nearest")
    least = tuning.USUAL_STEPS * np.median(np.append(steps[steps > 0.0], 0.0))
    least = max(least, tuning.LEAST_JUMP * np.ptp(usual))
    starts = np.flatnonzero(np.diff(x, prepend=np.nan))
    lengths = np.diff(starts, append=x.size)
    after = np.minimum(starts + lengths + 1, x.size - 1)  # the mean in between is of both
    stuck = (np.abs(x[after] - x[starts]) > least) & (lengths > tuning.WIDEST_SPIKE)
    stuck &= 3 * np.repeat(lengths, lengths)[after] < lengths
    found[there] = ndimage.binary_dilation(np.repeat(stuck, lengths)) | (np.abs(x - usual) > least)
    return found
