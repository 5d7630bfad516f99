"""Non-negative least squares of a few columns, many times over (Lawson & Hanson 1974, ch. 23)."""

from __future__ import annotations

import math

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray

_DEPENDENT = 1e-12  # of a unit column: what is left of it beside those it depends on
_TOLERANCE = 1e-14  # of |y|: a correlation with the residuals that is rounding


def solve_nonnegative(columns: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Non-negative least squares with columns brought to unit length; amplitudes and residuals.

    columns: (J, k).
    y: (J,).
    Returns: amplitudes (k,); residuals (J,).
    """
    if columns.shape[1] == 0:
        return np.zeros(0), y
    amplitudes, residuals = solve_columns(np.ascontiguousarray(columns), np.ascontiguousarray(y))
    return amplitudes, residuals


def objectives_with(columns: FloatArray, candidates: FloatArray, y: FloatArray) -> FloatArray:
    """Sums of squares that are left with each candidate in turn beside the columns.

    columns: (J, k).
    candidates: (J, G).
    y: (J,).
    Returns: (G,).
    """
    arrays = (np.ascontiguousarray(each) for each in (columns, candidates, y))
    return np.asarray(_each(*arrays))


@compiled()
def _append(
    unit: FloatArray, order: IntArray, p: int, basis: FloatArray, upper: FloatArray
) -> None:
    """Orthonormal direction of column ``order[p]`` beside those before, by Gram-Schmidt twice."""
    rows = unit.shape[0]
    for i in range(rows):
        basis[p, i] = unit[i, order[p]]
    for q in range(p):
        upper[q, p] = 0.0
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


@compiled()
def _passive_solution(
    unit: FloatArray,
    order: IntArray,
    first: int,
    size: int,
    basis: FloatArray,
    upper: FloatArray,
    rest: FloatArray,
    along: FloatArray,
    solution: FloatArray,
) -> None:
    """Least squares of the first ``size`` columns of ``order``; new are those from ``first`` on.

    Row p of ``rest`` is what the first p directions leave of the right side.
    """
    rows = unit.shape[0]
    for p in range(first, size):
        _append(unit, order, p, basis, upper)
        # The part along each direction is taken from what the earlier ones left.
        along[p] = 0.0
        for i in range(rows):
            along[p] += basis[p, i] * rest[p, i]
        for i in range(rows):
            rest[p + 1, i] = rest[p, i] - along[p] * basis[p, i]
    for p in range(size - 1, -1, -1):
        solution[p] = along[p]
        for q in range(p + 1, size):
            solution[p] -= upper[p, q] * solution[q]
        solution[p] = solution[p] / upper[p, p] if upper[p, p] > 0.0 else 0.0


@compiled()
def _solve(unit: FloatArray, y: FloatArray) -> FloatArray:
    rows, count = unit.shape
    most = min(rows, count)
    x = np.zeros(count)
    slope = np.zeros(count)
    order = np.zeros(most, dtype=np.int64)
    solution, along = np.zeros(most), np.zeros(most)
    is_passive = np.zeros(count, dtype=np.bool_)
    rejected = np.zeros(count, dtype=np.bool_)
    basis, upper = np.zeros((most, rows)), np.zeros((most, most))
    rest = np.zeros((most + 1, rows))
    size = np.int64(0)  # numba compiles a callee anew for a literal number
    residual = y.copy()
    length = 0.0
    for i in range(rows):
        rest[0, i] = y[i]
        length += y[i] ** 2
    least = _TOLERANCE * math.sqrt(length)
    for _ in range(3 * count + 3):
        rejected[:] = False
        slope[:] = 0.0
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
            _passive_solution(unit, order, size, size + 1, basis, upper, rest, along, solution)
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
            kept, first = np.int64(0), size
            for p in range(size):
                j = order[p]
                if p == at or x[j] <= 0.0:
                    x[j] = 0.0
                    is_passive[j] = False
                    first = min(first, np.int64(p))
                else:
                    order[kept] = j
                    kept += 1
            size = kept
            _passive_solution(unit, order, first, size, basis, upper, rest, along, solution)
        for p in range(size):
            x[order[p]] = solution[p]
        for i in range(rows):
            residual[i] = y[i]
        for p in range(size):
            for i in range(rows):
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
    """`solve_nonnegative`, for compiled code; the arrays are contiguous."""
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
    unit = _unit(columns)[0]
    for i in range(rows):
        for j in range(count):
            together[i, j] = unit[i, j]
    others = _unit(candidates)[0]
    result = np.zeros(candidates.shape[1])
    for g in range(result.size):
        for i in range(rows):
            together[i, count] = others[i, g]
        x = _solve(together, y)
        for i in range(rows):
            left = y[i]
            for j in range(count + 1):
                left -= together[i, j] * x[j]
            result[g] += left * left
    return result


@compiled()
def orthogonal_to(columns: FloatArray, others: FloatArray) -> FloatArray:
    """What of some columns is orthogonal to others, (J, k) and (J, l).

    At most so many of the others as there are rows.
    """
    rows, count = others.shape
    order = np.arange(count)
    basis, upper = np.zeros((count, rows)), np.zeros((count, count))
    unit = _unit(others)[0]
    for p in range(count):
        _append(unit, order, p, basis, upper)
    result = columns.copy()
    for j in range(columns.shape[1]):
        for p in range(count):
            product = 0.0
            for i in range(rows):
                product += basis[p, i] * columns[i, j]
            for i in range(rows):
                result[i, j] -= product * basis[p, i]
    return result
