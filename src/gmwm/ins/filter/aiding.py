"""What aids an inertial navigator: GNSS fixes, barometric heights, standstills; and outages."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from gmwm._core import checks
from gmwm._core.distributions import chi2
from gmwm._core.typing import BoolArray, FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.measurements import IS_INFERRED, KINDS, MEASUREMENTS, Instrument, Measurement
from gmwm.ins.filter.records import Events
from gmwm.ins.increments import Imu
from gmwm.ins.trajectory.trajectory import Trajectory, three_numbers

_STANDSTILL = 1e-3  # m/s, below which the vehicle of a simulated trajectory stands


@dataclass(frozen=True)
class Outage:
    """A time without GNSS.

    Attributes
    ----------
    start, duration : float
        s. Fixes at the start are still taken, those at the end are taken again.
    """

    start: float
    duration: float

    def __post_init__(self) -> None:
        if not (checks.is_number(self.start) and self.start >= 0.0):
            raise InputError(
                f"outage start {checks.shown(self.start)}: give seconds since the first epoch"
            )
        checks.positive("outage duration", self.duration, "give seconds above zero")

    @property
    def end(self) -> float:
        """End, s."""
        return self.start + self.duration


@dataclass(frozen=True, eq=False)
class Fixes:
    """Measurements of one kind.

    Attributes
    ----------
    kind : str
        "position", "velocity", "height", "standstill", "attitude", "odometer", "displacement" or
        "rotation".
    time : (E,) ndarray
        s since the first epoch, rising.
    value : (E, 3) ndarray
        Latitude, longitude, height (rad, m); velocity to the north, east, down (m/s); height (m)
        in the first column; zero for a standstill, or how much a simulated one shakes; roll, pitch,
        yaw (rad); velocity forward, right, down (m/s); way and turn (roll, pitch, yaw) since the
        last such fix, in body axes then (m, rad).
    sd : (E, 3) ndarray
        Standard deviations along the axes of the value, about them for angles, m, m/s or rad; a
        component of zero is not used.
    """

    kind: str
    time: FloatArray
    value: FloatArray
    sd: FloatArray

    def __post_init__(self) -> None:
        checks.choice("kind", self.kind, list(KINDS))
        name = f"{self.kind} fixes"
        time = checks.real_numbers(self.time, f"time of the {name}")
        value, sd = checks.real_numbers(self.value, name), checks.real_numbers(self.sd, name)
        if time.ndim != 1 or value.shape != (time.size, 3) or sd.shape != (time.size, 3):
            raise InputError(
                f"{name}: give E times and E x 3 values and standard deviations, not "
                f"{time.shape}, {value.shape}, {sd.shape}"
            )
        bad = ~np.all(np.isfinite(np.column_stack([time, value, sd])), axis=1)
        if np.any(bad):
            raise InputError(f"{name}: number {int(np.argmax(bad))} is not finite: leave it out")
        back = np.diff(time) < 0.0
        if np.any(back):
            late = int(np.argmax(back)) + 1
            raise InputError(
                f"{name}: number {late} at {time[late]:g} s is earlier than the one before it: "
                "sort them by time"
            )
        if np.any(sd < 0.0):
            raise InputError(f"{name}: a standard deviation is negative: give 0 or more")
        sd = np.where(np.arange(3) < self.measurement.components, sd, 0.0)
        for key, array in (("time", time), ("value", value), ("sd", sd)):
            object.__setattr__(self, key, array)

    @property
    def measurement(self) -> type[Measurement]:
        """Class of the kind."""
        return MEASUREMENTS[KINDS[self.kind]]

    def part(self, kept: BoolArray) -> Self:
        """Some of the fixes."""
        return replace(self, time=self.time[kept], value=self.value[kept], sd=self.sd[kept])

    def moved(self, by: FloatArray) -> FloatArray:
        """Values moved by metres or m/s to the north, east and down, (E, 3)."""
        return self.measurement.moved(self.value, by)


@dataclass(frozen=True, eq=False)
class Aiding:
    """All that a navigator is aided by.

    Attributes
    ----------
    fixes : tuple of Fixes
    lever_arm : (3,) ndarray
        From the IMU to the GNSS antenna, body axes, m.
    coloured_sd : (3,) ndarray
        Standard deviation of the coloured noise of GNSS positions to the north, east and down, m: a
        first-order Gauss-Markov process that the filter has states for; zero for none.
    coloured_tau : float
        Its correlation time, s.
    barometer_sd, barometer_tau : float
        The same of barometric heights, m and s: how far the height of a pressure is off.
    gate : float or None
        Probability of a larger innovation, below which a fix is rejected; ``None`` to use all.
        After `gmwm.ins.tuning.GATE_PATIENCE` rejections of a kind in a row the filter is more
        likely wrong than the fixes, and they are used until as many in a row agree. Standstills are
        always gated, and never used against the filter: they are recognised, not measured.
    """

    fixes: tuple[Fixes, ...] = ()
    lever_arm: FloatArray | Sequence[float] = (0.0, 0.0, 0.0)
    coloured_sd: FloatArray | Sequence[float] = (0.0, 0.0, 0.0)
    coloured_tau: float = 100.0
    barometer_sd: float = 0.0
    barometer_tau: float = tuning.BAROMETER[1]
    gate: float | None = None

    def __post_init__(self) -> None:
        for name in ("lever_arm", "coloured_sd"):
            object.__setattr__(self, name, three_numbers(name, getattr(self, name)))
        if np.any(np.asarray(self.coloured_sd) < 0.0):
            raise InputError("coloured_sd: give 0 or more metres to the north, east and down")
        checks.positive("coloured_tau", self.coloured_tau, "give seconds above zero")
        checks.positive("barometer_tau", self.barometer_tau, "give seconds above zero")
        if not (checks.is_number(self.barometer_sd) and self.barometer_sd >= 0.0):
            raise InputError(
                f"barometer_sd = {checks.shown(self.barometer_sd)}: give 0 or more metres"
            )
        if self.gate is not None:
            checks.share("gate", self.gate, tuning.GATE)

    def __add__(self, other: Self) -> Self:
        """Both together; the antenna and the noise of the first, or the other's barometer."""
        own = self if self.barometer_sd else other
        sd, tau, fixes = own.barometer_sd, own.barometer_tau, (*self.fixes, *other.fixes)
        return replace(self, fixes=fixes, barometer_sd=sd, barometer_tau=tau)

    def of(self, kind: str) -> Fixes | None:
        """The first fixes of a kind, ``None`` if there are none."""
        return next((each for each in self.fixes if each.kind == kind and each.time.size), None)

    def without(self, outages: Iterable[Outage]) -> Self:
        """The same without the GNSS fixes of the outages."""
        spans = [(o.start + tuning.SAME_TIME, o.end - tuning.SAME_TIME) for o in outages]
        result = []
        for fixes in self.fixes:
            kept = np.ones(fixes.time.size, dtype=bool)
            for start, end in spans if fixes.measurement.is_gnss else ():
                kept &= (fixes.time <= start) | (fixes.time >= end)
            sd = fixes.sd.copy()
            for _, end in spans if fixes.measurement.is_relative else ():
                # The first after an outage has no keyframe to relate to, and is the next one.
                sd[np.searchsorted(fixes.time, end) :][:1] = 0.0
            result.append(replace(fixes, sd=sd).part(kept))
        return replace(self, fixes=tuple(result))

    def unused(self) -> Self:
        """The same fixes without a component that is used: times alone."""
        return replace(self, fixes=tuple(replace(f, sd=np.zeros_like(f.sd)) for f in self.fixes))

    def noisy(self, rng: np.random.Generator) -> Self:
        """The same with noise added to error-free fixes, the coloured one included."""
        fixes = []
        for each in self.fixes:
            drawn = replace(each, value=each.moved(each.sd * rng.standard_normal(each.sd.shape)))
            sd, tau = each.measurement.slow_noise(self)
            if np.any(sd):
                # Stationary Gauss-Markov series of unit variance, times their size.
                noise, state = rng.standard_normal(each.sd.shape), np.zeros(3)
                for i, keep in enumerate(np.exp(-np.diff(each.time, prepend=-np.inf) / tau)):
                    state = keep * state + np.sqrt(1.0 - keep**2) * noise[i]
                    noise[i] = state
                drawn = replace(drawn, value=drawn.moved(noise * sd))
            fixes.append(drawn)
        return replace(self, fixes=tuple(fixes))

    def events(self, dt: float, n: int) -> Events:
        """Fixes in order of time, beside the epochs of an IMU with ``n`` intervals of ``dt``.

        Raises InputError if a fix lies outside the record.
        """
        for each in self.fixes:
            outside = (each.time < -0.5 * dt) | (each.time > (n + 0.5) * dt)
            if np.any(outside):
                raise InputError(
                    f"{each.kind} fix at {each.time[np.argmax(outside)]:g} s: the IMU record goes "
                    f"from 0 to {n * dt:g} s; cut the fixes or shift their clock"
                )
        empty = Fixes("position", np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)))
        fixes = (*self.fixes, empty)
        time = np.concatenate([each.time for each in fixes])
        kind = np.repeat([KINDS[each.kind] for each in fixes], [each.time.size for each in fixes])
        epoch = np.clip(np.rint(time / dt), 0, n).astype(np.int64)
        offset = time - epoch * dt
        offset[np.abs(offset) <= tuning.SAME_TIME] = 0.0
        order = np.lexsort((kind, offset, epoch))
        kind = kind[order]
        value, sd = (
            np.concatenate([getattr(each, name) for each in fixes])[order]
            for name in ("value", "sd")
        )
        gates, gated = np.full(kind.size, np.inf), (self.gate is not None) | IS_INFERRED[kind]
        freedom = np.maximum(np.count_nonzero(sd, axis=1), 1)
        gates[gated] = chi2.isf(self.gate or tuning.GATE, freedom[gated])
        return Events(epoch[order], kind, offset[order], value, sd, gates)


