"""What is said of a fit that cannot be trusted as it stands, one sentence each."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.stats import chi2

from gmwm._typing import FloatArray
from gmwm.estimate.design import Design
from gmwm.estimate.interval import UNDETERMINED
from gmwm.estimate.profile import Point, Profile, weight_root
from gmwm.process import GaussMarkov, Model
from gmwm.process.base import Shape
from gmwm.variance.wavelet import WaveletVariance

WELL_KNOWN_DOF = 30.0
"""Degrees of freedom of a level above which it is known well: to 13 % of the deviation."""

NO_TEST = (
    "no test of the fit: the gaps leave no wavelet variance, the one shown bridges them by lines"
)
"""Remark on a fit whose wavelet variance is not that of the data."""

_SHAPE_EDGE = 0.05  # in z, from the limit of the search
_MERGED_SIGMA = 1.96  # standard errors of the difference of two log correlation times
_POOR_DEVIATION = 0.10  # of the Allan deviation, at well-known levels
_IDLE_P = 0.01
_CONFOUNDED, _LOOSE = 0.999, 0.1  # correlation, relative standard error


def bound_remarks(model: Model, upper: dict[str, float]) -> list[str]:
    """Amplitudes that are zero or not significantly above it."""
    return [
        f"{key} is not identifiable from these data (not significantly above zero): below "
        f"{bound:.3g} with 95 % confidence"
        for key, bound in upper.items()
    ]


def shape_remarks(design: Design, shapes: Sequence[Shape], x: FloatArray) -> list[str]:
    """Shapes at the edge of what the search allows."""
    z = design.pack(shapes)
    low, high = design.bounds(shapes)
    amplitudes = design.amplitudes(x)
    remarks = []
    for k, i in enumerate(design.owners()):
        if amplitudes[i] > 0.0 and not low[k] + _SHAPE_EDGE < z[k] < high[k] - _SHAPE_EDGE:
            title = design.terms[i].process.title()
            remarks.append(
                f"a {title} term ran to the edge of what this record can show (shape "
                f"{shapes[i][0]:.3g}): it is not identifiable, leave it out"
            )
    return remarks


def merged_remarks(model: Model, keys: tuple[str, ...], matrix: FloatArray) -> list[str]:
    """Neighbouring Gauss-Markov terms whose correlation times do not differ significantly."""
    taus = [
        (item.key, item.value or 0.0)
        for item in model.parameters
        if isinstance(model.terms[item.term], GaussMarkov)
        and item.parameter.name == "tau"
        and item.key in keys
    ]
    remarks = []
    for (first, a), (second, b) in pairwise(taus):
        i, j = keys.index(first), keys.index(second)
        gradient = np.array([-1.0 / a, 1.0 / b])
        block = matrix[np.ix_([i, j], [i, j])]
        error = float(np.sqrt(gradient @ block @ gradient))
        if np.log(b / a) < _MERGED_SIGMA * error or b / a < 1.05:
            remarks.append(
                f"two Gauss-Markov terms do not differ significantly ({first} = {a:.3g} s, "
                f"{second} = {b:.3g} s): use one less"
            )
    return remarks


def confounded_remarks(model: Model, keys: tuple[str, ...], matrix: FloatArray) -> list[str]:
    """Parameters of which the data know one combination only."""
    errors = np.sqrt(np.diag(matrix))
    remarks = []
    for i, first in enumerate(keys):
        for j in range(i + 1, len(keys)):
            if errors[i] == 0.0 or errors[j] == 0.0:
                continue
            correlation = matrix[i, j] / (errors[i] * errors[j])
            loose = errors[j] > _LOOSE * abs(model.params[keys[j]] or 0.0)
            if abs(correlation) > _CONFOUNDED and loose:
                remarks.append(
                    f"{first} and {keys[j]} cannot be told apart (their estimates have a "
                    f"correlation of {correlation:.5f}): give one of them"
                )
    return remarks


def idle_remarks(
    design: Design, point: Point, target: FloatArray, covariance: FloatArray
) -> list[str]:
    """Terms whose shape was searched for, and that the data can do without.

    The amplitude alone does not tell: among all shapes one always fits some accident of the data.
    The objective without the term does, at one per cent shared among the levels where a term of
    this kind might have been found.
    """
    root = weight_root(covariance)
    idle: list[tuple[float, str]] = []
    amplitudes = design.amplitudes(point.x)
    for i in design.shaped:
        others = [k for k in range(len(design.terms)) if k != i]
        if amplitudes[i] == 0.0 or i not in design.linear or not others:
            continue
        model = Model(tuple(design.terms[k].process for k in others))
        reduced = Profile(Design(model, design.scales), target, root)
        without = reduced.refine(reduced.at([point.shapes[k] for k in others])).objective
        freed = 1 + int(np.sum(design.terms[i].free_shape))
        if without - point.objective < chi2.isf(_IDLE_P / target.size, freed):
            remark = (
                f"a {design.terms[i].process.title()} term does not improve the fit significantly: "
                "it is not identifiable, leave it out"
            )
            idle.append((without, remark))
    # Of several alike, each can stand in for another: one of them is too many, not all.
    return [min(idle)[1]] if idle else []


def undetermined_remarks(model: Model, keys: tuple[str, ...], matrix: FloatArray) -> list[str]:
    """Shapes whose standard error is as large as they are."""
    errors = dict(zip(keys, np.sqrt(np.diag(matrix)), strict=True))
    return [
        f"{item.key} is not determined by this record (standard error {errors[item.key]:.2g})"
        for item in model.parameters
        if item.key in errors
        and item.parameter.role == "shape"
        and item.parameter.lower == 0.0
        and errors[item.key] > UNDETERMINED * (item.value or 0.0)
    ]


def count_remarks(design: Design, sub: Design) -> list[str]:
    """More parameters than levels."""
    levels = design.scales.tau.size
    if levels >= sub.n_free:
        return []
    return [
        f"{levels} levels cannot determine {sub.n_free} parameters: record longer or take a "
        "smaller model"
    ]


def misfit(
    wv: WaveletVariance,
    target: FloatArray,
    implied: FloatArray,
    covariance: FloatArray,
    discrepancy: float,
) -> tuple[list[str], bool]:
    """What to say of a model that fails the chi-square test, and whether it fails too badly."""
    if discrepancy == 0.0:
        return [], False
    statistical = np.diag(covariance) - (discrepancy * target) ** 2
    worst, tau, poor = worst_misfit(wv, target, implied, statistical)
    if tau == 0.0:
        return [], False
    remark = (
        "the model differs from the data by more than their statistical errors; a discrepancy of "
        f"{100.0 * discrepancy:.2g} % of the variance at each level was allowed for and widens the "
        f"intervals (largest misfit of the deviation {100.0 * worst:.2g} % at tau = {tau:.3g} s)"
    )
    return [remark], poor


def worst_misfit(
    wv: WaveletVariance, target: FloatArray, implied: FloatArray, variance: FloatArray
) -> tuple[float, float, bool]:
    """Largest relative misfit of the deviation at well-known levels, its time (s), if it is poor.

    ``variance`` (J,) are the statistical variances of ``target``, u^4. The time is zero where no
    level is known well.
    """
    known = 2.0 * target**2 / np.maximum(variance, 1e-300) > WELL_KNOWN_DOF
    if not np.any(known):
        return 0.0, 0.0, False
    ratio = np.abs(np.sqrt(target[known] / np.maximum(implied[known], 1e-300)) - 1.0)
    worst = int(np.argmax(ratio))
    return float(ratio[worst]), float(wv.tau[known][worst]), bool(ratio[worst] > _POOR_DEVIATION)
