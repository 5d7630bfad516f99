"""Stretches at rest: generalized likelihood ratio on gyros and accelerometers.

At rest, samples scatter about a constant mean as the sensor's own noise does. The test statistic is
the variance within a block over that of the noise, summed over the axes (Skog et al., 2010, *IEEE
Trans. Biomed. Eng.* 57, 2657-2666, but with unknown biases). The quietest seconds give the noise.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
import scipy

from gmwm._core.distributions import chi2
from gmwm._core.text import brief, readable
from gmwm._core.typing import BoolArray, FloatArray
from gmwm._core.units import SI_UNIT, factor
from gmwm.diagnosis import tuning
from gmwm.diagnosis.motion import (
    find_motion,
    is_moved_with,
    level_changes,
    remembered,
    runs_of,
    times_of,
)
from gmwm.diagnosis.repeats import step_size
from gmwm.issues import Notice, notice
from gmwm.readers import Channel, Recording, require_recording

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
        values = {"stretches": len(self.stretches), "total": self.total}
        values |= {"longest": self.longest, "duration": self.duration}
        listed = f"{listed} s{more}"
        return notice("still-stretches", "", values, listed=listed, timeline=self.timeline)


def find_still(recording: Recording) -> Still:
    """Find the stretches of a log in which the sensor is at rest.

    Blocks of a quarter of a second whose scatter is that of the noise, and whose mean rate is that
    of the quietest ones; without stretches that scatter more than the quietest, or in a band.
    """
    require_recording(recording)
    blocks = blocks_of(recording)
    if blocks is None:
        return Still((), 0.0, (), recording.duration)
    size, means, scatter = blocks.size, blocks.means, blocks.scatter
    gyro, count = blocks.is_gyro, means.shape[0]
    floor = _floor(scatter, size)
    quiet_blocks = _quiet(scatter, floor, size) & ~blocks.loudness.loud
    # A turn may begin between two blocks.
    turns = np.maximum(tuning.TURNS, tuning.BEYOND_WHITE * np.sqrt(floor[gyro] / size))
    quiet_blocks[1:] &= np.all(np.abs(np.diff(means[:, gyro], axis=0)) < turns, axis=1)
    runs = _of_one_level(_runs(quiet_blocks, means[:, gyro]), blocks, floor)
    quiet = [run for run in runs if run[1] - run[0] >= 2]
    length = blocks.length
    long = [run for run in quiet if (run[1] - run[0]) * length >= tuning.SHORTEST_STILL]
    shaking = _vibrates(long, blocks)
    vibrating = [run for run, shakes in zip(long, shaking, strict=True) if shakes]
    rest = [run for run in long if run not in vibrating]
    others = [run[1] - run[0] for run in quiet if run not in vibrating]

    def times(some: Sequence[tuple[int, int]]) -> tuple[tuple[float, float], ...]:
        end = recording.duration
        return tuple((a * length, end if b == count else b * length) for a, b in some)

    longest = max(others, default=0) * length
    return Still(times(rest), longest, times(vibrating), recording.duration)


def rest_of(recording: Recording) -> Still | None:
    """The stretches at rest of a log that moves, or vibrates at some times only; None of others.

    A tilt between two attitudes does not count.
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
    """Mark blocks that scatter as noise does, by running medians: a shock is shorter."""
    known = np.where(np.isnan(scatter), np.inf, scatter) / floor
    width = 2 * tuning.BLOCKS_OF_SHOCK + 1
    ratio = scipy.ndimage.median_filter(known, (width, 1), mode="nearest")
    ratio[np.isinf(known)] = np.inf
    together = np.mean(ratio, axis=1)
    freedom = (size - 1.0) * floor.size
    most = max(tuning.MOST_OF_FLOOR, float(chi2.isf(tuning.CHANCE_OF_BLOCK, freedom)) / freedom)
    return np.asarray((together < most) & (np.max(ratio, axis=1) < tuning.MOST_OF_AXIS))


