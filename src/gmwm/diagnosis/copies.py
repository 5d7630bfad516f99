"""Stretches of a recording that are copies of earlier ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmwm._core.typing import FloatArray, IntArray
from gmwm.diagnosis import tuning
from gmwm.diagnosis.motion import remembered
from gmwm.issues import Notice, notice
from gmwm.readers import Recording

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
