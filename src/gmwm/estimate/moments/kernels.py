"""Hot loops of a search: curves of shaped terms, their slopes, and the profiled problem.

Loops stand in place of expressions of whole arrays and of slices, which take numba seconds to
compile.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.estimate.problem.nonnegative import orthogonal_to, solve_columns
from gmwm.process import shaped_curve, shaped_slope

_STEP = 1e-5  # of central differences in z, whose natural scale is 1


class Shaped(NamedTuple):
    """The S terms of a design with free shapes.

    kinds: (S,), `Process.compiled_kind`.
    places: (S,), terms of the design.
    first: (S,), first coordinate of each.
    free: (S, 3), which shape parameters are free.
    lower, upper: (S, 3), limits of the shape parameters.
    owners: (z,), for each coordinate the place of its term's amplitude among the free ones.
    levels: As `gmwm.process.shaped_curve` takes them.
    """

    kinds: IntArray
    places: IntArray
    first: IntArray
    free: BoolArray
    lower: FloatArray
    upper: FloatArray
    owners: IntArray
    levels: Any


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


@compiled()
def _shape(z: FloatArray, s: int, terms: Shaped, shapes: FloatArray) -> FloatArray:
    """The shape of shaped term ``s`` at coordinates z of all of them."""
    shape = shapes[s].copy()
    at = terms.first[s]
    for k in range(shape.size):
        if terms.free[s, k]:
            lower, upper = terms.lower[s, k], terms.upper[s, k]
            if math.isfinite(upper) and math.isfinite(lower):
                shape[k] = lower + (upper - lower) / (1.0 + math.exp(-z[at]))
            else:
                shape[k] = lower + math.exp(z[at]) if math.isfinite(lower) else z[at]
            at += 1
    return shape


@compiled()
def _curves(
    z: FloatArray, terms: Shaped, shapes: FloatArray, fixed: FloatArray
) -> tuple[bool, FloatArray]:
    """Curves of all terms, (J, terms), and whether they are known."""
    curves = fixed.copy()
    for s in range(terms.kinds.size):
        found = shaped_curve(terms.kinds[s], _shape(z, s, terms, shapes), terms.levels)
        if found.size == 0:
            return False, curves
        for j in range(found.size):
            curves[j, terms.places[s]] = found[j]
    return True, curves


@compiled()
def _slopes(z: FloatArray, terms: Shaped, shapes: FloatArray, rows: int) -> tuple[bool, FloatArray]:
    """Derivatives of the curves by the coordinates of their own terms, (rows, z)."""
    slopes = np.empty((rows, z.size))
    moved = z.copy()
    for s in range(terms.kinds.size):
        kind = terms.kinds[s]
        closed = shaped_slope(kind, _shape(z, s, terms, shapes), terms.levels)
        if closed.size:
            for j in range(rows):
                slopes[j, terms.first[s]] = closed[j]
            continue
        own = terms.first[s] - 1
        for k in range(terms.free.shape[1]):
            if not terms.free[s, k]:
                continue
            own += 1
            moved[own] = z[own] + _STEP
            above = shaped_curve(kind, _shape(moved, s, terms, shapes), terms.levels)
            moved[own] = z[own] - _STEP
            below = shaped_curve(kind, _shape(moved, s, terms, shapes), terms.levels)
            moved[own] = z[own]
            if above.size == 0 or below.size == 0:
                return False, slopes
            for j in range(rows):
                slopes[j, own] = (above[j] - below[j]) / (2.0 * _STEP)
    return True, slopes


@compiled()
def linearized(
    z: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
    problem: Weighted,
    terms: Shaped,
    shapes: FloatArray,
    fixed: FloatArray,
) -> tuple[bool, FloatArray, FloatArray, FloatArray]:
    """Free amplitudes, weighted residuals and their Jacobian (J, z) at coordinates z.

    bounds: Lowest and highest coordinates, between which z is brought.
    shapes: (S, 3), shapes of the shaped terms; only the fixed parameters count.
    fixed: (J, terms), curves of the other terms.
    Returns: first of all whether the curves are known in compiled form.
    """
    z = z.copy()
    for k in range(z.size):
        z[k] = min(max(z[k], bounds[0][k]), bounds[1][k])
    is_known, curves = _curves(z, terms, shapes, fixed)
    if is_known:
        is_known, slopes = _slopes(z, terms, shapes, fixed.shape[0])
    if not is_known:
        return False, z[:0], z[:0], fixed
    columns, x, residual = profiled(problem, curves)
    factor = np.empty(z.size)
    for k in range(z.size):
        factor[k] = x[terms.owners[k]]
    return True, x, residual, projected(problem.root, columns, x, slopes, factor)
