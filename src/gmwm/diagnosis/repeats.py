"""Samples that were not measured: rounded, held, interpolated, or copies of earlier stretches."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gmwm._core.distributions import norm
from gmwm._core.text import brief, readable
from gmwm._core.typing import FloatArray, IntArray, inner, known_of
from gmwm.diagnosis import tuning
from gmwm.diagnosis.health import Repetition
from gmwm.diagnosis.innovations import Examined, Held
from gmwm.diagnosis.motion import remembered
from gmwm.diagnosis.samples import is_dithered, stuck
from gmwm.issues import Notice, Severity, notice
from gmwm.readers import Channel, Recording

_SMALLEST = 1e-9  # of the range: what is smaller is the rounding of floating point


def step_size(values: FloatArray) -> float:
    """Largest step that divides all differences between samples; 0 if there is none.

    Text holds steps rounded to some decimals (0.00333, 0.00667, 0.01): places may be off the
    lattice by a tenth of a step (root mean square). No sample may be missing.
    """
    stride = -(-values.size // tuning.LEVELS_SAMPLED)
    part = values[::stride]
    levels = np.unique(part)
    if levels.size < 2:
        return 0.0
    gaps = np.diff(levels)
    differences = gaps[gaps > _SMALLEST * (levels[-1] - levels[0])]
    smallest = float(np.min(differences))
    first = float(np.median(differences[differences <= tuning.ONE_STEP * smallest]))
    # Few levels that come again and again are steps whatever their places.
    if levels.size < tuning.FEWEST_LEVELS and levels.size > part.size / 2:
        return 0.0
    levels -= np.mean(levels)
    for divisor in tuning.DIVISORS:
        step, off = _lattice(levels, gaps, first / divisor)
        if off <= tuning.OFF_LATTICE / (1.0 if divisor == 1 else 3.0):
            return step
    return 0.0


def _lattice(levels: FloatArray, gaps: FloatArray, step: float) -> tuple[float, float]:
    """Step after regression of the levels on their places, and rms distance in steps."""
    places = np.concatenate([[0.0], np.cumsum(np.rint(gaps / step))])
    if places[-1] == 0.0:
        return step, np.inf
    places -= np.mean(places)
    refined = inner(places, levels) / inner(places, places)
    off = gaps / refined
    off -= np.rint(off)
    return refined, float(np.sqrt(np.mean(off**2)))


def widest_step(values: FloatArray, step: float) -> float:
    """Step of the largest values, where numbers of few digits have wider ones from a power on.

    With three decimal digits, or in half precision, steps grow with the value: levels out there
    come often while their neighbours at the smaller ``step``, that of `step_size`, never do. That
    is returned if few samples have wider ones.
    """
    part = values[:: -(-values.size // tuning.LEVELS_SAMPLED)]
    if step == 0.0 and 2 * np.unique(part).size >= part.size:
        return 0.0  # numbers of few digits come again
    # Stuck values count once, so that none of them is a level for its frequency alone.
    begins = values[np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)]
    levels, counts = np.unique(begins, return_counts=True)
    gaps = np.diff(levels)
    gaps[gaps < 0.5 * step] = 0.0  # one level, written in two ways
    nearest = np.minimum(np.append(gaps, np.inf), np.insert(gaps, 0, np.inf))
    often = counts >= tuning.FEWEST_OF_LEVEL
    alone = often & (nearest > 1.5 * step)
    size = np.abs(levels)
    alone &= size > np.max(size[often & ~alone], initial=0.0)
    # Of several steps, as about zero, the widest that enough samples have.
    order = np.argsort(-nearest[alone], kind="stable")
    have = np.cumsum(counts[alone][order]) >= tuning.FEWEST_WIDE * begins.size
    return float(nearest[alone][order][np.argmax(have)]) if np.any(have) else step


def is_coarse(values: FloatArray, step: float) -> bool:
    """Whether the step is more than three times the noise, by how few samples leave two levels.

    Noise about the middle of a step switches between the two levels beside it, and beyond these
    lie, of Gaussian noise of a third of a step, ``2 Q(3)`` of the samples.
    """
    if not values.size:  # all of them belong to events
        return False
    size = min(tuning.BLOCK_OF_LEVELS, values.size)
    blocks = values[: values.size // size * size].reshape(-1, size)
    places = (blocks - blocks[:, :1]) / step
    # Multiples of a step but for rounding: half a step of room on either side.
    below = np.floor(np.mean(places, axis=1, keepdims=True))
    beyond = np.count_nonzero((places < below - 0.5) | (places > below + 1.5))
    return bool(beyond < 2.0 * norm.sf(tuning.COARSE) * places.size)


def rounding(channel: Examined) -> Iterator[Notice]:
    """Say how coarse the step is against the white noise.

    Rounding adds white noise of variance step^2/12 as long as the noise before it is not much
    below half a step (Widrow & Kollar, *Quantization Noise*, 2008, sec. 5).
    """
    unit, step, smallest = channel.unit, channel.step, channel.smallest
    if step == 0.0:
        return
    noise = float(np.sqrt(max(channel.scatter**2 - step**2 / 12.0, 0.0)))
    shown = readable(step, unit)
    if 0.0 < smallest < step:
        shown += f" ({readable(smallest, unit)} where they are smaller)"
    coarse = noise < step / tuning.COARSE or is_coarse(channel.noise, step)
    ratio = step / noise if noise > 0.0 else np.inf
    severity: Severity = "note" if ratio > 0.5 else "good"
    hint = "rounding is treated as white noise: {added:.2g%} of it"
    values = {"lsb": step, "noise": noise}
    if coarse:
        severity = "bad"
        hint = "the noise below the step cannot be estimated; use a finer range"
    elif ratio > 1.0:
        severity = "warning"
        hint = "rounding is treated as white noise: true for steps up to twice the noise"
    words = {"step": shown, "times": brief(ratio), "shown": readable(noise, unit), "hint": hint}
    words["variant"] = "coarse" if coarse else ""
    added = step**2 / 12.0 / (noise**2 + step**2 / 12.0)
    yield notice("rounding", channel.name, values, severity=severity, added=added, **words)


def repetition(channel: Channel) -> Repetition | None:
    """Find out whether a channel changes at every k-th sample only.

    Other changes are in the same place modulo k with a probability of 1/k each, so that some dozen
    leave no room for chance.
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


