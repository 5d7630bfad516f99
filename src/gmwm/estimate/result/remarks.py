"""What makes a fit untrustworthy as it stands, or less exact than it looks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.text import brief, per_cent
from gmwm._core.typing import FloatArray
from gmwm._core.units import customary_unit
from gmwm.estimate import tuning
from gmwm.estimate.result.goodness import Goodness
from gmwm.process import Model, Process
from gmwm.variance import WaveletVariance

REASONS = {
    "amplitude-bound": "amplitudes_above_zero",
    "search-limit": "shapes_within_search",
    "redundant-term": "terms_needed",
    "undetermined": "shapes_determined",
    "indistinct-terms": "terms_distinct",
    "confounded": "parameters_separable",
    "too-few-levels": "enough_levels",
    "misfit": "describes_data",
    "level-missed": "describes_every_level",
    "not-converged": "converged",
    "no-curvature": "converged",
    "drift-in-state": "drift_is_ramp",
    "no-region": "regions_found",
    "wrong-slope": "slopes_agree",
    "recordings-differ": "recordings_agree",
    "not-static": "recording_static",
    "tilt": "attitude_kept",
    "rate-changes": "rate_constant",
    "counts": "units_agree",
    "gravity": "units_agree",
    "swapped": "units_agree",
    "rounding": "resolution_fine",
    "saturation": "within_range",
    "abrupt-end": "within_range",
    "stuck": "samples_change",
    "dead": "samples_change",
    "held": "samples_measured",
    "filled": "samples_measured",
    "value-repeated": "samples_measured",
    "variance": "noise_steady",
    "step": "stationary",
    "transient": "stationary",
    "drift-at-start": "stationary",
    "slow-period": "stationary",
    "departures-many": "stationary",
    "unsteady": "noise_steady",
}
"""Code of a notice that makes a fit invalid -> the reason, as a property that the fit lacks."""


def missed_level_notices(goodness: Goodness) -> list[Notice]:
    """The averaging time that the model misses, if it misses one."""
    if goodness.largest is None or not goodness.is_excluded:
        return []
    residual, tau = goodness.largest
    side = "above" if residual > 0.0 else "below"
    return [
        Notice(
            "level-missed", "bad", "",
            f"at tau = {tau:.3g} s the data lie {brief(abs(residual))} standard errors {side} the "
            "model: it lacks a term there, or the recording has a fault",
            {"tau": tau, "residual": residual, "p_value": goodness.largest_p},
        )
    ]  # fmt: skip


def no_test_notice() -> Notice:
    """Of a fit whose wavelet variance is not that of the data."""
    return Notice(
        "no-test", "note", "",
        "no test of the fit: the gaps leave no wavelet variance, the one shown bridges them by "
        "straight lines",
    )  # fmt: skip


def bandwidth_notices(model: Model, wv: WaveletVariance) -> list[Notice]:
    """Terms that are the sensor's own filter: what they are, and what they act as.

    A Gauss-Markov process of a correlation time of a few samples is a low-pass of first order,
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
            continue  # a term of amplitude zero is no filter of the sensor's
        unit, factor = customary_unit("u/sqrt(Hz)", wv.quantity, wv.unit)
        density = float(np.sqrt(low))
        notices.append(
            Notice(
                "sensor-bandwidth", "note", key,
                f"the {term.title()} term is white noise of N = {density * factor:.3g} {unit} "
                f"behind the sensor's bandwidth of {bandwidth:.3g} Hz; a filter needs no state for "
                "it",
                {"bandwidth": bandwidth, "density": density},
            )
        )  # fmt: skip
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


def bound_notices(upper: Mapping[str, float]) -> list[Notice]:
    """Amplitudes that are zero or not significantly above it."""
    return [
        Notice(
            "amplitude-bound", "bad", key,
            "not significantly above zero, so that only an upper bound is known",
            {"upper": bound},
        )
        for key, bound in upper.items()
    ]  # fmt: skip


