"""Hot loops of the streaming wavelet variance: samples in, sums over windows out.

Row k of `Rows` holds the means of aligned blocks of 2^k samples. A row is worked off when it has
`CHUNK` new values: windows that end in them are added to the sums, pairs of them go to the next row
as means, and `HALO` values stay for the windows of the next chunk.
"""

from typing import NamedTuple

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray
from gmwm.variance import tuning
from gmwm.variance.kernels import ANY_ORDER, difference_powers, summed, summed_with_moments, survey

STARTS = tuning.STREAMING_STARTS
FINE = STARTS.bit_length()  # levels of single samples: 1, 2, 4, ... STARTS
HALO = 2 * STARTS - 1
CHUNK = 4096
ROOM = HALO + 2 * CHUNK  # of a row: less than a chunk, and half of what the row before had
MOST_BLOCKS = 2 * tuning.MOST_BLOCKS

FILLED, ORIGIN, GAPPY, OLD = range(4)  # of `Rows.state`
COUNT, MEAN, SQUARE, SCARCITY, LOST_MEAN, LOST_SQUARE = range(6)  # of `Sums.levels`
REFERENCE, LOWEST, HIGHEST, SUM, LOST_SUM, FOURTH, LOST_FOURTH = range(7)  # of `Sums.totals`
N, MISSING, RUN, BLOCKS, OCTAVE = range(5)  # of `Sums.tallies`

_EDGE, _LEAST_EDGE = tuning.STREAMING_EDGE, tuning.STREAMING_LEAST_EDGE
_LEAST = tuning.STREAMING_LEAST


class Rows(NamedTuple):
    """Latest values of each row, most recent last.

    data: (rows, ROOM), about the reference.
    present: (rows, ROOM), samples that each value is made of, where the row is gappy.
    state: (rows, 4) of int: values in the row, index of the first, whether samples of them are
        missing, values that are worked off.
    """

    data: FloatArray
    present: FloatArray
    state: IntArray


class Sums(NamedTuple):
    """What was found so far.

    levels: (levels, 6), number of windows, sums of the coefficients, of their squares and of the
        growth of the variance of white noise by missing samples; rounding errors of the former two.
    totals: (7,), reference, lowest and highest sample about it, sum and its rounding error, sum of
        the fourth powers of the finest coefficients and its rounding error.
    tallies: (5,) of int, samples, missing ones, missing ones at the end, blocks and their row.
    gaps: (63, 2) of int, number of gaps of up to 2^i samples, and samples they have.
    blocks: (2, MOST_BLOCKS), all values of one row, and samples they are made of.
    """

    levels: FloatArray
    totals: FloatArray
    tallies: IntArray
    gaps: IntArray
    blocks: FloatArray


@compiled(fastmath=ANY_ORDER)
def sum_of(values: FloatArray) -> float:
    total = 0.0
    for i in range(values.size):
        total += values[i]
    return total


@compiled()
def add(array: FloatArray, place: int, lost: int, value: float) -> None:
    """Add with what earlier additions lost (Neumaier 1974)."""
    before = array[place]
    after = before + value
    if abs(before) >= abs(value):
        array[lost] += (before - after) + value
    else:
        array[lost] += (value - after) + before
    array[place] = after


# -- windows ---------------------------------------------------------------------------------------


@compiled()
def complete_windows(
    values: FloatArray, new: int, row: int, sums: Sums, scratch: FloatArray
) -> None:
    """Add the windows that end at place ``new`` or later; no sample is missing.

    Sums of 2 m values are those of m values, m apart: nothing cancels.
    """
    number = values.size
    now = values
    m = 1
    for level in range(FINE):
        count = number - 2 * m + 1
        if count <= 0:
            return
        following = scratch[level % 2, :count]
        if row == 0 or level == FINE - 1:
            begin = max(new - 2 * m + 1, 0)
            summed(following[:begin], now[:begin], now[m : m + begin])
            mean, square = summed_with_moments(
                following[begin:], now[begin:count], now[m + begin : m + count]
            )
            own = sums.levels[level + row]
            own[COUNT] += count - begin
            add(own, MEAN, LOST_MEAN, mean * (0.5 / m))
            add(own, SQUARE, LOST_SQUARE, square * (0.25 / m / m))
            if level == 0:
                add(sums.totals, FOURTH, LOST_FOURTH, difference_powers(now[begin:])[2] / 16.0)
        else:
            summed(following, now[:count], now[m : m + count])
        now = following
        m *= 2


