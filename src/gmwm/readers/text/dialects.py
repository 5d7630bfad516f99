"""Text files whose columns mean something that their names do not say."""

from __future__ import annotations

import re
from dataclasses import replace

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


def with_dialect(layout: Layout, source: str, head: bytes) -> Layout:
    """A layout with the units that a known exporter implies in its column names.

    Betaflight (blackbox_decode): time in microseconds, gyros in deg/s, accelerometers in steps, of
    which the preamble has the number per g. Sensor Logger: axes without the sensor, which is in the
    name of the file, and time in nanoseconds. Gyroflow (gcsv): scales in the preamble. Xsens DOT:
    a clock of 1 MHz, where MTi has 10 kHz. Kalibr, ulog2csv of PX4 and rostopic: units of time.

    head: Beginning of the file.
    """
    names, preamble = layout.names, head[: layout.offset]
    if names[:1] == ("loopIteration",):
        return _of_blackbox(layout, preamble)
    if preamble.startswith(b"GYROFLOW IMU LOG"):
        sizes = {letter.decode(): float(size) for letter, size in _SCALES.findall(preamble)}
        meant = {name: new for name, new in _GYROFLOW.items() if name[0] in sizes}
        scales = {i: sizes[name[0]] for i, name in enumerate(names) if name in meant}
        return replace(_renamed(layout, meant), scales=scales)
    if b"DOT" in preamble:
        return _renamed(layout, {"SampleTimeFine": "time [us]"})
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
