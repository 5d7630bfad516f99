"""Hot loops over the windows of a row: differences of neighbouring means, summed up by level."""

from __future__ import annotations

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.variance import tuning
from gmwm.variance.kernels import summed, summed_with_moments

FINE = tuning.STREAMING_STARTS.bit_length()  # levels of single samples: 1, 2, 4, ... STARTS
_EDGE = tuning.STREAMING_EDGE
_LEAST_EDGE = tuning.STREAMING_LEAST_EDGE
_LEAST = tuning.STREAMING_LEAST

COUNT, MEAN, SQUARE, SCARCITY, LOST_MEAN, LOST_SQUARE = range(6)  # of `sums`
REFERENCE, LOWEST, HIGHEST, SUM, LOST_SUM, FOURTH, LOST_FOURTH = range(7)  # of `totals`

ANY_ORDER = {"reassoc", "contract", "nsz"}
"""Sums in any order, so that they run on vector registers."""


@compiled(fastmath=ANY_ORDER)
def total(values: FloatArray) -> float:
    total = 0.0
    for i in range(values.size):
        total += values[i]
    return total


@compiled(fastmath=ANY_ORDER)
def _fourth(values: FloatArray) -> float:
    total = 0.0
    for i in range(values.size - 1):
        square = (values[i + 1] - values[i]) ** 2
        total += square * square
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


@compiled()
def complete_windows(
    values: FloatArray,
    new: int,
    row: int,
    sums: FloatArray,
    totals: FloatArray,
    scratch: FloatArray,
) -> None:
    """Sum up the windows that end at place ``new`` or later, of values none of which is missing.

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
            own = sums[level + row]
            own[COUNT] += count - begin
            add(own, MEAN, LOST_MEAN, mean * (0.5 / m))
            add(own, SQUARE, LOST_SQUARE, square * (0.25 / m / m))
            if level == 0:
                add(totals, FOURTH, LOST_FOURTH, _fourth(now[begin:]) / 16.0)
        else:
            summed(following, now[:count], now[m : m + count])
        now = following
        m *= 2


@compiled()
def gappy_windows(
    values: FloatArray,
    present: FloatArray,
    new: int,
    row: int,
    levels: tuple[int, int],
    sums: FloatArray,
    totals: FloatArray,
    scratch: FloatArray,
) -> None:
    """The same for levels of a range, where samples may be missing: half windows are means of some.

    Those that have too few, or none at either end, are left out: what is missing lies within half a
    window, at any place equally often.
    """
    number = values.size
    integral, there = scratch[0, : number + 1], scratch[1, : number + 1]
    # About their own mean, which differences do not see.
    centre = 0.0
    for i in range(number):
        centre += present[i] * values[i]
    centre /= max(total(present), 1.0)
    integral[0], there[0] = 0.0, 0.0
    for i in range(number):
        integral[i + 1] = integral[i] + present[i] * (values[i] - centre)
        there[i + 1] = there[i] + present[i]
    for level in range(levels[0], levels[1]):
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
        own = sums[level + row]
        own[COUNT] += count
        own[SCARCITY] += scarcity
        add(own, MEAN, LOST_MEAN, mean)
        add(own, SQUARE, LOST_SQUARE, square)
        if level + row == 0:
            add(totals, FOURTH, LOST_FOURTH, fourth)
