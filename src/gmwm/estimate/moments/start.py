"""The search for the minimum: starting shapes from grids, without any value from the user."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.moments.profile import Point, Profile
from gmwm.estimate.problem import objectives_with, solve_nonnegative
from gmwm.process import Shape


def search(profile: Profile, known: Sequence[Shape | None] | None = None) -> Point:
    """Global minimum for fixed weights, by adding terms one at a time and exchanging them.

    Each term with free shapes is first placed where on its grid it lowers the objective most, then
    all shapes are refined together. A term with many shapes is refined from several such places. At
    the end each term in turn is taken out and placed anew. A model that extends another one is
    never worse if started from that one's shapes.

    known: Shapes to start with, ``None`` for the terms still to be placed.
    """
    design = profile.design
    shapes = list(known) if known is not None else design.fixed_shapes()
    missing = [i for i in design.shaped if shapes[i] is None]
    point = _present(profile, shapes)
    for i in missing:
        many = design.terms[i].n_shapes >= tuning.MANY_SHAPES
        starts = _places(profile, point.shapes, i, tuning.STARTS if many else 1)
        point = _refine_present(profile, starts[0])
        for start in starts[1:]:
            if point.objective < profile.target.size:
                break  # within chance
            point = min(point, _refine_present(profile, start), key=lambda p: p.objective)
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
