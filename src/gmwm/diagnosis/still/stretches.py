"""Stretches at rest: generalized likelihood ratio on gyros and accelerometers.

The hypothesis of rest is that samples scatter about a constant mean as the sensor's own noise
does; against any other mean and scatter its log likelihood ratio is, but for constants, the sum
over the axes of the squared deviations from the mean of a window over the variance of the noise
(Skog et al., 2010, *IEEE Trans. Biomed. Eng.* 57, 2657-2666, where the gyros have no bias and the
accelerometers read gravity; here neither is assumed, as biases are unknown). The variance of the
noise is that of the quietest seconds of the log itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from gmwm._core.distributions import chi2
from gmwm._core.notices import Notice
from gmwm._core.typing import BoolArray, FloatArray
from gmwm._core.units import SI_UNIT, factor
from gmwm.diagnosis import tuning
from gmwm.diagnosis.motion import find_motion
from gmwm.diagnosis.still.blocks import blocks_of
from gmwm.readers import Channel, Recording

_GRAVITY = factor("g", SI_UNIT["accel"])
_WIDTH = 60  # characters of the timeline


@dataclass(frozen=True)
class Still:
    """The stretches of a recording that are at rest.

    Attributes
    ----------
    stretches : tuple of (float, float)
        Begin and end, s; each of ten seconds and more.
    longest : float
        Length of the longest one, s, those that are too short included.
    vibrating : tuple of (float, float)
        Stretches that are quiet but vibrate: an engine, a fan.
    duration : float
        Of the recording, s.
    """

    stretches: tuple[tuple[float, float], ...]
    longest: float
    vibrating: tuple[tuple[float, float], ...]
    duration: float

    @property
    def total(self) -> float:
        """Length of all stretches, s."""
        return sum(stop - start for start, stop in self.stretches)

    @property
    def timeline(self) -> str:
        """The recording from left to right: ``#`` at rest, ``~`` vibrating, ``.`` in motion."""
        marks = np.full(_WIDTH, ".")
        for stretches, mark in ((self.vibrating, "~"), (self.stretches, "#")):
            for start, stop in stretches:
                first, last = (round(_WIDTH * each / self.duration) for each in (start, stop))
                marks[first : max(last, first + 1)] = mark
        return "".join(marks)

    def notice(self) -> Notice:
        """Which stretches are used, and how far they reach."""
        listed = ", ".join(f"{start:.4g} to {stop:.4g}" for start, stop in self.stretches[:8])
        more = f" and {len(self.stretches) - 8} more" if len(self.stretches) > 8 else ""
        text = (
            f"in motion or vibrating for a part of its {self.duration:.4g} s; at rest from "
            f"{listed} s{more} |{self.timeline}|: these {self.total:.4g} s are used, and no "
            f"averaging time is longer than the longest of them, {self.longest:.4g} s"
        )
        values = {
            "stretches": len(self.stretches),
            "total": self.total,
            "longest": self.longest,
            "duration": self.duration,
        }
        return Notice("still-stretches", "warning", "", text, values, "slower errors are not seen")


