"""Real data to be filtered: an IMU's record, GNSS fixes, and what is known of the sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field

from gmwm._core.notices import Notice
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.field.fix_file import FixLog, read_fix_log, read_heights
from gmwm.ins.field.imu_file import ImuLog, read_imu_log
from gmwm.ins.field.start import standstills
from gmwm.ins.filter import Aiding, Fixes
from gmwm.ins.imu import AXES, Imu, SensorModels
from gmwm.ins.spec import (
    FileName,
    Meters,
    Models,
    PositiveMeters,
    PositiveRadians,
    PositiveSeconds,
    PositiveSpeed,
    Radians,
    ReadingSpec,
    Seconds,
    Spec,
    Three,
    number,
    read_models,
    written,
)

_UNITS = {"position": "m", "velocity": "m/s"}


class ImuSpec(ReadingSpec):
    """The record of an IMU."""

    file: FileName
    start: Seconds | None = None

    def options(self) -> dict[str, Any]:
        """Arguments of `gmwm.ins.read_imu`."""
        return super().options() | {"start": self.start}


class BiasSpec(Spec):
    """How far sensors may be off when they are switched on."""

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


class MeasuredSpec(Spec):
    """What a file may say."""

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


@dataclass(frozen=True, eq=False)
class Measured:
    """All that a filter of real data needs.

    Attributes
    ----------
    imu : Imu
    aiding : Aiding
        On the IMU's time, s since its first epoch.
    sensors : SensorModels
    start : float
        Time of the first epoch on the clock of the files, s.
    heading : float or None
        Of the forward axis at the first fix, rad; ``None`` to find it in the data.
    heading_sd : float
        rad.
    attitude : tuple of three floats or None
        Roll, pitch and yaw at the first fix, rad; ``None`` to find them in the data.
    attitude_sd : float
        rad.
    title : str
    notices : tuple of Notice
    """

    imu: Imu
    aiding: Aiding
    sensors: SensorModels
    start: float = 0.0
    heading: float | None = None
    heading_sd: float = tuning.HEADING_SD
    attitude: tuple[float, float, float] | None = None
    attitude_sd: float = tuning.ATTITUDE_SD
    title: str = ""
    notices: tuple[Notice, ...] = ()

    @classmethod
    def of(cls, content: Mapping[str, Any], folder: Path = Path()) -> Measured:
        """From the content of a file.

        Parameters
        ----------
        content : mapping
            imu, gnss_fixes and sensors, and what else is known; see the documentation.
        folder : Path, optional
            That paths are relative to.

        Raises
        ------
        InputError
            If something is missing, unknown or cannot be used.
        """
        spec = MeasuredSpec.parse(content)
        if spec.attitude is not None and spec.heading is not None:
            raise InputError("heading and attitude: the attitude has a yaw; leave the heading out")
        sensors, assumed = with_bias(read_models("sensors", spec.sensors, folder), spec.bias.given)
        log = read_imu_log(folder / spec.imu.file, **spec.imu.options())
        found = read_fix_log(folder / spec.gnss_fixes)
        aiding, cut = _within(
            replace(
                found.aiding(
                    log.start - spec.gnss_shift, spec.position_sd, spec.velocity_sd, spec.lever_arm
                ),
                coloured_sd=spec.coloured_sd, coloured_tau=spec.coloured_tau, gate=spec.gate,
            ),
            log.imu, log.source, found.source, log.start,
        )  # fmt: skip
        if spec.barometer is not None:
            aiding, set_to = _with_barometer(aiding, spec.barometer, folder, log)
            cut = (*cut, set_to)
        if spec.zero_velocity is not None:
            aiding, seen = _with_standstills(aiding, log.imu, spec.zero_velocity)
            cut = (*cut, seen)
        for kind, own, usual in (("position", found.position_sd, spec.position_sd),
                                 ("velocity", found.velocity_sd, spec.velocity_sd)):  # fmt: skip
            name = f"{kind}_sd"
            if own is not None and name in spec.given:
                text = "the fixes have standard deviations of their own: those given are not used"
                assumed = (*assumed, Notice("sd-not-used", "warning", kind, text))
            if own is None and name not in spec.given and aiding.of(kind) is not None:
                sd, unit = ", ".join(f"{each:g}" for each in usual), _UNITS[kind]
                text = (
                    f"the fixes have no standard deviations: {sd} {unit} to the north, east and "
                    "down are assumed"
                )
                values = dict(zip(("north", "east", "down"), usual, strict=True))
                hint = f"give {name}"
                assumed = (*assumed, Notice("sd-assumed", "note", kind, text, values, hint))
        return cls(
            imu=log.imu,
            aiding=aiding,
            sensors=sensors,
            start=log.start,
            heading=spec.heading,
            heading_sd=spec.heading_sd,
            attitude=spec.attitude,
            attitude_sd=spec.attitude_sd,
            title=log.source,
            notices=(*log.notices, *found.notices, *_scales(log, found), *cut, *assumed),
        )


def _scales(log: ImuLog, found: FixLog) -> tuple[Notice, ...]:
    """Dates of the fixes on a scale that those of an IMU rarely are on."""
    scale = next((each.values["scale"] for each in found.notices if each.code == "dates"), "UTC")
    if scale == "UTC" or not any(each.code == "dates" for each in log.notices):
        return ()
    text = (
        f"both have dates, those of the fixes in {scale}: if the IMU's are in UTC, GPS time is "
        f"ahead of them by the leap seconds, {tuning.LEAP_SECONDS:g} s since 2017"
    )
    values = {"scale": scale}
    return (Notice("time-scales", "warning", "", text, values, "shift the fixes by as much"),)


def with_bias(
    models: SensorModels, given: Mapping[str, float]
) -> tuple[SensorModels, tuple[Notice, ...]]:
    """Models with a constant that is drawn when a sensor is switched on, and what was assumed."""
    bias_sd, assumed = {}, {}
    for axis in AXES:
        kind = axis.partition("_")[0]
        bias_sd[axis] = given.get(kind, models.bias_sd[axis] or tuning.TURN_ON_SD[kind])
        if kind not in given and not models.bias_sd[axis]:
            assumed[kind] = bias_sd[axis]
    shown = {
        "gyro": lambda sd: f"gyros {np.degrees(sd):g} deg/s",
        "accel": lambda sd: f"accelerometers {sd:g} m/s^2",
    }
    text = (
        "biases at switching on, which a static calibration does not know, are taken to be "
        + " and ".join(shown[kind](sd) for kind, sd in assumed.items())
        + " (1 sigma)"
    )
    notices = (Notice("biases-assumed", "note", "", text, assumed),) if assumed else ()
    return replace(models, bias_sd=bias_sd), notices


def _with_barometer(
    aiding: Aiding, spec: BarometerSpec, folder: Path, log: ImuLog
) -> tuple[Aiding, Notice]:
    """The fixes, and heights that are set to the first position fix.

    Raises InputError if no height is near that.
    """
    source, time, height = read_heights(folder / spec.file)
    time = time - log.start
    inside = np.isfinite(height) & (time > -0.5 * log.imu.dt)
    inside &= time < (log.imu.n + 0.5) * log.imu.dt
    time, height = time[inside], height[inside]
    first = aiding.of("position")
    near = np.abs(time - (np.nan if first is None else first.time[0])) <= tuning.CHORD
    if first is None or not np.any(near):
        raise InputError(
            f"{source} has no height within {tuning.CHORD:g} s of the first position fix, to be "
            "set to it: bring both to one clock"
        )
    shift = float(first.value[0, 2] - np.mean(height[near]))
    value, sd = np.zeros((time.size, 3)), np.zeros((time.size, 3))
    value[:, 0], sd[:, 0] = height + shift, spec.sd
    heights = Fixes("height", time, value, sd)
    text = f"barometric heights are set to the first position fix, by {shift:.3g} m"
    return (
        replace(
            aiding, fixes=(*aiding.fixes, heights), barometer_sd=spec.drift_sd,
            barometer_tau=spec.drift_tau,
        ),
        Notice("barometer-set", "note", "", text, {"shift": shift}),
    )  # fmt: skip


def _with_standstills(aiding: Aiding, imu: Imu, sd: float) -> tuple[Aiding, Notice]:
    """The fixes, and standstills that the IMU shows."""
    found = standstills(imu, aiding, sd)
    if found is None:
        text = "no standstill can be recognised: the vehicle does not stand at the start"
        return aiding, Notice("standstills-unknown", "warning", "", text)
    text = f"{found.time.size} standstills of {tuning.ZERO_VELOCITY[1]:g} s are recognised"
    return (
        replace(aiding, fixes=(*aiding.fixes, found)),
        Notice("standstills", "note", "", text, {"count": found.time.size}),
    )


def _within(
    aiding: Aiding, imu: Imu, record: str, source: str, start: float
) -> tuple[Aiding, tuple[Notice, ...]]:
    """The fixes of the time of the IMU's record."""
    end = imu.n * imu.dt
    kept, left_out, total = [], 0, 0
    for each in aiding.fixes:
        inside = (each.time > -0.5 * imu.dt) & (each.time < end + 0.5 * imu.dt)
        left_out += int(np.count_nonzero(~inside))
        total += inside.size
        kept.append(each.part(inside))
    if left_out == total:
        times = np.concatenate([[np.nan], *(each.time + start for each in aiding.fixes)])
        spans = (
            f"fixes from {np.nanmin(times):.10g} s to {np.nanmax(times):.10g} s" if total else
            "no fix at all"
        )  # fmt: skip
        raise InputError(
            f"{source} has {spans}, none in the time of {record}, {start:.10g} s to "
            f"{start + end:.10g} s: bring both to one clock"
        )
    text = f"{left_out} fixes before or after the IMU's record are left out"
    notice = Notice("fixes-left-out", "note", "", text, {"count": left_out})
    return replace(aiding, fixes=tuple(kept)), (notice,) if left_out else ()
