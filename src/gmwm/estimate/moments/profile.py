"""Weighted least squares for fixed weights: amplitudes profiled out, shapes by Gauss-Newton.

For given shapes the amplitudes solve a non-negative least-squares problem (Lawson & Hanson 1974).
One or two dimensions per term are left to search; the Jacobian is that of variable projection in
Kaufman's form (Golub & Pereyra 2003, *Inverse Problems* 19, R1-R26).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from scipy.optimize import leastsq

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.moments.design import Design
from gmwm.estimate.problem.nonnegative import (
    objectives_with,
    orthogonal_to,
    solve_nonnegative,
)
from gmwm.process import Model, Process, Shape

_MOST = 200  # evaluations of a search
_LARGEST = 300.0  # logarithm of an amplitude, beyond which its square overflows
_XTOL, _FTOL, _GTOL = 1e-7, 1e-9, 1e-9  # tolerances at which MINPACK ends it


@dataclass(frozen=True, eq=False)
class Point:
    """A point of the parameter space and its weighted sum of squares.

    x: (L,), free amplitudes, non-negative.
    """

    shapes: Sequence[Shape]
    x: FloatArray
    objective: float


class Profile:
    """The weighted least-squares problem of one design, one set of moments and one weight.

    target: (J,), observed wavelet variances, u^2.
    root: (J, J), L with L'L the weight matrix.
    beside: (J, k), further curves that the series may hold, each with an amplitude of its own, at
        the end of `Point.x`.
    lost: (J, terms), what the target lacks of each curve because a slope was removed from the data.
    """

    def __init__(
        self,
        design: Design,
        target: FloatArray,
        root: FloatArray,
        beside: FloatArray | None = None,
        lost: FloatArray | None = None,
    ) -> None:
        self.design, self.target, self.root, self._lost = design, target, root, lost
        self._beside = None if beside is None else root @ beside
        self._y = root @ target
        self._given = [i for i, term in enumerate(design.terms) if not term.free_scale]

    def at(self, shapes: Sequence[Shape]) -> Point:
        """The best point with these shapes."""
        _, x, residual = self._profiled(shapes)
        return Point(shapes, x, float(residual @ residual))

    def _profiled(self, shapes: Sequence[Shape]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Weighted columns of free amplitude, the best amplitudes, and the weighted residuals."""
        curves = self.design.curves(shapes)
        if self._lost is not None:
            curves -= self._lost
        weighted = self.root @ curves
        columns, y = weighted, self._y
        if self._given:
            columns = weighted[:, list(self.design.linear)]
            y = y - np.sum(weighted[:, self._given], axis=1)
        if self._beside is not None:
            columns = np.hstack([columns, self._beside])
        return columns, *solve_nonnegative(columns, y)

    def refine(self, start: Point, reach: float = np.inf) -> Point:
        """Local minimum reached from ``start``, at most so far from it; never worse than it."""
        design, shapes = self.design, start.shapes
        z0 = design.pack(shapes)
        if z0.size == 0 or z0.size > self.target.size:
            return self.at(shapes)
        low, high = design.bounds
        low, high = np.maximum(low, z0 - reach), np.minimum(high, z0 + reach)
        visited: dict[bytes, tuple[Sequence[Shape], FloatArray, FloatArray, FloatArray]] = {}

        def at(z: FloatArray) -> tuple[Sequence[Shape], FloatArray, FloatArray, FloatArray]:
            """Shapes, and what is `_profiled` there; MINPACK asks for a point repeatedly."""
            if z.tobytes() not in visited:
                visited.clear()
                moved = design.unpack(np.minimum(np.maximum(z, low), high), shapes)
                visited[z.tobytes()] = moved, *self._profiled(moved)
            return visited[z.tobytes()]

        def jacobian(z: FloatArray) -> FloatArray:
            moved, columns, x, _ = at(z)
            factor = design.amplitudes(x[: len(design.linear)])[design.owners]
            slopes = self.root @ (design.shape_derivatives(moved) * factor)
            return orthogonal_to(slopes, columns[:, x > 0.0])

        tolerances = {"xtol": _XTOL, "ftol": _FTOL, "gtol": _GTOL}
        z = leastsq(
            lambda z: -at(z)[-1], z0, Dfun=jacobian, maxfev=_MOST, full_output=True, **tolerances
        )[0]
        moved, _, x, residual = at(z)
        point = Point(moved, x, float(residual @ residual))
        return point if point.objective <= start.objective else start

    def descend(self, processes: Sequence[Process]) -> Point:
        """Local minimum over all parameters at once, amplitudes included, from any values.

        Nothing is profiled out: Levenberg-Marquardt steps in logarithms, as a user of eq. (9) of
        Stebler et al. (2012) would take them from starting values.
        """
        design, coordinates = self.design, self.design.coordinates
        z0, own = coordinates.pack(processes), [process.shape_values for process in processes]
        if not np.all(np.isfinite(z0)):
            raise InputError(f"start = {list(processes)!r}: give every parameter a positive value")
        linear = np.array([is_amplitude for _, is_amplitude in coordinates.owners])

        def shapes(z: FloatArray) -> list[Shape]:
            return design.unpack(np.clip(z[~linear], *design.bounds), own)

        def residuals(z: FloatArray) -> FloatArray:
            amplitudes = np.exp(np.minimum(z[linear], _LARGEST))
            left = self.target - design.implied(amplitudes, shapes(z))
            return np.asarray(self.root @ left)

        if z0.size > self.target.size:
            return self.at(own)
        z = leastsq(residuals, z0, maxfev=_MOST * z0.size, full_output=True)[0]
        return self.refine(self.at(shapes(z)))