def _runs(quiet: BoolArray, rate: FloatArray) -> list[tuple[int, int]]:
    """Begin and end of quiet stretches, a shock in them bridged, a block less at either end."""
    joined: list[tuple[int, int]] = []
    for a, b in runs_of(quiet):
        if joined and a - joined[-1][1] <= tuning.BLOCKS_OF_SHOCK:
            before = joined[-1][1] - joined[-1][0]
            change = np.median(rate[a:b], axis=0) - np.median(rate[slice(*joined[-1])], axis=0)
            same = bool(np.all(np.abs(change) < tuning.TURNS))
            if same and min(before, b - a) >= tuning.BLOCKS_OF_FLOOR:
                joined[-1] = (joined[-1][0], b)
                continue
        joined.append((a, b))
    trimmed = [(a + (a > 0), b - (b < quiet.size)) for a, b in joined]
    return [(a, b) for a, b in trimmed if b > a]


def _of_one_level(
    runs: list[tuple[int, int]], blocks: Blocks, floor: FloatArray
) -> list[tuple[int, int]]:
    """Runs whose rate is that of the run nearest to zero, and whose means do not sway."""
    if not runs:
        return runs
    means, gyro = blocks.means, blocks.is_gyro
    levels = [np.nanmedian(means[a:b], axis=0) for a, b in runs]
    least = min(tuning.BLOCKS_OF_FLOOR, max(b - a for a, b in runs))
    sizes = [float(np.linalg.norm(level[gyro])) for level in levels]
    rest = min((i for i, (a, b) in enumerate(runs) if b - a >= least), key=lambda i: sizes[i])
    sways = np.where(gyro, tuning.SWAYING_RATE, tuning.SWAYS * _GRAVITY)
    limit = np.maximum(sways, tuning.BEYOND_WHITE * np.sqrt(floor / (4 * blocks.size)))
    kept = []
    for (a, b), level in zip(runs, levels, strict=True):
        away = np.abs(level - levels[rest])[gyro]
        change = np.abs(means[a + 4 : b] - means[a : max(b - 4, a)])  # from one second to the next
        calm = not change.size or bool(np.all(np.nanmedian(change, axis=0) < limit))
        if calm and (not away.size or np.max(away) < tuning.TURNS):
            kept.append((a, b))
    return kept


def _vibrates(runs: Sequence[tuple[int, int]], blocks: Blocks) -> list[bool]:
    """Whether a stretch scatters more than the quietest one, now and then, or in a narrow band."""
    if not runs:
        return []
    scatter, size = blocks.scatter, blocks.size
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
        bool(loud) or any(_has_band(c.values[a * size : b * size], c.dt) for c in blocks.channels)
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


@dataclass(frozen=True, eq=False)
class Blocks:
    """Blocks of a quarter of a second, of the channels that motion can be seen in."""

    channels: tuple[Channel, ...]
    size: int  # samples
    means: FloatArray  # (blocks, axes), u; NaN where half is missing
    scatter: FloatArray  # variance within each, u^2

    @property
    def length(self) -> float:
        """Length of a block, s."""
        return self.size * self.channels[0].dt

    @property
    def is_gyro(self) -> BoolArray:
        """Which axes are gyros."""
        return np.array([channel.quantity == "gyro" for channel in self.channels])

    @cached_property
    def loudness(self) -> Loudness:
        """When axes scatter more than at their quietest."""
        step = [step_size(channel.values[~np.isnan(channel.values)]) for channel in self.channels]
        return loudness(self.scatter, np.array(step))

    @property
    def loud_stretches(self) -> tuple[tuple[float, float], ...]:
        """Begin and end of each, s."""
        return tuple((self.length * a, self.length * b) for a, b in runs_of(self.loudness.loud))


