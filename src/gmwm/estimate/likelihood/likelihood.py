"""Exact Gaussian likelihood of a series by the Kalman filter.

The series is ``c + R t + noise``. The constant and the slope have flat priors and are integrated
out (the diffuse, or restricted, likelihood: Harville 1974, *Biometrika* 61, 383-385; Durbin &
Koopman 2012, *Time Series Analysis by State Space Methods*, ch. 5), so that correlation times of
the order of the record are not taken for a drift that was removed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.likelihood.kalman import whiten
from gmwm.estimate.likelihood.scoring import Objective
from gmwm.estimate.problem import Coordinates
from gmwm.process import Process, StateSpace

LogLikelihood = Callable[[Sequence[Process]], float]

_NO_VARIANCE = 1e-12  # of a first sample, as a share of that of one step


@dataclass(frozen=True, eq=False)
class Regression:
    """Generalized least squares of whitened regressors.

    beta: (k,), coefficients.
    covariance: (k, k).
    residual: Sum of squares that is left.
    log_determinant: Of the regressors' information matrix.
    """

    beta: FloatArray
    covariance: FloatArray
    residual: float
    log_determinant: float

    @classmethod
    def of(cls, products: FloatArray) -> Regression:
        """From the (1 + k, 1 + k) products of the whitened series and regressors."""
        information = products[1:, 1:]
        beta = np.linalg.solve(information, products[1:, 0])
        return cls(
            np.asarray(beta),
            np.asarray(np.linalg.inv(information)),
            float(products[0, 0] - products[0, 1:] @ beta),
            float(np.linalg.slogdet(information)[1]),
        )


class Columns:
    """A series beside its regressors: a constant and, where the model has one, a ramp.

    values: (n,), NaN where missing.
    dt: Sampling interval, s.
    drift: Given slope, u/s, which is removed; ``None`` to estimate it.
    has_drift: Whether the model has a ramp at all.
    """

    def __init__(self, values: FloatArray, dt: float, drift: float | None, has_drift: bool) -> None:
        n = values.size
        self.dt, self.n = dt, n
        self.drift_is_free = has_drift and drift is None
        k = np.arange(n)
        self._half = max(0.5 * (n - 1), 1.0)
        series = values if not has_drift or drift is None else values - drift * dt * k
        # Remove the mean and the line first: large ones would cost digits.
        series = series - np.nanmean(series)
        columns = [series, np.ones(n)]
        self._removed = 0.0
        if self.drift_is_free:
            ramp = k / self._half - 1.0
            centred = np.where(np.isnan(series), 0.0, ramp - np.mean(ramp[~np.isnan(series)]))
            self._removed = float(np.nansum(centred * series) / np.sum(centred**2))
            columns = [series - self._removed * centred, np.ones(n), ramp]
        self.matrix = np.column_stack(columns)

    @classmethod
    def without_regressors(cls, values: FloatArray, dt: float) -> Columns:
        """A series of zero mean alone."""
        columns = cls(values, dt, None, False)
        columns.matrix = np.ascontiguousarray(values[:, None])
        return columns

    @property
    def centred(self) -> FloatArray:
        """The series less its mean alone, (n,)."""
        series = self.matrix[:, 0]
        if self.drift_is_free:
            series = series + self._removed * self.matrix[:, -1]
        return series - np.nanmean(series)

    def slope(self, regression: Regression) -> tuple[float, float]:
        """Slope (u/s) and its variance ((u/s)^2) from the last regressor."""
        unit = 1.0 / (self._half * self.dt)
        value = (self._removed + float(regression.beta[-1])) * unit
        return value, float(regression.covariance[-1, -1]) * unit**2


def stacked(processes: Sequence[Process], dt: float) -> StateSpace:
    """State space of the sum of processes."""
    return StateSpace.stack([process.state_space(dt) for process in processes])


def started(space: StateSpace) -> FloatArray:
    """Covariance of the first state that leaves the first sample a variance, (p, p).

    A walk from zero with (next to) no other noise leaves it none. As the series begins at an
    unknown constant, the walk can as well have made a step before; no contrast knows of it.
    """
    h = space.output
    first = space.measurement_noise + h @ space.initial_covariance @ h
    if first > _NO_VARIANCE * (h @ space.process_noise @ h):
        return space.initial_covariance
    return space.initial_covariance + space.process_noise


def whitened(columns: Columns, processes: Sequence[Process]) -> tuple[FloatArray, float, int]:
    """`gmwm.estimate.likelihood.kalman.whiten` of the columns under a sum of processes."""
    space = stacked(processes, columns.dt)
    return whiten(
        space.transition,
        space.process_noise,
        space.output,
        space.measurement_noise,
        started(space),
        columns.matrix,
    )


class KalmanLikelihood:
    """Diffuse log-likelihood of a series under sums of processes with a state space."""

    def __init__(self, columns: Columns) -> None:
        self.columns = columns

    def __call__(self, processes: Sequence[Process]) -> float:
        """Log-likelihood of these processes; a constant of the regressors is left out."""
        innovations, log_variance, count = whitened(self.columns, processes)
        regression = Regression.of(innovations.T @ innovations)
        free = count - regression.beta.size
        return -0.5 * (
            free * np.log(2.0 * np.pi)
            + log_variance
            + regression.log_determinant
            + regression.residual
        )

    def regression(self, processes: Sequence[Process]) -> Regression:
        """Constant and slope under these processes."""
        innovations, _, _ = whitened(self.columns, processes)
        return Regression.of(innovations.T @ innovations)


def defined(likelihood: LogLikelihood, processes: Sequence[Process]) -> float:
    """The likelihood, minus infinity where the processes give none (no noise at all)."""
    try:
        with np.errstate(all="ignore"):
            value = likelihood(processes)
    except (InputError, np.linalg.LinAlgError, ZeroDivisionError):
        return -np.inf
    return value if np.isfinite(value) else -np.inf


def objective_of(
    likelihood: LogLikelihood, coordinates: Coordinates, like: Sequence[Process]
) -> Objective:
    """The likelihood by coordinates, with given parameters taken from ``like``."""

    def objective(z: FloatArray) -> float:
        try:
            processes = coordinates.processes(z, like)
        except InputError:
            return -np.inf  # a step beyond what a parameter can be
        return defined(likelihood, processes)

    return objective
