"""Hot loops of a fit: the profiled problem, and the search for its shapes.

The search is Levenberg's and Marquardt's method with a region of trust, as Moré (1978, *Numerical
Analysis*, Lecture Notes in Mathematics 630, 105-116) has it and MINPACK's ``lmder`` does it. A step
takes some 20 microseconds, a tenth of what Python would take. Loops stand in place of expressions
of whole arrays and of slices, which take numba seconds to compile.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.estimate.problem import orthogonal_to, solve_columns
from gmwm.process import shaped_curve, shaped_slope

_STEP = 1e-5  # of central differences in z, whose natural scale is 1
_FACTOR = 100.0  # of the first region, which is that of the first step in the end
_NEAR = 0.1  # of its radius: how closely a step keeps to it
_TINY = np.finfo(np.float64).tiny

XTOL, FTOL, GTOL = 1e-7, 1e-9, 1e-9
"""Tolerances at which a search ends, as of MINPACK."""

Bounds = tuple[FloatArray, FloatArray]


class Shaped(NamedTuple):
    """The S terms of a design with free shapes.

    kinds: (S,), `Process.compiled_kind`.
    places: (S,), terms of the design.
    first: (S,), first coordinate of each.
    free: (S, 3), which shape parameters are free.
    lower, upper: (S, 3), limits of the shape parameters.
    """

    kinds: IntArray
    places: IntArray
    first: IntArray
    free: BoolArray
    lower: FloatArray
    upper: FloatArray


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


class Curves(NamedTuple):
    """The curves of a design, as functions of the free shapes.

    shapes: (S, 3), shapes of the shaped terms, of which the fixed parameters count.
    fixed: (J, terms), curves of the other terms.
    levels: As `gmwm.process.shaped_curve` takes them.
    owners: (z,), for each coordinate the place of its term's amplitude among the free ones.
    """

    shapes: FloatArray
    fixed: FloatArray
    levels: Any
    owners: IntArray


@compiled()
def profiled(problem: Weighted, curves: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Weighted columns of free amplitude, the best amplitudes, and the weighted residuals.

    curves: (J, terms).
    """
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
        if x[k] > 0.0:
            size += 1
    present = np.empty((rows, size))
    at = 0
    for k in range(x.size):
        if x[k] > 0.0:
            for i in range(rows):
                present[i, at] = columns[i, k]
            at += 1
    return orthogonal_to(weighted, present)


@compiled()
def _value(z: float, lower: float, upper: float) -> float:
    """A shape parameter at a coordinate on the real line."""
    if math.isfinite(upper) and math.isfinite(lower):
        return lower + (upper - lower) / (1.0 + math.exp(-z))
    return lower + math.exp(z) if math.isfinite(lower) else z


@compiled()
def _shape(z: FloatArray, s: int, terms: Shaped, shapes: FloatArray) -> FloatArray:
    """The shape of shaped term ``s`` at coordinates z of all of them."""
    shape = shapes[s].copy()
    at = terms.first[s]
    for k in range(shape.size):
        if terms.free[s, k]:
            shape[k] = _value(z[at], terms.lower[s, k], terms.upper[s, k])
            at += 1
    return shape


@compiled()
def _curves(z: FloatArray, terms: Shaped, at: Curves) -> tuple[bool, FloatArray]:
    """Curves of all terms, and whether they are known."""
    curves = at.fixed.copy()
    for s in range(terms.kinds.size):
        found = shaped_curve(terms.kinds[s], _shape(z, s, terms, at.shapes), at.levels)
        if found.size == 0:
            return False, curves
        for j in range(found.size):
            curves[j, terms.places[s]] = found[j]
    return True, curves


@compiled()
def _slopes(z: FloatArray, terms: Shaped, curves: Curves) -> tuple[bool, FloatArray]:
    """Derivatives of the curves by the coordinates of their own terms, (J, z)."""
    rows, shapes, levels = curves.fixed.shape[0], curves.shapes, curves.levels
    slopes = np.empty((rows, z.size))
    moved = z.copy()
    for s in range(terms.kinds.size):
        kind = terms.kinds[s]
        closed = shaped_slope(kind, _shape(z, s, terms, shapes), levels)
        if closed.size:
            for j in range(rows):
                slopes[j, terms.first[s]] = closed[j]
            continue
        at = terms.first[s] - 1
        for k in range(terms.free.shape[1]):
            if not terms.free[s, k]:
                continue
            at += 1
            moved[at] = z[at] + _STEP
            above = shaped_curve(kind, _shape(moved, s, terms, shapes), levels)
            moved[at] = z[at] - _STEP
            below = shaped_curve(kind, _shape(moved, s, terms, shapes), levels)
            moved[at] = z[at]
            if above.size == 0 or below.size == 0:
                return False, slopes
            for j in range(rows):
                slopes[j, at] = (above[j] - below[j]) / (2.0 * _STEP)
    return True, slopes


