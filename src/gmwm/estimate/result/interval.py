"""Confidence intervals of single parameters, from their standard errors."""

from __future__ import annotations

import numpy as np
from scipy.special import lambertw

from gmwm._core.distributions import student as t
from gmwm.estimate import tuning
from gmwm.process import Parameter

_NO_GROWTH = 1e-6
_EXACT = 1e-12  # relative error


def confidence_interval(
    parameter: Parameter,
    value: float,
    error: float,
    level: float,
    *,
    growth: float = 0.0,
    slope_dof: float = np.inf,
) -> tuple[float, float]:
    """Interval that keeps to the parameter's range.

    That of a positive parameter holds the values that the estimate does not contradict with the
    standard error which would be theirs (Wilson 1927, *JASA* 22, 209-212), where the relative
    standard error goes with ``value^k``; deviations are those of the logarithm. The quantiles are
    Student's t for the degrees of freedom that the relative error stands for: a variance known to
    a relative error of r has 2/r^2 of them.

    value, error: Estimate and standard error.
    level: Probability, between 0 and 1.
    growth: The exponent k, of positive parameters.
    slope_dof: Degrees of freedom of the standard error of a ramp's slope.
    Returns: lower, upper.
    """
    if parameter.lower == 0.0 and value > 0.0:
        relative = error / value
        if relative > tuning.UNDETERMINED:
            return 0.0, parameter.upper
        width = relative * _student(parameter, relative, level)
        low, high = (np.exp(_end(sign * width, growth)) for sign in (-1.0, 1.0))
        return float(value * low), min(float(value * high), parameter.upper)
    dof = slope_dof if parameter.role == "slope" else np.inf
    half_width = float(t.ppf(0.5 + 0.5 * level, max(dof, 1.0))) * error
    return max(value - half_width, parameter.lower), min(value + half_width, parameter.upper)


def _student(parameter: Parameter, relative: float, level: float) -> float:
    """Quantile for the degrees of freedom of a relative standard error.

    No fewer than three: below, the tails of t are heavier than those of a variance's logarithm.
    """
    power = parameter.power if parameter.linear else 1
    dof = 2.0 / max(power * relative, _EXACT) ** 2
    return float(t.ppf(0.5 + 0.5 * level, max(dof, tuning.FEWEST_DOF)))


def _end(width: float, growth: float) -> float:
    """The x with x = width exp(growth x).

    A standard error that grows faster than the deviation leaves no end. The power law is not to
    be trusted that far: then it is the largest deviation that has one, or that of the power of the
    parameter which has a constant standard error, whichever is farther.
    """
    steepness = growth * width
    if abs(steepness) < _NO_GROWTH:
        return width
    if steepness <= np.exp(-1.0):
        return float(-lambertw(-steepness).real / growth)
    constant = -np.log1p(-steepness) if steepness < 1.0 else np.inf
    return float(max(1.0, constant) / growth)
