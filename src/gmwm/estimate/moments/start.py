"""Starting values, found among a dictionary of shapes; the user gives none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast
from weakref import WeakKeyDictionary

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.moments.design import Design
from gmwm.estimate.moments.discrepancy import suffices
from gmwm.estimate.moments.profile import Point, Profile
from gmwm.estimate.problem import (
    Scales,
    is_plain,
    objectives_with,
    solve_nonnegative,
    weight_root,
)
from gmwm.process import (
    GaussMarkov,
    Model,
    Process,
    QuantizationNoise,
    RandomWalk,
    Shape,
    WhiteNoise,
)
from gmwm.variance import WaveletVariance

_BISECTIONS = 14

_references: WeakKeyDictionary[WaveletVariance, dict[Any, Reference]] = WeakKeyDictionary()
"""Mixtures that were fitted: candidate models ask for the same one again and again."""

DICTIONARY = (WhiteNoise, QuantizationNoise, RandomWalk, GaussMarkov)
"""Kinds of which a mixture is made that follows almost any wavelet variance."""


def search(profile: Profile, known: Sequence[Shape | None] | None = None) -> Point:
    """Global minimum for fixed weights, by adding terms one at a time and exchanging them.

    Each term with free shapes is first placed where on its grid it lowers the objective most, all
    shapes are then refined together, of a term with many shapes from several such places; at the
    end each term in turn is taken out and placed anew. A model that extends another one is never
    worse, if started from that one's shapes.

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
    matrix, y = _columns(profile, shapes)
    x, residual = solve_nonnegative(matrix, y)
    return Point(cast("Sequence[Shape]", shapes), x, float(residual @ residual))


def _places(profile: Profile, shapes: Sequence[Shape | None], i: int, count: int) -> list[Point]:
    """Put term ``i`` at so many grid shapes, those that lower the objective most."""
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


@dataclass(frozen=True, eq=False)
class Reference:
    """A rich mixture fitted to the wavelet variances.

    covariance: (J, J), of the wavelet variances under it, u^4.
    curve: (J,), its wavelet variances, u^2.
    discrepancy: Relative error that even this mixture needs, see
        `gmwm.estimate.moments.discrepancy`.
    """

    mixture: Model
    covariance: FloatArray
    curve: FloatArray
    discrepancy: float

    def weights(self, target: FloatArray, discrepancy: float) -> FloatArray:
        """Covariance of the wavelet variances with a discrepancy, u^4, (J, J)."""
        return self.covariance + np.diag((discrepancy * target) ** 2)


def dictionary_fit(
    wv: WaveletVariance, target: FloatArray, extra: tuple[Process, ...] = ()
) -> Reference:
    """Non-negative least-squares fit of a dictionary of processes.

    White, quantization and random-walk noise, a grid of Gauss-Markov processes and the kinds of
    ``extra`` together follow almost any wavelet variance. Their fit is a spectrum close enough for
    first weights, whatever model is to be fitted, and what it cannot follow no such model can.
    """
    kinds = _kinds(extra)
    if not all(is_plain(kind) for kind in kinds):
        return _mixture(wv, target, kinds)
    known, key = _references.setdefault(wv, {}), (kinds, target.tobytes())
    if key not in known:
        known[key] = _mixture(wv, target, kinds)
    return known[key]


def _mixture(wv: WaveletVariance, target: FloatArray, kinds: tuple[Process, ...]) -> Reference:
    design, atoms, matrix = _dictionary(Scales.of(wv), kinds)
    covariance, discrepancy = wv.covariance, 0.0
    for _ in range(tuning.REWEIGHTINGS):
        discrepancy = _needed(matrix, target, covariance)
        x = _amplitudes(matrix, target, covariance, discrepancy)
        mixture = [
            design.at_shape(i, shape).with_amplitude(float(value))
            for (i, shape), value in zip(atoms, x, strict=True)
            if value > 0.0
        ]
        if all(process.is_line for process in mixture):
            raise InputError(
                f"{wv.name or 'the series'} is not noise that these processes describe (an exact "
                "line or a pattern): check the data"
            )
        whole = Model(tuple(mixture))
        covariance = wv.covariance_under(whole.psd, whole.lines())
    return Reference(Model(tuple(mixture)), covariance, matrix @ x, discrepancy)


