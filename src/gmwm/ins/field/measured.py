"""Real data to be filtered: an IMU's record, GNSS fixes, and what is known of the sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.ins.field.fix_file import POSITION_SD, VELOCITY_SD, read_fix_log
from gmwm.ins.field.imu_file import read_imu_log
from gmwm.ins.filter import Aiding
from gmwm.ins.imu import AXES, Imu, SensorModels
from gmwm.ins.spec import mapping, positive, read_models, reading_options, three, value

KEYS = ("imu", "gnss_fixes", "sensors", "lever_arm", "heading", "heading_sd", "position_sd",
        "velocity_sd", "bias")  # fmt: skip
"""What a description may say."""

_OF_IMU = ("file", "rate", "units", "channels", "time")
_TURN_ON = {"gyro": np.radians(0.1), "accel": 0.1}
"""Standard deviation of what a static calibration takes off and a sensor changes when it is
switched on, where nobody says better: rad/s, m/s^2."""


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
    notes : tuple of str
    """

    imu: Imu
    aiding: Aiding
    sensors: SensorModels
    start: float = 0.0
    heading: float | None = None
    heading_sd: float = np.radians(2.0)
    title: str = ""
    notes: tuple[str, ...] = ()

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
        content = mapping("the description", content, KEYS)
        missing = [name for name in ("imu", "gnss_fixes", "sensors") if name not in content]
        if missing:
            raise InputError(
                f"there is no {', no '.join(missing)}: filtering needs the IMU's record (imu, "
                "--imu), GNSS fixes (gnss_fixes, --gnss) and sensor models (sensors, --sensors)"
            )
        given = content["imu"] if isinstance(content["imu"], Mapping) else {"file": content["imu"]}
        given = mapping("imu", given, _OF_IMU)
        file, fixes = _name("imu", given.get("file")), _name("gnss_fixes", content["gnss_fixes"])
        sensors = read_models("sensors", content["sensors"], folder)
        angles = {
            name: value(content[name], "rad", name)
            for name in ("heading", "heading_sd")
            if name in content
        }
        if "heading_sd" in angles:
            checks.positive("heading_sd", angles["heading_sd"])
        sensors, told = _with_bias(sensors, content.get("bias", {}))
        usual = {"position_sd": POSITION_SD, "velocity_sd": VELOCITY_SD}
        deviations = {
            name: _positive(content[name], unit, name) if name in content else usual[name]
            for name, unit in (("position_sd", "m"), ("velocity_sd", "m/s"))
        }
        arm = three(content.get("lever_arm", [0.0, 0.0, 0.0]), "m", "lever_arm")
        log = read_imu_log(folder / file, **reading_options("imu", given))
        found = read_fix_log(folder / fixes)
        aiding, cut = _within(
            found.aiding(log.start, deviations["position_sd"], deviations["velocity_sd"], arm),
            log.imu, log.source, found.source, log.start,
        )  # fmt: skip
        for kind, own in (("position", found.position_sd), ("velocity", found.velocity_sd)):
            if own is None and any(each.kind == kind for each in aiding.fixes):
                sd = ", ".join(f"{each:g}" for each in deviations[f"{kind}_sd"])
                told = (*told, f"{kind} fixes are taken to have standard deviations of {sd} "
                        f"{'m' if kind == 'position' else 'm/s'} (north, east, down)")  # fmt: skip
        return cls(
            imu=log.imu,
            aiding=aiding,
            sensors=sensors,
            start=log.start,
            heading=angles.get("heading"),
            heading_sd=angles.get("heading_sd", float(np.radians(2.0))),
            title=log.source,
            notes=(*log.notes, *found.notes, *cut, *told),
        )


def _name(where: str, given: Any) -> str:
    if not isinstance(given, str) or "\0" in given:
        raise InputError(f"{where}: {checks.shown(given)}: write the name of a file")
    return given


def _positive(content: Any, unit: str, where: str) -> list[float]:
    return [checks.positive(where, each) for each in three(content, unit, where)]


def _with_bias(models: SensorModels, content: Any) -> tuple[SensorModels, tuple[str, ...]]:
    """Models with a constant that is drawn when a sensor is switched on, and what was assumed."""
    content = mapping("bias", content, ("gyro", "accel"))
    given = {
        kind: value(each, SI_UNIT[kind], f"bias, {kind}")
        if each == 0
        else positive(each, SI_UNIT[kind], f"bias, {kind}")
        for kind, each in content.items()
    }
    bias_sd, assumed = {}, []
    for axis in AXES:
        kind = axis.partition("_")[0]
        bias_sd[axis] = given.get(kind, models.bias_sd[axis] or _TURN_ON[kind])
        if kind not in given and not models.bias_sd[axis] and kind not in assumed:
            assumed.append(kind)
    text = {"gyro": "gyros 0.1 deg/s", "accel": "accelerometers 0.1 m/s^2"}
    told = "biases at switching on, which a static calibration does not know, are taken to be "
    note = told + " and ".join(text[kind] for kind in assumed) + " (1 sigma)"
    return replace(models, bias_sd=bias_sd), (note,) if assumed else ()


def _within(
    aiding: Aiding, imu: Imu, record: str, source: str, start: float
) -> tuple[Aiding, tuple[str, ...]]:
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
    note = f"{left_out} fixes before or after the IMU's record are left out"
    return replace(aiding, fixes=tuple(kept)), (note,) if left_out else ()
