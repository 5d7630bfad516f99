"""The navigation filter: an IMU, its error models and what aids it in, a solution out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict, Unpack

import numpy as np

from gmwm._core import checks
from gmwm._core.spool import release, windows
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.aiding import Aiding
from gmwm.ins.filter.covariance_kernels import ATTITUDE, NAVIGATION, VELOCITY
from gmwm.ins.filter.filter_kernels import PAUSED, run
from gmwm.ins.filter.measurements import KINDS, MEASUREMENTS, new_keyframe
from gmwm.ins.filter.records import (
    Events,
    FilterState,
    Innovated,
    Kept,
    Keyframe,
    Kinematics,
    RunPlace,
    Samples,
    Settings,
)
from gmwm.ins.filter.states import SensorStates
from gmwm.ins.geometry import matrix_from_rpy, ned_difference, rpy_from_matrix, skew
from gmwm.ins.increments import Imu
from gmwm.ins.sensors import SensorModels
from gmwm.ins.trajectory.trajectory import NavState, Trajectory, check_latitudes

_POSE = ("north", "east", "down", "roll", "pitch", "yaw")  # states of a keyframe


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

        The truth has the same first epoch. Raises InputError if it ends before the solution.
        """
        index = np.rint(self.time / truth.dt).astype(int)
        if index.size and index[-1] > truth.n:
            raise InputError(
                f"the trajectory ends at {truth.duration:g} s, before the solution at "
                f"{self.time[-1]:g} s: give a longer one"
            )
        return self.less(truth.lla[index], truth.velocity[index], truth.rpy[index])

    def less(
        self,
        lla: FloatArray,
        velocity: FloatArray,
        rpy: FloatArray,
        at: BoolArray | slice = slice(None),
    ) -> FloatArray:
        """Estimates at some epochs less the truth there, each (K, 3); (K, 9) as ``covariance``."""
        # The estimate is (I - phi x) times the truth.
        product = self.matrix[at] @ np.swapaxes(matrix_from_rpy(rpy), 1, 2)
        twice = np.swapaxes(product, 1, 2) - product
        attitude = 0.5 * np.stack([twice[:, 2, 1], twice[:, 0, 2], twice[:, 1, 0]], axis=1)
        position = ned_difference(self.lla[at], lla)
        return np.hstack([position, self.velocity[at] - velocity, attitude])


