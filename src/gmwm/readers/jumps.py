"""Jumps of a clock: rows that a recording misses, and where the others stand on a regular grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gmwm._core.typing import FloatArray
from gmwm.readers import tuning

_Rows = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Jumps:
    """Where a clock jumps forward.

    Attributes
    ----------
    rows : (k,) ndarray of int
        First row after each jump.
    steps : (k,) ndarray
        How far the clock goes there, in sampling intervals; 1 would be no jump.
    missing : (k,) ndarray
        Whole number of rows that are missing there, one or more.
    interval : float
        Sampling interval, in the unit of the stamps.
    """

    rows: _Rows
    steps: FloatArray
    missing: FloatArray
    interval: float

    @property
    def total(self) -> float:
        """Number of rows that are missing."""
        return float(np.sum(self.missing))

    @property
    def longest(self) -> int:
        """Index of the longest jump."""
        return int(np.argmax(self.missing))

    @property
    def off_grid(self) -> int:
        """Number of jumps that are not near a whole number of sampling intervals."""
        return int(np.count_nonzero(_off_grid(self.steps, self.missing)))

    @property
    def are_rounding(self) -> bool:
        """Whether they look like stamps rounded to a coarse unit rather than like missing rows.

        A clock of 700 Hz that is written in whole milliseconds steps by 1 and now and then by 2,
        in a rhythm; rows are lost without one.
        """
        if self.rows.size < tuning.FEWEST_IN_RHYTHM or np.any(self.missing > 1.0):
            return False
        distance = np.diff(self.rows)
        return bool(np.std(distance) <= 0.5 + 0.1 * np.mean(distance))

    def spread(self, values: FloatArray) -> FloatArray:
        """Put samples on the regular grid.

        Parameters
        ----------
        values : (n,) ndarray

        Returns
        -------
        (n + total,) ndarray
            NaN where a row is missing.
        """
        if not self.rows.size:
            return values
        ends = np.append(self.rows, values.size)
        result = np.full(values.size + int(self.total), np.nan)
        result[: ends[0]] = values[: ends[0]]
        shift = np.cumsum(self.missing).astype(np.int64)
        for first, last, ahead in zip(ends[:-1], ends[1:], shift, strict=True):
            result[first + ahead : last + ahead] = values[first:last]
        return result


def find_jumps(stamps: FloatArray) -> Jumps:
    """Find the jumps of a clock.

    Parameters
    ----------
    stamps : (n,) ndarray
        Increasing.

    Returns
    -------
    Jumps
        The sampling interval is the time from the first to the last stamp over the number of
        intervals between them, those of missing rows included.

    Notes
    -----
    How many rows are missing is judged from the stamps of some rows before and after the jump,
    so that one stamp that comes late, and is followed by a short step, makes no gap.
    """
    steps = np.diff(stamps)
    usual = np.mean(steps[steps <= tuning.USUAL_STEP * np.median(steps)])
    candidates = np.flatnonzero(steps > tuning.LONGEST_STEP * usual) + 1
    rest = stamps[-1] - stamps[0] - np.sum(steps[candidates - 1])
    interval = float(rest / (steps.size - candidates.size))
    if not (0.0 < interval < np.inf):
        return Jumps(candidates[:0], steps[:0], steps[:0], interval)
    advance = _advance(stamps, candidates, interval)
    missing = np.maximum(np.rint(advance) - 1.0, 0.0)
    real = missing > 0.0
    rows, advance, missing = candidates[real], advance[real], missing[real]
    # What a jump off the grid goes beyond it belongs to no interval.
    beyond = np.sum((advance - 1.0 - missing)[_off_grid(advance, missing)])
    span = stamps[-1] - stamps[0] - interval * beyond
    return Jumps(rows, advance, missing, float(span / (steps.size + np.sum(missing))))


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
