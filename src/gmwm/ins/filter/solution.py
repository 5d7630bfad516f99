"""The result of a navigation filter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.errors import InputError
from gmwm.ins.geometry import matrix_from_rpy, ned_difference, rpy_from_matrix
from gmwm.ins.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class FilterInnovations:
    """Measurements less what the filter expected, component by component.

    Attributes
    ----------
    time : (E,) ndarray
        s.
    kind : (E,) ndarray of int
        Codes of `gmwm.ins.filter.KINDS`.
    value, sd : (E, 3) ndarray
        Each component given those before it, with the standard deviation that the filter expected;
        so ``value / sd`` is white with unit variance if the filter is right. NaN where a component
        was not measured, or not reached.
    used : (E,) ndarray of bool
        False where the measurement was beyond its gate, and was not used.
    """

    time: FloatArray
    kind: IntArray
    value: FloatArray
    sd: FloatArray
    used: BoolArray

    @property
    def standard(self) -> FloatArray:
        """``value / sd``, (E, 3)."""
        return self.value / self.sd

    @property
    def nis(self) -> FloatArray:
        """Normalised innovation squared of each measurement, (E,); NaN where it was not reached.

        Its degrees of freedom are the components in use.
        """
        squares = self.standard**2
        reached = np.any(np.isfinite(squares), axis=1)
        return np.where(reached, np.nansum(squares, axis=1), np.nan)


@dataclass(frozen=True, eq=False)
class Solution:
    """Position, velocity and attitude with their covariance at K epochs.

    Attributes
    ----------
    time : (K,) ndarray
        s since the first epoch.
    before : (K,) ndarray of bool
        Whether the measurements of the epoch are not in yet.
    lla : (K, 3) ndarray
        Latitude, longitude, rad, and height, m.
    velocity : (K, 3) ndarray
        To the north, east and down, m/s.
    matrix : (K, 3, 3) ndarray
        Attitude C_bn.
    covariance : (K, 9, 9) ndarray
        Of the errors of position (north, east, down, m), velocity (m/s) and attitude (rotation
        about north, east and down, rad).
    sensor_errors : (K, 6) ndarray
        Estimated errors of the sensors without their white noise, rad/s and m/s^2.
    sensor_covariance : (K, 6, 6) ndarray
    innovations : FilterInnovations
    state_names : tuple of str
        Of the sensor states.
    states, state_covariance : (m,) ndarray, (m, m) ndarray
        Sensor states at the last epoch.
    diverged_at : float or None
        Time at which the filter was stopped because it had diverged, s.
    """

    time: FloatArray
    before: BoolArray
    lla: FloatArray
    velocity: FloatArray
    matrix: FloatArray
    covariance: FloatArray
    sensor_errors: FloatArray
    sensor_covariance: FloatArray
    innovations: FilterInnovations
    state_names: tuple[str, ...]
    states: FloatArray
    state_covariance: FloatArray
    diverged_at: float | None = None

    @property
    def rpy(self) -> FloatArray:
        """Roll, pitch and yaw, rad, (K, 3)."""
        return rpy_from_matrix(self.matrix)

    @property
    def sd(self) -> FloatArray:
        """Predicted standard deviations of the nine navigation errors, (K, 9)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    def errors(self, truth: Trajectory) -> FloatArray:
        """Estimate less truth, (K, 9), in the order of ``covariance``.

        Raises InputError if it ends before the solution.

        Parameters
        ----------
        truth : Trajectory
            From the same first epoch on.
        """
        index = np.rint(self.time / truth.dt).astype(int)
        if index.size and index[-1] > truth.n:
            raise InputError(
                f"the trajectory ends at {truth.duration:g} s, before the solution at "
                f"{self.time[-1]:g} s: give all of it"
            )
        # The estimate is (I - phi x) times the truth.
        product = self.matrix @ np.swapaxes(matrix_from_rpy(truth.rpy[index]), 1, 2)
        twice = np.swapaxes(product, 1, 2) - product
        attitude = 0.5 * np.stack([twice[:, 2, 1], twice[:, 0, 2], twice[:, 1, 0]], axis=1)
        position = ned_difference(self.lla, truth.lla[index])
        return np.hstack([position, self.velocity - truth.velocity[index], attitude])
