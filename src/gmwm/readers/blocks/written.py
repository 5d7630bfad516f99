"""Rows that were written before, in an earlier block."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gmwm._core.typing import BoolArray, FloatArray
from gmwm.readers import tuning
from gmwm.readers.blocks.row_keys import RowKeys, row_keys


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
        self._kept: list[RowKeys] = []

    def fresh(self, arrays: Mapping[int, FloatArray]) -> tuple[dict[int, FloatArray], int]:
        """The rows of a block without those that were written before, and how many these are."""
        keys = row_keys(arrays.values())
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

    def _copies(self, back: BoolArray, keys: RowKeys) -> NDArray[np.intp]:
        rows = np.flatnonzero(back)
        if rows.size:
            again = np.isin(keys[rows], np.concatenate([*self._kept, keys[~back]]))
            if np.count_nonzero(again) > tuning.COPIES * rows.size:
                return rows[again]
        return rows[:0]

    def _keep(self, stamps: FloatArray, keys: RowKeys) -> None:
        if not keys.size:
            return
        self._newest = max(self._newest, float(np.fmax.reduce(stamps, initial=-np.inf)))
        self._kept.append(keys)
        while sum(each.size for each in self._kept[1:]) >= tuning.ROWS_KNOWN_AGAIN:
            del self._kept[0]
