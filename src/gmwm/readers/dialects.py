"""Text files of which the columns mean something that their names do not say."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from gmwm._core.notices import Notice
from gmwm.errors import InputError
from gmwm.readers.layout import Layout
from gmwm.readers.names import AXES

_GRAVITY_IN_STEPS = re.compile(rb'"?acc_1G"?\s*,\s*"?([0-9]+)')
_INDEXED = re.compile(r"(gyroADC|accSmooth)\[([012])\]")
_ANDROID = {"gyro": "rad/s", "accel": "m/s^2"}
_FUSED = "Sensor Logger has subtracted gravity from these accelerations, by what other sensors say"
_NOT_FUSED = "use TotalAcceleration or AccelerometerUncalibrated"
_SCALES = re.compile(rb"(?m)^([tga])scale,([0-9.eE+-]+)")
_GYROFLOW = {"t": "time [s]"} | {
    f"{letter}{axis}": f"{sensor}_{axis} [{unit}]"
    for letter, sensor, unit in (("g", "gyro", "rad/s"), ("a", "accel", "g"))
    for axis in AXES
}
_KALIBR = {
    f"{word}_{axis}": f"{sensor}_{axis} [{_ANDROID[sensor]}]"
    for word, sensor in (("omega", "gyro"), ("alpha", "accel"))
    for axis in AXES
}
_SHIMMER = re.compile(r"(?:Shimmer_\w+?_)?(?:(Gyro|Accel(?:_LN|_WR)?)_([XYZ])|Timestamp\w*)_CAL")
_GNSS_LOGGER = re.compile(rb"(?m)^# *UncalGyro,")
_RENAMED = (
    (frozenset({"timestamp", *_KALIBR}), {"timestamp": "time [ns]", **_KALIBR}),
    (frozenset({"timestamp", "gyro_rad[0]"}), {"timestamp": "time [us]"}),
    (
        frozenset({"time", "field.header.stamp"}),
        {"time": "time [ns]", "field.header.stamp": "field.header.stamp [ns]"},
    ),
)
"""Names by which an exporter is known, and what they mean."""


def with_dialect(layout: Layout, source: str, head: bytes) -> Layout:
    """A layout with the units that a known exporter implies in its column names.

    Betaflight (blackbox_decode): time in microseconds, gyros in deg/s, accelerometers in steps of
    which the preamble has the number per g. Sensor Logger: axes without the sensor, which is in the
    name of the file, and time in nanoseconds. Gyroflow (gcsv): scales in the preamble. Xsens DOT:
    a clock of 1 MHz, where MTi has 10 kHz. Kalibr, ulog2csv of PX4 and rostopic: units of time.
    Shimmer: units in a line below the names.

    source: Name of the file.
    head: Its beginning.
    Raises InputError at a log of GnssLogger: each of its lines is of one of several sensors.
    """
    if _GNSS_LOGGER.search(head):
        raise InputError(
            f"{source} is a log of GnssLogger, with lines of several sensors: write those of one "
            "to a file, e.g. (echo 'time [ns],gyro_x [rad/s],gyro_y [rad/s],gyro_z [rad/s]'; "
            f"grep ^UncalGyro, {source} | cut -d, -f3-6) > gyro.csv"
        )
    names = layout.names
    if names[:1] == ("loopIteration",):
        steps = _GRAVITY_IN_STEPS.search(head[: layout.offset])
        renamed = tuple(_of_blackbox(name, steps is not None) for name in names)
        scales: Mapping[int, float] = {}
        if steps is not None:
            scale = 1.0 / max(int(steps[1]), 1)
            scales = {i: scale for i, name in enumerate(names) if name.startswith("accSmooth")}
        return replace(layout, names=renamed, scales=scales)
    preamble = head[: layout.offset]
    if preamble.startswith(b"GYROFLOW IMU LOG"):
        sizes = {letter.decode(): float(size) for letter, size in _SCALES.findall(preamble)}
        renamed = tuple(_GYROFLOW.get(n, n) if n[:1] in sizes else n for n in names)
        scales = {i: sizes[n[0]] for i, n in enumerate(names) if renamed[i] != n}
        return replace(layout, names=renamed, scales=scales)
    if b"DOT" in preamble:
        renamed = tuple("time [us]" if n == "SampleTimeFine" else n for n in names)
        return replace(layout, names=renamed)
    if any(map(_SHIMMER.fullmatch, names)):
        return _of_shimmer(layout, head)
    for known, meant in _RENAMED:
        if known <= set(names):
            return replace(layout, names=tuple(meant.get(name, name) for name in names))
    if set(AXES) <= set(names) and "seconds_elapsed" in names:
        sensor = next((each for each in _ANDROID if each in source.lower()), None)
        if sensor is not None:
            units = {axis: f"{sensor}_{axis} [{_ANDROID[sensor]}]" for axis in AXES}
            units["time"] = "time [ns]"
            renamed = tuple(units.get(name, name) for name in names)
            notices = layout.notices
            if source.lower().startswith("accelerometer."):
                notices += (Notice("gravity-absent", "warning", "accel", _FUSED, {}, _NOT_FUSED),)
            return replace(layout, names=renamed, notices=notices)
    return layout


def _of_shimmer(layout: Layout, head: bytes) -> Layout:
    """The low-noise accelerometer, where there are two."""
    row = head[layout.offset :].partition(b"\n")[0]
    units = [unit.strip(' "\r') for unit in row.decode(errors="replace").split(layout.delimiter)]
    if "deg/s" not in units and "m/(s^2)" not in units:
        return layout
    names = list(layout.names)
    has_low_noise = any("Accel_LN_" in name for name in names)
    for i, (name, unit) in enumerate(zip(layout.names, units, strict=False)):
        found = _SHIMMER.fullmatch(name)
        if found and found[1] and not (found[1] == "Accel_WR" and has_low_noise):
            unit = unit.replace("(s^2)", "s^2")
            names[i] = f"{found[1][:5].lower().rstrip('_')}_{found[2].lower()} [{unit}]"
        elif found and not found[1] and unit == "ms":
            names[i] = "time [ms]"
    return replace(
        layout, names=tuple(names), offset=layout.offset + len(row) + 1, line=layout.line + 1
    )


def _of_blackbox(name: str, has_scale: bool) -> str:
    if name in ("time", "time (us)"):
        return "time [us]"
    found = _INDEXED.fullmatch(name)
    if not found:
        return name
    axis = AXES[int(found[2])]
    if found[1] == "gyroADC":
        return f"gyro_{axis} [deg/s]"
    return f"accel_{axis} [g]" if has_scale else f"accel_{axis}"