def indistinct_notices(model: Model, keys: Sequence[str], matrix: FloatArray) -> list[Notice]:
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
        block = matrix[np.ix_([i, j], [i, j])]
        error = float(np.sqrt(gradient @ block @ gradient))
        if np.log(b / a) < tuning.DISTINCT_SIGMA * error or b / a < tuning.DISTINCT_RATIO:
            notices.append(
                Notice(
                    "indistinct-terms", "bad", second,
                    f"two {title} terms do not differ significantly ({first} = {a:.3g} s, "
                    f"{second} = {b:.3g} s): use one fewer",
                    {"first": first, "second": second, first: a, second: b},
                )
            )  # fmt: skip
    return notices


def confounded_notices(model: Model, keys: Sequence[str], matrix: FloatArray) -> list[Notice]:
    """Parameters of which the data determine one combination only."""
    errors = np.sqrt(np.diag(matrix))
    notices = []
    for i, first in enumerate(keys):
        for j in range(i + 1, len(keys)):
            if errors[i] == 0.0 or errors[j] == 0.0:
                continue
            correlation = float(matrix[i, j] / (errors[i] * errors[j]))
            loose = errors[j] > tuning.LOOSE * abs(model.params[keys[j]] or 0.0)
            if abs(correlation) > tuning.CONFOUNDED and loose:
                notices.append(
                    Notice(
                        "confounded", "bad", keys[j],
                        f"cannot be distinguished from {first} (their estimates have a correlation "
                        f"of {correlation:.5f}): fix one of them",
                        {"other": first, "correlation": correlation},
                    )
                )  # fmt: skip
    return notices


def undetermined_notices(model: Model, keys: Sequence[str], matrix: FloatArray) -> list[Notice]:
    """Shapes whose standard error is as large as they are."""
    errors = dict(zip(keys, map(float, np.sqrt(np.diag(matrix))), strict=True))
    return [
        Notice(
            "undetermined", "bad", item.key,
            f"not determined by this record (standard error {errors[item.key]:.2g})",
            {"stderr": errors[item.key]},
        )
        for item in model.parameters
        if item.key in errors
        and item.parameter.role == "shape"
        and item.parameter.lower == 0.0
        and errors[item.key] > tuning.UNDETERMINED * (item.value or 0.0)
    ]  # fmt: skip


def misfit_notices(goodness: Goodness, discrepancy: float, *, failed: bool) -> list[Notice]:
    """What it means for prediction that a model misses an averaging time.

    discrepancy: Relative error of the variances that was allowed for.
    failed: Whether the chi-square test failed. If not, a misfit is bad that fewer than one in
        twenty right models have at any level: of six axes with right models nearly one would have a
        smaller one, which is chance.
    """
    beyond = goodness.beyond_chance
    if beyond is None:
        return []
    misfit, tau, residual = beyond
    values = {"misfit": misfit, "tau": tau, "residual": residual, "discrepancy": discrepancy}
    share = per_cent(abs(misfit))
    if goodness.is_poor:
        side, scale = ("above", "small") if misfit > 0.0 else ("below", "large")
        text = f"the data lie {share} {side} the model's Allan deviation"
        if failed or goodness.largest_p < tuning.POOR_P:
            text = f"predictions over {tau:.3g} s are too {scale}: there {text}, by "
            text += f"{brief(abs(residual))} standard errors"
            return [Notice("misfit", "bad", "", text, values)]
        chance = f"{100.0 * goodness.largest_p:.0f} % of right models are missed as clearly"
        text = f"at tau = {tau:.3g} s {text}, which is no more than chance: {chance} somewhere"
        return [Notice("misfit", "note", "", text, values)]
    text = f"describes the Allan deviation to {share} (least well at tau = {tau:.3g} s)"
    text += ", which the intervals allow for" if discrepancy > 0.0 else ""
    return [Notice("misfit", "note", "", text, values)]
