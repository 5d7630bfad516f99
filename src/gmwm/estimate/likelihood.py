"""Exact Gaussian likelihood of a series by the Kalman filter.

The series is ``c + R t + noise``. The constant and the slope have flat priors and are integrated
out (the diffuse, or restricted, likelihood: Harville 1974, *Biometrika* 61, 383-385; Durbin &
Koopman 2012, *Time Series Analysis by State Space Methods*, ch. 5), so that correlation times of
the order of the record are not taken for a drift that was removed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gmwm._typing import FloatArray
from gmwm.estimate.kalman import whiten
from gmwm.process import Process, StateSpace


@dataclass(frozen=True, eq=False)
class Regression:
    """Generalized least squares of whitened regressors.

    Attributes
    ----------
    beta : (k,) ndarray
        Coefficients.
    covariance : (k, k) ndarray
    residual : float
        Sum of squares that is left.
    log_determinant : float
        Of the regressors' information matrix.
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

    Parameters
    ----------
    values : (n,) ndarray
        NaN where missing.
    dt : float
        Sampling interval, s.
    drift : float or None
        Given slope, u/s, which is removed; ``None`` to estimate it.
    has_drift : bool
        Whether the model has a ramp at all.
    """

    def __init__(self, values: FloatArray, dt: float, drift: float | None, has_drift: bool) -> None:
        n = values.size
        self.dt, self.n = dt, n
        self.drift_is_free = has_drift and drift is None
        k = np.arange(n)
        self._half = max(0.5 * (n - 1), 1.0)
        series = values if not has_drift or drift is None else values - drift * dt * k
        # Remove the mean first: a large constant would cost digits.
        columns = [series - np.nanmean(series), np.ones(n)]
        if self.drift_is_free:
            columns.append(k / self._half - 1.0)
        self.matrix = np.column_stack(columns)

    @classmethod
    def without_regressors(cls, values: FloatArray, dt: float) -> Columns:
        """A series of zero mean alone."""
        columns = cls(values, dt, None, False)
        columns.matrix = np.ascontiguousarray(values[:, None])
        return columns

    def slope(self, regression: Regression) -> tuple[float, float]:
        """Slope (u/s) and its variance ((u/s)^2) from the last regressor."""
        unit = 1.0 / (self._half * self.dt)
        return float(regression.beta[-1]) * unit, float(regression.covariance[-1, -1]) * unit**2


def stacked(processes: Sequence[Process], dt: float) -> StateSpace:
    """State space of the sum of processes."""
    return StateSpace.stack([process.state_space(dt) for process in processes])


def whitened(columns: Columns, processes: Sequence[Process]) -> tuple[FloatArray, float, int]:
    """`gmwm.estimate.kalman.whiten` of the columns under a sum of processes."""
    space = stacked(processes, columns.dt)
    return whiten(
        space.transition,
        space.process_noise,
        space.output,
        space.measurement_noise,
        space.initial_covariance,
        columns.matrix,
    )


class KalmanLikelihood:
    """Diffuse log-likelihood of a series under sums of processes with a state space.

    Parameters
    ----------
    columns : Columns
    """

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
