"""Non-negative least squares of a few columns, many times over (Lawson & Hanson 1974, ch. 23)."""

from __future__ import annotations

import math

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray

_DEPENDENT = 1e-12  # of a unit column: what is left of it beside those it depends on
_TOLERANCE = 1e-14  # of |y|: a correlation with the residuals that is rounding


def solve_nonnegative(columns: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Non-negative least squares with columns brought to unit length; amplitudes and residuals.

    Parameters
    ----------
    columns : (J, k) ndarray
    y : (J,) ndarray

    Returns
    -------
    amplitudes : (k,) ndarray
    residuals : (J,) ndarray
    """
    if columns.shape[1] == 0:
        return np.zeros(0), y
    unit, length = _unit(columns)
    scaled = _solve(unit, np.ascontiguousarray(y))
    return scaled / length, y - unit @ scaled


def objectives_with(columns: FloatArray, candidates: FloatArray, y: FloatArray) -> FloatArray:
    """Sums of squares that are left with each candidate in turn beside the columns.

    Parameters
    ----------
    columns : (J, k) ndarray
    candidates : (J, G) ndarray
    y : (J,) ndarray

    Returns
    -------
    (G,) ndarray
    """
    together = np.empty((y.size, columns.shape[1] + 1))
    together[:, :-1] = _unit(columns)[0]
    y = np.ascontiguousarray(y)
    result = np.empty(candidates.shape[1])
    for g, column in enumerate(_unit(candidates)[0].T):
        together[:, -1] = column
        rest = y - together @ _solve(together, y)
        result[g] = rest @ rest
    return result


def _unit(columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    length = np.sqrt(np.sum(columns * columns, axis=0))
    length[length == 0.0] = 1.0
    return np.ascontiguousarray(columns / length), length


@compiled()
def _passive_solution(
    unit: FloatArray, y: FloatArray, order: FloatArray, size: int, basis: FloatArray,
    upper: FloatArray, solution: FloatArray,
) -> None:  # fmt: skip
    """Least squares of the first ``size`` columns of ``order``, by Gram-Schmidt done twice."""
    rows = y.size
    for p in range(size):
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
    # The part of y along each direction is taken from what the earlier ones left of it.
    rest = y.copy()
    for p in range(size):
        product = 0.0
        for i in range(rows):
            product += basis[p, i] * rest[i]
        for i in range(rows):
            rest[i] -= product * basis[p, i]
        solution[p] = product
    for p in range(size - 1, -1, -1):
        for q in range(p + 1, size):
            solution[p] -= upper[p, q] * solution[q]
        solution[p] = solution[p] / upper[p, p] if upper[p, p] > 0.0 else 0.0


@compiled()
def _solve(unit: FloatArray, y: FloatArray) -> FloatArray:
    rows, count = unit.shape
    x = np.zeros(count)
    order = np.zeros(count, dtype=np.int64)
    solution = np.zeros(count)
    is_passive = np.zeros(count, dtype=np.bool_)
    basis, upper = np.zeros((count, rows)), np.zeros((count, count))
    size = 0
    residual = y.copy()
    length = 0.0
    for i in range(rows):
        length += y[i] ** 2
    least = _TOLERANCE * math.sqrt(length)
    for _ in range(3 * count + 3):
        rejected = np.zeros(count, dtype=np.bool_)
        entered = -1
        while entered < 0 and size < min(rows, count):
            steepest, best = least, -1
            for j in range(count):
                if is_passive[j] or rejected[j]:
                    continue
                slope = 0.0
                for i in range(rows):
                    slope += unit[i, j] * residual[i]
                if slope > steepest:
                    steepest, best = slope, j
            if best < 0:
                break
            order[size] = best
            _passive_solution(unit, y, order, size + 1, basis, upper, solution)
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
            kept = 0
            for p in range(size):
                j = order[p]
                if p == at or x[j] <= 0.0:
                    x[j] = 0.0
                    is_passive[j] = False
                else:
                    order[kept] = j
                    kept += 1
            size = kept
            _passive_solution(unit, y, order, size, basis, upper, solution)
        for p in range(size):
            x[order[p]] = solution[p]
        for i in range(rows):
            residual[i] = y[i]
        for p in range(size):
            for i in range(rows):
                residual[i] -= unit[i, order[p]] * solution[p]
    return x
