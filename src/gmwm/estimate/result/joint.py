"""One model for several recordings, and whether they are the same noise."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from annotated_types import MinLen

from gmwm._core.distributions import chi2
from gmwm._core.documents import NotNegative, Probability, Text
from gmwm._core.frozen import freeze
from gmwm._core.text import cell, plain_table
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.problem.moments import FittedMoments, chi_square
from gmwm.estimate.result.fit import Fit
from gmwm.issues import notice
from gmwm.process import Model
from gmwm.variance import PooledVariance, WaveletVariance

_LEAST_SHARE = 1e-9  # smallest share of the weight that all recordings but one must have


@dataclass(frozen=True, eq=False, repr=False)
class JointFit(Fit):
    """A model fitted to several recordings at once.

    Attributes
    ----------
    parts : tuple of Fit
        The same model fitted to each recording.
    equality_p : float
        p-value of the test that the parameters are equal in all recordings; NaN where fewer than
        two of them determine the parameters.
    curves_p : float
        p-value of the test that each recording has the wavelet variances of the joint model, within
        the discrepancy allowed for; it tests the model too.
    spread : dict
        Standard deviation of each parameter between recordings beyond their standard errors, by
        key: relative for positive parameters, in SI units for others. Parameters for which one
        recording has all the weight are left out.
    """

    SCHEMA: ClassVar[str] = "gmwm.joint-fit"

    parts: Annotated[tuple[Fit, ...], MinLen(1)] = ()
    equality_p: Probability = float("nan")
    curves_p: Probability = float("nan")
    spread: Mapping[Text, NotNegative] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        freeze(self, "spread")

    def text(self, units: str = "field") -> str:
        positive, rows = _positive(self.model), []
        for key in self.keys:
            spread = self.spread.get(key)
            is_relative = key in positive and spread is not None
            unit = self[key].in_units(units).unit
            scale = (
                100.0 if is_relative else self[key].in_units(units).value / (self[key].value or 1.0)
            )
            shown = cell(spread, 3, scale) + " %" * is_relative
            values = "  ".join(cell(part[key].in_units(units).value) for part in self.parts)
            rows.append([key, shown, values, unit])
        table = plain_table(["parameter", "spread", "of each recording", "unit"], rows)
        return "\n".join([super().text(units), "", self.agreement, table])

    @property
    def agreement(self) -> str:
        """How many recordings there are, and whether they agree."""
        which = f"{len(self.parts)} recordings"
        if np.isfinite(self.equality_p):
            return f"{which}, equality of the parameters: p = {self.equality_p:.2g}"
        return f"{which}, agreement with the joint model: p = {self.curves_p:.2g}"

    @classmethod
    def from_content(cls, content: Mapping[str, Any]) -> Self:
        found = super().from_content(content)
        return replace(found, wv=PooledVariance.of([part.wv for part in found.parts]))


def fit_joint(
    model: Model,
    parts: Sequence[WaveletVariance],
    estimate: Callable[[Model, WaveletVariance], Fit],
    whole: Fit | None = None,
) -> JointFit:
    """Fit one model to several recordings together, and to each alone."""
    if any(term.is_drift for term in model.terms) and len(parts) > 1:
        raise InputError(
            "a rate ramp belongs to one recording: remove it from the model, or fit the recordings "
            "one by one"
        )
    whole = whole or estimate(model, PooledVariance.of(parts))
    each = tuple(estimate(model, part) for part in parts)
    equality_p, spread = _heterogeneity(whole, each)
    curves_p = _curves_test(whole, each)
    notices = list(whole.notices)
    p_values = {"equality_p": equality_p, "curves_p": curves_p}
    if equality_p < tuning.RECORDINGS_DIFFER:
        notices.append(notice("recordings-differ", "", p_values))
    elif np.isnan(equality_p) and curves_p < tuning.RECORDINGS_DIFFER:
        # Where the parameters cannot be compared, the curves can.
        notices.append(notice("recordings-differ", "", p_values, variant="curves"))
    values = {f.name: getattr(whole, f.name) for f in fields(Fit)} | {"notices": tuple(notices)}
    return JointFit(**values, parts=each, equality_p=equality_p, curves_p=curves_p, spread=spread)


def _curves_test(whole: Fit, each: Sequence[Fit]) -> float:
    """Chi-square test of all recordings' wavelet variances against the joint model."""
    statistic, levels = 0.0, 0
    for part in each:
        found = FittedMoments.of(whole.model, part.wv, whole.discrepancy, is_free=False)
        if np.any(found.implied <= 0.0):
            return float("nan")
        statistic += chi_square(found.target, found.implied, found.covariance, found.implied)[1]
        levels += found.target.size
    dof = levels - len(whole.keys)
    return float(chi2.sf(statistic, dof)) if dof > 0 else float("nan")


def _heterogeneity(whole: Fit, each: Sequence[Fit]) -> tuple[float, dict[str, float]]:
    """p-value of equal parameters (positive ones as logarithms), and the spread of each."""
    keys = [key for key in whole.keys if key not in whole.upper_bounds]
    positive = _positive(whole.model)
    points, matrices = [], []
    for fit in each:
        if not set(keys) <= set(fit.keys) - set(fit.upper_bounds):
            continue
        values = np.array([fit.params[key] for key in keys])
        logged = np.array([key in positive for key in keys])
        scale = np.where(logged, values, 1.0)
        order = [fit.keys.index(key) for key in keys]
        matrix = fit.covariance[np.ix_(order, order)] / np.outer(scale, scale)
        if np.linalg.matrix_rank(matrix, hermitian=True) < len(keys):
            continue
        matrices.append(matrix)
        points.append(np.where(logged, np.log(np.where(logged, values, 1.0)), values))
    if len(points) < 2 or not keys:
        return float("nan"), {}
    spread = {
        key: between(np.array([p[k] for p in points]), np.array([m[k, k] for m in matrices]))[0]
        for k, key in enumerate(keys)
    }
    information = [np.linalg.inv(matrix) for matrix in matrices]
    centre = np.linalg.solve(
        np.sum(information, axis=0),
        np.sum([i @ p for i, p in zip(information, points, strict=True)], axis=0),
    )
    away = [point - centre for point in points]
    statistic = sum(a @ i @ a for a, i in zip(away, information, strict=True))
    known = {key: value for key, value in spread.items() if np.isfinite(value)}
    return float(chi2.sf(statistic, (len(points) - 1) * len(keys))), known


def _positive(model: Model) -> set[str]:
    """Keys of the parameters that cannot be negative."""
    return {i.key for i in model.parameters if i.parameter.lower == 0.0}


def between(values: FloatArray, variances: FloatArray) -> tuple[float, float]:
    """Standard deviation between recordings beyond their errors, and p-value of equality.

    The moment estimate of DerSimonian & Laird (1986). NaN where one recording has all the weight.
    """
    weight = 1.0 / variances
    if not np.max(weight) < (1.0 - _LEAST_SHARE) * np.sum(weight):
        return float("nan"), float("nan")
    centre = np.sum(weight * values) / np.sum(weight)
    square, dof = float(np.sum(weight * (values - centre) ** 2)), values.size - 1
    scale = np.sum(weight) - np.sum(weight**2) / np.sum(weight)
    return float(np.sqrt(max((square - dof) / scale, 0.0))), float(chi2.sf(square, dof))
