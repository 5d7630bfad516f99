"""Terms that the moments do not support, as only this method finds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import islice

from gmwm._core.distributions import chi2
from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.moments.design import Design
from gmwm.estimate.moments.profile import Point, Profile
from gmwm.estimate.problem import weight_root
from gmwm.estimate.result import Fit, Goodness
from gmwm.process import Model, Process, Shape


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
) -> list[tuple[int, Notice]]:
    """Terms whose shape was searched for and that do not improve the fit, the least useful first.

    The amplitude alone does not show it: among all shapes one always fits some accident.
    The objective without the term does, at one per cent shared among the levels where a term of
    this kind might have been found. ``point.objective`` is under ``covariance``, whatever the
    weights of the estimate were. Each notice has the place of its term in the design.
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
            redundant.append((without - point.objective, i))
    return [
        (i, _redundant_notice(design.at_shape(i, point.shapes[i]), gain))
        for gain, i in sorted(redundant)
    ]


def _redundant_notice(process: Process, gain: float) -> Notice:
    return Notice(
        "redundant-term", "bad", "",
        f"the {process.named()} does not improve the fit significantly: it is not "
        "identifiable, leave it out",
        {
            "process": type(process).__name__,
            "gain": gain,
            **{p.name: process.values[p.name] for p in process.shape_parameters},
        },
    )  # fmt: skip


def with_doubtful_terms(
    fit: Fit,
    redundant: Sequence[tuple[int, Notice]],
    places: Mapping[str, int],
    without: Callable[[int], Goodness | None],
) -> Fit:
    """A fit with the notice of the term that the data can do without, if there is one.

    A slow term raises the errors of the very levels that show it, so that neither its gain nor its
    amplitude looks significant under the noise that it is part of. It is needed all the same where
    the model without it, by its own errors, misses an averaging time (`Goodness.loses_to`).

    redundant: Noise terms whose gain is not significant; of several alike each can stand in for
        another: one of them is too many, not all.
    places: Noise term of each amplitude.
    without: How well the fit without a noise term describes the data; None if nothing is left to
        fit.
    """
    present = [key for key in fit.upper_bounds if fit.params[key] > 0.0]
    if not redundant and not present:
        return fit

    @lru_cache
    def is_needed(i: int) -> bool:
        if not fit.goodness.describes_all:
            return False
        reduced = without(i)
        return reduced is not None and reduced.loses_to(fit.goodness)

    found = {key for key in present if is_needed(places[key])}
    notices = [n for n in fit.notices if n.code != "amplitude-bound" or n.where not in found]
    notices += islice((notice for i, notice in redundant if not is_needed(i)), 1)
    bounds = {key: bound for key, bound in fit.upper_bounds.items() if key not in found}
    return replace(fit, notices=tuple(notices), upper_bounds=bounds)


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
