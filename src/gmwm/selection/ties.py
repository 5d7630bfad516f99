"""Ranges of parameters where several models fit equally well.

The interval of a parameter holds if its model is the right one. Where other models fit equally
well, their intervals count too, and the range joins them.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from gmwm._core.text import brief
from gmwm._core.units import customary_unit, field_units
from gmwm.estimate.problem import Coefficients
from gmwm.estimate.result import Fit
from gmwm.issues import Notice, notice
from gmwm.process import Model, Process
from gmwm.selection import tuning

Ranges = dict[str, tuple[float, float]]


def ranges(fitted: Fit, others: Sequence[Fit], level: float = 0.95) -> Ranges:
    """Union of the intervals of each parameter over several models.

    Returns: key -> (lower, upper) in SI units, for every estimated parameter of the chosen model.
        An amplitude or slope of a term that one of the others does without has zero in its range.
    """
    result = dict(fitted.interval(level))
    for other in others:
        intervals = other.interval(level)
        partner = _partners(fitted.model, other.model)
        keys = {(i.term, i.parameter.name): i.key for i in other.model.parameters}
        for item in fitted.model.parameters:
            if item.key not in result:
                continue
            low, high = result[item.key]
            match = partner[item.term]
            if match is None:
                if item.parameter.role != "shape":
                    result[item.key] = (min(low, 0.0), max(high, 0.0))
                continue
            found = intervals.get(keys[match, item.parameter.name])
            if found is not None:
                result[item.key] = (min(low, found[0]), max(high, found[1]))
    return result


def ramp_or_walk(fitted: Fit, slope: Coefficients) -> Notice:
    """That a straight drift describes the slow part as well as the walk that was chosen."""
    wv = fitted.wv
    texts = []
    for unit, name, value in (
        ("u/s", "R", slope.value),
        ("u/s/sqrt(Hz)", "K", fitted.params.get("K", float("nan"))),
    ):
        label, factor = customary_unit(unit, wv.quantity, wv.unit)
        texts.append(f"{name} = {value * factor:.3g} {label}")
    ramp, walk = texts
    if "K" not in fitted.params:
        times = {term.values.get("tau") or 0.0: term for term in fitted.model.terms}
        longest = max(times)
        walk = times[longest].named() if longest > 0.0 else "a walk too slow to be resolved"
    values = {
        "slope": slope.value,
        "slope_error": float(np.sqrt(slope.variance)),
        "walk": fitted.params.get("K", float("nan")),
    }
    return notice("ramp-or-walk", "", values, ramp=ramp, slow=walk)


def _partners(model: Model, other: Model) -> list[int | None]:
    """For each term of a model, that of the other for the same noise; GM by nearest times."""
    partners: list[int | None] = []
    for term in model.terms:
        alike = [k for k, candidate in enumerate(other.terms) if _same(term, candidate)]
        partners.append(alike[0] if alike else None)
    own, theirs = _correlation_times(model), _correlation_times(other)
    if own and theirs:
        first, second = (np.log(list(times.values())) for times in (own, theirs))
        rows, columns = linear_sum_assignment(np.abs(first[:, None] - second))
        for row, column in zip(rows, columns, strict=True):
            partners[list(own)[row]] = list(theirs)[column]
    return partners


def _same(term: Process, other: Process) -> bool:
    """Whether two terms are of one kind; those of a shape were given the same."""
    if type(term) is not type(other) or term.ordered_by:
        return False
    return all(term.values[p.name] == other.values[p.name] for p in term.shape_parameters)


def _correlation_times(model: Model) -> dict[int, float]:
    terms = enumerate(model.terms)
    return {k: float(t.values[t.ordered_by] or 1.0) for k, t in terms if t.ordered_by}


def wider_ranges(fitted: Fit, found: Ranges) -> list[str]:
    """The parameters whose range is more than 20 % wider than their interval, in words."""
    intervals = fitted.interval()
    texts = []
    for estimate in fitted.estimates:
        key = estimate.key
        if key not in found:
            continue
        (low, high), (a, b) = found[key], intervals[key]
        if not high - low > tuning.WIDER * (b - a):
            continue
        parameter = next(i.parameter for i in fitted.model.parameters if i.key == key)
        units = field_units(parameter.unit, fitted.wv.quantity)
        unit, factor = (units[0].unit, units[0].per_si) if units else (estimate.unit, 1.0)
        first, last, *own = (brief(value * factor, 3) for value in (low, high, a, b))
        ends = f"{first} to {last}" if np.isfinite(high) else f"{first} or more"
        texts.append(f"{key} {ends} {unit} rather than {' to '.join(own)}")
    return texts
