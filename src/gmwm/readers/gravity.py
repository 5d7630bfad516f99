"""Whether an accelerometer at rest shows gravity in the unit that it is read in."""

from __future__ import annotations

import math
from collections.abc import Mapping

from gmwm._core.notices import Notice
from gmwm._core.units import SI_UNIT, factor
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.names import AXES
from gmwm.readers.recording import Recording

_GRAVITY = factor("g", SI_UNIT["accel"])
_TRIAD = tuple(f"accel_{axis}" for axis in AXES)
_UNITS = ("m/s^2", "g", "mg", "ug")


def gravity_notices(
    recording: Recording, unit_of: Mapping[str, str], given: Mapping[str, str]
) -> tuple[Notice, ...]:
    """Compare the mean of the accelerometer with gravity.

    A mean that is no gravity in the unit used, but is in another one, shows that the unit is
    wrong; any other mean may be that of data without gravity.

    Parameters
    ----------
    recording : Recording
    unit_of : mapping of str to str
        Unit of each channel in the file.
    given : mapping of str to str
        Units that the user gave, by channel or sensor.

    Raises
    ------
    InputError
        If the unit is wrong and comes from the file.
    """
    if not all(name in recording for name in _TRIAD):
        return ()
    used = {unit_of[name] for name in _TRIAD}
    norm = math.hypot(*(recording[name].mean for name in _TRIAD))
    if len(used) > 1 or not norm > 0.0 or _is_gravity(norm):
        return ()
    unit = used.pop()
    in_file = norm / factor(unit, SI_UNIT["accel"])
    likely = [name for name in _UNITS if _is_gravity(in_file * factor(name, SI_UNIT["accel"]))]
    if not likely:
        return ()
    text = (
        f"the mean of the accelerometer is {in_file:.4g} {unit} long, which is gravity in "
        f"{likely[0]}"
    )
    if not any(key in given for key in ("accel", *_TRIAD)):
        raise InputError(
            f'{recording.source}: {text}: give the unit, units={{"accel": "{likely[0]}"}}',
            "accel-unit-missing",
        )
    values = {"norm": norm, "unit": unit, "likely": likely[0]}
    action = f"check the unit: everything of the accelerometer is off by {_GRAVITY / norm:.4g}"
    return (Notice("gravity", "bad", "accel", text, values, action),)


def _is_gravity(norm: float) -> bool:
    return abs(norm / _GRAVITY - 1.0) < tuning.GRAVITY_AGREES
