"""Real data to be filtered: an IMU's record, GNSS fixes, sensor models, and a reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field
from scipy.interpolate import CubicSpline

from gmwm._core.text import brief
from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.fields import (
    FileName,
    Meters,
    Models,
    PositiveMeters,
    PositiveRadians,
    PositiveSeconds,
    PositiveSpeed,
    Radians,
    Seconds,
    Spec,
    Three,
    number,
    read_models,
    written,
)
from gmwm.ins.filter.aiding import Aiding, Fixes
from gmwm.ins.filter.filter import Solution
from gmwm.ins.increments import Imu
from gmwm.ins.logs.attitude import standstills
from gmwm.ins.logs.fix_log import height_steps, read_fix_log, read_heights
from gmwm.ins.logs.imu_log import ImuLog, read_imu_log
from gmwm.ins.sensors import AXES, SensorModels
from gmwm.ins.simulation.consistency import GROUPS, Ratio, serial_ratio
from gmwm.ins.spec import ReadingSpec
from gmwm.ins.trajectory.trajectory import (
    Trajectory,
    read_log,
    unwrapped_angles,
    unwrapped_longitudes,
)
from gmwm.issues import Notice, notice

_JUDGED = ("position", "velocity", "attitude")


@dataclass(frozen=True, eq=False)
class Reference:
    """Position, velocity and attitude of the IMU that are taken for the truth.

    source: Name of the file.
    start: Time of the first epoch on the clock of the files, s.
    """

    source: str
    start: float
    trajectory: Trajectory

    @classmethod
    def read(cls, path: Path) -> Reference:
        """Read a CSV of time, latitude, longitude, height, roll, pitch and yaw, evenly spaced.

        Raises InputError if it cannot be used.
        """
        start, dt, lla, rpy = read_log(path)
        truth = Trajectory.from_arrays(dt, unwrapped_longitudes(lla), unwrapped_angles(rpy))
        return cls(path.name, start, truth)

    def compared(self, solution: Solution, clock: FloatArray) -> ReferenceErrors:
        """Errors of a solution, whose epochs are at ``clock`` (s) on the clock of the files.

        Raises InputError if the reference has no epoch in its time.
        """
        truth = self.trajectory
        time = clock - self.start
        inside = (time >= 0.0) & (time <= truth.duration) & ~solution.before
        if not np.any(inside):
            raise InputError(
                f"{self.source} lasts from {self.start:.10g} s to "
                f"{self.start + truth.duration:.10g} s, the solution from {clock[0]:.10g} s to "
                f"{clock[-1]:.10g} s: bring both to one clock"
            )
        at = np.arange(truth.n + 1) * truth.dt
        lla, velocity, rpy = (
            each[0] + CubicSpline(at, each - each[0], axis=0)(time[inside])
            for each in (truth.lla, truth.velocity, truth.rpy)
        )
        error = solution.less(lla, velocity, rpy, inside)
        return ReferenceErrors(self.source, error, solution.covariance[inside])


@dataclass(frozen=True, eq=False)
class ReferenceErrors:
    """Errors of a solution at K epochs against a reference.

    source: Of the reference.
    error: (K, 9), of position (north, east, down, m), velocity (m/s) and attitude (rad).
    covariance: (K, 9, 9), that the filter predicted.
    """

    source: str
    error: FloatArray
    covariance: FloatArray

    def nees(self, group: str) -> Ratio:
        """Mean normalised error squared per degree of freedom of a group of errors.

        Its band allows for errors that are correlated from one epoch to the next.
        """
        own = GROUPS[group]
        root = np.linalg.cholesky(self.covariance[:, own, own])
        return serial_ratio(np.linalg.solve(root, self.error[:, own, None])[..., 0])

    @property
    def disagreeing(self) -> dict[str, float]:
        """Errors that contradict the filter's covariance -> how many times as large they are."""
        found = {name: self.nees(name) for name in _JUDGED}
        level = tuning.CONTRADICTED / len(found)
        return {k: float(np.sqrt(each.value)) for k, each in found.items() if each.p_value <= level}

    @property
    def in_words(self) -> str:
        """Whether the errors agree with the filter's covariance."""
        sizes = self.disagreeing
        if not sizes:
            return "the errors agree with the filter's covariance"
        shown = (f"{name} {brief(size)} times" for name, size in sizes.items())
        return f"the errors contradict the filter's covariance: {', '.join(shown)} as large"

    def rms(self, *errors: int) -> tuple[float, float]:
        """Root mean square of some of the nine errors together, and as the filter predicted it."""
        mine = list(errors)
        variance = np.diagonal(self.covariance, axis1=1, axis2=2)[:, mine]
        squares = self.error[:, mine] ** 2, variance
        actual, predicted = (float(np.sqrt(np.mean(np.sum(each, axis=1)))) for each in squares)
        return actual, predicted

    def sentence(self) -> str:
        """What people read of it."""
        parts = []
        for name, errors, unit, scale in (
            ("horizontal", (0, 1), "m", 1.0),
            ("vertical", (2,), "m", 1.0),
            ("velocity", (3, 4, 5), "m/s", 1.0),
            ("tilt", (6, 7), "deg", np.degrees(1.0)),
            ("heading", (8,), "deg", np.degrees(1.0)),
        ):
            actual, predicted = (brief(scale * value) for value in self.rms(*errors))
            parts.append(f"{name} {actual} {unit} ({predicted})")
        judged = ", ".join(
            f"{name} {each.value:.3g} ({each.lower:.2g} .. {each.upper:.2g})"
            for name, each in ((name, self.nees(name)) for name in _JUDGED)
        )
        return (
            f"Against {self.source}, {len(self.error):,} epochs, RMS (predicted): "
            f"{', '.join(parts)}; NEES per degree of freedom (95 % band if consistent): {judged}; "
            f"{self.in_words}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Root mean squares and NEES, SI."""
        return {
            "source": self.source,
            "epochs": len(self.error),
            "rms": {name: self.rms(*range(9)[GROUPS[name]])[0] for name in _JUDGED},
            "predicted": {name: self.rms(*range(9)[GROUPS[name]])[1] for name in _JUDGED},
            "nees": {name: asdict(self.nees(name)) for name in _JUDGED},
        }


_START = ("heading", "heading_sd", "attitude", "attitude_sd")
_UNITS = {"position": "m", "velocity": "m/s"}


class ImuSpec(ReadingSpec):
    """The record of an IMU."""

    file: FileName
    start: Seconds | None = None

    def options(self) -> dict[str, Any]:
        """Arguments of `gmwm.ins.read_imu`."""
        return super().options() | {"start": self.start}


class BiasSpec(Spec):
    """Standard deviations of the turn-on bias."""

    gyro: Annotated[float, number(SI_UNIT["gyro"]), Field(ge=0.0)] | None = None
    accel: Annotated[float, number(SI_UNIT["accel"]), Field(ge=0.0)] | None = None


class BarometerSpec(Spec):
    """Heights of a barometer, set to the first fix."""

    file: FileName
    sd: PositiveMeters = tuning.BAROMETER_SD
    drift_sd: PositiveMeters = tuning.BAROMETER[0]
    drift_tau: PositiveSeconds = tuning.BAROMETER[1]


def _of_file(given: Any) -> Any:
    return given if isinstance(given, Mapping) else {"file": given}


class LogSpec(Spec):
    """Content of a study file on an own log."""

    NEEDS: ClassVar[str] = (
        "filtering needs the IMU's record (imu), GNSS fixes (gnss_fixes) and sensor models "
        "(sensors)"
    )

    imu: Annotated[ImuSpec, BeforeValidator(_of_file)]
    gnss_fixes: FileName
    sensors: Models
    lever_arm: Three[Meters] = (0.0, 0.0, 0.0)
    heading: Radians | None = None
    heading_sd: PositiveRadians = tuning.HEADING_SD
    attitude: Annotated[tuple[Radians, Radians, Radians], written("[roll, pitch, yaw]")] | None = (
        None
    )
    attitude_sd: PositiveRadians = tuning.ATTITUDE_SD
    position_sd: Three[PositiveMeters] = tuning.POSITION_SD
    velocity_sd: Three[PositiveSpeed] = tuning.VELOCITY_SD
    coloured_sd: Three[Meters] = (0.0, 0.0, 0.0)
    coloured_tau: PositiveSeconds = 100.0
    gate: float | None = None
    gnss_shift: Seconds = 0.0
    barometer: Annotated[BarometerSpec, BeforeValidator(_of_file)] | None = None
    zero_velocity: PositiveSpeed | None = None
    bias: BiasSpec = BiasSpec()
    reference: FileName | None = None


@dataclass(frozen=True, eq=False)
class Measured:
    """Real data for a filter.

    Attributes
    ----------
    imu : Imu
    aiding : Aiding
        On the IMU's time, s since its first epoch.
    sensors : SensorModels
    start : float
        Time of the first epoch on the clock of the files, s.
    heading : float or None
        Heading of the forward axis at the first fix, rad; ``None`` to find it in the data.
    heading_sd : float
        rad.
    attitude : tuple of three floats or None
        Roll, pitch and yaw at the first fix, rad; ``None`` to find them in the data.
    attitude_sd : float
        rad.
    reference : Reference or None
        What the solution is compared with.
    title : str
    notices : tuple of Notice
    noise : dict
        Axis -> size of the fast noise over that of a calibration with a curve.
    """

    imu: Imu
    aiding: Aiding
    sensors: SensorModels
    start: float = 0.0
    heading: float | None = None
    heading_sd: float = tuning.HEADING_SD
    attitude: tuple[float, float, float] | None = None
    attitude_sd: float = tuning.ATTITUDE_SD
    reference: Reference | None = None
    title: str = ""
    notices: tuple[Notice, ...] = ()
    noise: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, content: Mapping[str, Any], folder: Path = Path()) -> Measured:
        """Read what a file or options describe.

        The content has imu, gnss_fixes and sensors, and what else is known; see the documentation.
        Paths are relative to a folder.

        Raises InputError if something is missing, unknown or cannot be used.
        """
        spec = LogSpec.parse(content)
        if spec.attitude is not None and spec.heading is not None:
            raise InputError("heading and attitude: the attitude has a yaw; leave the heading out")
        models = read_models("sensors", spec.sensors, folder)
        sensors, assumed = with_turn_on_bias(models, spec.bias.given)
        given = spec.imu.options() | {"curves": sensors.curves}
        log = read_imu_log(folder / spec.imu.file, **given)
        sensors = sensors.with_noise(log.noise)
        found = read_fix_log(folder / spec.gnss_fixes)
        aiding = found.aiding(
            log.start - spec.gnss_shift, spec.position_sd, spec.velocity_sd, spec.lever_arm
        )
        aiding = replace(
            aiding, coloured_sd=spec.coloured_sd, coloured_tau=spec.coloured_tau, gate=spec.gate
        )
        aiding, left_out = _within(aiding, log, found.source)
        notices = [*log.notices, *found.notices]
        scale = next((n.values["scale"] for n in found.notices if n.code == "dates"), "UTC")
        if scale != "UTC" and any(n.code == "dates" for n in log.notices):
            seconds = tuning.LEAP_SECONDS
            notices.append(notice("time-scales", values={"scale": scale}, seconds=seconds))
        notices += [*left_out, *height_steps(aiding, log.start)]
        if spec.barometer is not None:
            aiding, set_to = _with_barometer(aiding, spec.barometer, folder, log)
            notices.append(set_to)
        if spec.zero_velocity is not None:
            stands = standstills(log.imu, aiding, spec.zero_velocity)
            if stands is None:
                notices.append(notice("standstills-unknown"))
            else:
                aiding = replace(aiding, fixes=(*aiding.fixes, stands))
                count, length = {"count": stands.time.size}, tuning.ZERO_VELOCITY[1]
                notices.append(notice("standstills", values=count, length=length))
        notices += assumed
        for kind, own, usual in (
            ("position", found.position_sd, spec.position_sd),
            ("velocity", found.velocity_sd, spec.velocity_sd),
        ):
            is_given = f"{kind}_sd" in spec.given
            if own is not None and is_given:
                notices.append(notice("sd-not-used", kind))
            if own is None and not is_given and aiding.of(kind) is not None:
                sd = f"{', '.join(f'{each:g}' for each in usual)} {_UNITS[kind]}"
                values = dict(zip(("north", "east", "down"), usual, strict=True))
                notices.append(notice("sd-assumed", kind, values, sd=sd))
        start = {name: getattr(spec, name) for name in _START}
        if spec.reference is not None:
            start["reference"] = Reference.read(folder / spec.reference)
        return cls(
            log.imu,
            aiding,
            sensors,
            log.start,
            **start,
            title=log.source,
            notices=tuple(notices),
            noise=log.noise,
        )


