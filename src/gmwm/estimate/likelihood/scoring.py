"""Maximisation of a log-likelihood that is known to be near its maximum.

Quasi-Newton steps (Broyden, Fletcher, Goldfarb and Shanno's updates) that start from the expected
information: the first is a step of Fisher scoring (Osborne 1992, *International Statistical
Review* 60, 99-117). Differences are taken in steps of the parameters' own standard errors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gmwm._core.typing import FloatArray

Objective = Callable[[FloatArray], float]

_GRADIENT_STEP = 0.02  # standard errors
_HESSIAN_STEP = 0.1
_LARGEST_STEP = 1.0  # in z: a factor e of an amplitude or a time
_LEAST = 1e-8  # information: of less, the deviation would be 10^4 factors of e
_HALVINGS = 12


@dataclass(frozen=True, eq=False)
class Maximum:
    """Where a log-likelihood is largest.

    z: (d,).
    """

    z: FloatArray
    value: float
    converged: bool


def maximise(
    objective: Objective,
    start: FloatArray,
    information: FloatArray,
    *,
    close: float = 1e-6,
    max_steps: int = 60,
) -> Maximum:
    """Maximum reached from ``start``, near which the information matrix is ``information``.

    ``close`` is twice the gain in log-likelihood that is not worth another step.
    """
    z = start.copy()
    value = objective(z)
    if z.size == 0:
        return Maximum(z, value, True)
    scale = deviations(information)
    inverse = regular_inverse(information)
    slope = gradient(objective, z, scale)
    for _ in range(max_steps):
        step = inverse @ slope
        promised = float(slope @ step)
        if promised < close:
            return Maximum(z, value, True)
        step /= max(float(np.max(np.abs(step))) / _LARGEST_STEP, 1.0)
        for _ in range(_HALVINGS):
            moved, there = z + step, objective(z + step)
            if np.isfinite(there) and there > value:
                break
            step = 0.5 * step
        else:
            # Rounding errors of the objective are all that is left, or the matrix is bad.
            if promised < 100.0 * close:
                return Maximum(z, value, True)
            if np.array_equal(inverse, np.diag(scale**2)):
                return Maximum(z, value, False)
            inverse = np.diag(scale**2)
            continue
        value, previous = there, slope
        slope = gradient(objective, moved, scale)
        inverse = _updated(inverse, moved - z, previous - slope)
        z = moved
    return Maximum(z, value, False)


def observed_information(
    objective: Objective, z: FloatArray, information: FloatArray
) -> FloatArray:
    """Minus the matrix of second derivatives, in steps of ``information``'s standard errors.

    Zero where the objective is not finite all around ``z``.
    """
    d = z.size
    scale = _HESSIAN_STEP * np.minimum(deviations(information), 1.0)
    centre = objective(z)
    steps = np.diag(scale)
    ends = np.array([[objective(z + sign * steps[i]) for sign in (1.0, -1.0)] for i in range(d)])
    if not np.all(np.isfinite(ends)):
        return np.zeros((d, d))
    matrix = np.empty((d, d))
    for i in range(d):
        matrix[i, i] = 2.0 * centre - ends[i].sum()
        for j in range(i):
            corners = objective(z + steps[i] + steps[j]) + objective(z - steps[i] - steps[j])
            mixed = corners + 2.0 * centre - ends[i].sum() - ends[j].sum()
            matrix[i, j] = matrix[j, i] = -0.5 * mixed
    if not np.all(np.isfinite(matrix)):
        return np.zeros((d, d))
    return matrix / np.outer(scale, scale)


def regular_inverse(information: FloatArray) -> FloatArray:
    """Inverse on unit diagonal, with directions of no information held to a small one."""
    scale = deviations(information)
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    values = np.maximum(values, 1e-8 * np.max(values, initial=1.0))
    return np.asarray((vectors / values) @ vectors.T * np.outer(scale, scale))


def deviations(information: FloatArray) -> FloatArray:
    """Standard errors of the parameters one by one, finite where there is no information."""
    return np.asarray(1.0 / np.sqrt(np.maximum(np.abs(np.diag(information)), _LEAST)))


def gradient(objective: Objective, z: FloatArray, scale: FloatArray) -> FloatArray:
    """Central differences in steps that are small against ``scale`` (d,)."""
    result = np.empty(z.size)
    for i in range(z.size):
        step = np.zeros(z.size)
        step[i] = _GRADIENT_STEP * min(scale[i], 1.0)
        result[i] = (objective(z + step) - objective(z - step)) / (2.0 * step[i])
    return result


def _updated(inverse: FloatArray, moved: FloatArray, change: FloatArray) -> FloatArray:
    """The BFGS update of an inverse information matrix."""
    curvature = float(moved @ change)
    if curvature <= 1e-12 * float(np.linalg.norm(moved) * np.linalg.norm(change)):
        return inverse
    left = np.eye(moved.size) - np.outer(moved, change) / curvature
    return np.asarray(left @ inverse @ left.T + np.outer(moved, moved) / curvature)