def find_still(recording: Recording) -> Still:
    """Find the stretches of a log in which the sensor is at rest.

    Blocks of a quarter of a second whose scatter is that of the noise, in all axes together and in
    each, and whose mean rate is that of the quietest ones. A stretch in which an axis scatters more
    than in the quietest stretch, or has a narrow band of vibration, is no rest.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    Still
    """
    blocks = blocks_of(recording)
    if blocks is None:
        return Still((), 0.0, (), recording.duration)
    channels, size, means, scatter = blocks.channels, blocks.size, blocks.means, blocks.scatter
    gyro, count = blocks.is_gyro, means.shape[0]
    floor = _floor(scatter, size)
    quiet_blocks = _quiet(scatter, floor, size) & ~blocks.loudness.loud
    # A turn may begin between two blocks.
    turns = np.maximum(tuning.TURNS, tuning.BEYOND_WHITE * np.sqrt(floor[gyro] / size))
    quiet_blocks[1:] &= np.all(np.abs(np.diff(means[:, gyro], axis=0)) < turns, axis=1)
    runs = _runs(quiet_blocks, count, means[:, gyro])
    runs = _of_one_level(runs, means, floor, channels, size)
    quiet = [run for run in runs if run[1] - run[0] >= 2]
    length = blocks.length
    long = [run for run in quiet if (run[1] - run[0]) * length >= tuning.SHORTEST_STILL]
    shaking = _vibrates(long, channels, scatter, size, recording.dt)
    vibrating = [run for run, shakes in zip(long, shaking, strict=True) if shakes]
    rest = [run for run in long if run not in vibrating]
    others = [run[1] - run[0] for run in quiet if run not in vibrating]

    def times(some: Sequence[tuple[int, int]]) -> tuple[tuple[float, float], ...]:
        return tuple(
            (a * length, recording.duration if b == count else b * length) for a, b in some
        )

    longest = max(others, default=0) * length
    return Still(times(rest), longest, times(vibrating), recording.duration)


def rest_of(recording: Recording) -> Still | None:
    """The stretches at rest of a log that is not static; None if it is.

    It is not if it moves, or if it scatters more at some times than at others and begins or ceases
    to do so within seconds, as what vibrates. A tilt between two attitudes at rest is no motion.
    """
    motion = find_motion(recording)
    if motion.turns_steadily:
        return Still((), 0.0, (), recording.duration)
    if not all(move.is_tilt for move in motion.moves):
        return find_still(recording)
    blocks = blocks_of(recording)
    if blocks is None or not blocks.loudness.loud.any():
        return None
    return replace(find_still(recording), vibrating=blocks.loud_stretches)


def _floor(scatter: FloatArray, size: int) -> FloatArray:
    """Variance of the noise of each axis, from the quietest seconds."""
    least = np.nanmin(np.where(scatter > 0.0, scatter, np.nan), axis=0)
    logs = np.log(np.maximum(scatter, least)).sum(axis=1)
    width = min(tuning.BLOCKS_OF_FLOOR, logs.size)
    windows = np.lib.stride_tricks.sliding_window_view(logs, width)
    median = np.median(windows, axis=1)  # NaN where a block is missing
    first = int(np.nanargmin(median)) if not np.all(np.isnan(median)) else 0
    floor = np.maximum(np.nanmedian(scatter[first : first + width], axis=0), least)
    for _ in range(tuning.ROUNDS_OF_FLOOR):
        quiet = _quiet(scatter, floor, size)
        if np.count_nonzero(quiet) < width:
            break
        floor = np.maximum(np.median(scatter[quiet], axis=0), least)
    return floor


def _quiet(scatter: FloatArray, floor: FloatArray, size: int) -> BoolArray:
    """Whether the ratio of a block of so many samples is that of noise.

    By running medians: motion lasts longer than a shock, and to leave out the largest samples of
    noise of heavy tails would make it smaller than it is.
    """
    known = np.where(np.isnan(scatter), np.inf, scatter) / floor
    width = 2 * tuning.BLOCKS_OF_SHOCK + 1
    ratio = scipy.ndimage.median_filter(known, (width, 1), mode="nearest")
    ratio[np.isinf(known)] = np.inf
    together = np.mean(ratio, axis=1)
    freedom = (size - 1.0) * floor.size
    most = max(tuning.MOST_OF_FLOOR, float(chi2.isf(tuning.CHANCE_OF_BLOCK, freedom)) / freedom)
    return np.asarray((together < most) & (np.max(ratio, axis=1) < tuning.MOST_OF_AXIS))


