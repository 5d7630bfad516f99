"""The navigation filter: an IMU, its error models and what aids it in, a solution out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm._core.spool import release, windows
from gmwm._core.typing import FloatArray
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.aiding import Aiding, Events
from gmwm.ins.filter.covariance_kernels import ATTITUDE, NAVIGATION, VELOCITY
from gmwm.ins.filter.filter_arrays import Kept, Measured, Sampled, Sensors, State
from gmwm.ins.filter.filter_kernels import PAUSED, run
from gmwm.ins.filter.measurement_kernels import IS_POSITION, KINDS
from gmwm.ins.filter.solution import FilterInnovations, Solution
from gmwm.ins.filter.states import NO_AXIS, IntArray, SensorStates
from gmwm.ins.geometry import matrix_from_rpy, skew
from gmwm.ins.imu import Imu, SensorModels
from gmwm.ins.trajectory import NavState, check_latitudes


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
    tilt: float = np.radians(0.1)
    heading: float = np.radians(0.5)

    def __post_init__(self) -> None:
        for name in ("position", "velocity", "tilt", "heading"):
            checks.positive(f"initial {name}", getattr(self, name))

    @property
    def deviations(self) -> FloatArray:
        """Of the nine navigation errors, (9,)."""
        return np.array(
            [self.position] * 3 + [self.velocity] * 3 + [self.tilt, self.tilt, self.heading]
        )


@dataclass(frozen=True, eq=False)
class Filter:
    """An error-state Kalman filter with the states of given sensor models, ready to run.

    Closed loop: after the measurements of an epoch, the estimated errors are subtracted from
    position, velocity and attitude; the increments of the IMU are corrected for the estimated
    sensor errors sample by sample. The covariance is propagated in steps of ``stride`` samples, and
    at every epoch that has a measurement or a result.

    dt: Sampling interval of the IMU, s.
    stride: Samples per step of the covariance.
    coloured: (4,) of int, states of the coloured noise of GNSS positions to the north, east and
        down, and of barometric heights; -1 for none.
    lever_arm: (3,), m.
    second_order: Whether products of errors are allowed for; without it the filter is linear: too
        sure of its vertical channel where gyros are poor and accelerometers good, and of what
        precise fixes say after a long outage; see `gmwm.ins.filter.covariance_kernels.tilt_squared`
        and ``excess``.
    """

    states: SensorStates
    dt: float
    stride: int
    coloured: IntArray
    lever_arm: FloatArray
    second_order: bool = True

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
        """A filter for an IMU of sampling interval ``dt`` with covariance steps of ``step`` (s).

        For ``drift_known`` see `SensorStates.of`.
        """
        stride = max(round(checks.positive("step", step) / dt), 1)
        states = SensorStates.of(sensors, dt, stride, drift_known)
        coloured = np.full(4, -1, dtype=np.int64)
        sd = np.append(aiding.coloured_sd, aiding.barometer_sd)
        if np.any(sd):
            tau = np.append(np.full(3, aiding.coloured_tau), aiding.barometer_tau)
            names = ("GNSS north", "GNSS east", "GNSS down", "barometer")
            coloured[sd > 0.0] = states.m + np.arange(np.count_nonzero(sd))
            states = states.with_markov(
                [name for name, s in zip(names, sd, strict=True) if s > 0.0],
                sd[sd > 0.0], tau[sd > 0.0], dt,
            )  # fmt: skip
        return cls(states, dt, stride, coloured, np.asarray(aiding.lever_arm), second_order)

    @property
    def size(self) -> int:
        """Number of states, those of navigation included."""
        return NAVIGATION + self.states.m

    def covariance(self, initial: NavState, sd: InitialSd) -> FloatArray:
        """Covariance at the first epoch, (9 + m, 9 + m), with the modified velocity error."""
        P = np.zeros((self.size, self.size))
        P[:NAVIGATION, :NAVIGATION] = modified(np.diag(sd.deviations**2), initial.velocity)
        P[NAVIGATION:, NAVIGATION:] = self.states.covariance
        return P

    def run(
        self, imu: Imu, initial: NavState, initial_sd: InitialSd, events: Events, outputs: Outputs
    ) -> Solution:
        """Filter a record.

        imu: Of the filter's sampling interval.
        initial: Estimate at the first epoch.
        events: Measurements.
        outputs: Epochs to be kept.
        Raises InputError if it starts closer than 1 deg to a pole.
        """
        check_latitudes(initial.lla[None, :], "initial")
        table, m = self.states, self.states.m
        P, x = self.covariance(initial, initial_sd), table.mean.copy()
        state = State(
            matrix_from_rpy(initial.rpy), initial.velocity.copy(), initial.lla.copy(), P, x
        )
        axis = table.axis[table.axis != NO_AXIS]
        sensors = Sensors(
            np.searchsorted(axis, np.arange(7)).astype(np.int64),
            bool(np.any(table.partner != np.arange(m))),
            table.axis, table.output, table.partner, table.phi, table.phi_off, table.gain,
            table.noise, table.noise_off, table.cross, table.integral,
        )  # fmt: skip
        shape = events.value.shape
        measured = Measured(
            events.epoch, events.kind, events.offset, events.value, events.sd, events.gate,
            self.coloured, self.lever_arm, self.second_order,
            np.full(shape, np.nan), np.full(shape, np.nan), np.ones(shape[0], dtype=np.bool_),
        )  # fmt: skip
        count = outputs.epoch.size
        kept = Kept(
            outputs.epoch, outputs.before, np.zeros((count, 6)), np.zeros((count, 3, 3)),
            np.zeros((count, 9, 9)), np.zeros((count, 6)), np.zeros((count, 6, 6)),
        )  # fmt: skip
        sampled = Sampled(imu.rotation, imu.velocity, imu.dt, self.stride)
        place, carry = np.zeros(4 + len(KINDS), dtype=np.int64), np.zeros(7)
        stopped = PAUSED
        for part in (*windows(imu.n), slice(imu.n, imu.n)):
            if stopped == PAUSED:
                stopped = run(sampled, state, sensors, measured, kept, part.stop, place, carry)
            release(imu.rotation)
            release(imu.velocity)
        done = count if stopped < 0 else int(np.searchsorted(outputs.epoch, stopped))
        for part in windows(done):
            kept.P[part] = unmodified(kept.P[part], kept.nav[part, 3:])
        return Solution(
            time=outputs.time(imu.dt)[:done],
            before=outputs.before[:done] == 1,
            lla=kept.nav[:done, :3],
            velocity=kept.nav[:done, 3:],
            matrix=kept.C[:done],
            covariance=kept.P[:done],
            sensor_errors=kept.sensor[:done],
            sensor_covariance=kept.sensor_covariance[:done],
            innovations=FilterInnovations(
                time=events.epoch * imu.dt + events.offset,
                kind=events.kind,
                value=measured.innovation,
                sd=measured.innovation_sd,
                used=measured.used,
            ),
            state_names=table.names,
            states=x,
            state_covariance=P[NAVIGATION : NAVIGATION + m, NAVIGATION : NAVIGATION + m],
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
        epoch = np.concatenate([after, early])
        flag = np.concatenate([np.zeros(after.size), np.ones(early.size)]).astype(np.int64)
        order = np.lexsort((-flag, epoch))
        return cls(epoch[order].astype(np.int64), flag[order])


def modified(covariance: FloatArray, velocity: FloatArray) -> FloatArray:
    """Covariance with the modified velocity error ``dv - v x phi``, from one with ``dv``."""
    return _turned(covariance, velocity, -1.0)


def unmodified(covariance: FloatArray, velocity: FloatArray) -> FloatArray:
    """Covariance with the velocity error ``dv = u + v x phi``, from one with ``u``."""
    return _turned(covariance, velocity, 1.0)


def _turned(covariance: FloatArray, velocity: FloatArray, sign: float) -> FloatArray:
    T = np.tile(np.eye(9), (*covariance.shape[:-2], 1, 1))
    T[..., VELOCITY:ATTITUDE, ATTITUDE:] = sign * skew(velocity)
    return T @ covariance @ np.swapaxes(T, -1, -2)


def navigate(
    imu: Imu,
    initial: NavState,
    sensors: SensorModels | Calibration | Mapping[str, Any],
    aiding: Aiding,
    *,
    initial_sd: InitialSd | None = None,
    step: float = tuning.COVARIANCE_STEP,
    interval: float = 1.0,
    before: Sequence[float] = (),
    second_order: bool = True,
) -> Solution:
    """Integrated navigation: filter IMU increments with sensor models and aiding.

    Parameters
    ----------
    imu : Imu
    initial : NavState
        Estimate at the first epoch.
    sensors : SensorModels, Calibration or mapping
        See `SensorModels.of`.
    aiding : Aiding
        Measurements, with their noise.
    initial_sd : InitialSd, optional
    step : float, optional
        Step of the covariance, s.
    interval : float, optional
        Of the solution, s.
    before : sequence of float, optional
        Times (s) at which the solution before the measurements is wanted too, such as the end of an
        outage.
    second_order : bool, optional
        See `Filter`.

    Raises
    ------
    InputError
        If sensor models or measurements cannot be used.
    """
    models = SensorModels.of(sensors)
    ready = Filter.of(models, aiding, imu.dt, step, second_order)
    events = aiding.events(imu.dt, imu.n)
    if not np.any(events.kind == IS_POSITION) and aiding.fixes and np.any(ready.coloured[:3] >= 0):
        raise InputError("coloured_sd without position fixes: set it to zero")
    outputs = Outputs.every(interval, imu.dt, imu.n, before)
    return ready.run(imu, initial, initial_sd or InitialSd(), events, outputs)