@compiled()
def _triangular(matrix: FloatArray, right: FloatArray) -> tuple[FloatArray, FloatArray]:
    """R and Q'b of A = QR, by Householder's reflections."""
    a, b = matrix.copy(), right.copy()
    rows, count = a.shape
    for k in range(count):
        norm = 0.0
        for i in range(k, rows):
            norm += a[i, k] ** 2
        norm = math.sqrt(norm)
        if norm == 0.0:
            continue
        if a[k, k] > 0.0:
            norm = -norm
        # The reflection's vector is in the column, its square is 2 * scale.
        a[k, k] -= norm
        scale = -norm * a[k, k]
        for j in range(k + 1, count):
            product = 0.0
            for i in range(k, rows):
                product += a[i, k] * a[i, j]
            product /= scale
            for i in range(k, rows):
                a[i, j] -= product * a[i, k]
        product = 0.0
        for i in range(k, rows):
            product += a[i, k] * b[i]
        product /= scale
        for i in range(k, rows):
            b[i] -= product * a[i, k]
        a[k, k] = norm
    r = np.zeros((count, count))
    for k in range(count):
        for j in range(k, count):
            r[k, j] = a[k, j]
    return r, b[:count]


@compiled()
def _back(r: FloatArray, b: FloatArray) -> FloatArray:
    """R^-1 b; zero from the first zero of the diagonal on."""
    size = b.size
    for k in range(b.size - 1, -1, -1):
        if r[k, k] == 0.0:
            size = k
    x = np.zeros(b.size)
    for k in range(size - 1, -1, -1):
        x[k] = b[k]
        for j in range(k + 1, size):
            x[k] -= r[k, j] * x[j]
        x[k] /= r[k, k]
    return x


@compiled()
def _forward(r: FloatArray, scale: FloatArray, step: FloatArray, length: float) -> FloatArray:
    """R'^-1 D^2 x / |D x|."""
    x = np.zeros(step.size)
    for k in range(step.size):
        x[k] = scale[k] * (scale[k] * step[k]) / length
        for j in range(k):
            x[k] -= r[j, k] * x[j]
        x[k] /= r[k, k]
    return x


@compiled()
def _norm(x: FloatArray) -> float:
    total = 0.0
    for value in x:
        total += value * value
    return math.sqrt(total)


@compiled()
def _length(scale: FloatArray, x: FloatArray) -> float:
    total = 0.0
    for k in range(x.size):
        total += (scale[k] * x[k]) * (scale[k] * x[k])
    return math.sqrt(total)


@compiled()
def _moved_by(r: FloatArray, x: FloatArray) -> float:
    """|R x|."""
    total = 0.0
    for k in range(x.size):
        row = 0.0
        for j in range(k, x.size):
            row += r[k, j] * x[j]
        total += row * row
    return math.sqrt(total)


