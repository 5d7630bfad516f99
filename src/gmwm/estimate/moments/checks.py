"""Terms that the moments do not support, as only this method finds."""

from __future__ import annotations

from collections.abc import Sequence

from scipy.stats import chi2

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.moments.design import Design
from gmwm.estimate.moments.profile import Point, Profile
from gmwm.estimate.problem import weight_root
from gmwm.process import Model, Shape


def limit_notices(design: Design, shapes: Sequence[Shape], x: FloatArray) -> list[Notice]:
    """Shapes at the limit of what the search allows."""
    z = design.pack(shapes)
    low, high = design.bounds
    amplitudes = design.amplitudes(x)
    at_limit = (z <= low + tuning.SEARCH_MARGIN) | (z >= high - tuning.SEARCH_MARGIN)
    return [
        Notice(
            "search-limit", "bad", "",
            f"the {design.at_shape(i, shapes[i]).named()} ran to the limit of what this record can "
            "show: it is not identifiable, leave it out",
            {"process": type(design.terms[i].process).__name__, "shape": shapes[i][0]},
        )
        for k, i in enumerate(design.owners())
        if amplitudes[i] > 0.0 and at_limit[k]
    ]  # fmt: skip


def redundant_notices(
    design: Design, point: Point, target: FloatArray, covariance: FloatArray
) -> list[Notice]:
    """The term whose shape was searched for and that the data can do without, if there is one.

    The amplitude alone does not show it: among all shapes one always fits some accident.
    The objective without the term does, at one per cent shared among the levels where a term of
    this kind might have been found. ``point.objective`` is under ``covariance``, whatever the
    weights of the estimate were.
    """
    root = weight_root(covariance)
    redundant: list[tuple[float, int]] = []
    amplitudes = design.amplitudes(point.x)
    for i in design.shaped:
        others = [k for k in range(len(design.terms)) if k != i]
        if amplitudes[i] == 0.0 or i not in design.linear or not others:
            continue
        model = Model(tuple(design.terms[k].process for k in others))
        reduced = Profile(Design(model, design.scales), target, root)
        without = reduced.refine(reduced.at([point.shapes[k] for k in others])).objective
        freed = 1 + design.terms[i].n_shapes
        if without - point.objective < chi2.isf(tuning.REDUNDANT_P / target.size, freed):
            redundant.append((without, i))
    if not redundant:
        return []
    # Of several alike, each can stand in for another: one of them is too many, not all.
    without, i = min(redundant)
    process = design.at_shape(i, point.shapes[i])
    return [
        Notice(
            "redundant-term", "bad", "",
            f"the {process.named()} does not improve the fit significantly: it is not "
            "identifiable, leave it out",
            {
                "process": type(process).__name__,
                "gain": without - point.objective,
                **{p.name: process.values[p.name] for p in process.shape_parameters},
            },
        )
    ]  # fmt: skip


def level_notices(n_levels: int, n_free: int) -> list[Notice]:
    """More parameters than levels."""
    if n_levels >= n_free:
        return []
    return [
        Notice(
            "too-few-levels", "bad", "",
            f"{n_levels} levels cannot determine {n_free} parameters: record longer or take a "
            "smaller model",
            {"levels": n_levels, "parameters": n_free},
        )
    ]  # fmt: skip
