"""From the maximum of a likelihood to a result, and terms that it can do without."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from gmwm._core.typing import FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.likelihood.likelihood import (
    Columns,
    LogLikelihood,
    Objective,
    Series,
    defined,
    objective_of,
)
from gmwm.estimate.moments.weights import suffices
from gmwm.estimate.problem.information import density, frequency_nodes
from gmwm.estimate.problem.moments import Compared, Moments
from gmwm.estimate.problem.parameters import Coordinates, difference
from gmwm.estimate.problem.ramp import Slope
from gmwm.estimate.result.bound import upper_limits
from gmwm.estimate.result.conclusion import Estimates, agreement, conclude
from gmwm.estimate.result.fit import Fit
from gmwm.issues import Notice, notice
from gmwm.process import Model, Process

_GRADIENT_STEP = 0.02  # standard errors
_HESSIAN_STEP = 0.1
_LARGEST_STEP = 1.0  # in z: a factor e of an amplitude or a time
_LEAST = 1e-8  # information: of less, the deviation would be 10^4 factors of e
_HALVINGS = 12


@dataclass(frozen=True, eq=False)
class Maximum:
    """Where a log-likelihood is largest: coordinates z, (d,)."""

    z: FloatArray
    value: float
    converged: bool


def maximise(
    objective: Objective,
    start: FloatArray,
    information: FloatArray,
    *,
    close: float = 1e-6,
    max_steps: int = 60,
) -> Maximum:
    """Maximum reached from ``start``, near which the information matrix is ``information``.

    Quasi-Newton steps (Broyden, Fletcher, Goldfarb and Shanno's updates) that start from the
    expected information: the first is a step of Fisher scoring (Osborne 1992, *International
    Statistical Review* 60, 99-117). Differences are taken in steps of the parameters' own standard
    errors. ``close`` is twice the gain in log-likelihood that is not worth another step.
    """
    z = start.copy()
    value = objective(z)
    if z.size == 0:
        return Maximum(z, value, True)
    scale = deviations(information)
    inverse = regular_inverse(information)
    slope = gradient(objective, z, scale)
    for _ in range(max_steps):
        step = inverse @ slope
        promised = float(slope @ step)
        if promised < close:
            return Maximum(z, value, True)
        step /= max(float(np.max(np.abs(step))) / _LARGEST_STEP, 1.0)
        for _ in range(_HALVINGS):
            moved, there = z + step, objective(z + step)
            if np.isfinite(there) and there > value:
                break
            step = 0.5 * step
        else:
            # Rounding errors of the objective are all that is left, or the matrix is bad.
            if promised < 100.0 * close:
                return Maximum(z, value, True)
            if np.array_equal(inverse, np.diag(scale**2)):
                return Maximum(z, value, False)
            inverse = np.diag(scale**2)
            continue
        value, previous = there, slope
        slope = gradient(objective, moved, scale)
        if not np.all(np.isfinite(slope)):  # at the edge of what parameters can be
            return Maximum(moved, value, False)
        step, change, z = moved - z, previous - slope, moved
        curvature = float(step @ change)
        if curvature <= 1e-12 * float(np.linalg.norm(step) * np.linalg.norm(change)):
            continue
        left = np.eye(z.size) - np.outer(step, change) / curvature
        inverse = np.asarray(left @ inverse @ left.T + np.outer(step, step) / curvature)
    return Maximum(z, value, False)


def observed_information(
    objective: Objective, z: FloatArray, information: FloatArray
) -> FloatArray:
    """Minus the matrix of second derivatives, in steps of ``information``'s standard errors.

    Zero where the objective is not finite all around ``z``.
    """
    d = z.size
    scale = _HESSIAN_STEP * np.minimum(deviations(information), 1.0)
    centre = objective(z)
    steps = np.diag(scale)
    ends = np.array([[objective(z + sign * steps[i]) for sign in (1.0, -1.0)] for i in range(d)])
    if not np.all(np.isfinite(ends)):
        return np.zeros((d, d))
    matrix = np.empty((d, d))
    for i in range(d):
        matrix[i, i] = 2.0 * centre - ends[i].sum()
        for j in range(i):
            corners = objective(z + steps[i] + steps[j]) + objective(z - steps[i] - steps[j])
            mixed = corners + 2.0 * centre - ends[i].sum() - ends[j].sum()
            matrix[i, j] = matrix[j, i] = -0.5 * mixed
    if not np.all(np.isfinite(matrix)):
        return np.zeros((d, d))
    return matrix / np.outer(scale, scale)


def regular_inverse(information: FloatArray) -> FloatArray:
    """Inverse on unit diagonal, with directions of no information held to a small one."""
    scale = deviations(information)
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    values = np.maximum(values, 1e-8 * np.max(values, initial=1.0))
    return np.asarray((vectors / values) @ vectors.T * np.outer(scale, scale))


def deviations(information: FloatArray) -> FloatArray:
    """Standard errors of the parameters one by one, finite where there is no information."""
    return np.asarray(1.0 / np.sqrt(np.maximum(np.abs(np.diag(information)), _LEAST)))


def gradient(objective: Objective, z: FloatArray, scale: FloatArray) -> FloatArray:
    """Central differences in steps that are small against ``scale`` (d,)."""
    steps = _GRADIENT_STEP * np.minimum(scale, 1.0)
    return np.array([difference(objective, z, i, step) for i, step in enumerate(steps)])


_CLOSE = 0.02  # twice the error of the profile likelihood
_STEPS = 6  # to each of its points, which lie near each other
_FALL = 6.0  # log-likelihood below its maximum that counts as zero
_DOUBLINGS = 20
_INTERVALS = 16
_FINE = 2000


@dataclass(frozen=True, eq=False)
class Top:
    """The maximum of a likelihood over the open parameters of some terms.

    information: (d, d), observed information of the coordinates.
    likelihood: The log-likelihood of any processes.
    """

    coordinates: Coordinates
    processes: tuple[Process, ...]
    maximum: Maximum
    information: FloatArray
    likelihood: LogLikelihood


def conclude_likelihood(
    series: Series,
    processes: Sequence[Process],
    absent: Sequence[int],
    top: Top,
    method: str,
    notices: Sequence[Notice] = (),
    trace: Sequence[float] = (),
    drift: float | None = None,
) -> Fit:
    """Make the `Fit` of a maximum.

    Where straight lines bridge the gaps, the wavelet variances do not test the model.

    absent: Those among them that the likelihood can do without.
    drift: Slope (u/s) that it has estimated in place of the regression.
    """
    slope = series.columns.slope(top.processes) if series.columns.drift_is_free else None
    if slope is not None and drift is not None:
        slope = Slope(drift, slope.variance)
    owners, covariance = series.coordinates.owners, regular_inverse(top.information)
    processes = [p.with_amplitude(0.0) if i in absent else p for i, p in enumerate(processes)]
    present = [k for k, (i, _) in enumerate(owners) if i not in absent]
    limits = upper_limits(series.coordinates, processes, present, covariance, {}, series.wv)
    limits |= {i: _upper_limit(processes[i], top, series.columns) for i in absent}
    found = Estimates(
        coordinates=series.coordinates,
        processes=processes,
        present=present,
        covariance=covariance,
        limits=limits,
        slope=slope,
        method=method,
        notices=(*notices, notice("no-test")) if series.is_bridged else notices,
        log_likelihood=trace[-1] if trace else top.maximum.value,
        trace=trace,
    )
    wv = series.wv
    moments = Moments.of(wv, series.coordinates.model)
    if slope is not None:
        moments = Moments(wv, slope, True, moments.scales)
    noise = Model(top.processes)
    implied = noise.wavelet_variance(wv.tau, wv.dt, wv.wavelet)
    statistical = moments.covariance(noise)
    compared = Compared(moments.target, implied, statistical, implied, moments.taken)
    agrees = agreement(compared, statistical, len(present))
    misfits = not series.is_bridged and not suffices(0.0, compared, max(agrees["dof"], 1))
    if series.is_bridged:
        agrees |= dict.fromkeys(("chi_square", "chi_square_allowed"), float("nan"))
    return conclude(found, agrees, wv, misfits=misfits)


def redundant_term(
    coordinates: Coordinates, processes: Sequence[Process], likelihood: LogLikelihood
) -> int | None:
    """A term of free amplitude without which the likelihood is as high, if there is one."""
    value = defined(likelihood, processes)
    for i, is_amplitude in coordinates.owners:
        rest = [p for k, p in enumerate(processes) if k != i]
        if is_amplitude and rest and defined(likelihood, rest) > value - tuning.NEGLIGIBLE:
            return i
    return None


def _upper_limit(process: Process, top: Top, columns: Columns) -> float:
    """95 % upper limit of the scale of a term of no amplitude, by its profile likelihood."""
    power = next(p.power for p in process.parameters if p.linear)

    def profile(scale: float) -> float:
        raised = process.with_amplitude(scale**power)

        def likelihood(others: Sequence[Process]) -> float:
            return top.likelihood([*others, raised])

        objective = objective_of(likelihood, top.coordinates, top.processes)
        start, information = top.maximum.z, top.information
        return maximise(objective, start, information, close=_CLOSE, max_steps=_STEPS).value

    f, weight = frequency_nodes(columns.n, columns.dt)
    own = density([process.with_amplitude(1.0)], f, columns.dt)
    information = float(weight @ (own / density(top.processes, f, columns.dt)) ** 2)
    if not information > 0.0:
        return np.inf
    far = information ** (-0.5 / power)
    low = profile(0.0) - _FALL
    for _ in range(_DOUBLINGS):
        if profile(far) < low:
            break
        far *= 2.0
    else:
        return np.inf
    scale = np.linspace(0.0, far, _INTERVALS + 1)
    heights = np.array([max(profile(float(k)), low - _FALL) for k in scale])
    fine = np.linspace(0.0, far, _FINE)
    smooth = scipy.interpolate.PchipInterpolator(scale, heights)(fine)
    share = np.cumsum(np.exp(smooth - np.max(heights)))
    return float(np.interp(tuning.UPPER_LEVEL, share / share[-1], fine))