@compiled()
def gappy_windows(
    values: FloatArray, present: FloatArray, new: int, row: int, sums: Sums, scratch: FloatArray
) -> None:
    """Add the windows that end at place ``new`` or later, where samples may be missing.

    Half windows are means of the samples they have. Those that have too few, or none at either
    end, are left out: what is missing lies within half a window, at any place equally often.
    """
    number = values.size
    integral, there = scratch[0, : number + 1], scratch[1, : number + 1]
    # About their own mean, which differences do not see.
    centre = 0.0
    for i in range(number):
        centre += present[i] * values[i]
    centre /= max(sum_of(present), 1.0)
    integral[0], there[0] = 0.0, 0.0
    for i in range(number):
        integral[i + 1] = integral[i] + present[i] * (values[i] - centre)
        there[i + 1] = there[i] + present[i]
    for level in range(0 if row == 0 else FINE - 1, FINE):
        m = 1 << level
        edge = max(m // _EDGE, min(m, _LEAST_EDGE))
        whole = float(m << row)
        count = 0
        mean, square, scarcity, fourth = 0.0, 0.0, 0.0, 0.0
        for t in range(max(new - 2 * m + 1, 0), number - 2 * m + 1):
            first = there[t + m] - there[t]
            second = there[t + 2 * m] - there[t + m]
            outer = min(there[t + edge] - there[t], there[t + 2 * m] - there[t + 2 * m - edge])
            inner = min(there[t + m] - there[t + m - edge], there[t + m + edge] - there[t + m])
            if min(first, second) < _LEAST * whole or min(outer, inner) <= 0.0:
                continue
            before = (integral[t + m] - integral[t]) / first
            after = (integral[t + 2 * m] - integral[t + m]) / second
            w = 0.5 * (after - before)
            count += 1
            mean += w
            square += w * w
            scarcity += 0.25 * (1.0 / first + 1.0 / second - 2.0 / whole)
            fourth += w**4
        own = sums.levels[level + row]
        own[COUNT] += count
        own[SCARCITY] += scarcity
        add(own, MEAN, LOST_MEAN, mean)
        add(own, SQUARE, LOST_SQUARE, square)
        if level + row == 0:
            add(sums.totals, FOURTH, LOST_FOURTH, fourth)


# -- rows ------------------------------------------------------------------------------------------


@compiled()
def coarsened(values: FloatArray, present: FloatArray, means: FloatArray, there: FloatArray) -> int:
    """Means of pairs of values, and samples they have, which may go in place; returns how many."""
    for i in range(values.size // 2):
        both = present[2 * i] + present[2 * i + 1]
        total = present[2 * i] * values[2 * i] + present[2 * i + 1] * values[2 * i + 1]
        means[i] = total / both if both > 0.0 else 0.0
        there[i] = both
    return values.size // 2


@compiled()
def _keep_blocks(row: int, begin: int, end: int, rows: Rows, sums: Sums) -> None:
    """Keep new values of the row that is kept whole; a full one makes way for the next row."""
    blocks, tallies = sums.blocks, sums.tallies
    for i in range(begin, end):
        if row != tallies[OCTAVE]:
            return
        if rows.state[row, ORIGIN] + i < tallies[BLOCKS]:
            continue
        if tallies[BLOCKS] == MOST_BLOCKS:
            tallies[BLOCKS] = coarsened(blocks[0], blocks[1], blocks[0], blocks[1])
            tallies[OCTAVE] += 1
            return
        blocks[0, tallies[BLOCKS]] = rows.data[row, i]
        blocks[1, tallies[BLOCKS]] = (
            rows.present[row, i] if rows.state[row, GAPPY] else float(1 << row)
        )
        tallies[BLOCKS] += 1


@compiled()
def work_off(least: int, rows: Rows, sums: Sums, scratch: FloatArray) -> None:
    """Work off the rows that have ``least`` new values or more, from the finest on.

    Stops at the first that has fewer, unless every row is to be worked off.
    """
    data, present, state = rows
    for row in range(data.shape[0]):
        filled, old = state[row, FILLED], state[row, OLD]
        if filled - old < least:
            if least > 1:
                return
            continue
        values = data[row, :filled]
        if row == 0:
            add(sums.totals, SUM, LOST_SUM, sum_of(values[old:]))
        if state[row, GAPPY]:
            gappy_windows(values, present[row, :filled], old, row, sums, scratch)
        else:
            complete_windows(values, old, row, sums, scratch)
        if row + 1 < data.shape[0]:
            _pass_on(row, rows, sums)
        _shift(row, rows)


@compiled()
def _pass_on(row: int, rows: Rows, sums: Sums) -> None:
    """Append the means of the pairs whose second value is new to the next row."""
    data, present, state = rows
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
        own = slice(begin, filled)
        coarsened(
            data[row, own], present[row, own], data[row + 1, there:], present[row + 1, there:]
        )
    else:
        for i in range(count):
            p = begin + 2 * i
            data[row + 1, there + i] = 0.5 * (data[row, p] + data[row, p + 1])
        if state[row + 1, GAPPY]:
            present[row + 1, there : there + count] = 2.0 * full
    state[row + 1, FILLED] = there + count
    _keep_blocks(row + 1, there, there + count, rows, sums)


@compiled()
def _shift(row: int, rows: Rows) -> None:
    """Drop the values that no later window needs."""
    data, present, state = rows
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
def _close_gap(sums: Sums) -> None:
    """Count the gap that ends here; what is missing before the first sample is none."""
    run = sums.tallies[RUN]
    if 0 < run < sums.tallies[N]:
        octave = 0
        while (1 << octave) < run:
            octave += 1
        sums.gaps[octave, 0] += 1
        sums.gaps[octave, 1] += run
    sums.tallies[RUN] = 0


@compiled()
def _take_in(samples: FloatArray, rows: Rows, sums: Sums) -> None:
    """Append samples to the first row."""
    data, present, state = rows
    totals, tallies = sums.totals, sums.tallies
    filled = state[0, FILLED]
    end = filled + samples.size
    if np.isnan(totals[REFERENCE]):
        for i in range(samples.size):
            if not np.isnan(samples[i]):
                totals[REFERENCE] = samples[i]
                break
    own = data[0, filled:end]
    for i in range(samples.size):
        own[i] = samples[i] - totals[REFERENCE]
    missing, _, low, high = survey(own)
    if not missing:
        _close_gap(sums)
        tallies[N] += samples.size
        if state[0, GAPPY]:
            present[0, filled:end] = 1.0
    else:
        if not state[0, GAPPY]:
            present[0, :filled] = 1.0
            state[0, GAPPY] = 1
        for i in range(samples.size):
            if np.isnan(samples[i]):
                own[i], present[0, filled + i] = 0.0, 0.0
                tallies[RUN] += 1
                tallies[MISSING] += 1
            else:
                _close_gap(sums)
                present[0, filled + i] = 1.0
            tallies[N] += 1
    totals[LOWEST] = min(totals[LOWEST], low)
    totals[HIGHEST] = max(totals[HIGHEST], high)
    state[0, FILLED] = end


@compiled()
def absorb(samples: FloatArray, rows: Rows, sums: Sums, scratch: FloatArray) -> None:
    """Take in samples (n,), NaN where one is missing, none infinite.

    Chunks begin at the same samples however the samples are divided among calls, so that the sums
    are the same to the last bit.
    """
    place = 0
    while place < samples.size:
        begin = rows.state[0, FILLED]
        size = min(CHUNK - (begin - rows.state[0, OLD]), samples.size - place)
        _take_in(samples[place : place + size], rows, sums)
        _keep_blocks(0, begin, begin + size, rows, sums)
        work_off(max(size, CHUNK), rows, sums, scratch)  # a number would be compiled for anew
        place += size
