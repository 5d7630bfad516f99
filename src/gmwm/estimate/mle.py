"""Maximum likelihood: exact by the Kalman filter, or Whittle's for long series."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.conclusion import conclude
from gmwm.estimate.coordinates import Coordinates
from gmwm.estimate.fit import Fit
from gmwm.estimate.information import (
    density,
    frequency_nodes,
    log_slopes,
    spectral_information,
)
from gmwm.estimate.likelihood import Columns, KalmanLikelihood
from gmwm.estimate.ramp import Slope
from gmwm.estimate.scoring import (
    Maximum,
    Objective,
    gradient,
    maximise,
    observed_information,
    regular_inverse,
)
from gmwm.estimate.series import Series
from gmwm.estimate.uncertainty import quantile_above_zero
from gmwm.estimate.whittle import WhittleLikelihood
from gmwm.process import Model, Process, Sinusoid
from gmwm.recording import Channel

LogLikelihood = Callable[[Sequence[Process]], float]

_NEGLIGIBLE = 1e-4  # log-likelihood lost without a term that is not there
_ROUNDS = 8  # of prewhitening
_SETTLED = 1e-2  # standard errors from round to round
_SEGMENT = 1 << 16  # samples whose likelihood is computed exactly, for the beginning


@dataclass(frozen=True, eq=False)
class Top:
    """The maximum of a likelihood over the open parameters of some terms.

    Attributes
    ----------
    processes : tuple of Process
        The terms at the maximum.
    maximum : Maximum
    information : (d, d) ndarray
        Observed information of the coordinates.
    likelihood : callable
        The log-likelihood of any processes.
    """

    processes: tuple[Process, ...]
    maximum: Maximum
    information: FloatArray
    likelihood: LogLikelihood


Climb = Callable[[Coordinates, tuple[Process, ...]], Top]


def fit_mle(model: Model, channel: Channel, *, start: Process | Model | None = None) -> Fit:
    """Exact maximum likelihood; see `gmwm.fit` for the parameters."""
    series = Series.of(model, channel, start, gaps=True)
    columns = series.columns
    likelihood = KalmanLikelihood(columns)

    def climb(coordinates: Coordinates, first: tuple[Process, ...]) -> Top:
        information = spectral_information(coordinates, first, columns.n, columns.dt)
        objective = _objective(likelihood, coordinates, first)
        found = maximise(objective, coordinates.pack(first), information)
        observed = observed_information(objective, found.z, information)
        return Top(coordinates.processes(found.z, first), found, observed, likelihood)

    return _fit(series, climb, "mle")


def fit_whittle(model: Model, channel: Channel, *, start: Process | Model | None = None) -> Fit:
    """Debiased Whittle likelihood; see `gmwm.fit` for the parameters."""
    if any(isinstance(term, Sinusoid) for term in model.terms):
        raise InputError('method = "whittle" knows no Sinusoid: take "mle" or "gmwm"')
    series = Series.of(model, channel, start, gaps=False)

    def climb(coordinates: Coordinates, first: tuple[Process, ...]) -> Top:
        return _climb_whittle(series.columns, coordinates, first)

    return _fit(series, climb, "whittle")


def _objective(
    likelihood: LogLikelihood, coordinates: Coordinates, like: Sequence[Process]
) -> Objective:
    def objective(z: FloatArray) -> float:
        try:
            processes = coordinates.processes(z, like)
        except InputError:
            return -np.inf  # a step beyond what a parameter can be
        return _defined(likelihood, processes)

    return objective


def _climb_whittle(columns: Columns, coordinates: Coordinates, first: tuple[Process, ...]) -> Top:
    """Maximise, and whiten anew with the estimates, until they stay.

    The beginning of a series, which has no past to be predicted from, is no stationary filter's;
    the gradient of the difference to the exact likelihood of a first part makes up for that.
    """
    information = spectral_information(coordinates, first, columns.n, columns.dt)
    deviation = np.sqrt(np.diag(regular_inverse(information)))
    processes = first
    for _ in range(_ROUNDS):
        whittle = WhittleLikelihood(columns, processes)
        z = coordinates.pack(processes)
        residual = columns.matrix[:_SEGMENT, 0] - columns.matrix[:_SEGMENT, 1:] @ (
            whittle.regression.beta
        )
        part = Columns.without_regressors(residual, columns.dt)
        exact = _objective(KalmanLikelihood(part), coordinates, processes)
        spectral = _objective(WhittleLikelihood(part, processes), coordinates, processes)
        scale = 1.0 / np.sqrt(np.diag(information))
        tilt = gradient(exact, z, scale) - gradient(spectral, z, scale)
        objective = _tilted(_objective(whittle, coordinates, processes), z, tilt)
        found = maximise(objective, z, information)
        processes = coordinates.processes(found.z, processes)
        if np.all(np.abs(found.z - z) < _SETTLED * deviation):
            break
    observed = observed_information(objective, found.z, information)
    return Top(processes, found, observed, whittle)


def _tilted(objective: Objective, origin: FloatArray, tilt: FloatArray) -> Objective:
    return lambda z: objective(z) + float(tilt @ (z - origin))


def _fit(series: Series, climb: Climb, method: str) -> Fit:
    coordinates, processes = series.coordinates, list(series.start)
    absent: list[int] = []
    while True:
        present = [i for i in range(len(processes)) if i not in absent]
        part = coordinates.without(absent)
        top = climb(part, tuple(processes[i] for i in present))
        for i, process in zip(present, top.processes, strict=True):
            processes[i] = process
        idle = _idle(part, top)
        if idle is None:
            break
        absent.append(present[idle])
    covariance = regular_inverse(top.information)
    remarks = [] if top.maximum.converged else ["the maximum of the likelihood was not reached"]
    if np.any(np.linalg.eigvalsh(top.information) <= 0.0):
        remarks.append("the likelihood has no curvature in some direction: too many parameters")
    bounds = {i: _upper_bound(processes[i], part, top, series.columns) for i in absent}
    final = [p.with_amplitude(0.0) if i in absent else p for i, p in enumerate(processes)]
    slope = None
    if series.columns.drift_is_free:
        regression = KalmanLikelihood(series.columns).regression(top.processes)
        slope = Slope(*series.columns.slope(regression))
    return conclude(
        coordinates, final, covariance, slope, series.wv, method=method,
        log_likelihood=top.maximum.value, absent=bounds, remarks=remarks,
    )  # fmt: skip


def _idle(coordinates: Coordinates, top: Top) -> int | None:
    """A term of free amplitude without which the likelihood is as high, if there is one."""
    value = top.likelihood(top.processes)
    for i, is_amplitude in coordinates.owners:
        rest = [p for k, p in enumerate(top.processes) if k != i]
        if is_amplitude and rest and _defined(top.likelihood, rest) > value - _NEGLIGIBLE:
            return i
    return None


def _defined(likelihood: LogLikelihood, processes: Sequence[Process]) -> float:
    """The likelihood, minus infinity where the processes give none (no noise at all)."""
    try:
        value = likelihood(processes)
    except (InputError, np.linalg.LinAlgError, ZeroDivisionError):
        return -np.inf
    return value if np.isfinite(value) else -np.inf


def _upper_bound(process: Process, coordinates: Coordinates, top: Top, columns: Columns) -> float:
    """95 % upper bound of the scale of a term whose amplitude is zero, at its present shape.

    From the normal distribution of the unconstrained amplitude, whose mean is the score at zero
    over the information left by the other parameters.
    """
    unit = process.with_amplitude(1.0)
    f, weight = frequency_nodes(columns.n, columns.dt)
    others = log_slopes(coordinates, top.processes, f, columns.dt)
    own = density([unit], f, columns.dt) / density(top.processes, f, columns.dt)
    root = np.sqrt(weight)[:, None]
    basis, _ = np.linalg.qr(root * others)
    left = root[:, 0] * own
    left = left - basis @ (basis.T @ left)
    deviation = 1.0 / float(np.linalg.norm(left))
    small = 0.01 * deviation
    raised = top.likelihood([*top.processes, process.with_amplitude(small)])
    score = (raised - top.likelihood(top.processes)) / small
    power = next(p.power for p in process.parameters if p.linear)
    return quantile_above_zero(score * deviation**2, deviation) ** (1.0 / power)