def search(profile: Profile, known: Sequence[Shape | None] | None = None) -> Point:
    """Global minimum for fixed weights, by adding terms one at a time and exchanging them.

    Each term with free shapes is first placed where on its grid it lowers the objective most, then
    all shapes are refined together. A term with many shapes is refined from several such places,
    and from the fit of the processes that it nests. At the end each term in turn is taken out and
    placed anew. A model that extends another one is never worse if started from that one's shapes.

    known: Shapes to start with, ``None`` for the terms still to be placed.
    """
    design = profile.design
    shapes: list[Shape | None] = (
        list(known)
        if known is not None
        else [None if term.n_shapes else term.process.shape_values for term in design.terms]
    )
    missing = [i for i in design.shaped if shapes[i] is None]
    point = _present(profile, shapes)
    for i in missing:
        found = None
        for start in _starts(profile, point.shapes, i):
            refined = _refine_present(profile, start)
            found = min(found or refined, refined, key=lambda p: p.objective)
            if found.objective < profile.target.size:
                break  # within chance
        point = found or point
    if len(design.shaped) < 2:
        return point
    for _ in range(tuning.EXCHANGES):
        before = point.objective
        for i in design.shaped:
            shapes = list(point.shapes)
            shapes[i] = None
            (moved,) = _places(profile, shapes, i, 1)
            if moved.objective < point.objective * (1.0 + tuning.IMPROVEMENT):
                moved = _refine_present(profile, moved)
                point = min(point, moved, key=lambda p: p.objective)
        if point.objective > before * (1.0 - tuning.IMPROVEMENT):
            break
    return point


def _starts(profile: Profile, shapes: Sequence[Shape | None], i: int) -> Iterator[Point]:
    """Points from which term ``i`` is refined beside the terms placed."""
    term = profile.design.terms[i]
    if term.process.nested and np.all(term.free_shape):
        yield _at_nested(profile, shapes, i)
    many = term.n_shapes >= tuning.MANY_SHAPES
    yield from _places(profile, shapes, i, tuning.STARTS if many else 1)


def _at_nested(profile: Profile, shapes: Sequence[Shape | None], i: int) -> Point:
    """Term ``i`` at the sum of the processes that it nests, fitted beside the terms placed."""
    terms, scales = profile.design.terms, profile.design.scales
    nested = terms[i].process.nested
    others = (term.process for term, shape in zip(terms, shapes, strict=True) if shape is not None)
    design = Design(Model((*others, *nested)), scales)
    found = search(Profile(design, profile.target, profile.root))
    fitted = zip(design.terms, design.fitted_processes(found.x, found.shapes), strict=True)
    parts = [at for term, at in fitted if any(term.process is each for each in nested)]
    filled = list(shapes)
    filled[i] = terms[i].process.shape_of_sum(parts, scales.dt)
    return _present(profile, filled)


def _columns(profile: Profile, shapes: Sequence[Shape | None]) -> tuple[FloatArray, FloatArray]:
    """Weighted columns of the placed terms of free amplitude, and the weighted target."""
    design = profile.design
    target = profile.target.copy()
    columns = []
    for i, shape in enumerate(shapes):
        if shape is None:
            continue
        curve = design.curve(i, shape)
        if i in design.linear:
            columns.append(profile.root @ curve)
        else:
            target -= curve
    matrix = np.stack(columns, axis=1) if columns else np.zeros((target.size, 0))
    return matrix, profile.root @ target


def _present(profile: Profile, shapes: Sequence[Shape | None]) -> Point:
    """The best amplitudes of the terms placed so far."""
    matrix, y = _columns(profile, shapes)
    x, residual = solve_nonnegative(matrix, y)
    return Point(cast("Sequence[Shape]", shapes), x, float(residual @ residual))


def _places(profile: Profile, shapes: Sequence[Shape | None], i: int, count: int) -> list[Point]:
    """Points with term ``i`` at the ``count`` grid shapes that lower the objective most."""
    design = profile.design
    matrix, y = _columns(profile, shapes)
    candidates = profile.root @ design.grid_curves(i)
    if i in design.linear:
        objective = objectives_with(matrix, candidates, y)
    else:
        residuals = [solve_nonnegative(matrix, y - column)[1] for column in candidates.T]
        objective = np.array([residual @ residual for residual in residuals])
    filled, found = list(shapes), []
    for best in np.argsort(objective, kind="stable")[:count]:
        filled[i] = design.grid(i)[int(best)]
        found.append(_present(profile, list(filled)))
    return found


def _refine_present(profile: Profile, point: Point) -> Point:
    """Refine the shapes of the terms placed so far."""
    design = profile.design
    if all(shape is not None for shape in point.shapes):
        return profile.refine(point)
    present = [i for i, shape in enumerate(point.shapes) if shape is not None]
    reduced = Profile(design.part(present), profile.target, profile.root)
    found = reduced.refine(reduced.at([point.shapes[i] for i in present]))
    shapes = list(point.shapes)
    for i, shape in zip(present, found.shapes, strict=True):
        shapes[i] = shape
    return Point(shapes, found.x, found.objective)
