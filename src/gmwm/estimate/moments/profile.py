"""Weighted least squares for fixed weights: amplitudes profiled out, shapes by Gauss-Newton.

For given shapes the amplitudes solve a non-negative least-squares problem (Lawson & Hanson 1974).
What is left to search has one or two dimensions per term; its Jacobian is that of variable
projection in Kaufman's form (Golub & Pereyra 2003, *Inverse Problems* 19, R1-R26).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import leastsq

from gmwm._core.typing import FloatArray
from gmwm.estimate.moments.design import Design
from gmwm.estimate.problem import solve_nonnegative
from gmwm.process import Shape

_MAX_EVALUATIONS = 200


@dataclass(frozen=True, eq=False)
class Point:
    """A point of the parameter space and its weighted sum of squares.

    Attributes
    ----------
    shapes : list of Shape
        Of every term.
    x : (L,) ndarray
        Free amplitudes, non-negative.
    objective : float
    """

    shapes: Sequence[Shape]
    x: FloatArray
    objective: float


class _Place(NamedTuple):
    """What is known where residuals were asked for."""

    z: FloatArray
    shapes: Sequence[Shape]
    curves: FloatArray
    x: FloatArray
    residual: FloatArray


class Profile:
    """The weighted least-squares problem of one design, one set of moments and one weight.

    Parameters
    ----------
    design : Design
    target : (J,) ndarray
        Observed wavelet variances, u^2.
    root : (J, J) ndarray
        L with L'L the weight matrix.
    """

    def __init__(self, design: Design, target: FloatArray, root: FloatArray) -> None:
        self.design, self.target, self.root = design, target, root

    def amplitudes(self, curves: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Best free amplitudes for the curves of all terms, and the weighted residuals."""
        linear = list(self.design.linear)
        given = [i for i in range(curves.shape[1]) if i not in linear]
        y = self.root @ (self.target - curves[:, given].sum(axis=1))
        return solve_nonnegative(self.root @ curves[:, linear], y)

    def at(self, shapes: Sequence[Shape]) -> Point:
        """The best point with these shapes."""
        x, residual = self.amplitudes(self.design.curves(shapes))
        return Point(shapes, x, float(residual @ residual))

    def refine(self, start: Point) -> Point:
        """Local minimum reached from ``start``; never worse than it."""
        design = self.design
        z0 = design.pack(start.shapes)
        if z0.size == 0:
            return self.at(start.shapes)
        low, high = design.bounds
        template = start.shapes
        owners = design.owners()

        visited: list[_Place] = []
        slopes: list[FloatArray] = []

        def at(z: FloatArray) -> _Place:
            # The Jacobian is asked for where the residuals were.
            if not visited or not np.array_equal(visited[-1].z, z):
                shapes = design.unpack(np.clip(z, low, high), template)
                curves = design.curves(shapes)
                visited[:] = [_Place(z.copy(), shapes, curves, *self.amplitudes(curves))]
            return visited[-1]

        def residual(z: FloatArray) -> FloatArray:
            return -at(z).residual

        def jacobian(z: FloatArray) -> FloatArray:
            # The first is asked for twice.
            if not slopes or not np.array_equal(slopes[0], z):
                slopes[:] = [z.copy(), slope_at(z)]
            return slopes[1]

        def slope_at(z: FloatArray) -> FloatArray:
            _, shapes, curves, x, _ = at(z)
            weighted = self.root @ curves[:, list(design.linear)][:, x > 0.0]
            slope = self.root @ design.shape_derivatives(shapes)
            slope *= design.amplitudes(x)[owners]
            if weighted.shape[1]:
                basis, _ = np.linalg.qr(weighted)
                slope = slope - basis @ (basis.T @ slope)
            return slope

        if z0.size > self.target.size:
            return self.at(start.shapes)
        found = leastsq(
            residual, z0, Dfun=jacobian, xtol=1e-7, ftol=1e-9, gtol=1e-9,
            maxfev=_MAX_EVALUATIONS, full_output=True,
        )[0]  # fmt: skip
        point = self.at(design.unpack(np.clip(found, low, high), template))
        return point if point.objective <= start.objective else start
