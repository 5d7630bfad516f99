"""Text files of which the columns mean something that their names do not say."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from gmwm.readers.layout import Layout
from gmwm.readers.names import AXES

_GRAVITY_IN_STEPS = re.compile(rb'"?acc_1G"?\s*,\s*"?([0-9]+)')
_INDEXED = re.compile(r"(gyroADC|accSmooth)\[([012])\]")
_ANDROID = {"gyro": "rad/s", "accel": "m/s^2"}


def with_dialect(layout: Layout, source: str, head: bytes) -> Layout:
    """A layout with the units that a known exporter implies in its column names.

    Betaflight (blackbox_decode): time in microseconds, gyros in deg/s, accelerometers in steps of
    which the preamble has the number per g. Sensor Logger: axes without the sensor, which is in the
    name of the file, and time in nanoseconds.

    source: Name of the file.
    head: Its beginning.
    """
    names = layout.names
    if names[:1] == ("loopIteration",):
        steps = _GRAVITY_IN_STEPS.search(head[: layout.offset])
        renamed = tuple(_of_blackbox(name, steps is not None) for name in names)
        scales: Mapping[int, float] = {}
        if steps is not None:
            scale = 1.0 / max(int(steps[1]), 1)
            scales = {i: scale for i, name in enumerate(names) if name.startswith("accSmooth")}
        return replace(layout, names=renamed, scales=scales)
    if set(AXES) <= set(names) and "seconds_elapsed" in names:
        sensor = next((each for each in _ANDROID if each in source.lower()), None)
        if sensor is not None:
            units = {axis: f"{sensor}_{axis} [{_ANDROID[sensor]}]" for axis in AXES}
            units["time"] = "time [ns]"
            return replace(layout, names=tuple(units.get(name, name) for name in names))
    return layout


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