def moves(recording: Recording) -> Iterator[Notice]:
    """Say when the recording moves or tilts, and which stretches are static."""
    motion, still = find_motion(recording), rest_of(recording)
    static = motion.static if still is None else still.stretches
    ends: dict[str, float] = {}
    vibrate = ", and those without motion vibrate" if still and still.vibrating else ""
    hint = f"no stretch of {tuning.SHORTEST_STILL:g} s is at rest{vibrate}: record again, at rest"
    if static:
        start, stop = max(static, key=lambda each: each[1] - each[0])
        ends = {"start": start, "stop": stop}
        hint = f"use one static stretch: from {times_of(static)}"
    others = [move for move in motion.moves if not move.is_tilt]
    tilts = [move for move in motion.moves if move.is_tilt]
    if others:
        rate, tilt = max(move.rate for move in others), max(move.tilt for move in others)
        most = "" if motion.turns_steadily else "up to "
        verb = f"it tilts by {np.degrees(tilt):.2g} deg" if tilt > tuning.TILTS else "it moves"
        if rate > tuning.TURNS:
            verb = f"it turns at {most}{readable(rate, 'rad/s')}"
        values = {"moves": len(others), "rate": rate, "angle": tilt} | ends
        times = f"from {times_of([(move.start, move.stop) for move in others])}"
        yield notice("not-static", "", values, severity="bad", hint=hint, verb=verb, times=times)
    if tilts:
        largest = max(tilts, key=lambda move: move.tilt)
        when = 0.5 * (largest.start + largest.stop)
        values = {"tilts": len(tilts), "angle": largest.tilt, "time": when} | ends
        more = f", the largest of {len(tilts)} tilts" if len(tilts) > 1 else ""
        degrees = np.degrees(largest.tilt)
        yield notice("tilt", "", values, severity="bad", hint=hint, degrees=degrees, others=more)


def vibration(recording: Recording) -> Iterator[Notice]:
    """Say when a recording vibrates that does not move."""
    blocks = None if find_motion(recording).moves else blocks_of(recording)
    if blocks is None or not (stretches := blocks.loud_stretches):
        return
    total, ratio = sum(stop - start for start, stop in stretches), blocks.loudness.ratio
    values = {"stretches": len(stretches), "total": total, "ratio": ratio}
    yield notice("vibration", "", values, times=brief(ratio), listed=times_of(stretches))


@remembered
def blocks_of(recording: Recording) -> Blocks | None:
    """The blocks of a recording; None if there are too few, or no channel to be seen in."""
    size = max(round(tuning.STILL_BLOCK * recording.rate), tuning.FEWEST_OF_MOTION)
    channels = tuple(c for c in recording.inertial if c.is_of_a_sensor and is_moved_with(c))
    count = recording.n // size
    if not channels or count < tuning.FEWEST_STILL:
        return None
    means, scatter = np.full((2, count, len(channels)), np.nan)
    for axis, channel in enumerate(channels):
        blocks = np.asarray(channel.values[: count * size], dtype=float).reshape(count, size)
        known = np.count_nonzero(~np.isnan(blocks), axis=1)
        enough = known > size // 2
        means[enough, axis] = np.nanmean(blocks[enough], axis=1)
        squares = np.nansum((blocks - means[:, [axis]]) ** 2, axis=1)
        scatter[enough, axis] = squares[enough] / (known[enough] - 1)
    seen = np.flatnonzero(np.any(scatter > 0.0, axis=0))
    if not seen.size:
        return None
    return Blocks(tuple(channels[i] for i in seen), size, means[:, seen], scatter[:, seen])


@dataclass(frozen=True, eq=False)
class Loudness:
    """When some axes scatter more than at their quietest."""

    loud: BoolArray  # (blocks,)
    ratio: float  # largest standard deviation in a loud stretch over that at rest, of any axis