def gnss(
    trajectory: Trajectory,
    interval: float = 1.0,
    *,
    position_sd: float | Sequence[float] | None = tuning.POSITION_SD,
    velocity_sd: float | Sequence[float] | None = None,
    lever_arm: Sequence[float] = (0.0, 0.0, 0.0),
    coloured_sd: Sequence[float] = (0.0, 0.0, 0.0),
    coloured_tau: float = 100.0,
    imu: Imu | None = None,
) -> Aiding:
    """Error-free GNSS fixes along a trajectory; see `Aiding.noisy`.

    Raises InputError if the interval is not a multiple of the trajectory's, or a standard deviation
    not positive.

    Parameters
    ----------
    trajectory : Trajectory
    interval : float, optional
        s; the first fix is one interval after the first epoch.
    position_sd, velocity_sd : float or three floats, optional
        Standard deviations to the north, east and down, m and m/s; ``None`` for no such fixes.
    lever_arm : three floats, optional
        From the IMU to the antenna, body axes, m.
    coloured_sd, coloured_tau : optional
        See `Aiding`.
    imu : Imu, optional
        Error-free, for the antenna's velocity about the IMU; needed with a lever arm and velocity.
    """
    given = {"position": position_sd, "velocity": velocity_sd}
    found = _along(trajectory, interval, given, lever_arm, imu)
    return replace(found, coloured_sd=coloured_sd, coloured_tau=coloured_tau)


