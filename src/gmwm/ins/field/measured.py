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
from gmwm.ins.field.fix_file import read_fix_log
from gmwm.ins.field.imu_file import read_imu_log
from gmwm.ins.filter import Aiding
from gmwm.ins.imu import AXES, Imu, SensorModels
from gmwm.ins.spec import (
    FileName,
    Meters,
    Models,
    PositiveMeters,
    PositiveRadians,
    PositiveSpeed,
    Radians,
    ReadingSpec,
    Spec,
    Three,
    number,
    read_models,
)

_UNITS = {"position": "m", "velocity": "m/s"}


class ImuSpec(ReadingSpec):
    """The record of an IMU."""

    file: FileName


class BiasSpec(Spec):
    """How far sensors may be off when they are switched on."""

    gyro: Annotated[float, number(SI_UNIT["gyro"]), Field(ge=0.0)] | None = None
    accel: Annotated[float, number(SI_UNIT["accel"]), Field(ge=0.0)] | None = None


class MeasuredSpec(Spec):
    """What a file may say."""

    NEEDS: ClassVar[str] = (
        "filtering needs the IMU's record (imu), GNSS fixes (gnss_fixes) and sensor models "
        "(sensors)"
    )

    imu: Annotated[
        ImuSpec, BeforeValidator(lambda each: each if isinstance(each, Mapping) else {"file": each})
    ]
    gnss_fixes: FileName
    sensors: Models
    lever_arm: Three[Meters] = (0.0, 0.0, 0.0)
    heading: Radians | None = None
    heading_sd: PositiveRadians = tuning.HEADING_SD
    position_sd: Three[PositiveMeters] = tuning.POSITION_SD
    velocity_sd: Three[PositiveSpeed] = tuning.VELOCITY_SD
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
    title : str
    notices : tuple of Notice
    """

    imu: Imu
    aiding: Aiding
    sensors: SensorModels
    start: float = 0.0
    heading: float | None = None
    heading_sd: float = tuning.HEADING_SD
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
        sensors, assumed = with_bias(read_models("sensors", spec.sensors, folder), spec.bias.given)
        log = read_imu_log(folder / spec.imu.file, **spec.imu.options())
        found = read_fix_log(folder / spec.gnss_fixes)
        aiding, cut = _within(
            found.aiding(log.start, spec.position_sd, spec.velocity_sd, spec.lever_arm),
            log.imu, log.source, found.source, log.start,
        )  # fmt: skip
        for kind, own, usual in (("position", found.position_sd, spec.position_sd),
                                 ("velocity", found.velocity_sd, spec.velocity_sd)):  # fmt: skip
            if own is None and any(each.kind == kind for each in aiding.fixes):
                sd, unit = ", ".join(f"{each:g}" for each in usual), _UNITS[kind]
                text = (
                    f"{kind} fixes are taken to have standard deviations of {sd} {unit} (north, "
                    "east, down)"
                )
                values = dict(zip(("north", "east", "down"), usual, strict=True))
                assumed = (*assumed, Notice("sd-assumed", "note", "", text, values))
        return cls(
            imu=log.imu,
            aiding=aiding,
            sensors=sensors,
            start=log.start,
            heading=spec.heading,
            heading_sd=spec.heading_sd,
            title=log.source,
            notices=(*log.notices, *found.notices, *cut, *assumed),
        )


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
