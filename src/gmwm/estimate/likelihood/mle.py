"""Maximum likelihood: exact by the Kalman filter, or Whittle's for long series."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import scipy

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.likelihood.conclusion import (
    Top,
    conclude_likelihood,
    deviations,
    gradient,
    maximise,
    observed_information,
    redundant_term,
    regular_inverse,
)
from gmwm.estimate.likelihood.likelihood import (
    Columns,
    KalmanLikelihood,
    Objective,
    Regression,
    Series,
    WhittleLikelihood,
    defined,
    have_states,
    objective_of,
    whitened,
)
from gmwm.estimate.moments import Design
from gmwm.estimate.problem import (
    Coordinates,
    Moments,
    Scales,
    solve_nonnegative,
    spectral_information,
)
from gmwm.estimate.result import Fit
from gmwm.issues import notice
from gmwm.process import Model, Process, as_model
from gmwm.readers import Channel

_SEGMENT = 1 << 16  # samples whose likelihood is computed exactly, for the beginning
_LOG2_COUNT = 3  # of the candidates
_LEAST_LEFT = 0.01  # share of a wavelet variance that is left after removing a drift
_SMALL = 0.1  # share of the variance that a term which is not needed starts with

Climb = Callable[[Coordinates, tuple[Process, ...]], Top]


@dataclass(frozen=True)
class MLE:
    """Exact maximum likelihood by the Kalman filter, ``method="mle"``.

    Parameters
    ----------
    start : Process or Model, optional
        The same model with starting values; by default the estimates of the method of moments.

    Raises
    ------
    InputError
        If ``start`` is not a model.
    """

    start: Process | Model | None = None

    name: ClassVar[str] = "mle"

    def __post_init__(self) -> None:
        if self.start is not None:
            as_model(self.start)

    def estimate(self, model: Model, channel: Channel) -> Fit:
        """Fit the open parameters of a model to samples, some of which may be missing."""
        if any(term.is_line and term.is_open for term in model.terms):
            raise InputError(
                'method = "mle" does not support an open Sinusoid (its amplitude and frequency are '
                'not parameters of a spectrum): give it values, or use method="gmwm"'
            )
        for term in model.terms:
            if term.is_band_limited:
                raise InputError(
                    f'method = "mle" does not support {type(term).__name__}, which has no '
                    'exact state-space form: use method="gmwm" or "whittle"'
                )
        series = Series.of(model, channel, self.start, exact=True)
        columns = series.columns
        likelihood = KalmanLikelihood(columns)

        def climb(coordinates: Coordinates, first: tuple[Process, ...]) -> Top:
            information = spectral_information(coordinates, first, columns.n, columns.dt)
            objective = objective_of(likelihood, coordinates, first)
            found = maximise(objective, coordinates.pack(first), information)
            observed = observed_information(objective, found.z, information)
            processes = coordinates.processes(found.z, first)
            return Top(coordinates, processes, found, observed, likelihood)

        return _fit(series, climb, self.name)


@dataclass(frozen=True)
class Whittle(MLE):
    """The debiased Whittle likelihood by FFT, for long series, ``method="whittle"``.

    Parameters
    ----------
    start
        As of `MLE`.
    """

    name: ClassVar[str] = "whittle"

    def estimate(self, model: Model, channel: Channel) -> Fit:
        """Fit the open parameters of a model to samples, all of which must exist."""
        if any(term.is_line for term in model.terms):
            raise InputError('method = "whittle" does not support a Sinusoid: use method="gmwm"')
        series = Series.of(model, channel, self.start, exact=False)

        def climb(coordinates: Coordinates, first: tuple[Process, ...]) -> Top:
            return _climb_whittle(series.columns, coordinates, first)

        return _fit(series, climb, self.name)


def _climb_whittle(columns: Columns, coordinates: Coordinates, first: tuple[Process, ...]) -> Top:
    """Maximise, and whiten anew with the estimates, until they stay.

    A stationary filter predicts the beginning of a series from a past that it does not have; the
    gradient of the difference to the exact likelihood of a first part makes up for that.
    """
    information = spectral_information(coordinates, first, columns.n, columns.dt)
    deviation = np.sqrt(np.diag(regular_inverse(information)))
    alone = deviations(information)
    processes = first
    for _ in range(tuning.PREWHITENING_ROUNDS):
        whittle = WhittleLikelihood(columns, processes)
        origin = coordinates.pack(processes)
        residual = columns.matrix[:_SEGMENT, 0] - columns.matrix[:_SEGMENT, 1:] @ (
            whittle.regression.beta
        )
        part = Columns.without_regressors(residual, columns.dt)
        tilt = np.zeros_like(origin)
        if have_states(processes):
            exact = objective_of(KalmanLikelihood(part), coordinates, processes)
            spectral = objective_of(WhittleLikelihood(part, processes), coordinates, processes)
            tilt = gradient(exact, origin, alone) - gradient(spectral, origin, alone)
        objective = _tilted(objective_of(whittle, coordinates, processes), origin, tilt)
        found = maximise(objective, origin, information)
        reached = coordinates.processes(found.z, processes)
        if not np.isfinite(defined(KalmanLikelihood(columns), reached)):
            # Only the exact likelihood ends a climb along a direction that the data hardly know.
            found = replace(found, z=origin, converged=False)
            break
        processes = reached
        if np.all(np.abs(found.z - origin) < tuning.PREWHITENING_SETTLED * deviation):
            break
    observed = observed_information(objective, found.z, information)
    return Top(coordinates, processes, found, observed, whittle)


def _tilted(objective: Objective, origin: FloatArray, tilt: FloatArray) -> Objective:
    return lambda z: objective(z) + float(tilt @ (z - origin))


def _fit(series: Series, climb: Climb, method: str) -> Fit:
    """Climb, drop terms that the likelihood can do without, and climb again."""
    coordinates, processes = series.coordinates, list(series.start)
    absent: list[int] = []
    while True:
        present = [i for i in range(len(processes)) if i not in absent]
        part = coordinates.without(absent)
        top = climb(part, tuple(processes[i] for i in present))
        if not absent and not series.start_is_valid:
            # From another candidate, if that lies above the top already.
            likelihood = KalmanLikelihood(series.columns)
            reached = defined(likelihood, top.processes)
            places = [_rescaled(point, series) for point in candidates(series)]
            height, best = max(places, key=lambda place: place[0], default=(-np.inf, ()))
            if height > reached:
                other = climb(coordinates, best)
                top = other if defined(likelihood, other.processes) > reached else top
        for i, process in zip(present, top.processes, strict=True):
            processes[i] = process
        redundant = redundant_term(part, top.processes, top.likelihood)
        if redundant is None:
            break
        absent.append(present[redundant])
    notices = []
    if not top.maximum.converged:
        notices.append(notice("not-converged"))
    if np.any(np.linalg.eigvalsh(top.information) <= 0.0):
        notices.append(notice("no-curvature"))
    return conclude_likelihood(series, processes, absent, top, method, notices)


def _rescaled(processes: tuple[Process, ...], series: Series) -> tuple[float, tuple[Process, ...]]:
    """Likelihood and terms with all variances times the factor of highest likelihood.

    Innovations keep their proportions when all variances grow alike, so that the factor is their
    mean square. Where an amplitude is given nothing is changed.
    """
    coordinates, columns = series.coordinates, series.columns
    amplitudes = np.array([is_amplitude for _, is_amplitude in coordinates.owners])
    if np.sum(amplitudes) < len(processes):
        return defined(KalmanLikelihood(columns), processes), processes
    try:
        with np.errstate(all="ignore"):
            innovations, log_variance, count = whitened(columns, processes)
            regression = Regression.of(innovations.T @ innovations)
            free = count - regression.beta.size
            log_factor = np.log(regression.residual / free)
            z = coordinates.pack(processes)
            z[amplitudes] += log_factor
            moved = coordinates.processes(z, processes)
    except (InputError, np.linalg.LinAlgError, ZeroDivisionError):
        return -np.inf, processes
    height = -0.5 * (
        free * (np.log(2.0 * np.pi) + 1.0 + log_factor) + log_variance + regression.log_determinant
    )
    return float(height) if np.isfinite(height) else -np.inf, moved


def candidates(series: Series) -> list[tuple[Process, ...]]:
    """Values of the noise terms of a series' model, eight sets where a shape is open.

    Where the model is not that of the data, the estimates by the method of moments may lie in a
    corner from which the likelihood does not climb to its top. A few points spread over the shapes
    that the record can show (a Sobol sequence: Sobol 1967, *USSR Computational Mathematics and
    Mathematical Physics* 7, 86-112), each with amplitudes near the wavelet variances, cost one
    likelihood each.
    """
    try:
        design = Design(Model(series.coordinates.noise), Scales.of(series.wv))
    except InputError:
        return []  # no grid for coefficients of which only some are given
    moments = Moments.of(series.wv, series.coordinates.model)
    target = np.maximum(moments.target, _LEAST_LEFT * series.wv.variance)
    points = np.zeros((1, 0))
    if design.shaped:
        sequence = scipy.stats.qmc.Sobol(len(design.shaped), scramble=False)
        points = sequence.random_base2(_LOG2_COUNT) + 0.5 / 2**_LOG2_COUNT
    given = [i for i in range(len(design.terms)) if i not in design.linear]
    found = []
    for point in points:
        fractions = dict(zip(design.shaped, point, strict=True))
        grids = [design.grid(i) for i in range(len(design.terms))]
        shapes = [grid[int(fractions.get(i, 0.0) * len(grid))] for i, grid in enumerate(grids)]
        # Amplitudes of least relative squares, all of them positive.
        curves = design.curves(shapes) / target[:, None]
        free = curves[:, list(design.linear)]
        x, _ = solve_nonnegative(free, 1.0 - curves[:, given].sum(axis=1))
        highest = np.maximum(np.max(free, axis=0, initial=0.0), np.finfo(float).tiny)
        found.append(tuple(design.fitted_processes(np.maximum(x, _SMALL / highest), shapes)))
    return found