def barometer(trajectory: Trajectory, interval: float = 1.0, sd: float = 1.0) -> Aiding:
    """Error-free heights along a trajectory; see `gnss`."""
    return _along(trajectory, interval, {"height": sd})


def standstills(trajectory: Trajectory, interval: float = 1.0, sd: float = 0.01) -> Aiding:
    """Zero-velocity updates wherever a trajectory stands still; see `gnss`."""
    (fixes,) = _along(trajectory, interval, {"standstill": sd}).fixes
    index = np.rint(fixes.time / trajectory.dt).astype(int)
    speed = np.linalg.norm(trajectory.velocity[index], axis=1)
    return Aiding((fixes.part(speed < _STANDSTILL),))


def poses(trajectory: Trajectory, interval: float = 1.0) -> Aiding:
    """Error-free absolute poses, as of a lidar in a map; see `gnss`."""
    position, attitude = tuning.POSE_SD
    return _along(trajectory, interval, {"position": position, "attitude": attitude})


def odometry(trajectory: Trajectory, interval: float = 1.0) -> Aiding:
    """Error-free relative poses between keyframes, of cameras or a lidar; see `gnss`."""
    way, turn = tuning.ODOMETRY_SD
    return _along(trajectory, interval, {"displacement": way, "rotation": turn})


def wheels(trajectory: Trajectory, interval: float = 0.1) -> Aiding:
    """Error-free velocities forward, right and down of a car that does not slip; see `gnss`."""
    return _along(trajectory, interval, {"odometer": tuning.WHEEL_SD})


def _along(
    trajectory: Trajectory,
    interval: float,
    given: Mapping[str, float | Sequence[float] | None],
    arm: Sequence[float] = (0.0, 0.0, 0.0),
    imu: Imu | None = None,
) -> Aiding:
    """Error-free fixes every ``interval`` (s) after the first epoch, by kinds and deviations."""
    # Beyond the end there are no fixes, however far.
    stride = min(checks.positive("interval", interval) / trajectory.dt, trajectory.n + 1.0)
    if abs(stride - round(stride)) > 1e-6 or round(stride) < 1:
        raise InputError(
            f"interval = {interval:g} s: give a multiple of the trajectory's {trajectory.dt:g} s"
        )
    index = np.arange(round(stride), trajectory.n + 1, round(stride))
    where, fixes = Instrument(trajectory, index, three_numbers("lever_arm", arm), imu), []
    for kind, sd in given.items():
        if sd is None:
            continue
        own = checks.real_numbers(sd, "standard deviation")
        each = three_numbers("standard deviation", np.full(3, own) if own.ndim == 0 else own)
        if np.any(each <= 0.0):
            raise InputError(f"standard deviation = {checks.shown(sd)}: give positive numbers")
        value = MEASUREMENTS[KINDS[kind]].along(where)
        fixes.append(Fixes(kind, trajectory.time[index], value, np.tile(each, (index.size, 1))))
    return Aiding(tuple(fixes), where.arm)
