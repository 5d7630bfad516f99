"""Upper bounds of amplitudes that are not significantly above zero."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.special import gammaincinv, ndtr, ndtri

from gmwm.estimate import tuning
from gmwm.estimate.problem import Coordinates, Scales, information_with
from gmwm.process import Process
from gmwm.variance import WaveletVariance

_LEAST_QUANTILE = 1e-9  # keeps levels that say nothing in numbers
_NEGLIGIBLE = 1e-3  # of that bound: an amplitude that changes no standard error


def quantile_above_zero(centre: float, deviation: float) -> float:
    """95 % quantile of N(centre, deviation^2) restricted to positive values."""
    tail = ndtr(centre / deviation) * (1.0 - tuning.UPPER_LEVEL)
    return centre - deviation * float(ndtri(tail))


def upper_amplitude(
    coordinates: Coordinates,
    processes: Sequence[Process],
    term: int,
    centre: float,
    deviation: float,
    at: float,
    wv: WaveletVariance,
) -> float:
    """95 % upper bound of a term's amplitude, in the power that the spectrum is linear in.

    An estimate varies by more, the larger the true value is: a random walk that can hardly be seen
    shows in few degrees of freedom. So the bound is the amplitude whose own estimate lies below the
    one found in 5 % of records: with the standard error of a vanishing amplitude, and beside it the
    spread of a chi-square with the degrees of freedom by which the amplitude raises that error.

    coordinates: Of the terms that have an amplitude, and this one.
    processes: These terms with values.
    term: Which of them.
    centre, deviation: The estimate without the restriction to positive values, and its standard
        error.
    at: The amplitude under which that is its standard error.
    wv: The data.
    Returns: a bound no larger than all of the variance at any level, and its error, leave room for.
    """
    most = _whole(processes[term], wv)
    plain = min(quantile_above_zero(centre, deviation), most)
    if not (np.isfinite(plain) and plain > 0.0 and all(p.has_spectrum() for p in processes)):
        return plain
    owners = coordinates.owners
    kept = [k for k, (i, is_amplitude) in enumerate(owners) if i != term or is_amplitude]
    place = kept.index(owners.index((term, True)))

    present = [p.with_amplitude(plain) if i == term else p for i, p in enumerate(processes)]
    information_at = information_with(coordinates, present, term, wv.n, wv.dt)

    def error(amplitude: float) -> float:
        """Standard error of the amplitude where it is the true one, at the present shape."""
        information = information_at(amplitude)[np.ix_(kept, kept)]
        scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
        inverse = np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-10)
        variance = inverse[place, place]
        return float(amplitude * scale[place] * np.sqrt(variance)) if variance > 0.0 else np.nan

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
            below = 1.0 - 2.0 * float(gammaincinv(0.5 * dof, 1.0 - tuning.UPPER_LEVEL)) / dof
        spread = np.hypot(least, amplitude * below / ndtri(tuning.UPPER_LEVEL))
        return amplitude - quantile_above_zero(centre, float(spread))

    # Terms that stand in for each other leave their amplitudes open, but not beyond the data.
    if most <= plain or excess(np.log(plain)) >= 0.0:
        return plain
    if excess(np.log(most)) <= 0.0:
        return most
    return float(np.exp(brentq(excess, np.log(plain), np.log(most))))


def _whole(process: Process, wv: WaveletVariance) -> float:
    """95 % upper bound of an amplitude to which every level is due, whichever has the least.

    Of levels whose variance is positive: across gaps it need not be.
    """
    alone = Scales.of(wv).curve(process.with_amplitude(1.0))
    tail = (1.0 - tuning.UPPER_LEVEL) / wv.tau.size
    upper = (
        wv.dof * wv.variance / np.maximum(2.0 * gammaincinv(0.5 * wv.dof, tail), _LEAST_QUANTILE)
    )
    known = (alone > 0.0) & (wv.variance > 0.0)
    return float(np.min(upper[known] / alone[known], initial=np.inf))
