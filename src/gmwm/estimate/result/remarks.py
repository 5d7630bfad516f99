"""Notices about a fit: what makes it not valid, or less exact than it looks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from gmwm._core.text import brief, per_cent
from gmwm._core.typing import FloatArray
from gmwm._core.units import customary_unit
from gmwm.estimate import tuning
from gmwm.estimate.result.goodness import Goodness
from gmwm.issues import Notice, notice
from gmwm.process import Model, Process
from gmwm.variance import WaveletVariance


def estimate_notices(
    model: Model,
    keys: Sequence[str],
    matrix: FloatArray,
    upper: Mapping[str, float],
    wv: WaveletVariance,
) -> tuple[list[Notice], list[Notice]]:
    """Notices about the estimates themselves: those that make a fit not valid, and the others.

    model: With the estimates.
    keys, matrix: The estimated parameters and their covariance.
    upper: Upper limits of amplitudes that are not significantly above zero.
    """
    bad = [notice("amplitude-bound", key, {"upper": limit}) for key, limit in upper.items()]
    errors = dict(zip(keys, map(float, np.sqrt(np.diag(matrix))), strict=True))
    for item in model.parameters:
        parameter, error = item.parameter, errors.get(item.key, 0.0)
        is_positive_shape = parameter.role == "shape" and parameter.lower == 0.0
        if is_positive_shape and error > tuning.UNDETERMINED * (item.value or 0.0):
            bad.append(notice("undetermined", item.key, {"stderr": error}))
    bad += _indistinct_notices(model, keys, matrix)
    for (i, first), (j, second) in combinations(enumerate(keys), 2):
        if errors[first] == 0.0 or errors[second] == 0.0:
            continue
        correlation = float(matrix[i, j] / (errors[first] * errors[second]))
        is_loose = errors[second] > tuning.LOOSE * abs(model.params[second] or 0.0)
        if abs(correlation) > tuning.CONFOUNDED and is_loose:
            values = {"other": first, "correlation": correlation}
            bad.append(notice("confounded", second, values))
    return bad, _bandwidth_notices(model, wv)


def _indistinct_notices(model: Model, keys: Sequence[str], matrix: FloatArray) -> list[Notice]:
    """Neighbouring terms of a kind whose correlation times do not differ significantly."""
    taus = [
        (item.key, item.value or 0.0, model.terms[item.term].title())
        for item in model.parameters
        if item.parameter.name == model.terms[item.term].ordered_by and item.key in keys
    ]
    notices = []
    for (first, a, title), (second, b, other) in pairwise(taus):
        if title != other:
            continue
        i, j = keys.index(first), keys.index(second)
        gradient = np.array([-1.0 / a, 1.0 / b])
        error = float(np.sqrt(gradient @ matrix[np.ix_([i, j], [i, j])] @ gradient))
        if np.log(b / a) < tuning.DISTINCT_SIGMA * error or b / a < tuning.DISTINCT_RATIO:
            values = {"first": first, "second": second, first: a, second: b}
            words: dict[str, Any] = {"kind": title, "one": a, "other": b}
            notices.append(notice("indistinct-terms", second, values, **words))
    return notices


def _bandwidth_notices(model: Model, wv: WaveletVariance) -> list[Notice]:
    """Terms that are the sensor's own filter, and the white noise that they act as.

    A Gauss-Markov process with a correlation time of a few samples is a low-pass of first order
    where the model has no white noise beside it.
    """
    filtered = [i for i, term in enumerate(model.terms) if term.is_band_limited]
    if not filtered and not any(term.is_white for term in model.terms):
        times = ((i, term.values.get("tau")) for i, term in enumerate(model.terms))
        filtered = [i for i, tau in times if tau is not None and tau < tuning.FILTER_LIKE * wv.dt]
    notices = []
    for i in filtered:
        term = model.terms[i]
        key = next(p.key for p in model.parameters if p.term == i and p.parameter.role == "shape")
        bandwidth = _half_power(term, wv.dt)
        low = term.psd(np.array([tuning.FOOT * bandwidth]), wv.dt)[0]
        if not low > 0.0:
            continue  # a term of zero amplitude is no filter of the sensor's
        unit, factor = customary_unit("u/sqrt(Hz)", wv.quantity, wv.unit)
        density = float(np.sqrt(low))
        values = {"bandwidth": bandwidth, "density": density}
        words: dict[str, Any] = {"term": term.title(), "size": density * factor, "unit": unit}
        notices.append(notice("sensor-bandwidth", key, values, **words))
    return notices


def _half_power(term: Process, dt: float) -> float:
    """Lowest frequency (Hz) at which half of the power of a low-pass is left, or half the rate."""
    f = np.geomspace(1e-5, 0.5, 2000) / dt
    density = term.psd(f, dt)
    below = np.flatnonzero(density < 0.5 * density[0])
    if below.size == 0:
        return float(f[-1])
    part = slice(below[0] - 1, below[0] + 1)
    return float(np.interp(-0.5 * density[0], -density[part], f[part]))


def missed_level_notices(goodness: Goodness) -> list[Notice]:
    """The averaging time that the model misses, if it misses one."""
    if goodness.largest is None or not goodness.is_excluded:
        return []
    residual, tau = goodness.largest
    side = "above" if residual > 0.0 else "below"
    values = {"tau": tau, "residual": residual, "p_value": goodness.largest_p}
    return [notice("level-missed", "", values, errors=brief(abs(residual)), side=side)]


def misfit_notices(goodness: Goodness, discrepancy: float, *, failed: bool) -> list[Notice]:
    """Consequence for prediction where a model misses an averaging time.

    discrepancy: Relative error of the variances that was allowed for.
    failed: Whether the chi-square test failed. If not, a misfit is bad only where fewer than one in
        twenty right models have one as clear at any level: of six axes with right models nearly one
        has a smaller one by chance.
    """
    beyond = goodness.beyond_chance
    if beyond is None:
        return []
    misfit, tau, residual = beyond
    values = {"misfit": misfit, "tau": tau, "residual": residual, "discrepancy": discrepancy}
    side, scale = ("above", "small") if misfit > 0.0 else ("below", "large")
    words: dict[str, Any] = {
        "share": per_cent(abs(misfit)),
        "side": side,
        "scale": scale,
        "errors": brief(abs(residual)),
        "chance": 100.0 * goodness.largest_p,
    }
    if not goodness.is_poor:
        variant = "allowed" if discrepancy > 0.0 else "slight"
    elif failed or goodness.largest_p < tuning.POOR_P:
        return [notice("misfit", "", values, **words)]
    else:
        variant = "chance"
    return [notice("misfit", "", values, severity="note", variant=variant, **words)]