@compiled()
def _inside(z: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    found = z.copy()
    for k in range(z.size):
        found[k] = min(max(z[k], low[k]), high[k])
    return found


@compiled()
def damped_step(
    r: FloatArray, b: FloatArray, scale: FloatArray, radius: float, damping: float, is_full: bool
) -> tuple[FloatArray, float]:
    """The step of least squares within a radius, and the damping that keeps it there (Moré)."""
    count = b.size
    x = _back(r, b)
    length = _length(scale, x)
    beyond = length - radius
    if beyond <= _NEAR * radius:
        return x, 0.0
    least = 0.0
    if is_full:
        for k in range(count):
            if r[k, k] == 0.0:
                is_full = False
    if is_full:
        least = beyond / radius / _norm(_forward(r, scale, x, length)) ** 2
    gradient = np.zeros(count)
    for k in range(count):
        for j in range(k + 1):
            gradient[k] += r[j, k] * b[j]
        gradient[k] /= scale[k]
    steepest = _norm(gradient)
    most = steepest / radius
    if most == 0.0:
        most = _TINY / min(radius, _NEAR)
    damping = min(max(damping, least), most)
    if damping == 0.0:
        damping = steepest / length
    stacked, right = np.zeros((2 * count, count)), np.zeros(2 * count)
    for rounds in range(10):
        if damping == 0.0:
            damping = max(_TINY, 0.001 * most)
        for k in range(count):
            right[k] = b[k]
            for j in range(count):
                stacked[k, j] = r[k, j]
            stacked[count + k, k] = math.sqrt(damping) * scale[k]
        s, c = _triangular(stacked, right)
        x = _back(s, c)
        length = _length(scale, x)
        before, beyond = beyond, length - radius
        if abs(beyond) <= _NEAR * radius or rounds == 9:
            break
        if least == 0.0 and beyond <= before and before < 0.0:
            break
        correction = beyond / radius / _norm(_forward(s, scale, x, length)) ** 2
        if beyond > 0.0:
            least = max(least, damping)
        elif beyond < 0.0:
            most = min(most, damping)
        damping = max(least, damping + correction)
    return x, damping


@compiled()
def refined(
    z: FloatArray, bounds: Bounds, terms: Shaped, curves: Curves, problem: Weighted, most: int
) -> tuple[bool, FloatArray, FloatArray, float]:
    """Local minimum of the profiled problem.

    z: (z,), coordinates of the free shapes to start from.
    bounds: Lowest and highest coordinates.
    most: Largest number of evaluations of the curves.
    Returns: found, false where a curve is not known in compiled form; z, x, coordinates, within the
        bounds, and free amplitudes; objective.
    """
    low, high = bounds
    rows, count = problem.target.size, z.size
    z = z.copy()
    nothing = np.zeros(0)
    known, matrix = _curves(_inside(z, low, high), terms, curves)
    if not known:
        return False, z, nothing, 0.0
    columns, x, residual = profiled(problem, matrix)
    norm = _norm(residual)
    damping, radius, length, evaluations = 0.0, 0.0, 0.0, 1
    scale = np.zeros(count)
    is_first, is_over = True, False
    while not is_over:
        inside = _inside(z, low, high)
        known, slopes = _slopes(inside, terms, curves)
        if not known:
            return False, z, nothing, 0.0
        lengths, along, factor = np.zeros(count), np.zeros(count), np.zeros(count)
        for k in range(count):
            factor[k] = x[curves.owners[k]]
        jacobian = projected(problem.root, columns, x, slopes, factor)
        for k in range(count):
            for j in range(rows):
                lengths[k] += jacobian[j, k] * jacobian[j, k]
                along[k] += jacobian[j, k] * residual[j]
            lengths[k] = math.sqrt(lengths[k])
        if is_first:
            for k in range(count):
                scale[k] = lengths[k] if lengths[k] > 0.0 else 1.0
            length = _length(scale, z)
            radius = _FACTOR * length if length > 0.0 else _FACTOR
        steepest = 0.0
        if norm > 0.0:
            for k in range(count):
                if lengths[k] > 0.0:
                    steepest = max(steepest, abs(along[k]) / (norm * lengths[k]))
        if steepest <= GTOL:
            break
        # Coordinates that change nothing stay where they are.
        size = 0
        for k in range(count):
            scale[k] = max(scale[k], lengths[k])
            size += lengths[k] > 0.0
        is_full = size == count
        active, own, moving = np.zeros(size, np.int64), np.zeros(size), np.zeros((rows, size))
        at = 0
        for k in range(count):
            if lengths[k] > 0.0:
                active[at], own[at] = k, scale[k]
                for j in range(rows):
                    moving[j, at] = jacobian[j, k]
                at += 1
        r, b = _triangular(moving, residual)
        while True:
            step, damping = damped_step(r, b, own, radius, damping, is_full)
            moved = z.copy()
            for k in range(active.size):
                moved[active[k]] += step[k]
            step_length = _length(own, step)
            if is_first:
                radius = min(radius, step_length)
            inside = _inside(moved, low, high)
            known, matrix = _curves(inside, terms, curves)
            if not known:
                return False, z, nothing, 0.0
            new_columns, new_x, new_residual = profiled(problem, matrix)
            evaluations += 1
            new_norm = _norm(new_residual)
            gained = 1.0 - (new_norm / norm) ** 2 if _NEAR * new_norm < norm else -1.0
            straight, damped = _moved_by(r, step) / norm, math.sqrt(damping) * step_length / norm
            expected = straight**2 + 2.0 * damped**2
            slope = -(straight**2 + damped**2)
            ratio = gained / expected if expected != 0.0 else 0.0
            if ratio <= 0.25:
                part = 0.5 if gained >= 0.0 else 0.5 * slope / (slope + 0.5 * gained)
                if _NEAR * new_norm >= norm or part < 0.1:
                    part = 0.1
                radius = part * min(radius, step_length / 0.1)
                damping /= part
            elif damping == 0.0 or ratio >= 0.75:
                radius = step_length / 0.5
                damping *= 0.5
            if ratio >= 1e-4:
                z, columns, x, residual, norm = moved, new_columns, new_x, new_residual, new_norm
                length = _length(scale, z)
                is_first = False
            is_small = max(abs(gained), expected) <= FTOL and 0.5 * ratio <= 1.0
            is_over = is_small or radius <= XTOL * length or norm == 0.0
            is_over = is_over or evaluations >= most
            if is_over or ratio >= 1e-4:
                break
    return True, _inside(z, low, high), x, norm**2
