"""The search for shapes, compiled: least squares of the profiled problem by damped Gauss-Newton.

Levenberg's and Marquardt's method with a region of trust, as Moré (1978, *Numerical Analysis*,
Lecture Notes in Mathematics 630, 105-116) has it and MINPACK's ``lmder`` does it. A step takes some
20 microseconds, of which Python would make a fifth of a millisecond. Loops stand in place of
expressions of whole arrays and of slices, which take numba seconds to compile.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.estimate.moments.profile_kernels import profiled, projected
from gmwm.process import shaped_curve, shaped_slope

_STEP = 1e-5  # of central differences in z, whose natural scale is 1
_FACTOR = 100.0  # of the first region, which is that of the first step in the end
_NEAR = 0.1  # of its radius: how closely a step keeps to it
_TINY = np.finfo(np.float64).tiny


@compiled()
def _value(z: float, lower: float, upper: float) -> float:
    """A shape parameter at a coordinate on the real line."""
    if math.isfinite(upper) and math.isfinite(lower):
        return lower + (upper - lower) / (1.0 + math.exp(-z))
    return lower + math.exp(z) if math.isfinite(lower) else z


@compiled()
def _shape(z: FloatArray, s: int, terms: Any, shapes: FloatArray) -> FloatArray:
    """The shape of shaped term ``s`` at coordinates z of all of them."""
    _, _, first, free, lower, upper = terms
    shape = shapes[s].copy()
    at = first[s]
    for k in range(shape.size):
        if free[s, k]:
            shape[k] = _value(z[at], lower[s, k], upper[s, k])
            at += 1
    return shape


@compiled()
def _curves(
    z: FloatArray, terms: Any, shapes: FloatArray, fixed: FloatArray, levels: Any
) -> tuple[bool, FloatArray]:
    """Curves of all terms, and whether they are known."""
    kinds, places = terms[0], terms[1]
    curves = fixed.copy()
    for s in range(kinds.size):
        found = shaped_curve(kinds[s], _shape(z, s, terms, shapes), levels)
        if found.size == 0:
            return False, curves
        for j in range(found.size):
            curves[j, places[s]] = found[j]
    return True, curves


@compiled()
def _slopes(
    z: FloatArray, terms: Any, shapes: FloatArray, rows: int, levels: Any
) -> tuple[bool, FloatArray]:
    """Derivatives of the curves by the coordinates of their own terms, (J, z)."""
    kinds, _, first, free, _, _ = terms
    slopes = np.empty((rows, z.size))
    moved = z.copy()
    for s in range(kinds.size):
        closed = shaped_slope(kinds[s], _shape(z, s, terms, shapes), levels)
        if closed.size:
            for j in range(rows):
                slopes[j, first[s]] = closed[j]
            continue
        at = first[s] - 1
        for k in range(free.shape[1]):
            if not free[s, k]:
                continue
            at += 1
            moved[at] = z[at] + _STEP
            above = shaped_curve(kinds[s], _shape(moved, s, terms, shapes), levels)
            moved[at] = z[at] - _STEP
            below = shaped_curve(kinds[s], _shape(moved, s, terms, shapes), levels)
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
    z: FloatArray, bounds: Any, terms: Any, shapes: FloatArray, fixed: FloatArray, levels: Any,
    weighted: Any, tolerances: Any,
) -> tuple[bool, FloatArray, FloatArray, float]:  # fmt: skip
    """Local minimum of the profiled problem.

    z: (z,), coordinates of the free shapes to start from.
    bounds: (low, high), how far each may go.
    terms: Of the S shaped terms: kinds, columns, first coordinates; (S, 3): which shape parameters
        are free, their lower and upper limits.
    shapes: (S, 3), their shapes, of which the fixed ones count.
    fixed: (J, terms), curves of the other terms.
    levels: As `gmwm.process.shaped_curve` has them.
    weighted: (root, linear, given, owners, target), as `profiled` has them; for each coordinate,
        the place of its term's amplitude in x.
    tolerances: (xtol, ftol, gtol, evaluations), as of MINPACK.
    Returns: found, false where a curve is not known in compiled form; z, x, coordinates, within the
        bounds, and free amplitudes; objective.
    """
    low, high = bounds
    root, linear, given, owners, target = weighted
    xtol, ftol, gtol, most = tolerances
    rows, count = target.size, z.size
    z = z.copy()
    nothing = np.zeros(0)
    known, curves = _curves(_inside(z, low, high), terms, shapes, fixed, levels)
    if not known:
        return False, z, nothing, 0.0
    columns, x, residual = profiled(root, curves, linear, given, target)
    norm = _norm(residual)
    damping, radius, length, evaluations = 0.0, 0.0, 0.0, 1
    scale = np.zeros(count)
    is_first, is_over = True, False
    while not is_over:
        inside = _inside(z, low, high)
        known, slopes = _slopes(inside, terms, shapes, rows, levels)
        if not known:
            return False, z, nothing, 0.0
        lengths, along, factor = np.zeros(count), np.zeros(count), np.zeros(count)
        for k in range(count):
            factor[k] = x[owners[k]]
        jacobian = projected(root, columns, x, slopes, factor)
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
        if steepest <= gtol:
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
            known, curves = _curves(inside, terms, shapes, fixed, levels)
            if not known:
                return False, z, nothing, 0.0
            new_columns, new_x, new_residual = profiled(root, curves, linear, given, target)
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
            is_small = abs(gained) <= ftol and expected <= ftol and 0.5 * ratio <= 1.0
            is_over = is_small or radius <= xtol * length or evaluations >= most or norm == 0.0
            if is_over or ratio >= 1e-4:
                break
    return True, _inside(z, low, high), x, norm**2
