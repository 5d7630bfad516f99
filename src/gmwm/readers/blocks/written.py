"""Rows that were written before, in an earlier block."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from gmwm._core.typing import BoolArray, FloatArray
from gmwm.readers import tuning

_Keys = NDArray[np.uint64]
_MIXED = np.uint64(0x9E3779B97F4A7C15)
"""2^64 over the golden ratio, odd: neighbouring numbers go far apart (Knuth, *The Art of Computer
Programming* 3, sec. 6.4)."""


class Written:
    """Numbers by which rows of the latest blocks are known again.

    A driver that sends its buffer again, or files that were joined with an overlap, write rows
    twice, far from each other. Where time stamps go back before the newest one so far, and most of
    these rows of a block are as earlier ones in all columns, they are copies. A clock that was set
    back has others. Those at the end of a block are left out here too: beside the next block they
    would stand without the rows that they repeat.
    """

    def __init__(self, time: int):
        self._time = time
        self._newest = -np.inf
        self._kept: list[_Keys] = []

    def fresh(self, arrays: Mapping[int, FloatArray]) -> tuple[dict[int, FloatArray], int]:
        """The rows of a block without those that were written before, and how many these are."""
        keys = _keys(arrays.values())
        stamps = np.asarray(arrays[self._time])
        newest = np.fmax.accumulate(np.concatenate([[self._newest], stamps]))
        back = stamps < newest[:-1]
        copies = self._copies(back, keys)
        found = dict(arrays)
        if copies.size:
            found = {column: np.delete(values, copies) for column, values in arrays.items()}
            keys = np.delete(keys, copies)
        self._keep(found[self._time], keys)
        return found, copies.size

    def _copies(self, back: BoolArray, keys: _Keys) -> NDArray[np.intp]:
        rows = np.flatnonzero(back)
        if rows.size:
            again = np.isin(keys[rows], np.concatenate([*self._kept, keys[~back]]))
            if np.count_nonzero(again) > tuning.COPIES * rows.size:
                return rows[again]
        return rows[:0]

    def _keep(self, stamps: FloatArray, keys: _Keys) -> None:
        if not keys.size:
            return
        self._newest = max(self._newest, float(np.fmax.reduce(stamps, initial=-np.inf)))
        self._kept.append(keys)
        while sum(each.size for each in self._kept[1:]) >= tuning.ROWS_KNOWN_AGAIN:
            del self._kept[0]


def _keys(columns: Collection[FloatArray]) -> _Keys:
    """A number for each row, the same for the same values."""
    size = len(next(iter(columns)))
    keys = np.zeros(size, dtype=np.uint64)
    for values in columns:
        keys ^= np.ascontiguousarray(values, dtype=float).view(np.uint64)
        keys *= _MIXED
        keys ^= keys >> np.uint64(29)
    return keys
