"""Hot loops of a search: the profiled problem and its slopes.

Loops stand in place of expressions of whole arrays and of slices, which take numba seconds to
compile.
"""

from typing import NamedTuple

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray
from gmwm.estimate.problem.nonnegative import orthogonal_to, solve_columns


class Weighted(NamedTuple):
    """A weighted least-squares problem for given shapes.

    root: (J, J), L with L'L the weight matrix.
    linear, given: (L,), (G,), terms of free and of fixed amplitude.
    target: (J,), observed wavelet variances, u^2.
    """

    root: FloatArray
    linear: IntArray
    given: IntArray
    target: FloatArray


@compiled()
def profiled(problem: Weighted, curves: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Weighted columns of free amplitude, the best amplitudes, and the weighted residuals."""
    root, linear, given, target = problem
    rows = target.size
    rest = target.copy()
    for i in range(rows):
        for k in given:
            rest[i] -= curves[i, k]
    columns, y = np.zeros((rows, linear.size)), np.zeros(rows)
    for i in range(rows):
        for j in range(rows):
            weight = root[i, j]
            y[i] += weight * rest[j]
            for k in range(linear.size):
                columns[i, k] += weight * curves[j, linear[k]]
    x, residual = solve_columns(columns, y)
    return columns, x, residual


@compiled()
def projected(
    root: FloatArray, columns: FloatArray, x: FloatArray, slopes: FloatArray, factor: FloatArray
) -> FloatArray:
    """Weighted slopes of the curves times factors, orthogonal to columns of positive amplitude.

    root: (J, J).
    columns, x: (J, L), (L,), weighted columns and their amplitudes.
    slopes, factor: (J, z), (z,), derivatives of the curves by the shapes, and the amplitudes of the
        terms they belong to.
    """
    rows, count = slopes.shape
    weighted = np.zeros((rows, count))
    for i in range(rows):
        for j in range(rows):
            for k in range(count):
                weighted[i, k] += root[i, j] * slopes[j, k] * factor[k]
    size = 0
    for k in range(x.size):
        size += x[k] > 0.0
    present = np.empty((rows, size))
    at = 0
    for k in range(x.size):
        if x[k] > 0.0:
            for i in range(rows):
                present[i, at] = columns[i, k]
            at += 1
    return orthogonal_to(weighted, present)
