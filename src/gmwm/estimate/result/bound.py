"""Upper bounds of amplitudes that are not significantly above zero."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, norm

from gmwm.estimate import tuning
from gmwm.estimate.problem import Coordinates, spectral_information
from gmwm.process import Process

_FARTHEST = 1e6  # times the bound under the noise without the term
_STEP = 1.0  # in the logarithm, of the search for the bound
_NEGLIGIBLE = 1e-3  # of that bound: an amplitude that changes no standard error


def quantile_above_zero(centre: float, deviation: float) -> float:
    """95 % quantile of N(centre, deviation^2) restricted to positive values."""
    tail = norm.sf(-centre / deviation) * (1.0 - tuning.UPPER_LEVEL)
    return centre + deviation * float(norm.isf(tail))


def upper_amplitude(
    coordinates: Coordinates,
    processes: Sequence[Process],
    term: int,
    centre: float,
    deviation: float,
    at: float,
    n: int,
    dt: float,
) -> float:
    """95 % upper bound of a term's amplitude, in the power that the spectrum is linear in.

    An estimate varies by more, the larger the true value is: a random walk that can hardly be seen
    shows in few degrees of freedom. So the bound is the amplitude whose own estimate lies below the
    one found in 5 % of records: with the standard error of a vanishing amplitude, and beside it the
    spread of a chi-square with the degrees of freedom by which the amplitude raises that error.

    Parameters
    ----------
    coordinates : Coordinates
        Of the terms that have an amplitude, and this one.
    processes : sequence of Process
        These terms with values.
    term : int
        Which of them.
    centre, deviation : float
        The estimate without the restriction to positive values, and its standard error.
    at : float
        The amplitude under which that is its standard error.
    n : int
    dt : float
        Sampling interval, s.

    Returns
    -------
    float
        Infinite where ``deviation`` is.
    """
    plain = quantile_above_zero(centre, deviation)
    if not (np.isfinite(plain) and plain > 0.0 and all(p.has_spectrum() for p in processes)):
        return plain
    place = coordinates.owners.index((term, True))

    def error(amplitude: float) -> float:
        """Standard error of the amplitude where it is the true one."""
        raised = list(processes)
        raised[term] = raised[term].with_amplitude(amplitude)
        information = spectral_information(coordinates, raised, n, dt)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
        inverse = np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-10)
        return float(amplitude * scale[place] * np.sqrt(inverse[place, place]))

    vanishing, there = (error(max(value, _NEGLIGIBLE * plain)) for value in (0.0, at))
    if not (np.isfinite(vanishing * there) and vanishing > 0.0 and there > 0.0):
        return plain
    least = deviation * vanishing / there
    # An estimate that does not use all information shows it in fewer degrees of freedom too.
    efficiency = float(np.clip((there / deviation) ** 2, tuning.LEAST_EFFICIENCY, 1.0))

    def excess(log_amplitude: float) -> float:
        amplitude = float(np.exp(log_amplitude))
        growth = max(error(amplitude) ** 2 - vanishing**2, 0.0) / amplitude**2 / efficiency
        below = 0.0
        if growth > 0.0:
            dof = 2.0 / growth
            below = 1.0 - float(chi2.ppf(1.0 - tuning.UPPER_LEVEL, dof)) / dof
        spread = np.hypot(least, amplitude * below / tuning.SIGNIFICANT)
        return amplitude - quantile_above_zero(centre, float(spread))

    low = np.log(plain)
    if excess(low) >= 0.0:
        return plain
    while low < np.log(plain * _FARTHEST):
        high = low + _STEP
        if excess(high) > 0.0:
            return float(np.exp(brentq(excess, low, high)))
        low = high
    return plain  # terms that stand in for each other leave no amplitude that the data exclude
