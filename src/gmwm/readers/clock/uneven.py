"""Uneven clocks: bursts, repeated rows, jitter of half a step, clocks that were set."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gmwm._core.typing import QUARTILE, BoolArray, FloatArray, IntArray, median
from gmwm.readers import tuning
from gmwm.readers.clock.line import interval_of


@dataclass(frozen=True)
class Followed:
    """What following uneven stamps row by row gives.

    advance: (n,) of int, sample number less that of the row before: 1 as a rule, more after lost
        samples, 0 for a row that repeats the one before it.
    is_set: (n,) of bool, whether the clock was set between the row before and this one.
    late: (n,), how far each stamp is after the even clock, in sampling intervals.
    interval: Sampling interval, in the unit of the stamps.
    burst: Rows that have one stamp, usually.
    """

    advance: IntArray
    is_set: BoolArray
    late: FloatArray
    interval: float
    burst: int

    @property
    def is_usual(self) -> BoolArray:
        """Of each step, whether it is from one sample to the next: (n - 1,)."""
        return np.asarray((self.advance[1:] == 1) & ~self.is_set[1:])

    @property
    def is_a_clock(self) -> bool:
        """Whether most stamps are near it, and it is seldom set."""
        often = np.count_nonzero(self.is_set) > max(tuning.MOST_SET * self.late.size, 1)
        return not often and median(np.abs(self.late), overwrite=True) <= tuning.MOST_UNEVEN


def followed(stamps: FloatArray, same: BoolArray, extent: int) -> Followed | None:
    """Number the rows of an uneven clock.

    stamps: (n,).
    same: (n,) of bool, whether stamp and samples of a row are those of the row before.
    extent: Samples that may be lost in one gap, at most.
    Returns: None if there is no interval that most rows agree on.
    """
    from gmwm.readers.clock.tracking import follow  # compiled: even stamps do without numba

    burst, of_row = _bursts(stamps)
    if np.max(of_row) > min(tuning.MOST_OF_ONE_STAMP, max(stamps.size // 8, 16)):
        return None  # the clock stood still
    if burst > 1:
        same = same & (of_row > burst)  # coarse samples repeat by chance
    del of_row  # as are others below, once they have served: each is as long as the recording
    rough = _rough_interval(stamps, same, burst)
    if not 0.0 < rough < np.inf:
        return None
    x = (stamps - stamps[0]) / rough
    if burst > 1:
        # The stamp of a burst is that of its last row.
        x = x - _rows_that_follow(x, same, burst, extent)
    n = x.size
    costs = _costs(stamps, same)
    shorter = _likeliest(x, same, costs)
    x, rough = x * shorter, rough / shorter
    advance, is_set = np.ones(n, dtype=np.int64), np.zeros(n, dtype=bool)
    trend, late, slope = np.zeros(n), np.zeros(0), 1.0
    sigma, age = tuning.JITTER_EXPECTED, tuning.ROWS_KNOWN
    start, before = _start(x), np.zeros(0, dtype=np.int64)
    for memory in tuning.ROWS_OF_CLOCK:
        is_set_now = np.zeros(n, dtype=bool)
        follow(
            (x - trend) / slope, same, float(extent), start, sigma, memory, age,
            costs, advance, is_set_now, tuning.ROWS_AT_ONCE,
        )  # fmt: skip
        is_set |= is_set_now
        if np.array_equal(advance, before) and not np.any(is_set_now):
            break
        del trend
        late = late[:0].copy()
        before = advance.copy()
        number = np.cumsum(advance)
        slope = interval_of(x, number, is_set)
        if not 0.0 < slope < np.inf:
            return None
        trend = _smooth(x - slope * number, is_set)
        late = (x - trend) / slope - number
        del number
        spread = median(np.abs(late), overwrite=True) / QUARTILE
        sigma, age, start = max(spread, tuning.LEAST_JITTER), memory, 0.0
    return Followed(advance, is_set, late, rough * slope, burst)


def _bursts(stamps: FloatArray) -> tuple[int, IntArray]:
    """How many rows have one stamp, usually; and for each row how many have its stamp."""
    starts = np.flatnonzero(np.diff(stamps, prepend=np.nan) != 0.0)
    sizes = np.diff(np.append(starts, stamps.size))
    of_row = np.repeat(sizes, sizes)
    is_burst = 2 * np.count_nonzero(of_row > 1) > stamps.size
    return (int(np.median(of_row)) if is_burst else 1), of_row


def _rough_interval(stamps: FloatArray, same: BoolArray, burst: int) -> float:
    """Median of the interval over some rows."""
    starts = np.flatnonzero(np.diff(stamps, prepend=np.nan) != 0.0)
    rows = np.cumsum(~same)[starts]
    width = max(min(tuning.ROWS_OF_ROUGH // burst, starts.size // 2), 1)
    if starts.size <= width:
        return 0.0
    first = stamps[starts]
    means = (first[width:] - first[:-width]) / (rows[width:] - rows[:-width])
    return median(means, overwrite=True)


def _costs(stamps: FloatArray, same: BoolArray) -> FloatArray:
    """Where stamps repeat with the samples only, a row of both repeated is no new sample."""
    repeats = np.count_nonzero(np.diff(stamps) == 0.0)
    copies = np.count_nonzero(same)
    costs = np.array([*tuning.CLOCK_COSTS, 0.0])
    if copies > tuning.COPIES * repeats:
        costs[1], costs[4] = 0.0, costs[1]
    return costs


def _start(x: FloatArray) -> float:
    """The clock at the first row."""
    first = x[: tuning.NEIGHBOURS]
    return float(np.median(first - np.arange(first.size)))


def _likeliest(x: FloatArray, same: BoolArray, costs: FloatArray) -> float:
    """By how much the interval is shorter than thought: where many rows are lost, some rows have
    no stretch without a loss.
    """
    from gmwm.readers.clock.tracking import follow

    few = slice(0, tuning.ROWS_OF_TRIAL)
    advance, is_set = np.zeros(x[few].size, dtype=np.int64), np.zeros(x[few].size, dtype=bool)

    def cost(shorter: float) -> float:
        tried = x[few] * shorter
        return follow(
            tried, same[few], float(x.size), _start(tried), tuning.JITTER_EXPECTED,
            tuning.ROWS_OF_CLOCK[0], tuning.ROWS_KNOWN, costs, advance, is_set,
            tuning.ROWS_AT_ONCE,
        )  # fmt: skip

    return min(tuning.TRIED_INTERVALS, key=cost)


def _rows_that_follow(x: FloatArray, same: BoolArray, burst: int, extent: int) -> IntArray:
    """Rows of its burst after each row, those that repeat it not counted.

    x: (n,), stamps, in sampling intervals.
    """
    fresh = np.cumsum(~same)
    last = np.flatnonzero(np.diff(x) != 0.0)
    # Where the clock was set in the midst of a burst, two stamps share the rows of one.
    ahead = x[last + 1] - x[last]
    rows = np.diff(fresh[np.append(last, x.size - 1)], prepend=0)
    is_cut = ((ahead < 0.0) | (ahead > extent)) & (rows[:-1] + rows[1:] <= burst)
    last = np.append(last[~is_cut], x.size - 1)
    ends = np.repeat(fresh[last], np.diff(last, prepend=-1))
    return np.asarray(ends - fresh)


def _smooth(late: FloatArray, is_set: BoolArray) -> FloatArray:
    """Slow part of what stamps are late, between the times at which the clock was set."""
    from scipy import ndimage

    smooth = np.empty(late.size)
    edges = [0, *np.flatnonzero(is_set), late.size]
    for start, stop in pairwise(edges):
        part = late[start:stop]
        # The median drops what a stall delays, the mean the noise of the median.
        calm, size = smooth[start:stop], tuning.ROWS_OF_TREND
        ndimage.median_filter(part, min(size, part.size) | 1, output=calm, mode="nearest")
        ndimage.uniform_filter1d(calm, size, output=calm, mode="nearest")
    return smooth
