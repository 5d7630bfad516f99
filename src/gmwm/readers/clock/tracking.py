"""The sample number of every row, from stamps that are uneven."""

from __future__ import annotations

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import BoolArray, FloatArray, IntArray

_DEPTH = 8  # hypotheses that are followed at a time
_AHEAD = 512  # rows beyond a chunk that decide on its last ones
_ALONE = 3.0  # samples lost together that cost as much as if each were lost alone
_UNLIKELY = 24.0  # cost beyond that of the best at which a hypothesis is dropped


@compiled()
def follow(
    x: FloatArray,
    same: BoolArray,
    limit: float,
    start_at: float,
    sigma: float,
    memory: int,
    age: int,
    costs: FloatArray,
    advance: IntArray,
    is_set: BoolArray,
    chunk: int,
) -> float:
    """Number the rows so that their stamps lie close to an even clock: the likeliest sequence.

    A row is the next sample; or samples before it are lost; or it repeats the row before; or the
    clock was set. Each has a cost, and so has the distance of a stamp from the clock, which is
    followed by a straight line with a fading memory. The sequences of least cost are kept, the one
    with the fewest losses always among them: a host that stalls sends many late rows.

    x: (n,), stamps, in sampling intervals (roughly).
    same: (n,) of bool, whether a row may repeat the one before.
    limit: Intervals beyond which a jump is no loss, the clock was set.
    start_at: The clock at the first row.
    sigma: Standard deviation of the stamps, intervals.
    memory: Rows of the straight line.
    age: Rows that the clock given is worth.
    costs: (5,), negative logarithm of the chance of a loss, a repetition and a set clock; the most
        that one stamp costs; and what it costs if a row that may repeat another does not.
    advance: (n,) of int, written, sample number less that of the row before; 0 for a repetition.
    is_set: (n,) of bool, written, whether the clock was set before a row.
    chunk: Rows that are decided at a time.
    Returns: cost of the sequence.
    """
    n = x.size
    rows = min(n, chunk + _AHEAD)
    parent = np.zeros((rows, _DEPTH), dtype=np.int8)
    step = np.zeros((rows, _DEPTH), dtype=np.int64)
    # Per hypothesis: sample number, clock there, interval, cost, rows that tell the phase.
    number = np.zeros(_DEPTH, dtype=np.int64)
    phased, new_phased = np.full(_DEPTH, float(n)), np.zeros(3 * _DEPTH)
    clock, interval, cost = np.zeros(_DEPTH), np.ones(_DEPTH), np.zeros(_DEPTH)
    most = 3 * _DEPTH
    new_number = np.zeros(most, dtype=np.int64)
    new_clock, new_interval, new_cost = np.zeros(most), np.zeros(most), np.zeros(most)
    new_parent, new_step = np.zeros(most, dtype=np.int8), np.zeros(most, dtype=np.int64)
    saved_number, saved_clock = number.copy(), clock.copy()
    saved_interval, saved_phased = interval.copy(), phased.copy()
    order = np.zeros(most, dtype=np.int64)
    start, alive = 1, 1
    clock[0] = start_at
    spent = 0.0
    advance[0], is_set[0] = 0, False
    given_up = 64.0 * costs[3]
    while start < n:
        stop = min(start + chunk, n)
        end = min(stop + _AHEAD, n)
        for k in range(start, end):
            rows_known = float(min(k + age, memory))
            gain = 2.0 * (2.0 * rows_known + 1.0) / ((rows_known + 1.0) * (rows_known + 2.0))
            slow = 6.0 / ((rows_known + 1.0) * (rows_known + 2.0))
            count = 0
            for h in range(alive):
                ahead = (x[k] - clock[h]) / interval[h]
                # The phase after a set clock is that of its first rows: no better than their mean,
                # and sooner forgotten than the interval, which outlasts it.
                pull = max(gain, 1.0 / (phased[h] + 1.0))
                width = sigma * np.sqrt(1.0 + 1.0 / phased[h])
                for way in range(4):
                    # the next one, samples lost, a repetition, a clock that was set
                    by = 1.0
                    extra = 0.0
                    if way == 1:
                        by = np.rint(ahead)
                        if by < 2.0 or by > limit:
                            continue
                        extra = costs[0] * min(by - 1.0, _ALONE)
                    elif way == 2:
                        if not same[k]:
                            continue
                        by, extra = 0.0, costs[1]
                    elif way == 3:
                        if -1.0 < ahead <= limit:
                            continue
                        extra = costs[2]
                    error = x[k] - (clock[h] + by * interval[h])
                    if way == 3:
                        error = 0.0
                    total = cost[h] + extra + min(0.5 * (error / width) ** 2, costs[3])
                    here = number[h] + np.int64(by)
                    # What is far from the clock moves it the less.
                    far = max(abs(error) / (3.0 * width), 1.0)
                    bounded = error / far**2
                    base = x[k] if way == 3 else clock[h] + by * interval[h] + pull * bounded
                    rate = interval[h] + slow * bounded
                    # One hypothesis for each sample number and state of the clock.
                    slot = count
                    for other in range(count):
                        if new_number[other] == here and abs(new_clock[other] - base) < 0.5:
                            slot = other
                            break
                    if way != 2 and same[k]:
                        total += costs[4]
                    if slot < count and new_cost[slot] <= total:
                        continue
                    if slot == most:
                        continue
                    new_number[slot], new_clock[slot] = here, base
                    new_interval[slot], new_cost[slot] = rate, total
                    new_phased[slot] = 1.0 if way == 3 else phased[h] + 1.0
                    new_parent[slot] = h
                    new_step[slot] = -1 if way == 3 else np.int64(by)
                    count = max(count, slot + 1)
            for i in range(count):  # insertion: there are few
                j = i
                while j > 0 and new_cost[order[j - 1]] > new_cost[i]:
                    order[j] = order[j - 1]
                    j -= 1
                order[j] = i
            best = new_cost[order[0]]
            if k < stop:
                spent += best
            fewest = order[0]
            for i in range(count):
                each = order[i]
                if new_cost[each] < best + given_up and new_number[each] < new_number[fewest]:
                    fewest = each
            kept = 0
            for i in range(count):
                each = order[i]
                few = each == fewest
                if not few and (new_cost[each] > best + _UNLIKELY or kept >= _DEPTH - 1):
                    continue
                number[kept], clock[kept] = new_number[each], new_clock[each]
                interval[kept], cost[kept] = new_interval[each], new_cost[each] - best
                phased[kept] = new_phased[each]
                parent[k - start, kept] = new_parent[each]
                step[k - start, kept] = new_step[each]
                kept += 1
            alive = kept
            if k == stop - 1:
                saved_number, saved_clock = number.copy(), clock.copy()
                saved_interval, saved_phased = interval.copy(), phased.copy()
        # The best at the end decides; from its state at the end of the chunk the next one goes on.
        h = 0
        for k in range(end - 1, start - 1, -1):
            if k == stop - 1:
                number[0], clock[0] = saved_number[h], saved_clock[h]
                interval[0], cost[0] = saved_interval[h], 0.0
                phased[0] = saved_phased[h]
                alive = 1
            if k < stop:
                by_step = step[k - start, h]
                is_set[k] = by_step < 0
                advance[k] = abs(by_step)
            h = parent[k - start, h]
        start = stop
    return spent
