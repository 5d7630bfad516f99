"""Samples that were not measured: sample and hold, lost packets, and linear interpolation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gmwm._core.notices import Notice, Severity
from gmwm._core.typing import FloatArray, known_of
from gmwm.diagnosis import tuning
from gmwm.diagnosis.resolution import step_size
from gmwm.diagnosis.result import Repetition
from gmwm.diagnosis.samples import is_dithered
from gmwm.readers import Channel


def repetition(channel: Channel) -> Repetition | None:
    """Find out whether a channel changes at every k-th sample only.

    Of samples that are not repeated, every change is in the same place modulo k with a probability
    of 1/k, so that some dozen changes leave no room for chance, however coarse the rounding is.
    """
    steps = np.diff(channel.values)
    changes = np.flatnonzero((steps != 0.0) & ~np.isnan(steps)) + 1
    if changes.size < tuning.FEWEST_KNOWN:
        return None
    times = int(np.gcd.reduce(np.diff(changes)))
    # Where the others are missing, as in rows of which every third is empty, nothing was repeated.
    repeats = np.count_nonzero(steps == 0.0)
    if times == 1 or 2 * repeats < (times - 1) * changes.size:
        return None
    return Repetition(times, int(changes[0]) % times)


def thinned(channel: Channel, found: Repetition) -> Channel:
    """One of each group of equal samples, at the channel's own rate."""
    values = channel.values[found.first :: found.times]
    return replace(channel, values=values, dt=channel.dt * found.times)


def repetition_notice(channel: Channel, found: Repetition) -> Notice:
    """Say how often each sample comes, and the rate of the channel."""
    rate = 1.0 / (channel.dt * found.times)
    text = f"each sample is repeated, {found.times} times in all: the channel's own rate is "
    return Notice(
        "repeated-samples",
        "note",
        channel.name,
        f"{text}{rate:.6g} Hz",
        {"times": float(found.times), "rate": rate},
        "one of each is used, at that rate",
    )


def interpolation_notice(channel: Channel) -> Notice | None:
    """Say that samples lie on straight lines between others, all over or now and then.

    Second differences vanish but where two lines meet, which two of them see: of an interpolation
    from f to F Hz a share of 1 - 2 f / F vanishes; of noise nearly none, if its step is small.
    """
    values = np.asarray(channel.values, dtype=float)
    steps = np.diff(values)
    bends = np.abs(np.diff(steps))
    # A value that is held, of a sensor that is stuck, is on no line between others.
    is_held = (steps[1:] == 0.0) & (steps[:-1] == 0.0)
    bends = bends[~np.isnan(bends) & ~is_held]
    if bends.size < tuning.FEWEST_KNOWN:
        return None
    size = float(np.quantile(bends, tuning.BENT))
    rounding = 4.0 * max(
        step_size(values[~np.isnan(values)]), float(np.spacing(np.nanmax(np.abs(values))))
    )
    limit = max(tuning.STRAIGHT * size, rounding)
    if not limit < tuning.STRAIGHT_AT_MOST * size:
        return None  # steps as large as the noise
    share = float(np.mean(bends <= limit))
    near = float(np.mean(bends <= tuning.NEARLY_STRAIGHT * size)) - share
    if share < max(tuning.FEWEST_STRAIGHT, tuning.BESIDE_STRAIGHT * near, 10.0 * limit / size):
        return None
    text = f"{share:.2g} of the samples lie on straight lines between others"
    if share < tuning.LEAST_STRAIGHT:
        values_of = {"share": share}
        text += ": put there for samples that were lost or sorted out"
        hint = "make such samples missing (NaN)"
        severity: Severity = "bad" if share > tuning.HELD_AT_MOST else "warning"
        return Notice("filled", severity, channel.name, text, values_of, hint)
    rate = 0.5 * (1.0 - share) / channel.dt
    text += f": it was interpolated from about {rate:.3g} Hz, and its noise is not the sensor's"
    hint = (
        "record what the sensor gives, in a topic of its own or without the driver's interpolation "
        "(RealSense: unite_imu_method 0); the channel is skipped in the calibration"
    )
    values_of = {"share": share, "rate": rate}
    return Notice("interpolated", "bad", channel.name, text, values_of, hint)


def held_share(values: FloatArray, step: float, scatter: float) -> tuple[float, float]:
    """Share of samples that repeat the one before without being measured, and that of chance.

    Where a packet is lost, recorders write the last sample again. Of measured samples, differences
    of no step are by a power of the ratio more frequent than those of one step by which these are
    than those of two: 1/3 of a Gaussian law.

    values: (n,), samples in their order, NaN where missing.
    step: u; 0 if samples are not rounded: then none equals the one before by chance.
    scatter: Standard deviation of what cannot be predicted of a sample, u.
    Returns: zeros if chance, with three standard errors, explains those that repeat.
    """
    sizes = np.diff(values)
    sizes = known_of(np.abs(sizes, out=sizes))
    same = int(np.count_nonzero(sizes == 0.0))
    fewest = max(tuning.FALSE_ALARM * sizes.size, tuning.LONG_RUN)
    if same < fewest:
        return 0.0, 0.0
    width = step or tuning.NEAR * scatter
    near, one, two = np.histogram(sizes[sizes > 0.0], np.array([0.0, 0.5, 1.5, 2.5]) * width)[0]
    if not is_dithered(known_of(values), step) or not min(one, two):
        return 0.0, 0.0
    if step == 0.0:
        # Steps that slowly change their size, by a correction, are a lattice all the same: of noise
        # without steps half as many are so near.
        chance, error = float(not one < 4 * near < 4 * one), 0.0
    else:
        power = tuning.LAST_RISE
        chance = 0.5 * one / sizes.size * max(one / two, 1.0) ** power
        error = float(np.hypot((1.0 + power) / np.sqrt(one), power / np.sqrt(two)))
    if same - chance * np.exp(3.0 * error) * sizes.size < fewest:
        return 0.0, 0.0
    return same / sizes.size - chance, chance


def leaves_runs(values: FloatArray) -> bool:
    """Whether some samples in a row are left where those that repeat the one before are missing.

    Not where every fifth is: a slower sensor in the rows of a faster clock.
    """
    ends = np.flatnonzero(np.isnan(values[1:]) | (np.diff(values) == 0.0)) + 1
    longest = np.max(np.diff(ends, prepend=0, append=values.size))
    return bool(longest > tuning.FEWEST_BETWEEN_HELD)


def held_notice(name: str, share: float, chance: float, *, is_even: bool) -> Notice:
    """Say how many samples repeat the one before, and whether that is every so manyth."""
    text = f"{share:.2g} of the samples repeat the one before, where chance explains {chance:.2g}"
    return Notice(
        "held",
        "bad" if share > tuning.HELD_AT_MOST else "warning",
        name,
        f"{text}: lost packets, for which the last sample was written again",
        {"share": share, "chance": chance},
        "record at the sensor's own rate" if is_even else "make such samples missing (NaN)",
    )
