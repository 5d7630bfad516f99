"""Lasting shifts of a clock that no lost sample explains."""

from __future__ import annotations

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.readers import tuning
from gmwm.readers.clock.jumps import Jumps


def find_shifts(stamps: FloatArray, jumps: Jumps) -> list[tuple[int, float]]:
    """Find where the distance of the stamps from an even clock changes, and stays so.

    Parameters
    ----------
    stamps : (n,) ndarray
    jumps : Jumps
        Found in them; what it reports itself is no shift.

    Returns
    -------
    list of (int, float)
        A row near each, and by how much, in sampling intervals.
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
