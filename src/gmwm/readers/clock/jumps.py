"""Jumps of a clock: rows that a recording misses, where the others stand, and lasting shifts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from gmwm._core.spool import alike, release
from gmwm._core.typing import FloatArray, median
from gmwm.readers import tuning
from gmwm.readers.clock.line import interval_of
from gmwm.readers.clock.uneven import Followed

_Rows = npt.NDArray[np.int64]

_LONG = 2.25
"""Median steps from which a step is a jump: those of 1 and 2 of rounded stamps are none."""


@dataclass(frozen=True)
class Jumps:
    """Where a clock jumps forward, which rows come twice, and where the clock was set.

    rows: (k,) of int, first row after each jump.
    steps: (k,), how far the clock goes there, in sampling intervals; 1 would be no jump.
    missing: (k,), whole number of rows that are missing there, one or more.
    interval: Sampling interval, in the unit of the stamps.
    repeated: (r,) of int, rows that repeat one before them.
    set_at: (s,) of int, first row after each time that the clock was set.
    """

    rows: _Rows
    steps: FloatArray
    missing: FloatArray
    interval: float
    repeated: _Rows = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    set_at: _Rows = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    @property
    def total(self) -> float:
        """Number of rows that are missing."""
        return float(np.sum(self.missing))

    @property
    def longest(self) -> int:
        """Index of the longest jump."""
        return int(np.argmax(self.missing))

    @property
    def is_off_grid(self) -> npt.NDArray[np.bool_]:
        """Of each jump, whether it is not near a whole number of sampling intervals."""
        return _off_grid(self.steps, self.missing)

    @property
    def off_grid(self) -> int:
        """Number of such jumps."""
        return int(np.count_nonzero(self.is_off_grid))

    @property
    def are_bursts(self) -> bool:
        """Whether rows come in bursts of equal length with stamps close together."""
        length = np.diff(self.rows)
        if length.size < tuning.FEWEST_BURSTS:
            return False
        usual = int(np.median(length))
        alike = (length == usual) & (self.missing[1:] == np.median(self.missing))
        return usual <= tuning.LONGEST_BURST and bool(np.mean(alike) > tuning.BURSTS_ALIKE)

    @property
    def are_rounding(self) -> bool:
        """Whether they look like stamps rounded to a coarse unit rather than like missing rows.

        A clock of 700 Hz that is written in whole milliseconds steps by 1 and now and then by 2,
        in a rhythm; rows are lost without one. A row that is lost besides breaks it for two.
        """
        single = self.missing == 1.0
        if np.count_nonzero(single) < max(tuning.FEWEST_IN_RHYTHM, 0.9 * self.rows.size):
            return False
        apart = np.sort(np.diff(self.rows))
        half = max((apart.size + 1) // 2, min(apart.size, tuning.ALL_IN_RHYTHM))
        shortest = np.min(apart[half - 1 :] - apart[: apart.size - half + 1])
        return bool(shortest <= 1.0 + 0.1 * np.median(apart))

    def sample(self, rows: _Rows) -> _Rows:
        """Index of rows on the regular grid; -1 of that before the first."""
        ahead = np.append(0.0, np.cumsum(self.missing)).astype(np.int64)
        again = np.searchsorted(self.repeated, rows, side="right")
        return np.asarray(rows + ahead[np.searchsorted(self.rows, rows, side="right")] - again)

    def among(self, kept: _Rows, copies: _Rows) -> Jumps:
        """The same by the numbers of all rows, of which some were kept and others repeat one."""
        repeated = np.sort(np.concatenate([kept[self.repeated], copies]))
        return replace(self, rows=kept[self.rows], repeated=repeated, set_at=kept[self.set_at])

    def spread(self, values: FloatArray) -> FloatArray:
        """Put samples on the regular grid.

        values: (n,).
        Returns: NaN where a row is missing; without those that repeat another.
        """
        if not (self.repeated.size or self.rows.size):
            return values
        result = alike(values, values.size - self.repeated.size + int(self.total))
        result.fill(np.nan)
        if self.repeated.size:
            values = np.delete(values, self.repeated)
        rows = self.rows - np.searchsorted(self.repeated, self.rows)
        ends = np.append(rows, values.size)
        result[: ends[0]] = values[: ends[0]]
        shift = np.cumsum(self.missing).astype(np.int64)
        for first, last, ahead in zip(ends[:-1], ends[1:], shift, strict=True):
            result[first + ahead : last + ahead] = values[first:last]
        release(result)
        return result


@dataclass(frozen=True)
class Change:
    """A change of the sampling rate.

    row: Where it is, to within a part of the recording.
    rates: Before and after, in rows per unit of the stamps.
    """

    row: int
    rates: tuple[float, float]


def find_change(stamps: FloatArray) -> Change | None:
    """Find out whether some parts of a recording have another sampling rate than others.

    Both the median and the mean of the steps, without jumps, must differ: rounded stamps change
    the one from part to part, a few missing rows the other.

    stamps: (n,), increasing.
    Returns: the largest from one part to the next; of a rate that comes and goes, so that the
        parts before and after it differ by less than half as much, to the fastest or the slowest.
    """
    steps = np.diff(stamps)
    parts = min(tuning.RATE_PARTS, steps.size // tuning.LEAST_PART)
    if parts < 2:
        return None
    rows = np.array_split(steps, parts)
    medians = np.array([median(part) for part in rows])
    usual = [part[part < _LONG * median] for part, median in zip(rows, medians, strict=True)]
    if not all(part.size for part in usual):
        return None
    means = np.array([np.mean(part) for part in usual])
    if not (np.all(means > 0.0) and np.all(np.isfinite(means))):
        return None
    errors = np.array([np.std(part) / np.sqrt(part.size) for part in usual]) / means
    fast, slow = int(np.argmin(means)), int(np.argmax(means))
    limit = tuning.RATES_AGREE + tuning.RATE_ERRORS * np.hypot(errors[fast], errors[slow])
    if min(_distance(means, fast, slow), _distance(medians, fast, slow)) <= limit:
        return None
    edge = int(np.argmax(np.abs(np.diff(np.log(means))))) + 1
    row = sum(part.size for part in rows[:edge])
    before, after = (float(1.0 / np.median(some)) for some in (means[:edge], means[edge:]))
    if 2.0 * abs(np.log(before / after)) < _distance(means, fast, slow):
        first, then = sorted((fast, slow))
        row = sum(part.size for part in rows[:then])
        before, after = float(1.0 / means[first]), float(1.0 / means[then])
    return Change(row, (before, after))


def _distance(sizes: FloatArray, small: int, large: int) -> float:
    return float(np.log(sizes[large] / sizes[small]))


def find_jumps(stamps: FloatArray) -> Jumps:
    """Find the jumps of a clock.

    Parameters
    ----------
    stamps : (n,) ndarray
        Increasing.

    Returns
    -------
    Jumps
        The sampling interval is the slope of a robust line through the stamps.

    Notes
    -----
    How many rows are missing is judged from the stamps of some rows before and after the jump,
    so that one stamp that comes late, and is followed by a short step, makes no gap.
    """
    steps = np.diff(stamps)
    usual = np.mean(steps[steps <= tuning.USUAL_STEP * median(steps)])
    candidates = np.flatnonzero(steps > tuning.LONGEST_STEP * usual) + 1
    rest = stamps[-1] - stamps[0] - np.sum(steps[candidates - 1])
    interval = float(rest / (steps.size - candidates.size))
    if not (0.0 < interval < np.inf):
        return Jumps(candidates[:0], steps[:0], steps[:0], interval)
    advance = _advance(stamps, candidates, interval)
    missing = np.maximum(np.rint(advance) - 1.0, 0.0)
    real = missing > 0.0
    rows, advance, missing = candidates[real], advance[real], missing[real]
    del steps  # the line needs as much memory
    advances = np.ones(stamps.size, dtype=np.int64)
    advances[rows] += missing.astype(np.int64)
    # What a jump off the grid goes beyond it belongs to no interval.
    starts = np.zeros(stamps.size, dtype=bool)
    starts[rows[_off_grid(advance, missing)]] = True
    line = interval_of(stamps, np.cumsum(advances, out=advances), starts)
    return Jumps(rows, advance, missing, line)


def jumps_of(found: Followed) -> Jumps:
    """The jumps of a clock that was followed row by row."""
    rows = np.flatnonzero(found.advance > 1)
    missing = np.asarray(found.advance[rows] - 1, dtype=np.float64)
    reach = np.arange(tuning.NEIGHBOURS)
    last = found.late.size - 1
    later = np.median(found.late[np.minimum(rows[:, None] + reach, last)], axis=1)
    earlier = np.median(found.late[np.maximum(rows[:, None] - 1 - reach, 0)], axis=1)
    return Jumps(
        rows=rows,
        steps=1.0 + missing + later - earlier,
        missing=missing,
        interval=found.interval,
        repeated=np.flatnonzero(found.advance == 0)[1:],
        set_at=np.flatnonzero(found.is_set),
    )


def _off_grid(steps: FloatArray, missing: FloatArray) -> npt.NDArray[np.bool_]:
    return np.asarray(np.abs(steps - 1.0 - missing) > tuning.OFF_GRID)


def _advance(stamps: FloatArray, rows: _Rows, interval: float) -> FloatArray:
    """How far the clock goes at each of these rows, in intervals, with jitter averaged out."""
    offsets = np.arange(tuning.NEIGHBOURS)
    before = rows[:, None] - 1 - offsets
    after = rows[:, None] + offsets
    previous = np.concatenate([[0], rows[:-1]])[:, None]
    following = np.append(rows[1:], stamps.size)[:, None]
    earlier = _lead(stamps, rows, np.maximum(before, 0), before >= previous, interval)
    later = _lead(stamps, rows, np.minimum(after, stamps.size - 1), after < following, interval)
    return 1.0 + later - earlier


def _lead(
    stamps: FloatArray, rows: _Rows, near: _Rows, wanted: npt.NDArray[np.bool_], interval: float
) -> FloatArray:
    """Median of how far stamps near a row are ahead of an even clock, in intervals."""
    # Against the stamp of the row itself: large stamps would lose digits.
    lead = (stamps[near] - stamps[rows][:, None]) / interval - (near - rows[:, None])
    lead[~wanted] = np.nan
    return np.asarray(np.nanmedian(lead, axis=1))


def find_shifts(stamps: FloatArray, jumps: Jumps) -> list[tuple[int, float]]:
    """Find where the distance of the stamps from an even clock changes, and stays so.

    No lost sample explains such a shift.

    stamps: (n,).
    jumps: Found in them; what it reports itself is no shift.
    Returns: a row near each, and by how much, in sampling intervals.
    """
    size = tuning.ROWS_OF_SHIFT
    count = stamps.size // size
    if count < 5:
        return []
    advance = np.ones(stamps.size)
    advance[0] = 0.0
    advance[jumps.rows] += jumps.missing
    advance[jumps.repeated] = 0.0
    late = (stamps - stamps[0]) / jumps.interval - np.cumsum(advance)
    level = np.median(late[: count * size].reshape(count, size), axis=1)
    change = level[2:] - level[:-2]
    change -= np.median(change)
    usual = 1.4826 * float(np.median(np.abs(change)))
    reported = np.zeros(stamps.size, dtype=bool)
    reported[jumps.set_at] = True
    reported[jumps.rows[jumps.is_off_grid]] = True
    taken = np.any(reported[: count * size].reshape(count, size), axis=1)
    change[taken[2:] | taken[1:-1] | taken[:-2]] = 0.0
    found = []
    while change.size:
        i = int(np.argmax(np.abs(change)))
        if not abs(change[i]) > max(tuning.LEAST_SHIFT, tuning.SHIFT_ERRORS * usual):
            break
        part = late[i * size : (i + 3) * size]
        far = np.abs(part - level[i]) > np.abs(part - level[i + 2])
        found.append((i * size + int(np.count_nonzero(~far)), float(change[i])))
        change[max(i - 2, 0) : i + 3] = 0.0
    return sorted(found)
