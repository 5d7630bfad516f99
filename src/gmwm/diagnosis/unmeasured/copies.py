"""Stretches of a recording that are copies of earlier ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import IntArray
from gmwm.diagnosis import tuning
from gmwm.diagnosis.unmeasured.row_keys import MIXED, RowKeys, row_keys
from gmwm.readers import Recording


@dataclass(frozen=True)
class Copy:
    """Rows that are as earlier ones in all channels.

    start, stop: First row, and the one after the last.
    first: The row that the first is a copy of.
    """

    start: int
    stop: int
    first: int


def find_copies(recording: Recording) -> tuple[Copy, ...]:
    """Rows that are there twice: noise does not repeat, a buffer that is sent again does.

    recording: Of one rate.
    """
    if not recording.inertial:
        return ()
    return tuple(_copies(row_keys(channel.values for channel in recording.inertial)))


def first_in_common(one: Recording, other: Recording) -> tuple[float, float] | None:
    """Times (s) in either recording from which on both have the same samples; None if nowhere."""
    shared = [
        channel.name
        for channel in one.inertial
        if channel.n == one.n and channel.name in other and other[channel.name].n == other.n
    ]
    if not shared:
        return None
    keys = [row_keys(each[name].values for name in shared) for each in (one, other)]
    for copy in _copies(np.concatenate(keys)):
        if copy.first < one.n <= copy.start:
            return copy.first * one.dt, (copy.start - one.n) * other.dt
    return None


def copies_notice(found: Sequence[Copy], dt: float) -> Notice | None:
    """Say how many rows are copies, where the longest stretch of them is and of what."""
    if not found:
        return None
    rows = sum(each.stop - each.start for each in found)
    longest = max(found, key=lambda each: each.stop - each.start)
    start, first = longest.start * dt, longest.first * dt
    length = (longest.stop - longest.start) * dt
    many = f"in {len(found):,} stretches, the longest {length:.6g} s" if found[1:] else "all"
    text = (
        f"{rows:,} rows are as earlier ones in every channel, {many} from {start:.6g} s on, as "
        f"from {first:.6g} s on: noise does not repeat"
    )
    values = {
        "samples": float(rows),
        "count": float(len(found)),
        "longest": length,
        "start": start,
        "first": first,
    }
    hint = "look for files joined with an overlap and for buffers that are sent again"
    return Notice("rows-copied", "warning", "", text, values, hint)


def _copies(keys: RowKeys) -> Iterator[Copy]:
    window = _window(keys)
    anchors, firsts = _seen_before(keys, window)
    done = 0
    for anchor, first in zip(anchors.tolist(), firsts.tolist(), strict=True):
        if anchor < done:
            continue
        stop = anchor + _same_from(keys, anchor, first)
        if stop - anchor < window:
            continue  # other rows of the same number
        before = _same_before(keys, anchor, first, anchor - done)
        done = stop
        yield Copy(anchor - before, stop, first - before)


def _window(keys: RowKeys) -> int:
    """Rows that are not the same twice by chance.

    Rows of fine samples are hardly ever; where they are coarse or slow, one that is the same makes
    the next likely to be.
    """
    again = []
    for part in tuning.LAGS_OF_ROWS:
        lag = int(part * keys.size)
        same = keys[lag:] == keys[: keys.size - lag]
        often = max(int(np.count_nonzero(same)), 1)
        again.append(int(np.count_nonzero(same[1:] & same[:-1])) / often)
    is_fine = np.median(again) < tuning.MOST_OF_FINE
    return tuning.FEWEST_COPIED if is_fine else tuning.FEWEST_COARSE_COPIED


def _seen_before(keys: RowKeys, window: int) -> tuple[IntArray, IntArray]:
    """Rows from which a window is as an earlier one, and where that begins.

    Of all windows those are looked at whose number ends in some zero bits: which these are, the
    content says, so that they are the same in a copy (Manber 1994, *USENIX Winter*, 1-10). The
    number is a polynomial in an odd number modulo 2^64 (Karp and Rabin 1987, *IBM J. Res. Dev.* 31,
    249-260).
    """
    none = np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    if keys.size <= window:
        return none
    powers = np.full(keys.size, MIXED)
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


def _same_before(keys: RowKeys, row: int, first: int, most: int) -> int:
    """Rows before two that are the same, up to some."""
    most = min(most, first)
    differ = np.flatnonzero(keys[row - most : row] != keys[first - most : first])
    return most - 1 - int(differ[-1]) if differ.size else most


def _same_from(keys: RowKeys, row: int, first: int) -> int:
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