def loudness(scatter: FloatArray, step: FloatArray) -> Loudness:
    """Find the blocks that scatter more than others; none where that does no harm.

    scatter: (blocks, axes), variance within each block, u^2; NaN where it is not known.
    step: (axes,), to which samples are rounded, u; 0 where they are not.
    """
    nothing = Loudness(np.zeros(scatter.shape[0], dtype=bool), 1.0)
    # A block that does not scatter at all is dead, not quiet, if all others do by more than a step.
    smallest = np.nanmin(np.where(scatter > 0.0, scatter, np.inf), axis=0, initial=np.inf)
    dead = (scatter == 0.0) & (step**2 < smallest)
    known = np.flatnonzero(~np.any(np.isnan(scatter) | dead, axis=1))
    count = known.size // tuning.BLOCKS_OF_LEVEL
    if count < tuning.FEWEST_BLOCKS:
        return nothing
    # Noise below a step scatters by up to half of it, only where the level is between two steps.
    values = np.maximum(scatter[known], step**2 / 4.0)
    least = np.array([np.min(each[each > 0.0], initial=np.inf) for each in values.T])
    logs = np.log(np.maximum(values, least)[:, np.isfinite(least)])
    if not logs.size:
        return nothing
    found = [_loud_blocks(series) for series in (*logs.T, np.mean(logs, axis=1))]
    axes = [axis for axis, (where, _) in enumerate(found[:-1]) if where.any()]
    # The axes that vibrate know together when they do; else those that do not at the same time.
    together, _ = _loud_blocks(np.mean(logs[:, axes], axis=1)) if axes else found[-1]
    chosen = together if together.any() else np.any([where for where, _ in found], axis=0)
    loud = nothing.loud.copy()
    loud[known] = chosen
    level = max((level for where, level in found if where.any()), default=0.0)
    return Loudness(loud, float(np.exp(0.5 * level)))


def _loud_blocks(logs: FloatArray) -> tuple[BoolArray, float]:
    """Loud blocks of one axis, and their highest level above the lowest one."""
    ends = _changes(logs)
    levels = np.array([np.median(logs[a:b]) for a, b in pairwise(ends)])
    lengths = np.diff(ends)
    long = lengths >= tuning.BLOCKS_OF_LEVEL * tuning.MEDIAN_BLOCKS
    above = levels - np.min(levels[long]) if np.any(long) else np.zeros(levels.size)
    loud = above > np.log(tuning.LOUDER_THAN_REST)
    share = lengths[loud] / logs.size
    added = float(np.sum(share * np.expm1(above[loud])))
    lasts = np.max(lengths[loud], initial=0) >= tuning.SHORTEST_STILL / tuning.STILL_BLOCK
    harms = added > tuning.HARMFUL_SCATTER and (lasts or np.sum(share) > tuning.LEAST_SHAKEN)
    if not harms:
        return np.zeros(logs.size, dtype=bool), 0.0
    # A change that was missed leaves something at rest in a loud stretch.
    smooth = scipy.ndimage.median_filter(logs, tuning.BLOCKS_OF_FLOOR + 1, mode="nearest")
    half = np.repeat(np.where(loud, 0.5 * above, np.inf), lengths)
    return smooth - np.min(levels[long]) > half, float(np.max(above[loud]))


def _changes(logs: FloatArray) -> list[int]:
    """Begin, sudden changes of the level, end: block numbers."""
    width, lag = tuning.BLOCKS_OF_LEVEL, tuning.MEDIAN_BLOCKS
    seconds = logs[: logs.size // width * width].reshape(-1, width).mean(axis=1)
    padded = np.pad(seconds, lag // 2, mode="edge")
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(padded, lag), axis=1)
    # The scale is known the less, the shorter the recording.
    unsure = 1.0 + tuning.FEW_SECONDS / np.sqrt(seconds.size)
    change, is_far = level_changes(smooth, np.log(tuning.LOUDER_THAN_REST), unsure=unsure)
    sign = np.sign(change) * is_far
    edges = np.flatnonzero(np.diff(sign, prepend=0.0, append=0.0))
    ends = [0]
    for a, b in pairwise(edges.tolist()):
        if sign[a]:
            middle = (a + int(np.argmax(np.abs(change[a:b]))) + lag // 2 + 1) * width
            # Where two levels describe a few seconds best.
            start = max(ends[-1], middle - lag * width)
            part = logs[start : middle + lag * width]
            before = np.arange(1, part.size)
            sums = np.cumsum(part)[:-1]
            explained = sums**2 / before + (np.sum(part) - sums) ** 2 / (part.size - before)
            ends.append(start + 1 + int(np.argmax(explained)))
    return [*ends, logs.size]
