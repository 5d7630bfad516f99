"""The sample number of every row, from stamps that are uneven."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gmwm._core.compiled import compiled
from gmwm._core.typing import BoolArray, FloatArray, IntArray

_DEPTH = 8  # hypotheses that are followed at a time
_AHEAD = 512  # rows beyond a chunk that decide on its last ones
_ALONE = 3.0  # samples lost together that cost as much as if each were lost alone
_UNLIKELY = 24.0  # cost beyond that of the best at which a hypothesis is dropped

# Of a hypothesis: sample number, clock there, interval, cost, rows that tell the phase.
_NUMBER, _CLOCK, _INTERVAL, _COST, _PHASED = range(5)


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
    state, saved, new = np.zeros((_DEPTH, 5)), np.zeros((_DEPTH, 5)), np.zeros((3 * _DEPTH, 5))
    new_parent = np.zeros(3 * _DEPTH, dtype=np.int8)
    new_step = np.zeros(3 * _DEPTH, dtype=np.int64)
    order = np.zeros(3 * _DEPTH, dtype=np.int64)
    state[0, _CLOCK], state[0, _INTERVAL], state[0, _PHASED] = start_at, 1.0, float(n)
    start, alive, spent = 1, 1, 0.0
    advance[0], is_set[0] = 0, False
    while start < n:
        stop = min(start + chunk, n)
        end = min(stop + _AHEAD, n)
        for k in range(start, end):
            known = min(k + age, memory)
            count = _continued(
                x[k], same[k], limit, sigma, known, costs, state, alive, new, new_parent, new_step
            )
            best = _by_cost(new, count, order)
            if k < stop:
                spent += best
            alive = 0
            fewest = _fewest_losses(new, order, count, best + 64.0 * costs[3])
            for i in range(count):
                each = order[i]
                unlikely = new[each, _COST] > best + _UNLIKELY or alive >= _DEPTH - 1
                if unlikely and each != fewest:
                    continue
                state[alive] = new[each]
                state[alive, _COST] -= best
                parent[k - start, alive], step[k - start, alive] = new_parent[each], new_step[each]
                alive += 1
            if k == stop - 1:
                saved[:] = state
        # The best at the end decides; from its state at the end of the chunk the next one goes on.
        h = 0
        for k in range(end - 1, start - 1, -1):
            if k == stop - 1:
                state[0] = saved[h]
                state[0, _COST], alive = 0.0, 1
            if k < stop:
                is_set[k], advance[k] = step[k - start, h] < 0, abs(step[k - start, h])
            h = parent[k - start, h]
        start = stop
    return spent


@compiled()
def _continued(
    stamp: float,
    same: bool,
    limit: float,
    sigma: float,
    known: int,
    costs: FloatArray,
    state: FloatArray,
    alive: int,
    new: FloatArray,
    new_parent: npt.NDArray[np.int8],
    new_step: IntArray,
) -> int:
    """Every hypothesis with a further row, in each way that this may be; returns how many.

    known: Rows that the straight line has seen.
    state: (depth, 5), of which the first ``alive`` count.
    new, new_parent, new_step: Written: states, what they continue, by how many samples; -1 for a
        clock that was set.
    """
    gain = 2.0 * (2.0 * known + 1.0) / ((known + 1.0) * (known + 2.0))
    slow = 6.0 / ((known + 1.0) * (known + 2.0))
    count = 0
    for h in range(alive):
        number, clock, interval = state[h, _NUMBER], state[h, _CLOCK], state[h, _INTERVAL]
        ahead = (stamp - clock) / interval
        # The phase after a set clock is that of its first rows: no better than their mean,
        # and sooner forgotten than the interval, which outlasts it.
        pull = max(gain, 1.0 / (state[h, _PHASED] + 1.0))
        width = sigma * np.sqrt(1.0 + 1.0 / state[h, _PHASED])
        for way in range(4):
            # the next one, samples lost, a repetition, a clock that was set
            by, extra = 1.0, 0.0
            if way == 1:
                by = np.rint(ahead)
                if by < 2.0 or by > limit:
                    continue
                extra = costs[0] * min(by - 1.0, _ALONE)
            elif way == 2:
                if not same:
                    continue
                by, extra = 0.0, costs[1]
            elif way == 3:
                if -1.0 < ahead <= limit:
                    continue
                extra = costs[2]
            if same and way != 2:
                extra += costs[4]
            error = 0.0 if way == 3 else stamp - (clock + by * interval)
            total = state[h, _COST] + extra + min(0.5 * (error / width) ** 2, costs[3])
            # What is far from the clock moves it the less.
            far = max(abs(error) / (3.0 * width), 1.0)
            bounded = error / far**2
            base = stamp if way == 3 else clock + by * interval + pull * bounded
            # One hypothesis for each sample number and state of the clock.
            slot = count
            for other in range(count):
                if new[other, _NUMBER] == number + by and abs(new[other, _CLOCK] - base) < 0.5:
                    slot = other
                    break
            if slot == new.shape[0] or (slot < count and new[slot, _COST] <= total):
                continue
            new[slot, _NUMBER], new[slot, _CLOCK] = number + by, base
            new[slot, _INTERVAL], new[slot, _COST] = interval + slow * bounded, total
            new[slot, _PHASED] = 1.0 if way == 3 else state[h, _PHASED] + 1.0
            new_parent[slot], new_step[slot] = h, -1 if way == 3 else np.int64(by)
            count = max(count, slot + 1)
    return count


@compiled()
def _by_cost(new: FloatArray, count: int, order: IntArray) -> float:
    """Write the order from the cheapest on, and return its cost; by insertion, there are few."""
    for i in range(count):
        j = i
        while j > 0 and new[order[j - 1], _COST] > new[i, _COST]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = i
    return float(new[order[0], _COST])


@compiled()
def _fewest_losses(new: FloatArray, order: IntArray, count: int, given_up: float) -> int:
    """The hypothesis of the lowest sample number among those that are not given up."""
    fewest = order[0]
    for i in range(count):
        each = order[i]
        if new[each, _COST] < given_up and new[each, _NUMBER] < new[fewest, _NUMBER]:
            fewest = each
    return int(fewest)