def dictionary(
    scales: Scales, extra: tuple[Process, ...] = ()
) -> tuple[Design, list[tuple[int, Shape]], FloatArray]:
    """Processes of which almost any wavelet variance is a sum.

    Returns: design; atoms, term of the design and its shape; matrix (J, A), wavelet variance of
        each at unit amplitude.
    """
    return _dictionary(scales, _kinds(extra))


def _kinds(extra: tuple[Process, ...]) -> tuple[Process, ...]:
    """The processes of the dictionary."""
    # Lines to be found are left out: a comb of them follows anything. Those at given frequencies
    # follow one thing only, which no other process can.
    lines = tuple(p for p in extra if p.is_line and p.values["frequency"] is not None)
    # Simulated processes are too: they take their time, and the mixture does without them.
    kinds = {type(p): p for p in extra if not p.is_line and p.has_spectrum()}
    kinds.pop(GaussMarkov, None)
    processes: tuple[Process, ...] = tuple(kind() for kind in DICTIONARY)
    processes += tuple(p for kind, p in kinds.items() if kind not in map(type, processes))
    return processes + tuple(line.with_values(amplitude=None) for line in lines)


def _dictionary(
    scales: Scales, kinds: tuple[Process, ...]
) -> tuple[Design, list[tuple[int, Shape]], FloatArray]:
    design = Design(Model(kinds), scales)
    atoms, columns = [], []
    for i in design.linear:
        shapes, curves = _atoms(design, i)
        atoms += [(i, shape) for shape in shapes]
        columns.append(curves)
    return design, atoms, np.concatenate(columns, axis=1)


def _atoms(design: Design, i: int) -> tuple[list[Shape], FloatArray]:
    """Shapes of a term and their curves, (J, A)."""
    if not design.terms[i].process.ordered_by:
        return design.grid(i), design.grid_curves(i)
    kept, key = design.kept(i), ("atoms", design.terms[i].process)
    if key not in kept:
        shapes = _denser(design.grid(i))
        kept[key] = shapes, np.stack([design.curve(i, shape) for shape in shapes], axis=1)
    found: tuple[list[Shape], FloatArray] = kept[key]
    return found


def _denser(shapes: list[Shape]) -> list[Shape]:
    """Shapes of one parameter with their geometric means in between.

    The finest levels of long records are known to a thousandth, and the mixture must not fail on
    account of its grid.
    """
    values = np.array([shape[0] for shape in shapes])
    middle = np.sqrt(values[1:] * values[:-1])
    return [(float(v),) for v in np.sort(np.concatenate([values, middle]))]


def _amplitudes(
    matrix: FloatArray, target: FloatArray, covariance: FloatArray, discrepancy: float
) -> FloatArray:
    root = weight_root(covariance + np.diag((discrepancy * target) ** 2))
    return solve_nonnegative(root @ matrix, root @ target)[0]


def _needed(matrix: FloatArray, target: FloatArray, covariance: FloatArray) -> float:
    """Smallest discrepancy under which the best mixture passes for right.

    The mixture is fitted anew for each value tried: with more allowance it follows the fine
    levels less closely, and residuals of a loose fit would ask for ever more.
    """
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        value = low if high == 1.0 and low == 0.0 else float(np.sqrt(max(low, 1e-4) * high))
        x = _amplitudes(matrix, target, covariance, value)
        curve = matrix @ x
        dof = max(target.size - int(np.sum(x > 0.0)), 3)
        if suffices(value, target - curve, covariance, target, curve, dof):
            if value == 0.0:
                return 0.0
            high = value
        else:
            low = max(value, 1e-4)
        if high < 1.05 * low:
            break
    return high
