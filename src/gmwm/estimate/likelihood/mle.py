"""Maximum likelihood: exact by the Kalman filter, or Whittle's for long series."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

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
    Series,
    WhittleLikelihood,
    defined,
    have_states,
    objective_of,
)
from gmwm.estimate.problem.information import spectral_information
from gmwm.estimate.problem.moments import Scales
from gmwm.estimate.problem.parameters import Coordinates
from gmwm.estimate.result.fit import Fit
from gmwm.issues import notice
from gmwm.process import Model, Process, as_model
from gmwm.readers import Channel

_SEGMENT = 1 << 16  # samples whose likelihood is computed exactly, for the beginning

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
        return _fit(series, partial(_climb_whittle, series.columns), self.name)


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
            # The method of moments may start in a corner from which no climb leads to the top.
            other, exact = climb(coordinates, _spread(series)), KalmanLikelihood(series.columns)
            first, second = (defined(exact, each.processes) for each in (top, other))
            top = other if second > first + tuning.NEGLIGIBLE else top
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


def _spread(series: Series) -> tuple[Process, ...]:
    """The noise terms with shapes spread over the record's, each below the wavelet variances."""
    wv, terms, found = series.wv, series.coordinates.terms, []
    rank, count = 0.5, sum(bool(term.n_shapes) for term in terms)
    for term, process in zip(terms, series.start, strict=True):
        if term.n_shapes:
            grid = list(process.shape_grid(wv.dt, wv.n))
            shape, rank = grid[int(rank / count * len(grid))], rank + 1.0
            if all(term.free_shape):
                process = process.with_shape(shape)
        if term.free_scale:
            alone = Scales.of(wv).curve(process.with_amplitude(1.0))
            ratio = wv.variance / np.maximum(alone, np.finfo(float).tiny)
            process = process.with_amplitude(float(np.min(ratio[wv.variance > 0.0])))
        found.append(process)
    return tuple(found)
