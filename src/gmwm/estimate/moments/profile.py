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
from gmwm.estimate.moments.design import MOST_SHAPES, Design
from gmwm.estimate.moments.profile_kernels import profiled, projected
from gmwm.estimate.moments.refinement_kernels import damped_step, refined
from gmwm.estimate.problem import Scales
from gmwm.process import GaussMarkov, Shape, WhiteNoise

_MAX_EVALUATIONS = 200
_TOLERANCES = {"xtol": 1e-7, "ftol": 1e-9, "gtol": 1e-9}


@dataclass(frozen=True, eq=False)
class Point:
    """A point of the parameter space and its weighted sum of squares.

    shapes: Of every term.
    x: (L,), free amplitudes, non-negative.
    """

    shapes: Sequence[Shape]
    x: FloatArray
    objective: float


Bounds = tuple[FloatArray, FloatArray]


class _Place(NamedTuple):
    """What is known where residuals were asked for."""

    z: FloatArray
    shapes: Sequence[Shape]
    columns: FloatArray
    x: FloatArray
    residual: FloatArray


class Profile:
    """The weighted least-squares problem of one design, one set of moments and one weight.

    target: (J,), observed wavelet variances, u^2.
    root: (J, J), l with L'L the weight matrix.
    beside: (J, k), curves of what else the series may hold, each with an amplitude of its own, at
        the end of `Point.x`.
    """

    def __init__(
        self, design: Design, target: FloatArray, root: FloatArray, beside: FloatArray | None = None
    ) -> None:
        self.design = design
        if beside is None:
            beside = np.zeros((target.size, 0))
        self.target, self.root, self._beside = (
            np.array(each, order="C") for each in (target, root, beside)
        )
        linear = np.ones(len(design.terms) + self._beside.shape[1], dtype=bool)
        linear[: len(design.terms)] = False
        linear[list(design.linear)] = True
        self._linear, self._given = np.flatnonzero(linear), np.flatnonzero(~linear)

    def _profiled(self, curves: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Weighted columns, best free amplitudes, and the weighted residuals."""
        curves = np.hstack([curves, self._beside])
        columns, x, residual = profiled(self.root, curves, self._linear, self._given, self.target)
        return columns, x, residual

    def at(self, shapes: Sequence[Shape]) -> Point:
        """The best point with these shapes."""
        _, x, residual = self._profiled(self.design.curves(shapes))
        return Point(shapes, x, float(residual @ residual))

    def refine(self, start: Point, reach: float = np.inf) -> Point:
        """Local minimum reached from ``start``, at most so far from it; never worse than it."""
        z0 = self.design.pack(start.shapes)
        if z0.size == 0:
            return self.at(start.shapes)
        if z0.size > self.target.size:
            return self.at(start.shapes)
        low, high = self.design.bounds
        bounds = np.maximum(low, z0 - reach), np.minimum(high, z0 + reach)
        point = self._compiled(z0, start, bounds) or self._stepwise(z0, start, bounds)
        return point if point.objective <= start.objective else start

    def _compiled(self, z0: FloatArray, start: Point, bounds: Bounds) -> Point | None:
        """The local minimum, if all curves are known in compiled form."""
        design = self.design
        compiled = design.compiled
        if compiled is None:
            return None
        shapes = np.zeros((len(design.shaped), MOST_SHAPES))
        for row, i in zip(shapes, design.shaped, strict=True):
            row[: len(start.shapes[i])] = start.shapes[i]
        nothing = np.zeros((self.target.size, len(design.terms)))
        fixed = np.hstack([nothing, self._beside])
        for i, term in enumerate(design.terms):
            if not term.n_shapes:
                fixed[:, i] = design.curve(i, start.shapes[i])
        weighted = (self.root, self._linear, self._given, compiled.amplitudes, self.target)
        found, z, x, objective = refined(
            z0, bounds, compiled.terms, shapes, fixed, compiled.levels, weighted,
            (*_TOLERANCES.values(), _MAX_EVALUATIONS),
        )  # fmt: skip
        return Point(design.unpack(z, start.shapes), x, objective) if found else None

    def _stepwise(self, z0: FloatArray, start: Point, bounds: Bounds) -> Point:
        """The same for curves of any process."""
        design = self.design
        low, high = bounds
        template = start.shapes
        owners = design.owners()

        visited: list[_Place] = []
        slopes: list[FloatArray] = []

        def at(z: FloatArray) -> _Place:
            # The Jacobian is asked for where the residuals were.
            if not visited or not np.array_equal(visited[-1].z, z):
                shapes = design.unpack(np.clip(z, low, high), template)
                curves = design.curves(shapes)
                visited[:] = [_Place(z.copy(), shapes, *self._profiled(curves))]
            return visited[-1]

        def residual(z: FloatArray) -> FloatArray:
            return -at(z).residual

        def jacobian(z: FloatArray) -> FloatArray:
            # The first is asked for twice.
            if not slopes or not np.array_equal(slopes[0], z):
                slopes[:] = [z.copy(), slope_at(z)]
            return slopes[1]

        def slope_at(z: FloatArray) -> FloatArray:
            _, shapes, columns, x, _ = at(z)
            slopes = design.shape_derivatives(shapes)
            factor = design.amplitudes(x[: len(design.linear)])[owners]
            return np.asarray(projected(self.root, columns, x, slopes, factor))

        found = leastsq(
            residual, z0, Dfun=jacobian, maxfev=_MAX_EVALUATIONS, full_output=True, **_TOLERANCES
        )[0]
        return self.at(design.unpack(np.clip(found, low, high), template))


def compile_search() -> None:
    """Have the loops of a search ready: where none is kept on disk, compiling them takes seconds.

    Another process does it while this one reads and examines a recording.
    """
    model, tau = WhiteNoise() + GaussMarkov(), np.array([1.0, 2.0, 4.0, 8.0])
    design = Design(model, Scales(tau, 1.0, 32))
    profile = Profile(design, np.ones(4), np.eye(4))
    profile.refine(profile.at([(), (1.0,)]))


def compile_steps() -> None:
    """Those of its loops that `compile_search` comes to last, for a process that waits for it."""
    vector, matrix = np.ones(2), np.eye(2)
    projected(matrix, matrix, vector, matrix, vector)
    damped_step(matrix, vector, vector, 1.0, 0.0, True)
