"""Upper limits of amplitudes that are zero, or not significantly above it."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from scipy.optimize import brentq
from scipy.special import gammaincinv, ndtr, ndtri

from gmwm._core.typing import FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.problem.information import information_with
from gmwm.estimate.problem.moments import Scales
from gmwm.estimate.problem.parameters import Coordinates
from gmwm.process import Process
from gmwm.variance import WaveletVariance

_LEAST_QUANTILE = 1e-9  # of a chi-square: keeps the limit of a level without information finite
_NEGLIGIBLE = 1e-3  # of an upper limit: an amplitude that changes no standard error


def upper_limits(
    coordinates: Coordinates,
    processes: Sequence[Process],
    present: Sequence[int],
    covariance: FloatArray,
    unrestricted: Mapping[int, tuple[float, float]],
    wv: WaveletVariance,
) -> dict[int, float]:
    """95 % upper limits of scales that are zero, or have no shape and are not significant, by term.

    present, covariance: Coordinates of the terms that have an amplitude, and their (d, d).
    unrestricted: Other terms, with the amplitude and the standard error that they would have
        without the restriction to positive values.
    """
    estimates = {i: (*found, 0.0) for i, found in unrestricted.items()}
    for k, variance in zip(present, np.diag(covariance), strict=True):
        i, is_amplitude = coordinates.owners[k]
        term, deviation = coordinates.terms[i], float(np.sqrt(variance))
        if is_amplitude and not term.n_shapes and deviation > 1.0 / tuning.SIGNIFICANT:
            scale = float(processes[i].values[term.linear.name] or 0.0)
            amplitude = scale**term.linear.power
            estimates[i] = (amplitude, deviation * amplitude, amplitude)
    absent = {i for k, (i, _) in enumerate(coordinates.owners) if k not in present}
    limits = {}
    for i, estimate in estimates.items():
        limit = upper_amplitude(coordinates, processes, i, estimate, wv, absent)
        limits[i] = max(limit, 0.0) ** (1.0 / coordinates.terms[i].linear.power)
    return limits


def quantile_above_zero(centre: float, deviation: float) -> float:
    """95 % quantile of N(centre, deviation^2) restricted to positive values."""
    tail = ndtr(centre / deviation) * (1.0 - tuning.UPPER_LEVEL)
    return centre - deviation * float(ndtri(tail))


def upper_amplitude(
    coordinates: Coordinates,
    processes: Sequence[Process],
    term: int,
    estimate: tuple[float, float, float],
    wv: WaveletVariance,
    absent: Collection[int] = (),
) -> float:
    """95 % upper limit of a term's amplitude, in the power that the spectrum is linear in.

    The larger the true value, the more its estimate varies: a random walk that can hardly be seen
    shows in few degrees of freedom. So the limit is the amplitude whose own estimate lies below the
    one found in 5 % of records: with the standard error of a vanishing amplitude, and beside it the
    spread of a chi-square with the degrees of freedom by which the amplitude raises that error. It
    does not exceed the amplitude that explains all of the variance at any level.

    coordinates, processes: Of all noise terms, which have values.
    estimate: The amplitude without the restriction to positive values, its standard error, and the
        amplitude at which that standard error holds.
    """
    centre, deviation, at = estimate
    most = _all_of_the_variance(processes[term], wv)
    kept = [i for i in range(len(processes)) if i == term or i not in absent]
    coordinates = coordinates.without([i for i in absent if i != term])
    processes, term = [processes[i] for i in kept], kept.index(term)
    plain = min(quantile_above_zero(centre, deviation), most)
    if not (np.isfinite(plain) and plain > 0.0 and all(p.has_spectrum() for p in processes)):
        return plain
    owners = coordinates.owners
    free = [k for k, (i, is_amplitude) in enumerate(owners) if i != term or is_amplitude]
    place = free.index(owners.index((term, True)))
    present = [p.with_amplitude(plain) if i == term else p for i, p in enumerate(processes)]
    information_at = information_with(coordinates, present, term, wv.n, wv.dt)

    def error(amplitude: float) -> float:
        """Standard error of the amplitude where it is the true one, at the present shape."""
        information = information_at(amplitude)[np.ix_(free, free)]
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


def _all_of_the_variance(process: Process, wv: WaveletVariance) -> float:
    """Smallest 95 % upper limit over the levels of an amplitude that explains all variance."""
    alone = Scales.of(wv).curve(process.with_amplitude(1.0))
    tail = (1.0 - tuning.UPPER_LEVEL) / wv.tau.size
    quantile = np.maximum(2.0 * gammaincinv(0.5 * wv.dof, tail), _LEAST_QUANTILE)
    upper = wv.dof * wv.variance / quantile
    known = (alone > 0.0) & (wv.variance > 0.0)
    return float(np.min(upper[known] / alone[known], initial=np.inf))
