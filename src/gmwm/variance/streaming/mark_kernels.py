"""Running sums at places from which the few windows of the coarsest level are known.

Where a record is hardly longer than a window, there are few windows, whose mean square needs each
of them, and those that begin at multiples of 1/512 of an averaging time are too few; where it is
longer, those at the ends still weigh. Windows of 2 m = 2^j samples begin at 0, have their middle at
m and their end at 2 m, and places after these: the sums up to places after 0 and after the latest
powers of two are all that they need.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.frozen import frozen
from gmwm._core.typing import FloatArray, IntArray
from gmwm.variance import tuning
from gmwm.variance.streaming.window_kernels import total

_DENSE = tuning.STREAMING_PLACES  # places of an octave: of the first ones, all
PLACES = 2 * _DENSE + _DENSE * tuning.STREAMING_OCTAVES
SLOTS = 4  # 0 and three powers of two
_NEVER = 1 << 62


@cache
def offsets() -> IntArray:
    """Places after a mark: the first ones all, and then so many of each octave."""
    octaves = np.arange(tuning.STREAMING_OCTAVES)[:, None]
    rest = (np.arange(_DENSE) + _DENSE) << octaves + 1
    found: IntArray = frozen(np.concatenate([np.arange(2 * _DENSE), rest.ravel()]))
    return found


@compiled()
def _offset(place: int) -> int:
    if place < 2 * _DENSE:
        return place
    if place >= PLACES:
        return _NEVER
    octave = place // _DENSE - 1
    return (place % _DENSE + _DENSE) << octave


@compiled()
def _next_place(offset: int) -> int:
    """The first place that is no nearer than an offset."""
    if offset < 2 * _DENSE:
        return max(offset, 0)
    octave = 0
    while offset >> octave >= 2 * _DENSE:
        octave += 1
    unit = 1 << octave
    return (octave + 1) * _DENSE + ((offset + unit - 1) >> octave) - _DENSE


@compiled()
def mark(values: FloatArray, begin: int, before: float, marks: FloatArray) -> None:
    """Keep the sums before places within the values, and before the one after the last.

    begin: Index of the first value within the record.
    before: Sum of those before it.
    marks: (SLOTS, 1 + PLACES), where a mark is, and the sums before places after it; NaN if not
        known. 0 is in the first slot, powers of two are in the three others in turn.
    """
    end = begin + values.size
    octave = 0
    while (2 << octave) <= end:
        octave += 1
    for j in range(max(octave - 2, 0), octave + 1):
        if marks[1 + j % 3, 0] != 1 << j:
            marks[1 + j % 3, 0] = 1 << j
            marks[1 + j % 3, 1:] = np.nan
    for i in range(SLOTS):
        at = int(marks[i, 0])
        if at < 0:
            continue
        place = _next_place(begin - at)
        done, known = begin, before
        index = at + _offset(place)
        while index <= end:
            known += total(values[done - begin : index - begin])
            marks[i, 1 + place] = known
            done, place = index, place + 1
            index = at + _offset(place)
