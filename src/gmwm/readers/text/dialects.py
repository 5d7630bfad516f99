"""Text files whose columns mean something that their names do not say."""

from __future__ import annotations

import re
from dataclasses import replace

from gmwm.errors import InputError
from gmwm.issues import notice
from gmwm.readers.names import AXES
from gmwm.readers.text.layout import Layout

_UNITS = {"gyro": "rad/s", "accel": "m/s^2"}


def _axes(**prefixes: str) -> dict[str, str]:
    """Name of a column -> its meaning, for the three axes of a prefix."""
    return {
        f"{prefix}{axis}": f"{sensor}_{axis} [{_UNITS[sensor]}]"
        for sensor, prefix in prefixes.items()
        for axis in AXES
    }


_RENAMED = (
    {"timestamp": "time [ns]"} | _axes(gyro="omega_", accel="alpha_"),  # Kalibr
    {"timestamp": "time [us]", "gyro_rad[0]": "gyro_rad[0]"},  # ulog2csv of PX4
    {"time": "time [ns]", "field.header.stamp": "field.header.stamp [ns]"},  # rostopic
)
"""Names by which an exporter is known, and their meaning."""

_GRAVITY_IN_STEPS = re.compile(rb'"?acc_1G"?\s*,\s*"?([0-9]+)')
_BLACKBOX = re.compile(r"(gyroADC|accSmooth)\[([012])\]")
_SCALES = re.compile(rb"(?m)^([tga])scale,([0-9.eE+-]+)")
_GYROFLOW = {"t": "time [s]"} | _axes(gyro="g") | {f"a{axis}": f"accel_{axis} [g]" for axis in AXES}
_SHIMMER = re.compile(r"(?:Shimmer_\w+?_)?(?:(Gyro|Accel(?:_LN|_WR)?)_([XYZ])|Timestamp\w*)_CAL")
_GNSS_LOGGER = re.compile(rb"(?m)^# *UncalGyro,")


def with_dialect(layout: Layout, source: str, head: bytes) -> Layout:
    """A layout with the units that a known exporter implies in its column names.

    Betaflight (blackbox_decode): time in microseconds, gyros in deg/s, accelerometers in steps, of
    which the preamble has the number per g. Sensor Logger: axes without the sensor, which is in the
    name of the file, and time in nanoseconds. Gyroflow (gcsv): scales in the preamble. Xsens DOT:
    a clock of 1 MHz, where MTi has 10 kHz. Kalibr, ulog2csv of PX4 and rostopic: units of time.
    Shimmer: units in a line below the names.

    head: Beginning of the file.
    Raises InputError at a log of GnssLogger: each of its lines is of one of several sensors.
    """
    names, preamble = layout.names, head[: layout.offset]
    if _GNSS_LOGGER.search(head):
        raise InputError(
            f"{source} is a log of GnssLogger, with lines of several sensors: write those of one "
            "to a file, e.g. (echo 'time [ns],gyro_x [rad/s],gyro_y [rad/s],gyro_z [rad/s]'; "
            f"grep ^UncalGyro, {source} | cut -d, -f3-6) > gyro.csv"
        )
    if names[:1] == ("loopIteration",):
        return _of_blackbox(layout, preamble)
    if preamble.startswith(b"GYROFLOW IMU LOG"):
        sizes = {letter.decode(): float(size) for letter, size in _SCALES.findall(preamble)}
        meant = {name: new for name, new in _GYROFLOW.items() if name[0] in sizes}
        scales = {i: sizes[name[0]] for i, name in enumerate(names) if name in meant}
        return replace(_renamed(layout, meant), scales=scales)
    if b"DOT" in preamble:
        return _renamed(layout, {"SampleTimeFine": "time [us]"})
    if any(map(_SHIMMER.fullmatch, names)):
        return _of_shimmer(layout, head)
    for meant in _RENAMED:
        if set(meant) <= set(names):
            return _renamed(layout, meant)
    sensor = next((each for each in _UNITS if each in source.lower()), "")
    if sensor and {*AXES, "seconds_elapsed"} <= set(names):
        meant = {axis: f"{sensor}_{axis} [{_UNITS[sensor]}]" for axis in AXES}
        layout = _renamed(layout, {**meant, "time": "time [ns]"})
        if source.lower().startswith("accelerometer."):
            return replace(layout, notices=(*layout.notices, notice("gravity-absent", "accel")))
    return layout


def _renamed(layout: Layout, meant: dict[str, str]) -> Layout:
    return replace(layout, names=tuple(meant.get(name, name) for name in layout.names))


def _of_blackbox(layout: Layout, preamble: bytes) -> Layout:
    steps = _GRAVITY_IN_STEPS.search(preamble)
    meant, scales = {"time": "time [us]", "time (us)": "time [us]"}, {}
    for i, name in enumerate(layout.names):
        if found := _BLACKBOX.fullmatch(name):
            axis = AXES[int(found[2])]
            if found[1] == "gyroADC":
                meant[name] = f"gyro_{axis} [deg/s]"
            else:
                meant[name] = f"accel_{axis} [g]" if steps else f"accel_{axis}"
        if steps and name.startswith("accSmooth"):
            scales[i] = 1.0 / max(int(steps[1]), 1)
    return replace(_renamed(layout, meant), scales=scales)


def _of_shimmer(layout: Layout, head: bytes) -> Layout:
    """Units from the line below the names; the low-noise accelerometer, where there are two."""
    row = head[layout.offset :].partition(b"\n")[0]
    units = [unit.strip(' "\r') for unit in row.decode(errors="replace").split(layout.delimiter)]
    if "deg/s" not in units and "m/(s^2)" not in units:
        return layout
    meant = {}
    has_low_noise = any("Accel_LN_" in name for name in layout.names)
    for name, unit in zip(layout.names, units, strict=False):
        found = _SHIMMER.fullmatch(name)
        if found and found[1] and not (found[1] == "Accel_WR" and has_low_noise):
            unit = unit.replace("(s^2)", "s^2")
            meant[name] = f"{found[1][:5].lower().rstrip('_')}_{found[2].lower()} [{unit}]"
        elif found and not found[1] and unit == "ms":
            meant[name] = "time [ms]"
    offset, line = layout.offset + len(row) + 1, layout.line + 1
    return replace(_renamed(layout, meant), offset=offset, line=line)