@dataclass(frozen=True)
class InitialSd:
    """How well the initial state is known, 1 sigma.

    Attributes
    ----------
    position : float
        m, horizontal and vertical.
    velocity : float
        m/s.
    tilt, heading : float
        rad.
    """

    position: float = 1.0
    velocity: float = 0.1
    tilt: float = math.radians(0.1)
    heading: float = math.radians(0.5)

    def __post_init__(self) -> None:
        for name in ("position", "velocity", "tilt", "heading"):
            checks.positive(f"initial {name}", getattr(self, name))

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations of the nine navigation errors, (9,)."""
        return np.repeat([self.position, self.velocity, self.tilt, self.heading], [3, 3, 2, 1])


@dataclass(frozen=True, eq=False)
class Filter:
    """An error-state Kalman filter with the states of given sensor models, ready to run.

    Closed loop: after the measurements of an epoch, the estimated errors are subtracted from
    position, velocity and attitude; the increments of the IMU are corrected for the estimated
    sensor errors sample by sample. The covariance is propagated in steps of ``stride`` samples, and
    at every epoch that has a measurement or a result.

    keyframe: First place in the covariance of the states of the last keyframe; -1 for none.
    """

    states: SensorStates
    dt: float
    settings: Settings
    keyframe: int

    @classmethod
    def of(
        cls,
        sensors: SensorModels,
        aiding: Aiding,
        dt: float,
        step: float = tuning.COVARIANCE_STEP,
        second_order: bool = True,
        drift_known: bool = False,
    ) -> Filter:
        """A filter for an IMU of interval ``dt`` (s), covariance steps of ``step`` (s)."""
        stride = max(round(checks.positive("step", step) / dt), 1)
        places, slow = [], []
        for code, kind in enumerate(MEASUREMENTS):
            sd, tau = kind.slow_noise(aiding)
            for component in np.flatnonzero(sd > 0.0):
                places.append((code, component))
                slow.append((kind.slow_names[component], float(sd[component]), tau))
        relative = any(each.measurement.is_relative for each in aiding.fixes)
        slow += [(f"keyframe {name}", 0.0, 0.0) for name in _POSE] * relative
        states = SensorStates.of(sensors, dt, stride, drift_known, tuple(slow))
        noise_states = np.full((len(MEASUREMENTS), 3), -1, dtype=np.int64)
        for state, place in enumerate(places, states.m - len(slow)):
            noise_states[place] = state
        arm = np.asarray(aiding.lever_arm)
        settings = Settings(states.table, noise_states, arm, second_order, stride)
        return cls(states, dt, settings, NAVIGATION + states.m - len(_POSE) if relative else -1)

    def covariance(self, initial: NavState, sd: InitialSd) -> FloatArray:
        """Covariance at the first epoch, (9 + m, 9 + m), with the modified velocity error."""
        P = np.zeros((NAVIGATION + self.states.m, NAVIGATION + self.states.m))
        P[:NAVIGATION, :NAVIGATION] = unmodified(np.diag(sd.deviations**2), -initial.velocity)
        P[NAVIGATION:, NAVIGATION:] = self.states.covariance
        if self.keyframe >= 0:
            new_keyframe(P, *self.at_keyframe(initial), 1.0)
        return P

    def at_keyframe(self, initial: NavState) -> tuple[Kinematics, Keyframe]:
        """The initial state, and the keyframe that it is."""
        C, v, lla = matrix_from_rpy(initial.rpy), initial.velocity.copy(), initial.lla.copy()
        pose = Kinematics(C.copy(), v.copy(), lla.copy())
        return Kinematics(C, v, lla), Keyframe(pose, self.keyframe)

    def run(
        self, imu: Imu, initial: NavState, initial_sd: InitialSd, events: Events, outputs: Outputs
    ) -> Solution:
        """Filter a record of the filter's sampling interval; ``outputs`` are kept."""
        check_latitudes(initial.lla[None, :], "initial")
        at, since = self.at_keyframe(initial)
        P, x = self.covariance(initial, initial_sd), self.states.mean.copy()
        estimate = FilterState(at, P, x)
        nothing, count = np.full(events.value.shape, np.nan), outputs.epoch.size
        found = Innovated(nothing, nothing.copy(), np.ones(events.epoch.size, dtype=np.bool_))
        sizes = ((6,), (3, 3), (9, 9), (6,), (6, 6))
        kept = Kept(outputs.epoch, outputs.before, *(np.zeros((count, *each)) for each in sizes))
        samples = Samples(imu.rotation, imu.velocity, imu.dt)
        place, rejected = np.zeros(4, dtype=np.int64), np.zeros(len(KINDS), dtype=np.int64)
        where, stopped = RunPlace(place, rejected, np.zeros(7), since), PAUSED
        settings = self.settings
        for part in (*windows(imu.n), slice(imu.n, imu.n)):
            if stopped == PAUSED:
                stopped = run(samples, settings, estimate, events, found, kept, where, part.stop)
            release(imu.rotation)
            release(imu.velocity)
        done = count if stopped < 0 else int(np.searchsorted(outputs.epoch, stopped))
        for part in windows(done):
            kept.P[part] = unmodified(kept.P[part], kept.nav[part, 3:])
        time = events.epoch * imu.dt + events.offset
        return Solution(
            time=outputs.time(imu.dt)[:done],
            before=outputs.before[:done] == 1,
            lla=kept.nav[:done, :3],
            velocity=kept.nav[:done, 3:],
            matrix=kept.C[:done],
            covariance=kept.P[:done],
            sensor_errors=kept.sensor[:done],
            sensor_covariance=kept.sensor_covariance[:done],
            innovations=FilterInnovations(time, events.kind, found.value, found.sd, found.used),
            state_names=self.states.names,
            states=x,
            state_covariance=P[NAVIGATION:, NAVIGATION:],
            diverged_at=None if stopped < 0 else float(stopped * imu.dt),
        )


