"""How a filter with one sensor model came through outages, and next to one with another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm._core.distributions import student
from gmwm._core.typing import FloatArray
from gmwm.ins import tuning
from gmwm.ins.simulation import InnovationTest, Ratio

PARTS = {"horizontal": (0, 1), "vertical": (2,)}


@dataclass(frozen=True, eq=False)
class Outcome:
    """How the filter with one sensor model came through the outages.

    Attributes
    ----------
    error : (K, 3) ndarray
        Estimate at the end of each outage less the smoothed position: north, east, down, m.
    variance : (K, 3, 3) ndarray
        Of these, as predicted, m^2: by as much as the covariance of the smoothed position less
        than that of the filter, since what both have in common cancels.
    reference_variance : (3,) ndarray
        Mean of the variances of the smoothed positions, m^2.
    rms : dict
        Root mean square of the true errors by part, m: the uncertainty of the reference included.
    predicted : dict
        The same as the filter predicted.
    nees : Ratio
        Per degree of freedom.
    score : (K,) ndarray
        Negative logarithm of the predicted density at the reference; less is better.
    nis : InnovationTest
        Of the whole log.
    """

    error: FloatArray
    variance: FloatArray
    reference_variance: FloatArray
    rms: dict[str, float]
    predicted: dict[str, float]
    nees: Ratio
    score: FloatArray
    nis: InnovationTest


@dataclass(frozen=True)
class Paired:
    """Errors of one model over those of another, outage by outage.

    Attributes
    ----------
    ratio, lower, upper : float
        Ratio of the root mean squares and its interval.
    p_value : float
        Of errors that differ by no more than `gmwm.ins.tuning.TIE_RATIO`.
    score, score_p_value : float
        Mean difference, and the p-value of no more than `gmwm.ins.tuning.TIE_SCORE`.
    error : float
        Standard error of the logarithm of the ratio.
    """

    ratio: float
    lower: float
    upper: float
    p_value: float
    score: float
    score_p_value: float
    error: float


def by_part(squares: FloatArray) -> dict[str, float]:
    """Root mean squares of the horizontal and the vertical part, of squares (K, 3)."""
    return {p: float(np.sqrt(np.mean(np.sum(squares[:, i], axis=1)))) for p, i in PARTS.items()}


def true_squares(outcome: Outcome) -> FloatArray:
    return np.asarray(outcome.error**2 + outcome.reference_variance)


def paired(first: Outcome, second: Outcome, scale: FloatArray) -> Paired:
    """Ratio of the errors, each component in units of its usual size.

    Its standard error is that of the jackknife (Miller 1974, *Biometrika* 61, 1-15): of eight
    outages, some of which are twice as hard as others, intervals then cover 93 to 94 %; by the
    delta method 91 to 93 %.
    """
    a = np.sum(true_squares(first) / scale, axis=1)
    b = np.sum(true_squares(second) / scale, axis=1)
    log = 0.5 * float(np.log(np.sum(a) / np.sum(b)))
    count = a.size
    without = 0.5 * np.log((np.sum(a) - a) / (np.sum(b) - b))
    error = float(np.sqrt((count - 1.0) * np.var(without)))
    width = float(student.ppf(0.5 + 0.5 * tuning.CONFIDENCE, count - 1)) * error
    difference = first.score - second.score
    score_error = float(np.std(difference, ddof=1) / np.sqrt(count))
    mean = float(np.mean(difference))
    return Paired(
        ratio=float(np.exp(log)),
        lower=float(np.exp(log - width)),
        upper=float(np.exp(log + width)),
        p_value=_p_value(tuning.TIE_RATIO, log, error, count),
        score=mean,
        score_p_value=_p_value(tuning.TIE_SCORE, mean, score_error, count),
        error=error,
    )


def _p_value(within: float, value: float, error: float, count: int) -> float:
    """Of a mean that is ``within`` from zero (Hodges & Lehmann 1954, *J. R. Stat. Soc. B* 16)."""
    if error == 0.0:
        return float(abs(value) <= within)
    return float(np.sum(student.sf((abs(value) + np.array([-within, within])) / error, count - 1)))
