"""What makes a fit untrustworthy as it stands, or less exact than it looks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.result.goodness import Goodness
from gmwm.process import Model
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
    "step": "stationary",
    "transient": "stationary",
    "drift-at-start": "stationary",
    "slow-period": "stationary",
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
            f"at tau = {tau:.3g} s the data lie {abs(residual):.2g} standard errors {side} the "
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


def bound_notices(upper: Mapping[str, float]) -> list[Notice]:
    """Amplitudes that are zero or not significantly above it."""
    return [
        Notice(
            "amplitude-bound", "bad", key,
            "not identifiable from these data (not significantly above zero): below "
            f"{bound:.3g} with 95 % confidence",
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


def misfit_notices(
    wv: WaveletVariance,
    target: FloatArray,
    implied: FloatArray,
    variance: FloatArray,
    discrepancy: float,
) -> list[Notice]:
    """Notices of a model that fails the chi-square test.

    ``variance`` (J,) are the statistical variances of ``target``, u^4.
    """
    worst, tau, poor = worst_misfit(wv, target, implied, variance)
    text = f"largest misfit of the deviation {100.0 * worst:.2g} % at tau = {tau:.3g} s"
    if discrepancy > 0.0:
        if tau == 0.0:
            return []
        text = (
            f"a discrepancy of {100.0 * discrepancy:.2g} % of the variance at each level was "
            f"allowed for and widens the intervals ({text})"
        )
    return [
        Notice(
            "misfit", "bad" if poor else "note", "",
            f"the model differs from the data by more than their statistical errors; {text}",
            {"misfit": worst, "tau": tau, "discrepancy": discrepancy},
        )
    ]  # fmt: skip


def worst_misfit(
    wv: WaveletVariance, target: FloatArray, implied: FloatArray, variance: FloatArray
) -> tuple[float, float, bool]:
    """Largest relative misfit of the deviation at well-known levels, its time (s), if it is poor.

    ``variance`` (J,) are the statistical variances of ``target``, u^4. The time is zero where no
    level is known well.
    """
    known = 2.0 * target**2 / np.maximum(variance, 1e-300) > tuning.WELL_KNOWN_DOF
    if not np.any(known):
        return 0.0, 0.0, False
    ratio = np.abs(np.sqrt(target[known] / np.maximum(implied[known], 1e-300)) - 1.0)
    worst = int(np.argmax(ratio))
    return (
        float(ratio[worst]),
        float(wv.tau[known][worst]),
        bool(ratio[worst] > tuning.POOR_DEVIATION),
    )