def interpolation_notice(channel: Channel) -> Notice | None:
    """Say that samples lie on straight lines between others, all over or now and then.

    Of an interpolation from f to F Hz a share of 1 - 2 f / F of the second differences vanishes; of
    noise nearly none, if its step is small.
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
    step = max(step_size(known_of(values)), float(np.spacing(np.nanmax(np.abs(values)))))
    limit = max(tuning.STRAIGHT * size, 4.0 * step)
    if not limit < tuning.STRAIGHT_AT_MOST * size:
        return None  # steps as large as the noise
    share = float(np.mean(bends <= limit))
    near = float(np.mean(bends <= tuning.NEARLY_STRAIGHT * size)) - share
    if share < max(tuning.FEWEST_STRAIGHT, tuning.BESIDE_STRAIGHT * near, 10.0 * limit / size):
        return None
    if share < tuning.LEAST_STRAIGHT:
        severity: Severity = "bad" if share > tuning.HELD_AT_MOST else "warning"
        return notice("filled", channel.name, {"share": share}, severity=severity)
    rate = 0.5 * (1.0 - share) / channel.dt
    return notice("interpolated", channel.name, {"share": share, "rate": rate})


def held_samples(channel: Examined) -> Held:
    """Find samples that repeat the one before, as recorders write them for a lost packet.

    Of a log-concave law, differences of no step are more frequent than those of one step by at most
    the ratio by which these are than those of two. Each group of blocks of like scatter has its own
    law. Nothing is held if chance, with three standard errors, explains those that repeat.
    """
    values, step, scatter = channel.values, channel.step, channel.scatter
    # Where steps are wide in a part of the values, neighbours are equal by chance in that part.
    if step != channel.smallest and 2.0 * step >= scatter:
        return Held()
    sizes = np.diff(values)
    sizes = known_of(np.abs(sizes, out=sizes))
    same = int(np.count_nonzero(sizes == 0.0))
    fewest = max(tuning.FALSE_ALARM * sizes.size, tuning.LONG_RUN)
    if same < fewest or not is_dithered(channel.present, step):
        return Held()
    expected, variance = 0.0, 0.0
    if step != 0.0:
        expected, variance = np.sum([_by_chance(each) for each in _alike(sizes / step)], axis=0)
    else:
        edges = np.array([0.0, 0.5, 1.5, 2.5]) * tuning.NEAR * scatter
        near, one, two = np.histogram(sizes[sizes > 0.0], edges)[0]
        # Steps that slowly change their size, by a correction, are a lattice all the same: of noise
        # without steps half as many are so near.
        if not two or not one < 4 * near < 4 * one:
            return Held()
    if same - expected - 3.0 * np.sqrt(variance) < fewest:
        return Held()
    share, chance = (same - expected) / sizes.size, expected / sizes.size
    runs = next(stuck(channel), None)
    if runs is not None and 2.0 * runs.values["samples"] > share * channel.present.size:
        return Held(0.0, chance)  # most of what is held is held in a few places
    # A slower sensor in the rows of a faster clock leaves no runs of samples between them.
    ends = np.flatnonzero(np.isnan(values[1:]) | (np.diff(values) == 0.0)) + 1
    longest = np.max(np.diff(ends, prepend=0, append=values.size))
    return Held(share, chance, bool(longest <= tuning.FEWEST_BETWEEN_HELD))


def _alike(steps: FloatArray) -> list[IntArray]:
    """Differences in whole steps, in groups of blocks whose means are alike."""
    width = tuning.BLOCK_OF_HELD
    blocks = np.rint(steps[: steps.size // width * width]).astype(np.int64).reshape(-1, width)
    means = np.log(np.maximum(blocks.mean(axis=1), 1.0 / width))
    level = np.floor(means / np.log(tuning.LIKE_SCATTER))
    return [blocks[level == each].ravel() for each in np.unique(level)]


def _by_chance(steps: IntArray) -> tuple[float, float]:
    """How many differences of no step chance explains at most, and the variance of that."""
    none, one, two = np.bincount(np.minimum(steps, 3), minlength=3)[:3].tolist()
    if not min(one, two):  # nothing shows the law
        return none, 0.0
    found = 0.5 * one * max(one / two, 1.0)
    return min(found, none), found**2 * (4.0 / one + 1.0 / two)


def held_or_stuck(channel: Examined) -> Iterator[Notice]:
    """Say how many samples repeat the one before, or where values stick."""
    share, chance, is_even = channel.held
    if share == 0.0:
        yield from stuck(channel)
        return
    severity: Severity = "bad" if share > tuning.HELD_AT_MOST else "warning"
    hint = "record at the sensor's own rate" if is_even else None
    values = {"share": share, "chance": chance}
    yield notice("held", channel.name, values, severity=severity, hint=hint)


_RowKeys = NDArray[np.uint64]

_MIXED = np.uint64(0x9E3779B97F4A7C15)
"""2^64 over the golden ratio, odd: neighbouring numbers go far apart (Knuth, *The Art of Computer
Programming* 3, sec. 6.4)."""


@dataclass(frozen=True)
class Copy:
    """Rows that equal earlier ones in all channels."""

    start: int
    stop: int  # the one after the last
    first: int  # the row that the first is a copy of


@remembered
def find_copies(recording: Recording) -> tuple[Copy, ...]:
    """Rows that are there twice: noise does not repeat, a buffer that is sent again does."""
    if not recording.inertial:
        return ()
    return tuple(_copies(_row_keys(channel.values for channel in recording.inertial)))


def first_in_common(one: Recording, other: Recording) -> tuple[float, float] | None:
    """Times (s) in either recording from which on both have the same samples; None if nowhere."""
    shared = [
        channel.name
        for channel in one.inertial
        if channel.n == one.n and channel.name in other and other[channel.name].n == other.n
    ]
    if not shared:
        return None
    keys = [_row_keys(each[name].values for name in shared) for each in (one, other)]
    for copy in _copies(np.concatenate(keys)):
        if copy.first < one.n <= copy.start:
            return copy.first * one.dt, (copy.start - one.n) * other.dt
    return None


def copied_rows(recording: Recording) -> Iterator[Notice]:
    """Say how many rows are copies, where the longest stretch of them is and of what."""
    found, dt = find_copies(recording), recording.dt
    if not found:
        return
    longest = max(found, key=lambda each: each.stop - each.start)
    samples = float(sum(each.stop - each.start for each in found))
    values = {"samples": samples, "count": float(len(found))}
    values |= {"longest": (longest.stop - longest.start) * dt, "start": longest.start * dt}
    values["first"] = longest.first * dt
    yield notice("rows-copied", "", values, variant="several" if found[1:] else "")


def _copies(keys: _RowKeys) -> Iterator[Copy]:
    window = _window(keys)
    anchors, firsts = _seen_before(keys, window)
    done = 0
    for anchor, first in zip(anchors.tolist(), firsts.tolist(), strict=True):
        if anchor < done:
            continue
        stop = anchor + _same_from(keys, anchor, first)
        if stop - anchor < window:
            continue  # other rows of the same number
        most = min(anchor - done, first)
        differ = np.flatnonzero(keys[anchor - most : anchor] != keys[first - most : first])
        before = most - 1 - int(differ[-1]) if differ.size else most
        done = stop
        yield Copy(anchor - before, stop, first - before)


def _row_keys(columns: Iterable[FloatArray]) -> _RowKeys:
    """A number for each row, the same for the same values of the columns, (n,)."""
    keys: _RowKeys = np.zeros(1, dtype=np.uint64)
    for values in columns:
        keys = keys ^ np.ascontiguousarray(values, dtype=float).view(np.uint64)
        # Numbers of few digits differ in their highest bits alone.
        for _ in range(2):
            keys *= _MIXED
            keys ^= keys >> np.uint64(29)
    return keys


def _window(keys: _RowKeys) -> int:
    """Rows that are not the same twice by chance: many of coarse or slow samples."""
    again = []
    for part in tuning.LAGS_OF_ROWS:
        lag = int(part * keys.size)
        same = keys[lag:] == keys[: keys.size - lag]
        often = max(int(np.count_nonzero(same)), 1)
        again.append(int(np.count_nonzero(same[1:] & same[:-1])) / often)
    is_fine = np.median(again) < tuning.MOST_OF_FINE
    return tuning.FEWEST_COPIED if is_fine else tuning.FEWEST_COARSE_COPIED


def _seen_before(keys: _RowKeys, window: int) -> tuple[IntArray, IntArray]:
    """Rows from which a window is as an earlier one, and where that begins.

    Only windows whose number ends in some zero bits are looked at, which are the same in a copy
    (Manber 1994, *USENIX Winter*, 1-10). The number is a polynomial modulo 2^64 (Karp and Rabin
    1987, *IBM J. Res. Dev.* 31, 249-260).
    """
    none = np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    if keys.size <= window:
        return none
    powers = np.full(keys.size, _MIXED)
    np.multiply.accumulate(powers, out=powers)
    sums = np.cumsum(keys * powers)
    # The window that ends at row i, times the power of what comes after it, is the same anywhere.
    numbers = (sums[window:] - sums[:-window]) * powers[: window - 1 : -1]
    numbers ^= numbers >> np.uint64(32)
    chosen = np.flatnonzero((numbers & np.uint64(tuning.SPARSE - 1)) == 0)
    changes = np.cumsum(keys[1:] != keys[:-1])
    moving = changes[chosen + window - 1] - changes[chosen] >= tuning.CHANGES_IN_COPY
    chosen = chosen[moving]
    _, where, group = np.unique(numbers[chosen], return_index=True, return_inverse=True)
    firsts = chosen[where[group]]
    again = firsts < chosen
    return chosen[again] + 1, firsts[again] + 1


def _same_from(keys: _RowKeys, row: int, first: int) -> int:
    """Rows from two on that are the same."""
    size = 1 << 10
    while True:
        later, earlier = keys[row : row + size], keys[first : first + size][: keys.size - row]
        differ = np.flatnonzero(later != earlier[: later.size])
        if differ.size:
            return int(differ[0])
        if later.size < size:
            return int(later.size)
        size *= 4
