"""Non-negative least squares of a few columns, many times over (Lawson & Hanson 1974, ch. 23)."""

import math

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray

_DEPENDENT = 1e-12  # of a unit column: what is left of it beside those it depends on
_TOLERANCE = 1e-14  # of |y|: a correlation with the residuals that is rounding


def solve_nonnegative(columns: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amplitudes (k,) of columns (J, k) that come nearest to y (J,), and the residuals (J,)."""
    found: tuple[FloatArray, FloatArray] = solve_columns(*map(np.ascontiguousarray, (columns, y)))
    return found


def objectives_with(columns: FloatArray, candidates: FloatArray, y: FloatArray) -> FloatArray:
    """Sums of squares (G,) of y (J,) that each candidate (J, G) leaves beside columns (J, k)."""
    return np.asarray(_each(*map(np.ascontiguousarray, (columns, candidates, y))))


@compiled()
def _orthonormal(unit: FloatArray, order: IntArray, size: int) -> tuple[FloatArray, FloatArray]:
    """Q' (size, J), zeros if dependent, and R of the first columns; Gram-Schmidt twice."""
    rows = unit.shape[0]
    basis, upper = np.empty((size, rows)), np.zeros((size, size))
    for p in range(size):
        for i in range(rows):
            basis[p, i] = unit[i, order[p]]
        for _ in range(2):
            for q in range(p):
                product = 0.0
                for i in range(rows):
                    product += basis[q, i] * basis[p, i]
                upper[q, p] += product
                for i in range(rows):
                    basis[p, i] -= product * basis[q, i]
        norm = 0.0
        for i in range(rows):
            norm += basis[p, i] ** 2
        norm = math.sqrt(norm)
        upper[p, p] = norm if norm > _DEPENDENT else 0.0
        for i in range(rows):
            basis[p, i] = basis[p, i] / norm if norm > _DEPENDENT else 0.0
    return basis, upper


@compiled()
def _least_squares(unit: FloatArray, y: FloatArray, order: IntArray, size: int) -> FloatArray:
    """Least squares of the first ``size`` columns of ``order``, zero for one that depends."""
    basis, upper = _orthonormal(unit, order, size)
    rest, solution = y.copy(), np.zeros(size)
    for p in range(size):
        # The part along each direction is taken from what the earlier ones left.
        for i in range(y.size):
            solution[p] += basis[p, i] * rest[i]
        for i in range(y.size):
            rest[i] -= solution[p] * basis[p, i]
    for p in range(size - 1, -1, -1):
        for q in range(p + 1, size):
            solution[p] -= upper[p, q] * solution[q]
        solution[p] = solution[p] / upper[p, p] if upper[p, p] > 0.0 else 0.0
    return solution


@compiled()
def _solve(unit: FloatArray, y: FloatArray) -> FloatArray:
    """Amplitudes (k,) of columns of unit length."""
    rows, count = unit.shape
    most = min(rows, count)
    x, solution = np.zeros(count), np.zeros(0)
    order = np.zeros(most, dtype=np.int64)  # the passive columns, those that may be positive
    is_passive, rejected = np.zeros(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_)
    size = 0
    residual = y.copy()
    length = 0.0
    for i in range(rows):
        length += y[i] ** 2
    least = _TOLERANCE * math.sqrt(length)
    for _ in range(3 * count + 3):
        rejected[:] = False
        slope = np.zeros(count)
        for i in range(rows):
            for j in range(count):
                slope[j] += unit[i, j] * residual[i]
        entered = -1
        while entered < 0 and size < most:
            steepest, best = least, -1
            for j in range(count):
                if not (is_passive[j] or rejected[j]) and slope[j] > steepest:
                    steepest, best = slope[j], j
            if best < 0:
                break
            order[size] = best
            solution = _least_squares(unit, y, order, size + 1)
            # By rounding, what should gain may come out with the wrong sign.
            if solution[size] > 0.0:
                entered = best
            else:
                rejected[best] = True
        if entered < 0:
            break
        is_passive[entered] = True
        size += 1
        while True:
            step, at = 1.0, -1
            for p in range(size):
                if solution[p] <= 0.0:
                    own = x[order[p]] / (x[order[p]] - solution[p])
                    if own < step or at < 0:
                        step, at = own, p
            if at < 0:
                break
            for p in range(size):
                x[order[p]] += step * (solution[p] - x[order[p]])
            dropped = 0
            for p in range(size):
                j = order[p]
                order[p - dropped] = j
                if p == at or x[j] <= 0.0:
                    x[j] = 0.0
                    is_passive[j] = False
                    dropped += 1
            size -= dropped
            solution = _least_squares(unit, y, order, size)
        for p in range(size):
            x[order[p]] = solution[p]
        for i in range(rows):
            residual[i] = y[i]
            for p in range(size):
                residual[i] -= unit[i, order[p]] * solution[p]
    return x


@compiled()
def _unit(columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Columns of unit length, and their lengths, 1 in place of 0."""
    rows, count = columns.shape
    length = np.zeros(count)
    unit = np.empty((rows, count))
    for i in range(rows):
        for j in range(count):
            length[j] += columns[i, j] * columns[i, j]
    for j in range(count):
        length[j] = math.sqrt(length[j]) if length[j] > 0.0 else 1.0
    for i in range(rows):
        for j in range(count):
            unit[i, j] = columns[i, j] / length[j]
    return unit, length


@compiled()
def solve_columns(columns: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """`solve_nonnegative` of columns brought to unit length, for contiguous arrays."""
    unit, length = _unit(columns)
    x = _solve(unit, y)
    residual = y.copy()
    for i in range(y.size):
        for j in range(x.size):
            residual[i] -= unit[i, j] * x[j]
    for j in range(x.size):
        x[j] /= length[j]
    return x, residual


@compiled()
def _each(columns: FloatArray, candidates: FloatArray, y: FloatArray) -> FloatArray:
    rows, count = columns.shape
    together = np.empty((rows, count + 1))
    for i in range(rows):
        for j in range(count):
            together[i, j] = columns[i, j]
    result = np.zeros(candidates.shape[1])
    for g in range(result.size):
        for i in range(rows):
            together[i, count] = candidates[i, g]
        for left in solve_columns(together, y)[1]:
            result[g] += left * left
    return result


@compiled()
def orthogonal_to(columns: FloatArray, others: FloatArray) -> FloatArray:
    """What of some columns is orthogonal to others, (J, k) and (J, l), l no more than J."""
    rows, count = others.shape
    basis, _ = _orthonormal(_unit(others)[0], np.arange(count), count)
    result = columns.copy()
    for j in range(columns.shape[1]):
        for p in range(count):
            product = 0.0
            for i in range(rows):
                product += basis[p, i] * columns[i, j]
            for i in range(rows):
                result[i, j] -= product * basis[p, i]
    return result