def with_turn_on_bias(
    models: SensorModels, given: Mapping[str, float]
) -> tuple[SensorModels, list[Notice]]:
    """Models with the standard deviation of a turn-on bias, and a notice of assumed ones."""
    bias_sd, assumed = {}, {}
    for axis in AXES:
        kind = axis.partition("_")[0]
        bias_sd[axis] = given.get(kind, models.bias_sd[axis] or tuning.TURN_ON_SD[kind])
        if kind not in given and not models.bias_sd[axis]:
            assumed[kind] = bias_sd[axis]
    shown = {
        "gyro": f"gyros {np.degrees(assumed.get('gyro', 0.0)):g} deg/s",
        "accel": f"accelerometers {assumed.get('accel', 0.0):g} m/s^2",
    }
    sd = " and ".join(shown[kind] for kind in assumed)
    notices = [notice("biases-assumed", values=assumed, sd=sd)] if assumed else []
    return replace(models, bias_sd=bias_sd), notices


def _within(aiding: Aiding, log: ImuLog, source: str) -> tuple[Aiding, list[Notice]]:
    """The fixes in the time of the IMU's record."""
    dt, end = log.imu.dt, log.imu.n * log.imu.dt
    inside = [(each.time > -0.5 * dt) & (each.time < end + 0.5 * dt) for each in aiding.fixes]
    kept = tuple(each.part(own) for each, own in zip(aiding.fixes, inside, strict=True))
    total = sum(each.size for each in inside)
    left_out = total - sum(int(np.count_nonzero(each)) for each in inside)
    if left_out == total:
        spans = "no fix at all"
        if total:
            times = np.concatenate([each.time + log.start for each in aiding.fixes])
            spans = f"fixes from {np.min(times):.10g} s to {np.max(times):.10g} s"
        raise InputError(
            f"{source} has {spans}, but {log.source} lasts from {log.start:.10g} s to "
            f"{log.start + end:.10g} s: bring both to one clock"
        )
    notices = [notice("fixes-left-out", values={"count": left_out})] if left_out else []
    return replace(aiding, fixes=kept), notices


def _with_barometer(
    aiding: Aiding, spec: BarometerSpec, folder: Path, log: ImuLog
) -> tuple[Aiding, Notice]:
    """The fixes with heights, which are set to the first position fix."""
    source, time, height = read_heights(folder / spec.file)
    time = time - log.start
    inside = np.isfinite(height) & (time > -0.5 * log.imu.dt)
    inside &= time < (log.imu.n + 0.5) * log.imu.dt
    time, height = time[inside], height[inside]
    first = aiding.of("position")
    near = np.abs(time - (np.nan if first is None else first.time[0])) <= tuning.CHORD
    if first is None or not np.any(near):
        raise InputError(
            f"{source} has no height within {tuning.CHORD:g} s of the first position fix: bring "
            "both to one clock"
        )
    shift = float(first.value[0, 2] - np.mean(height[near]))
    value, sd = np.zeros((time.size, 3)), np.zeros((time.size, 3))
    value[:, 0], sd[:, 0] = height + shift, spec.sd
    fixes = (*aiding.fixes, Fixes("height", time, value, sd))
    aiding = replace(aiding, fixes=fixes, barometer_sd=spec.drift_sd, barometer_tau=spec.drift_tau)
    return aiding, notice("barometer-set", values={"shift": shift})
