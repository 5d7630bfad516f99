"""Hot loops of the streaming wavelet variance: samples in, sums over windows out.

Row k holds the means of aligned blocks of 2^k samples, most recent last. A row is worked off when
`CHUNK` new values are in it: windows that end in them are summed up, pairs of them go to the next
row as means, and `HALO` values stay for the windows of the next chunk. All arrays belong to one
series and are changed in place; `Series` says what they hold.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.variance import tuning
from gmwm.variance.streaming.mark_kernels import mark
from gmwm.variance.streaming.window_kernels import (
    ANY_ORDER,
    FINE,
    HIGHEST,
    LOST_SUM,
    LOWEST,
    REFERENCE,
    SUM,
    add,
    complete_windows,
    gappy_windows,
    total,
)

STARTS = tuning.STREAMING_STARTS
HALO = 2 * STARTS - 1
CHUNK = 4096
ROOM = HALO + 2 * CHUNK  # of a row: less than a chunk, and half of what the row before had
MOST_BLOCKS = 2 * tuning.MOST_BLOCKS

N, MISSING, RUN, LEADING, BLOCKS, OCTAVE, NEXT_BLOCK, START = range(8)  # of `tallies`
FILLED, ORIGIN, GAPPY, HEADED, OLD = range(5)  # of `state`

IntArray = NDArray[np.int64]


@compiled(fastmath=ANY_ORDER)
def _centred(out: FloatArray, samples: FloatArray, reference: float) -> float:
    total = 0.0
    for i in range(out.size):
        value = samples[i] - reference
        out[i] = value
        total += value
    return total


@compiled(fastmath=True)
def _range(values: FloatArray) -> tuple[float, float]:
    """Smallest and largest of finite values."""
    low, high = values[0], values[0]
    for i in range(values.size):
        low = min(low, values[i])
        high = max(high, values[i])
    return low, high


@compiled()
def coarsened(values: FloatArray, present: FloatArray, count: int, first: int) -> int:
    """Replace values by the means of aligned pairs of them, in place; returns their number.

    values, present: Means, and numbers of samples that they are made of.
    count: How many of them are in use.
    first: Absolute index of the first.
    """
    made = 0
    for i in range(first % 2, count - 1, 2):
        both = present[i] + present[i + 1]
        total = present[i] * values[i] + present[i + 1] * values[i + 1]
        values[made] = total / both if both > 0.0 else 0.0
        present[made] = both
        made += 1
    return made


@compiled()
def _note(
    row: int,
    value: float,
    there: float,
    index: int,
    blocks: FloatArray,
    tallies: IntArray,
) -> None:
    """Keep a value of the row that is kept whole."""
    if row != tallies[OCTAVE] or index < tallies[NEXT_BLOCK]:
        return
    if tallies[BLOCKS] == MOST_BLOCKS:
        first = index - tallies[BLOCKS]
        tallies[BLOCKS] = coarsened(blocks[0], blocks[1], tallies[BLOCKS], first)
        tallies[OCTAVE] += 1
        tallies[NEXT_BLOCK] = index // 2
        return
    blocks[0, tallies[BLOCKS]] = value
    blocks[1, tallies[BLOCKS]] = there
    tallies[BLOCKS] += 1
    tallies[NEXT_BLOCK] = index + 1


@compiled()
def _noted(
    row: int,
    begin: int,
    end: int,
    data: FloatArray,
    present: FloatArray,
    state: IntArray,
    head: FloatArray,
    blocks: FloatArray,
    tallies: IntArray,
) -> None:
    """Keep what new values of a row are the first of, or are blocks."""
    full = float(1 << row)
    kept = head.shape[2]
    first = state[row, ORIGIN] + begin
    if state[row, HEADED] >= kept and row != tallies[OCTAVE]:
        return
    for i in range(begin, end):
        there = present[row, i] if state[row, GAPPY] else full
        if state[row, HEADED] < kept:
            head[0, row, state[row, HEADED]] = data[row, i]
            head[1, row, state[row, HEADED]] = there
            state[row, HEADED] += 1
        elif row != tallies[OCTAVE]:
            return
        _note(row, data[row, i], there, first + i - begin, blocks, tallies)


@compiled()
def work_off(
    least: int,
    data: FloatArray,
    present: FloatArray,
    state: IntArray,
    sums: FloatArray,
    head: FloatArray,
    blocks: FloatArray,
    totals: FloatArray,
    tallies: IntArray,
    marks: FloatArray,
    scratch: FloatArray,
) -> None:
    """Work off the rows that have ``least`` new values or more, from the finest on.

    Stops at the first that has fewer, if not every row is to be worked off.
    """
    for row in range(data.shape[0]):
        filled, old = state[row, FILLED], state[row, OLD]
        if filled - old < least:
            if least > 1:
                return
            continue
        values = data[row, :filled]
        if row == 0:
            mark(values[old:], state[row, ORIGIN] + old, totals[SUM] + totals[LOST_SUM], marks)
            add(totals, SUM, LOST_SUM, total(values[old:]))
        if state[row, GAPPY]:
            levels = (0 if row == 0 else FINE - 1, FINE)
            gappy_windows(values, present[row, :filled], old, row, levels, sums, totals, scratch)
        else:
            complete_windows(values, old, row, sums, totals, scratch)
        if row + 1 < data.shape[0]:
            _pairs(row, data, present, state, head, blocks, tallies)
        _shift(row, data, present, state)


@compiled()
def _pairs(
    row: int,
    data: FloatArray,
    present: FloatArray,
    state: IntArray,
    head: FloatArray,
    blocks: FloatArray,
    tallies: IntArray,
) -> None:
    """Means of the pairs whose second value is new go to the next row."""
    filled, origin, old = state[row, FILLED], state[row, ORIGIN], state[row, OLD]
    begin = max(old - 1, 0)
    begin += (origin + begin) % 2
    count = (filled - begin) // 2
    if count <= 0:
        return
    there = state[row + 1, FILLED]
    if there == 0:
        state[row + 1, ORIGIN] = (origin + begin) // 2
    full = float(1 << row)
    if state[row, GAPPY] and not state[row + 1, GAPPY]:
        present[row + 1, :there] = 2.0 * full
        state[row + 1, GAPPY] = 1
    if state[row, GAPPY]:
        for i in range(count):
            p = begin + 2 * i
            first, second = present[row, p], present[row, p + 1]
            total = first * data[row, p] + second * data[row, p + 1]
            both = first + second
            data[row + 1, there + i] = total / both if both > 0.0 else 0.0
            present[row + 1, there + i] = both
    else:
        for i in range(count):
            p = begin + 2 * i
            data[row + 1, there + i] = 0.5 * (data[row, p] + data[row, p + 1])
        if state[row + 1, GAPPY]:
            present[row + 1, there : there + count] = 2.0 * full
    state[row + 1, FILLED] = there + count
    _noted(row + 1, there, there + count, data, present, state, head, blocks, tallies)


@compiled()
def _shift(row: int, data: FloatArray, present: FloatArray, state: IntArray) -> None:
    """Keep the values that later windows need."""
    filled = state[row, FILLED]
    drop = max(filled - HALO, 0)
    kept = filled - drop
    for i in range(kept):
        data[row, i] = data[row, drop + i]
    if state[row, GAPPY]:
        whole = True
        full = float(1 << row)
        for i in range(kept):
            present[row, i] = present[row, drop + i]
            whole = whole and present[row, i] == full
        if whole:
            state[row, GAPPY] = 0
    state[row, FILLED], state[row, OLD] = kept, kept
    state[row, ORIGIN] += drop


@compiled()
def _close_gap(tallies: IntArray, gaps: IntArray) -> None:
    """The gap that ends here."""
    run = tallies[RUN]
    if run == 0:
        return
    if run == tallies[N]:
        tallies[LEADING] = run
    else:
        octave = 0
        while (1 << octave) < run:
            octave += 1
        gaps[octave, 0] += 1
        gaps[octave, 1] += run
    tallies[RUN] = 0


@compiled()
def _take_in(
    samples: FloatArray,
    data: FloatArray,
    present: FloatArray,
    state: IntArray,
    totals: FloatArray,
    tallies: IntArray,
    gaps: IntArray,
) -> None:
    """Append samples to the first row."""
    filled = state[0, FILLED]
    end = filled + samples.size
    if np.isnan(totals[REFERENCE]):
        for i in range(samples.size):
            if not np.isnan(samples[i]):
                totals[REFERENCE] = samples[i]
                break
    own = data[0, filled:end]
    total = _centred(own, samples, totals[REFERENCE])
    if np.isfinite(total):
        _close_gap(tallies, gaps)
        low, high = _range(own)
        tallies[N] += samples.size
        if state[0, GAPPY]:
            present[0, filled:end] = 1.0
    else:
        if not state[0, GAPPY]:
            present[0, :filled] = 1.0
            state[0, GAPPY] = 1
        low, high = np.inf, -np.inf
        for i in range(samples.size):
            if np.isnan(samples[i]):
                own[i], present[0, filled + i] = 0.0, 0.0
                tallies[RUN] += 1
                tallies[MISSING] += 1
            else:
                _close_gap(tallies, gaps)
                present[0, filled + i] = 1.0
                low, high = min(low, own[i]), max(high, own[i])
            tallies[N] += 1
    totals[LOWEST] = min(totals[LOWEST], low)
    totals[HIGHEST] = max(totals[HIGHEST], high)
    state[0, FILLED] = end


@compiled()
def first_infinite(samples: FloatArray) -> int:
    """Place of the first infinite sample, or -1."""
    for begin in range(0, samples.size, CHUNK):
        part = samples[begin : begin + CHUNK]
        if not np.isfinite(total(part)):
            for i in range(part.size):
                if np.isinf(part[i]):
                    return begin + i
    return -1


@compiled()
def absorb(
    samples: FloatArray,
    data: FloatArray,
    present: FloatArray,
    state: IntArray,
    sums: FloatArray,
    head: FloatArray,
    blocks: FloatArray,
    totals: FloatArray,
    tallies: IntArray,
    gaps: IntArray,
    marks: FloatArray,
    scratch: FloatArray,
) -> None:
    """Take in samples (n,), NaN where one is missing, none infinite.

    Chunks begin at the same samples however the samples are divided among calls, so that the sums
    are the same to the last bit.
    """
    place = 0
    while place < samples.size:
        begin = state[0, FILLED]
        size = min(CHUNK - (begin - state[0, OLD]), samples.size - place)
        part = samples[place : place + size]
        _take_in(part, data, present, state, totals, tallies, gaps)
        _noted(0, begin, begin + size, data, present, state, head, blocks, tallies)
        work_off(CHUNK, data, present, state, sums, head, blocks, totals, tallies, marks, scratch)
        place += size
