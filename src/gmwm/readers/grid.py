"""The even grid that time stamps lie on: the sampling interval, and which rows are missing."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from gmwm._core.spool import alike, release
from gmwm._core.typing import BoolArray, FloatArray, IntArray, median
from gmwm.readers import tuning


@dataclass(frozen=True)
class Jumps:
    """Where a clock jumps forward because rows are missing, and which rows are copies."""

    rows: IntArray  # (k,), first row after each jump
    steps: FloatArray  # (k,), how far the clock goes there, in intervals; 1 would be no jump
    missing: FloatArray  # (k,), whole number of rows that are missing there, one or more
    interval: float  # sampling interval, in the unit of the stamps
    repeated: IntArray = field(default_factory=lambda: np.empty(0, int))  # (r,), copies

    @property
    def total(self) -> float:
        return float(np.sum(self.missing))

    @property
    def is_off_grid(self) -> BoolArray:
        """Whether each jump is far from a whole number of sampling intervals."""
        return np.asarray(np.abs(self.steps - 1.0 - self.missing) > tuning.OFF_GRID)

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
        """Whether they come in the rhythm of stamps rounded to a coarse unit, as 700 Hz in ms.

        Rows are lost without one, and a lost row breaks it at two distances.
        """
        single = self.missing == 1.0
        if np.count_nonzero(single) < max(tuning.FEWEST_IN_RHYTHM, 0.9 * self.rows.size):
            return False
        apart = np.sort(np.diff(self.rows))
        half = max((apart.size + 1) // 2, min(apart.size, tuning.ALL_IN_RHYTHM))
        shortest = np.min(apart[half - 1 :] - apart[: apart.size - half + 1])
        return bool(shortest <= 1.0 + 0.1 * np.median(apart))

    @property
    def have_rhythm(self) -> bool:
        """Whether many, half of one row, have lines in their spectrum: rounding, and lost rows."""
        if 2 * np.count_nonzero(self.missing == 1.0) <= self.rows.size:
            return False
        number = np.ones(self.rows[-1] + 1, dtype=np.int64)
        number[self.rows] += self.missing.astype(np.int64)
        fewest = max(tuning.MANY_LOST * number.size, tuning.BINS_OF_RHYTHM)
        return self.rows.size > fewest and _has_rhythm(np.cumsum(number))

    def strays(self, stamps: FloatArray) -> bool:
        """Whether the differences of the steps add up, as those of rows lost unnoticed do."""
        number = np.ones(stamps.size)
        number[self.rows] += self.missing
        ahead = stamps / self.interval - np.cumsum(number)
        away = ahead[tuning.ROWS_OF_STRAYING :] - ahead[: -tuning.ROWS_OF_STRAYING]
        return away.size > 0 and median(np.abs(away)) > tuning.MOST_STRAYING

    def spread(self, values: FloatArray) -> FloatArray:
        """Samples (n,) on the even grid: NaN where a row is missing, without copies."""
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
    """A change of the sampling rate near a row; rates are in rows per unit of the stamps."""

    row: int
    rates: tuple[float, float]


@dataclass(frozen=True)
class Uneven:
    """Uneven stamps on an even grid: jitter, bursts, late stamps."""

    jumps: Jumps
    late: FloatArray  # (m,), how far each different stamp is after the grid, in sampling intervals
    last: IntArray  # (m,), last row that has the stamp
    burst: int  # rows that have one stamp, usually
    jitter: float  # standard deviation of the steps without losses, in sampling intervals
    is_coarse: bool  # whether stamps are rounded to more than the interval, and no row is missing

    @property
    def have_rhythm(self) -> bool:
        """Whether stamps with losses come in a rhythm, as those of rounding do."""
        rows = self.jumps.rows
        fewest = max(tuning.MANY_LOST * self.last.size, tuning.BINS_OF_RHYTHM)
        return rows.size > fewest and _has_rhythm(np.searchsorted(self.last, rows))


@dataclass(frozen=True)
class Grid:
    """Jumps and jitter of a clock, the change of its rate, and its uneven stamps if it has any."""

    jumps: Jumps
    jitter: float
    change: Change | None
    uneven: Uneven | None = None
    is_lattice: bool = False  # whether many rows are lost from a clock that shows the interval


@dataclass(frozen=True)
class NoGrid:
    """Why most time stamps fit no even grid."""

    row: int  # the first that does not
    stamp: str  # what is wrong with its stamp; empty for a clock that was set back
    count: int = 1  # of such rows


def find_grid(stamps: FloatArray) -> Grid | NoGrid:
    """The even grid of a clock; where no step is short, the jumps are those of the steps."""
    with np.errstate(all="ignore"):  # extreme stamps end in an InputError, not in a warning
        steps = np.diff(stamps)
        is_increasing = bool(np.all(steps > 0.0))
        if is_increasing and (lattice := find_lattice(stamps)) is not None:
            whole = np.delete(steps, lattice.rows - 1) / lattice.interval
            return Grid(lattice, float(np.std(whole)), None, is_lattice=True)
        is_even = is_increasing and not _are_in_turns(stamps, steps)
        every = 1 if is_even else tuning.ROWS_OF_ROUGH
        change = find_change(stamps[::every])
        if change is not None:
            before, after = change.rates
            change = Change(change.row * every, (before * every, after * every))
        short = np.flatnonzero(~(steps >= tuning.SHORTEST_STEP * median(steps)))
        if is_even and (change is not None or not short.size):
            jumps = find_jumps(stamps)
            if jumps.interval > 0.0:
                jitter = float(np.std(np.delete(steps, jumps.rows - 1))) / jumps.interval
                return Grid(jumps, jitter, change)
        uneven = place_uneven(stamps)
        if isinstance(uneven, Uneven):
            return Grid(uneven.jumps, uneven.jitter, change, uneven)
    if uneven is not None and np.count_nonzero(steps < 0.0) <= 1:
        return NoGrid(uneven, "")
    for wrong, what in ((steps < 0.0, "goes back"), (steps == 0.0, "repeats the one before")):
        if np.any(wrong):
            return NoGrid(int(np.argmax(wrong)) + 1, what, int(np.count_nonzero(wrong)))
    row = int(short[0] if short.size else np.argmax(steps))
    what = f"is {steps[row]:.6g} after the one before, {np.median(steps):.6g} is usual"
    return NoGrid(row + 1, what)


def _are_in_turns(stamps: FloatArray, steps: FloatArray) -> bool:
    """Whether short and long steps alternate, so that the usual step is not the interval."""
    pairs = stamps[2:] - stamps[:-2]
    usual = median(pairs)
    if abs(2.0 * median(steps) / usual - 1.0) < tuning.UNLIKE_STEPS:
        return False
    short, long = median(steps[steps < 0.5 * usual]), median(steps[steps > 0.5 * usual])
    # A long step of about twice the short one may as well be one of three samples that is lost.
    if abs(long / short - 2.0) < tuning.OFF_GRID:
        return False
    return bool(np.mean(np.abs(pairs / usual - 1.0) < 0.1) > tuning.MOST_IN_TURNS)


def find_change(stamps: FloatArray) -> Change | None:
    """The change of the sampling rate between parts of a recording; None if there is none.

    Both the median and the mean of the steps, without jumps, must differ: rounded stamps change
    the median from part to part, a few missing rows the mean. It is the largest change from one
    part to the next or, if the rate comes and goes, that from or to the extreme part.
    """
    steps = np.diff(stamps)
    parts = min(tuning.RATE_PARTS, steps.size // tuning.LEAST_PART)
    if parts < 2:
        return None
    rows = np.array_split(steps, parts)
    medians = np.array([median(part) for part in rows])
    usual = [part[part < tuning.JUMP * m] for part, m in zip(rows, medians, strict=True)]
    if not all(part.size for part in usual):
        return None
    means = np.array([np.mean(part) for part in usual])
    if not (np.all(means > 0.0) and np.all(np.isfinite(means))):
        return None
    errors = np.array([np.std(part) / np.sqrt(part.size) for part in usual]) / means
    fast, slow = int(np.argmin(means)), int(np.argmax(means))
    limit = tuning.RATES_AGREE + tuning.RATE_ERRORS * np.hypot(errors[fast], errors[slow])
    by_means, by_medians = (float(np.log(each[slow] / each[fast])) for each in (means, medians))
    if min(by_means, by_medians) <= limit:
        return None
    edge = int(np.argmax(np.abs(np.diff(np.log(means))))) + 1
    before, after = (float(1.0 / np.median(some)) for some in (means[:edge], means[edge:]))
    if 2.0 * abs(np.log(before / after)) < by_means:
        first, edge = sorted((fast, slow))
        before, after = float(1.0 / means[first]), float(1.0 / means[edge])
    return Change(sum(part.size for part in rows[:edge]), (before, after))


def find_jumps(stamps: FloatArray) -> Jumps:
    """Jumps of a clock without short steps, judged from some stamps before and after each."""
    steps = np.diff(stamps)
    usual = np.mean(steps[steps <= tuning.USUAL_STEP * median(steps)])
    candidates = np.flatnonzero(steps > tuning.LONGEST_STEP * usual) + 1
    rest = stamps[-1] - stamps[0] - np.sum(steps[candidates - 1])
    interval = float(rest / (steps.size - candidates.size))
    if not (0.0 < interval < np.inf):
        return Jumps(candidates[:0], steps[:0], steps[:0], interval)
    shortest = float(np.min(steps))
    del steps  # the line needs as much memory
    advance = _advance(stamps, candidates, interval)
    missing = np.maximum(np.rint(advance) - 1.0, 0.0)
    real = missing > 0.0
    found = Jumps(candidates[real], advance[real], missing[real], interval)
    number = np.ones(stamps.size, dtype=np.int64)
    if found.are_rounding:
        rows = np.cumsum(number)
        line = interval_of(stamps, rows)
        late = stamps - stamps[0] - line * rows
        # Within half a unit of an even clock, none is lost; many at equal distances may be.
        is_sure = np.ptp(np.diff(found.rows)) > 0 or found.rows.size < tuning.MANY_LOST * rows.size
        if is_sure and np.ptp(late) < tuning.ROUNDED * shortest:
            return Jumps(candidates[:0], advance[:0], missing[:0], line)
    number[found.rows] += found.missing.astype(np.int64)
    # A jump off the grid starts a part whose clock has an offset of its own.
    starts = found.rows[found.is_off_grid]
    return replace(found, interval=interval_of(stamps, np.cumsum(number, out=number), starts))


def find_lattice(stamps: FloatArray) -> Jumps | None:
    """Jumps where many rows are lost from a clock whose steps are whole multiples of the shortest.

    None if few steps are longer, if the steps are not such multiples, or if the rows that are there
    have a rhythm: stamps rounded to a coarse unit, batches and stalls are multiples of a unit, too.
    """
    steps = np.diff(stamps)
    low = float(np.quantile(steps, tuning.SHARE_OF_SHORTEST))
    interval = median(steps[(steps >= low) & (steps <= tuning.LONGEST_STEP * low)])
    if not (interval > 0.0 and np.sum(steps) < tuning.MOST_LOST * steps.size * interval):
        return None
    # Longer steps tell the interval more finely, once it is known well enough to number them.
    for reach in (1.0, 4.0, 16.0, 64.0, 256.0, np.inf):
        number = np.rint(steps / interval)
        near = (number > 0.0) & (number <= reach)
        if np.mean(near) < tuning.SHARE_OF_SHORTEST:
            return None
        interval = float(steps[near] @ number[near] / (number[near] @ number[near]))
    number = np.rint(steps / interval)
    off = np.mean(np.abs(steps / interval - number) > tuning.OFF_GRID)
    if np.min(number) < 1.0 or off > tuning.MOST_OFF_GRID:
        return None
    rows = np.flatnonzero(number > 1.0) + 1
    if rows.size < tuning.MANY_LOST * steps.size:
        return None
    place = np.cumsum(np.append(0.0, number)).astype(np.int64)
    if _has_rhythm(place):
        return None
    # Steps off the grid begin no new parts: rounded stamps slip, all to one side.
    line = interval_of(stamps, place)
    return Jumps(rows, steps[rows - 1] / line, number[rows - 1] - 1.0, line)


def _has_rhythm(place: IntArray) -> bool:
    """Whether rows at these places of a grid have lines in their spectrum; lost ones have none."""
    from scipy import ndimage

    size = min(tuning.PLACES_OF_RHYTHM, int(place[-1]) + 1)
    for start in np.linspace(0, place[-1] + 1 - size, tuning.PARTS_OF_RHYTHM).astype(int):
        first, last = np.searchsorted(place, [start, start + size])
        there = np.zeros(size)
        there[place[first:last] - start] = 1.0
        power = np.abs(np.fft.rfft((there - np.mean(there)) * np.hanning(size))[3:]) ** 2
        usual = ndimage.median_filter(power, tuning.BINS_OF_RHYTHM, mode="reflect")
        if np.any(power > tuning.RHYTHM * usual):
            return True
    return False


def _advance(stamps: FloatArray, rows: IntArray, interval: float) -> FloatArray:
    """Advance of the clock at each of these rows, in intervals, with jitter averaged out."""

    def lead(near: IntArray, wanted: BoolArray) -> FloatArray:
        """Median of how far stamps near a row are ahead of an even clock, in intervals."""
        near = np.clip(near, 0, stamps.size - 1)
        # Against the stamp of the row itself: large stamps would lose digits.
        ahead = (stamps[near] - stamps[rows][:, None]) / interval - (near - rows[:, None])
        ahead[~wanted] = np.nan
        return np.asarray(np.nanmedian(ahead, axis=1))

    offsets = np.arange(tuning.NEIGHBOURS)
    before, after = rows[:, None] - 1 - offsets, rows[:, None] + offsets
    previous = np.concatenate([[0], rows[:-1]])[:, None]
    following = np.append(rows[1:], stamps.size)[:, None]
    return 1.0 + lead(after, after < following) - lead(before, before >= previous)


def place_uneven(stamps: FloatArray) -> Uneven | int | None:
    """Place rows with uneven stamps on an even grid.

    The stamp of several rows is taken as that of the last of them. Rows are lost where the stamps
    are later from then on; a host that stalls catches up again, and loses none. Of a clock that was
    set back, the first row after it; None if most stamps are far from any even grid.
    """
    from scipy import ndimage

    last = np.flatnonzero(np.diff(stamps, append=np.nan) != 0.0)
    sizes = np.diff(last, prepend=-1)
    if np.max(sizes) > min(tuning.MOST_OF_ONE_STAMP, max(stamps.size // 8, 16)):
        return None  # the clock stood still
    time = stamps[last] - stamps[last[0]]
    rows = max(round(stamps.size / last.size), 1)
    width = max(min(-(-tuning.ROWS_OF_ROUGH // rows), last.size // 2), 1)
    if last.size <= width:
        return None
    # To start: the narrowest range of a third of the slopes over few rows, those without a loss.
    slopes = np.sort((time[width:] - time[:-width]) / (last[width:] - last[:-width]))
    third = slopes.size // 3
    first = int(np.argmin(slopes[third:] - slopes[: slopes.size - third]))
    interval = float(np.mean(slopes[first : first + third + 1]))
    lost, line = np.zeros(last.size, dtype=np.int64), interval_of(time, last)
    # The last row of a rounded stamp is within an interval of an even clock that loses none. The
    # last stamp may be cut off. Bursts have one size but for losses, which add up.
    fewest = max(tuning.MANY_LOST * last.size, tuning.FEWEST_BESIDE)
    is_mixed = np.count_nonzero(sizes != np.median(sizes)) > fewest
    is_coarse = bool(is_mixed and np.ptp((time / line - last)[:-1]) < tuning.ROUNDED)
    interval, number = (line, last) if is_coarse else (interval, last)
    for _ in range(0 if is_coarse else tuning.ROUNDS_OF_GRID):
        if not 10.0 * np.spacing(np.max(np.abs(stamps))) < interval < np.inf:
            return None
        lost, set_back = _losses(time / interval - last)
        if set_back is not None:
            return int(last[set_back] - sizes[set_back] + 1)
        number = last + np.cumsum(lost)
        interval = interval_of(time, number)
    late = time / interval - number
    away = np.abs(late[tuning.STAMPS_OF_STRAYING :] - late[: -tuning.STAMPS_OF_STRAYING])
    if away.size and median(away) > tuning.MOST_STRAYING:  # rows were lost, how many is not known
        return int(last[tuning.STAMPS_OF_STRAYING + np.argmax(away > tuning.MOST_STRAYING)])
    # Slow wander of the clock: the median drops what a stall delays, the mean its own noise.
    size = tuning.STAMPS_OF_WANDER
    calm = ndimage.median_filter(late, min(size, late.size) | 1, mode="nearest")
    late -= ndimage.uniform_filter1d(calm, size, mode="nearest")
    if not median(np.abs(late)) <= tuning.MOST_UNEVEN:
        return None
    usual = (lost[1:] == 0) & (sizes[1:] == np.median(sizes))
    jitter = float(np.std(np.diff(late)[usual])) if np.any(usual) else 0.0
    some = np.flatnonzero(lost)
    missing = lost[some].astype(float)
    steps = 1.0 + missing + late[some] - late[np.maximum(some - 1, 0)]
    # Which row of a burst was lost is not known: the first is taken.
    jumps = Jumps(last[some] - sizes[some] + 1, steps, missing, interval)
    is_burst = 2 * int(np.sum(sizes[sizes > 1])) > stamps.size
    burst = int(np.median(np.repeat(sizes, sizes))) if is_burst else 1
    return Uneven(jumps, late, last, 1 if is_coarse else burst, jitter, is_coarse)


def _losses(late: FloatArray) -> tuple[IntArray, int | None]:
    """Samples lost before each stamp, by its lateness, and the stamp before which one goes back."""
    lost = np.zeros(late.size, dtype=np.int64)
    rows = np.flatnonzero(np.abs(np.diff(late, prepend=late[0])) > 0.5)
    reach = np.arange(tuning.STAMPS_BESIDE)
    for some in np.array_split(rows, -(-rows.size // 4096)) if rows.size else ():
        before = _early(late[np.maximum(some[:, None] - 1 - reach, 0)])
        after = _early(late[np.minimum(some[:, None] + reach, late.size - 1)])
        for row in some[np.abs(after - before) > 0.4].tolist():
            start = max(row - reach.size, 0)
            earlier = lost[start:row]
            level = late[start:row] + np.sum(earlier) - np.cumsum(earlier)
            by = float(_early(late[row : row + reach.size]) - _early(level))
            if by < -1.0 and min(row, late.size - row) >= tuning.FEWEST_BESIDE:
                return lost, row + int(np.argmin(np.diff(late[row - 1 : row + reach.size])))
            # Less than a whole one may be jitter, or a loss that comes soon.
            lost[row] = max(int(by + 0.3), 0)
    return lost, None


def _early(late: FloatArray) -> FloatArray:
    """Lateness of the second earliest stamp: a host that stalls makes others late."""
    place = min(1, late.shape[-1] - 1)
    return np.asarray(np.partition(late, place)[..., place])


def interval_of(stamps: FloatArray, number: IntArray, starts: Iterable[int] = ()) -> float:
    """Sampling interval: slope of the robust line through the stamps over their sample numbers.

    From the median slope of rows half of the record apart, least squares with the residuals bounded
    at three robust standard deviations. At rows of ``starts`` new parts begin, with offsets.
    """
    edges = [0, *starts, stamps.size]
    parts = [slice(a, b) for a, b in pairwise(edges) if b > a]
    lever = np.subtract(number, number[0], dtype=float)
    half = max(max(part.stop - part.start for part in parts) // 2, 1)
    pairs = [(slice(p.start, p.stop - half), slice(p.start + half, p.stop)) for p in parts]
    slopes = [
        (stamps[then] - stamps[first]) / (lever[then] - lever[first])
        for first, then in pairs
        if first.stop > first.start
    ]
    slope = median(np.concatenate(slopes), overwrite=True)
    for part in parts:
        lever[part] -= np.mean(lever[part])
    scale = float(lever @ lever)
    if not scale > 0.0:
        return 0.0
    late = np.empty(stamps.size)
    for _ in range(tuning.ROUNDS_OF_LINE):
        for part in parts:
            np.subtract(stamps[part], stamps[part.start], out=late[part])
            late[part] -= slope * lever[part]
            late[part] -= median(late[part])
        bound = 3.0 * 1.4826 * median(np.abs(late), overwrite=True)
        change = float(lever @ np.clip(late, -bound, bound)) / scale
        slope += change
        if abs(change) < tuning.LINE_SETTLED * abs(slope):
            break
    return slope
