"""The unit of each channel: as the user gives it, else as the header does, and as gravity shows."""

from __future__ import annotations

import math
from collections.abc import Mapping

from gmwm._core.notices import Notice
from gmwm._core.units import SI_UNIT, factor, quantity_of
from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.names import AXES, meaning
from gmwm.readers.recording import Recording
from gmwm.readers.roles import Roles
from gmwm.readers.table import Table

_SAME_UNIT = 1e-6  # relative; the same unit in two spellings differs by rounding

_GRAVITY = factor("g", SI_UNIT["accel"])
_TRIAD = tuple(f"accel_{axis}" for axis in AXES)
_UNITS = ("m/s^2", "g", "mg", "ug")
_EXAMPLES = {"gyro": "deg/s", "accel": "g"}


def channel_units(
    table: Table, roles: Roles, units: Mapping[str, str]
) -> tuple[dict[str, str], tuple[Notice, ...]]:
    """Find the unit of every channel.

    Parameters
    ----------
    table : Table
    roles : Roles
    units : mapping of str to str
        What the user gave, by sensor or by channel; the latter goes first.

    Returns
    -------
    units : dict of str to str
        By channel.
    notices : tuple of Notice
        Where they come from, if not from the user alone.

    Raises
    ------
    InputError
        If a unit is missing, unknown, or not one of what the channel measures.
    """
    _check_keys(units, roles)
    found: dict[str, str] = {}
    from_header: dict[str, str] = {}
    overruled: dict[str, str] = {}
    for channel, column in roles.channels.items():
        sensor = _sensor(channel, table.names[column])
        in_header = meaning(table.names[column]).unit
        given = units.get(channel, units.get(sensor or ""))
        unit = given if given is not None else in_header
        if unit is None:
            raise _missing(table, channel, sensor)
        _check(table, channel, sensor, unit)
        found[channel] = unit
        if given is None:
            from_header[channel] = unit
        elif in_header is not None and not _same(in_header, given):
            overruled[channel] = f"{in_header}, not {given}"
    return found, tuple(_notices(from_header, overruled))


def _sensor(channel: str, column: str) -> str | None:
    """What a channel measures, by its own name or by that of its column."""
    for name in (channel, meaning(column).role or ""):
        for sensor in SI_UNIT:
            if name.lower().startswith(sensor):
                return sensor
    return None


def _check_keys(units: Mapping[str, str], roles: Roles) -> None:
    known = (*roles.channels, *(column.name for column in roles.auxiliary))
    for key in units:
        if key not in SI_UNIT and key not in known:
            raise InputError(
                f"units has {key!r}, which is neither gyro nor accel nor a channel: the channels "
                f"are {', '.join(known)}"
            )


def _check(table: Table, channel: str, sensor: str | None, unit: str) -> None:
    try:
        if sensor:
            factor(unit, SI_UNIT[sensor])
        else:
            quantity_of(unit)
    except InputError as error:
        raise InputError(f"{table.source}, channel {channel}: {error}") from error


def _same(unit: str, other: str) -> bool:
    try:
        return abs(factor(unit, other) - 1.0) < _SAME_UNIT
    except InputError:
        return False


def _missing(table: Table, channel: str, sensor: str | None) -> InputError:
    if sensor is None:
        return InputError(
            f"{table.source} does not give the unit of {channel}: give it, e.g. "
            f'units={{"{channel}": "deg/s"}}',
            "unit-missing",
        )
    example = _EXAMPLES[sensor]
    return InputError(
        f"{table.source} does not give the unit of {channel}: give it, e.g. "
        f'units={{"{sensor}": "{example}"}}',
        f"{sensor}-unit-missing",
    )


def _notices(from_header: Mapping[str, str], overruled: Mapping[str, str]) -> list[Notice]:
    notices = []
    if from_header:
        by_unit = {
            unit: ", ".join(name for name, u in from_header.items() if u == unit)
            for unit in dict.fromkeys(from_header.values())
        }
        parts = "; ".join(f"{names} in {unit}" for unit, names in by_unit.items())
        text = f"units from the names of the columns: {parts}"
        notices.append(Notice("units-from-names", "note", "", text, from_header))
    if overruled:
        parts = "; ".join(f"{name} in {text}" for name, text in overruled.items())
        text = f"the names of the columns contradict the units given: {parts}"
        notices.append(Notice("units-contradicted", "warning", "", text, overruled))
    return notices


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
