"""Hot loops of series with gaps."""

from __future__ import annotations

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray


@compiled()
def fill(
    values: FloatArray,
    integral: FloatArray,
    edges: IntArray,
    block: IntArray,
    boxes: IntArray,
    weights: FloatArray,
    slope: float,
) -> None:
    """Fill gaps with a weighted mean of the samples on either side, and a line of no mean.

    values: (n,), changed in place.
    integral: (n + 1,), their cumulative sum before, starting with 0.
    edges: (G, 2), first sample of each gap, and the one after its last.
    block: (G,), samples of the nearest box on either side.
    boxes: (G,), number of boxes: they end at 1, 2, 4, 8, ... blocks from the gap.
    weights: (G, most boxes), of the mean of each pair of boxes.
    slope: Per sample.
    """
    for g in range(edges.shape[0]):
        start, stop = edges[g, 0], edges[g, 1]
        mean = 0.0
        near = 0
        far = block[g]
        for i in range(boxes[g]):
            left = integral[start - near] - integral[start - far]
            right = integral[stop + far] - integral[stop + near]
            mean += weights[g, i] * (left + right) / (2.0 * (far - near))
            near = far
            far = 2 * far
        centre = 0.5 * (start + stop - 1)
        for k in range(start, stop):
            values[k] = mean + slope * (k - centre)


@compiled()
def pairs_at_lag(first: IntArray, second: IntArray, lag: int) -> int:
    """Number of places t within the first intervals such that t + lag is within the second.

    first, second: (P, 2), (Q, 2), ascending intervals, their ends excluded.
    lag: Zero or more.
    """
    total = 0
    j = 0
    for i in range(first.shape[0]):
        low, high = first[i, 0] + lag, first[i, 1] + lag
        while j > 0 and second[j - 1, 1] > low:
            j -= 1
        while j < second.shape[0] and second[j, 0] < high:
            total += max(min(high, second[j, 1]) - max(low, second[j, 0]), 0)
            j += 1
        j = min(j, second.shape[0] - 1)
    return total


@compiled()
def neighbours(centre: IntArray, kind: IntArray, kinds: int, reach: int) -> IntArray:
    """Number of pairs of gaps by kinds and distance, (kinds, kinds, reach).

    centre: (G,), ascending, in half samples.
    kind: (G,), from 0; negative ones are left out.
    reach: Half samples.
    """
    number = np.zeros((kinds, kinds, reach), dtype=np.int64)
    for g in range(centre.size):
        if kind[g] < 0:
            continue
        other = g + 1
        while other < centre.size and centre[other] - centre[g] < reach:
            if kind[other] >= 0:
                number[kind[g], kind[other], centre[other] - centre[g]] += 1
            other += 1
    return number