@dataclass(frozen=True, eq=False)
class Outputs:
    """Epochs whose solution is kept.

    epoch: (K,) of int, in order.
    before: (K,) of int, 1 for the solution before the measurements of the epoch, 0 for that after
        them.
    """

    epoch: IntArray
    before: IntArray

    def time(self, dt: float) -> FloatArray:
        """Times of the epochs, s, (K,)."""
        return np.asarray(self.epoch * dt, dtype=float)

    @classmethod
    def every(
        cls,
        interval: float,
        dt: float,
        n: int,
        before: Sequence[float] = (),
        also: Sequence[float] | FloatArray = (),
    ) -> Outputs:
        """Every ``interval`` and ``also`` (s) after the measurements, ``before`` before them."""
        stride = max(round(checks.positive("interval", interval) / dt), 1)
        extra = np.clip(np.rint(np.asarray(also, dtype=float) / dt), 0, n).astype(np.int64)
        after = np.union1d(np.arange(0, n + 1, stride), extra)
        times = checks.real_numbers(before, "before")
        outside = ~((times >= -0.5 * dt) & (times <= (n + 0.5) * dt))
        if np.any(outside):
            raise InputError(
                f"before = {times[np.argmax(outside)]:g} s: the IMU record goes from 0 to "
                f"{n * dt:g} s; give times within it"
            )
        early = np.clip(np.rint(times / dt), 0, n).astype(np.int64)
        epoch = np.concatenate([after, early]).astype(np.int64)
        flag = np.repeat(np.array([0, 1]), [after.size, early.size])
        order = np.lexsort((-flag, epoch))
        return cls(epoch[order], flag[order])


def unmodified(covariance: FloatArray, velocity: FloatArray) -> FloatArray:
    """Covariance with the velocity error ``dv = u + v x phi``, from one with ``u``.

    With the velocity reversed, the other way round.
    """
    T = np.tile(np.eye(9), (*covariance.shape[:-2], 1, 1))
    T[..., VELOCITY:ATTITUDE, ATTITUDE:] = skew(velocity)
    return T @ covariance @ np.swapaxes(T, -1, -2)


class FilterOptions(TypedDict, total=False):
    """Step of the covariance, s, and whether products of errors are allowed for; see `Filter`."""

    step: float
    second_order: bool


def navigate(
    imu: Imu,
    initial: NavState,
    sensors: SensorModels | Calibration | Mapping[str, Any],
    aiding: Aiding,
    *,
    initial_sd: InitialSd | None = None,
    interval: float = 1.0,
    before: Sequence[float] = (),
    **options: Unpack[FilterOptions],
) -> Solution:
    """Integrated navigation: filter IMU increments with sensor models and aiding.

    Raises InputError if sensor models or measurements cannot be used.

    Parameters
    ----------
    imu : Imu
    initial : NavState
        At the first epoch.
    sensors : SensorModels, Calibration or mapping
        See `SensorModels.of`.
    aiding : Aiding
        Measurements, with their noise.
    initial_sd : InitialSd, optional
    interval : float, optional
        Of the solution, s.
    before : sequence of float, optional
        Times (s) at which the solution before the measurements is wanted too, such as the end of an
        outage.
    step : float, optional
        Of the covariance, s.
    second_order : bool, optional
        Whether products of errors are allowed for; see `Filter`.
    """
    ready = Filter.of(SensorModels.of(sensors), aiding, imu.dt, **options)
    events = aiding.events(imu.dt, imu.n)
    position = KINDS["position"]
    slow = np.any(ready.settings.noise_states[position] >= 0)
    if slow and aiding.fixes and not np.any(events.kind == position):
        raise InputError("coloured_sd without position fixes: set it to zero")
    outputs = Outputs.every(interval, imu.dt, imu.n, before)
    return ready.run(imu, initial, initial_sd or InitialSd(), events, outputs)