def _runs(quiet: BoolArray, count: int, rate: FloatArray) -> list[tuple[int, int]]:
    """Begin and end of quiet stretches, a shock in them bridged, a block less at either end."""
    edges = np.flatnonzero(np.diff(quiet, prepend=False, append=False))
    runs = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    joined: list[tuple[int, int]] = []
    for a, b in runs:
        if joined and a - joined[-1][1] <= tuning.BLOCKS_OF_SHOCK:
            before = joined[-1][1] - joined[-1][0]
            change = np.median(rate[a:b], axis=0) - np.median(rate[slice(*joined[-1])], axis=0)
            same = bool(np.all(np.abs(change) < tuning.TURNS))
            if same and min(before, b - a) >= tuning.BLOCKS_OF_FLOOR:
                joined[-1] = (joined[-1][0], b)
                continue
        joined.append((a, b))
    trimmed = [(a + (a > 0), b - (b < count)) for a, b in joined]
    return [(a, b) for a, b in trimmed if b > a]


def _of_one_level(
    runs: list[tuple[int, int]],
    means: FloatArray,
    floor: FloatArray,
    channels: Sequence[Channel],
    size: int,
) -> list[tuple[int, int]]:
    """Runs whose rate is that of the run nearest to zero, and whose means do not sway."""
    if not runs:
        return runs
    gyro = np.array([channel.quantity == "gyro" for channel in channels])
    levels = [np.nanmedian(means[a:b], axis=0) for a, b in runs]
    least = min(tuning.BLOCKS_OF_FLOOR, max(b - a for a, b in runs))
    sizes = [float(np.linalg.norm(level[gyro])) for level in levels]
    rest = min((i for i, (a, b) in enumerate(runs) if b - a >= least), key=lambda i: sizes[i])
    sways = np.where(gyro, tuning.SWAYING_RATE, tuning.SWAYS * _GRAVITY)
    limit = np.maximum(sways, tuning.BEYOND_WHITE * np.sqrt(floor / (4 * size)))
    kept = []
    for (a, b), level in zip(runs, levels, strict=True):
        away = np.abs(level - levels[rest])[gyro]
        change = np.abs(means[a + 4 : b] - means[a : max(b - 4, a)])  # from one second to the next
        calm = not change.size or bool(np.all(np.nanmedian(change, axis=0) < limit))
        if calm and (not away.size or np.max(away) < tuning.TURNS):
            kept.append((a, b))
    return kept


def _vibrates(
    runs: Sequence[tuple[int, int]],
    channels: Sequence[Channel],
    scatter: FloatArray,
    size: int,
    dt: float,
) -> list[bool]:
    """Whether a stretch scatters more than the quietest one, now and then, or in a narrow band."""
    if not runs:
        return []
    levels = np.array([np.nanmedian(scatter[a:b], axis=0) for a, b in runs])
    # A channel that is dead in the quietest one has no floor to be compared with.
    floor = np.min(levels, axis=0)
    alive = floor > 0.0
    excess = np.max(levels[:, alive] / floor[alive], axis=1, initial=0.0) > tuning.LOUDER_THAN_REST
    # Large samples of noise come in one axis at a time, what shakes now and then in most of them.
    if np.any(alive):
        shaken = np.median(scatter[:, alive] / floor[alive], axis=1) > tuning.MOST_OF_FLOOR
        excess |= [bool(np.mean(shaken[a:b]) > tuning.NOW_AND_THEN) for a, b in runs]
    return [
        bool(loud) or any(_has_band(c.values[a * size : b * size], dt) for c in channels)
        for (a, b), loud in zip(runs, excess, strict=True)
    ]


def _has_band(values: FloatArray, dt: float) -> bool:
    """Whether the spectrum has a band far above what is around it, with much of the variance."""
    known = values[~np.isnan(values)]
    points = min(tuning.POINTS_OF_BAND, known.size // 4)
    frequency, density = scipy.signal.welch(known, 1.0 / dt, nperseg=points, detrend="linear")
    frequency, density = frequency[3:], density[3:]
    total = float(np.sum(density))
    for i in np.argsort(density)[-5:]:
        near = (frequency > frequency[i] / 2.0) & (frequency < 2.0 * frequency[i])
        band = slice(max(i - 2, 0), i + 3)
        strong = density[i] > tuning.PEAK_OF_BAND * np.median(density[near])
        if strong and np.sum(density[band]) > tuning.SHARE_OF_BAND * total:
            return True
    return False
