"""Non-negative least squares of a few columns, many times over (Lawson & Hanson 1974, ch. 23).

The loops are compiled: a call of a library takes longer than a problem of this size. Columns stand
in rows, (k, J), of unit length.
"""

import math

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import BoolArray, FloatArray

_DEPENDENT = 1e-12  # of a column: what is left of it beside those it depends on
_ROUNDING = 1e-14  # of |y|: a correlation with the residuals that is none


def solve_nonnegative(columns: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amplitudes (k,) of columns (J, k) that come nearest to y (J,), and the residuals (J,)."""
    found: tuple[FloatArray, FloatArray] = _solve(_rows(columns), np.ascontiguousarray(y))
    return found


def objectives_with(columns: FloatArray, candidates: FloatArray, y: FloatArray) -> FloatArray:
    """Sums of squares (G,) of y (J,) that each candidate (J, G) leaves beside columns (J, k)."""
    return np.asarray(_objectives(_rows(columns), _rows(candidates), np.ascontiguousarray(y)))


def orthogonal_to(columns: FloatArray, others: FloatArray) -> FloatArray:
    """What of some columns is orthogonal to others, (J, k) and (J, l)."""
    return np.asarray(_orthogonal(_rows(columns), _rows(others)).T)


def _rows(columns: FloatArray) -> FloatArray:
    return np.ascontiguousarray(columns.T)


@compiled()
def _unit(columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Columns of unit length, and their lengths, 1 in place of 0."""
    length, unit = np.ones(columns.shape[0]), np.empty(columns.shape)
    for j in range(length.size):
        square = _product(columns[j], columns[j])
        if square > 0.0:
            length[j] = math.sqrt(square)
        for i in range(columns.shape[1]):
            unit[j, i] = columns[j, i] / length[j]
    return unit, length


@compiled()
def _product(a: FloatArray, b: FloatArray) -> float:
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


@compiled()
def _least_squares(
    unit: FloatArray, present: BoolArray, y: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Amplitudes (k,), zero for a column that depends on others, and the residuals (J,).

    Gram-Schmidt, twice for the digits, with y as the last column.
    """
    places, size = np.empty(present.size, dtype=np.int64), 0
    for j in range(present.size):
        if present[j]:
            places[size] = j
            size += 1
    basis, upper = np.empty((size + 1, y.size)), np.zeros((size, size + 1))
    for p in range(size + 1):
        for i in range(y.size):
            basis[p, i] = unit[places[p], i] if p < size else y[i]
        for _ in range(2):
            for q in range(p):
                shared = _product(basis[q], basis[p])
                upper[q, p] += shared
                for i in range(y.size):
                    basis[p, i] -= shared * basis[q, i]
        if p < size:
            length = math.sqrt(_product(basis[p], basis[p]))
            upper[p, p] = length if length > _DEPENDENT else 0.0
            for i in range(y.size):
                basis[p, i] = basis[p, i] / length if length > _DEPENDENT else 0.0
    x = np.zeros(present.size)
    for p in range(size - 1, -1, -1):
        left = upper[p, size]
        for q in range(p + 1, size):
            left -= upper[p, q] * x[places[q]]
        x[places[p]] = left / upper[p, p] if upper[p, p] > 0.0 else 0.0
    return x, basis[size]


@compiled()
def _solve(columns: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """`solve_nonnegative` of rows of any length."""
    count, (unit, length) = columns.shape[0], _unit(columns)
    x, residual, way = np.zeros(count), y.copy(), np.ones(count)
    positive = np.zeros(count, dtype=np.bool_)
    least = _ROUNDING * math.sqrt(_product(y, y))
    for _ in range(3 * count + 3):
        # The column that gains most. By rounding it may come out with the wrong sign.
        tried, entered = positive.copy(), -1
        while entered < 0:
            best, steepest = -1, least
            for j in range(count):
                slope = _product(unit[j], residual)
                if not tried[j] and slope > steepest:
                    best, steepest = j, slope
            if best < 0:
                for j in range(count):
                    x[j] /= length[j]
                return x, residual
            positive[best] = tried[best] = True
            solution, left = _least_squares(unit, positive, y)
            if solution[best] > 0.0:
                entered = best
            else:
                positive[best] = False
        # Go towards the solution as far as all amplitudes stay positive; who ends it leaves.
        while True:
            step = 2.0
            for j in range(count):
                way[j] = 2.0
                if positive[j] and solution[j] <= 0.0:
                    way[j] = x[j] / (x[j] - solution[j])
                step = min(step, way[j])
            if step > 1.0:
                break
            for j in range(count):
                positive[j] = positive[j] and way[j] > step
                x[j] = x[j] + step * (solution[j] - x[j]) if positive[j] else 0.0
            solution, left = _least_squares(unit, positive, y)
        x, residual = solution, left
    for j in range(count):
        x[j] /= length[j]
    return x, residual


@compiled()
def _objectives(columns: FloatArray, candidates: FloatArray, y: FloatArray) -> FloatArray:
    count = columns.shape[0]
    together = np.empty((count + 1, y.size))
    result = np.empty(candidates.shape[0])
    for g in range(result.size):
        for i in range(y.size):
            for j in range(count):
                together[j, i] = columns[j, i]
            together[count, i] = candidates[g, i]
        left = _solve(together, y)[1]
        result[g] = _product(left, left)
    return result


@compiled()
def _orthogonal(columns: FloatArray, others: FloatArray) -> FloatArray:
    unit, _ = _unit(others)
    result = np.empty(columns.shape)
    for j in range(columns.shape[0]):
        left = _least_squares(unit, np.ones(unit.shape[0], dtype=np.bool_), columns[j])[1]
        for i in range(left.size):
            result[j, i] = left[i]
    return result
