"""The unit of each channel: as the user gives it, else as the header does."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from gmwm._core.notices import Notice
from gmwm._core.units import SI_UNIT, factor, quantity_of
from gmwm.errors import InputError
from gmwm.readers.names import meaning
from gmwm.readers.roles import Roles
from gmwm.readers.table import Table

_SAME_UNIT = 1e-6  # relative; the same unit in two spellings differs by rounding

_EXAMPLES = {"gyro": "deg/s", "accel": "g"}


def channel_units(
    table: Table,
    roles: Roles,
    units: Mapping[str, str],
    unknown_rate: Callable[[], InputError | None],
) -> tuple[dict[str, str], tuple[Notice, ...]]:
    """Find the unit of every channel.

    units: What the user gave, by sensor or by channel; the latter goes first.
    unknown_rate: What is wrong with the sampling rate, which is then asked for at once.
    Returns: units, by channel; notices, where they come from, if not from the user alone.
    Raises InputError if a unit is missing, unknown, or not one of what the channel measures; or the
        rate is missing.
    """
    _check_keys(units, roles)
    found: dict[str, str] = {}
    from_header: dict[str, str] = {}
    overruled: dict[str, str] = {}
    missing: dict[str, str | None] = {}
    for channel, column in roles.channels.items():
        sensor = _sensor(channel, table.names[column])
        in_header = meaning(table.names[column]).unit
        given = units.get(channel, units.get(sensor or ""))
        unit = given if given is not None else in_header
        if unit is None:
            missing[channel] = sensor
            continue
        _check(table, channel, sensor, unit)
        found[channel] = unit
        if given is None:
            from_header[channel] = unit
        elif in_header is not None and not _same(in_header, given):
            overruled[channel] = f"{in_header}, not {given}"
    # Time stamps are looked at after the units, unless these are to be asked for anyway.
    rate = unknown_rate() if missing or roles.time is None else None
    if missing or rate is not None:
        raise _incomplete(table.source, missing, rate)
    origin = getattr(table, "message_type", "") or "the names of the columns"
    return found, tuple(_notices(origin, from_header, overruled))


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


def _incomplete(
    source: str, missing: Mapping[str, str | None], rate: InputError | None
) -> InputError:
    """Whatever the file and the user leave out, asked for in one sentence."""
    if rate is not None and not missing:
        return rate
    # One channel of each sensor stands for the others: they are mended together.
    first: dict[str, str] = {}
    for channel, sensor in missing.items():
        first.setdefault(sensor or channel, channel)
    text = f"does not give the unit of {' and '.join(first.values())}"
    codes = [f"{key}-unit-missing" if key in SI_UNIT else "unit-missing" for key in first]
    examples = [f'"{key}": "{_EXAMPLES.get(key, "deg/s")}"' for key in first]
    hint = f"units={{{', '.join(examples)}}}"
    if rate is None:
        it = "it" if len(codes) == 1 else "them"
        return InputError(
            f"{source} {text}", " ".join(dict.fromkeys(codes)), f"give {it}, e.g. {hint}"
        )
    # What is advised of a time column ends the advice of the command line.
    codes.insert(len(codes) if rate.code == "time-unit" else 0, rate.code)
    hint = f"give them, e.g. rate={rate.values['rate']:.6g}, {hint}"
    codes = list(dict.fromkeys(codes))
    return InputError(f"{rate.problem}, and it {text}", " ".join(codes), hint, rate.values)


def _notices(
    origin: str, from_header: Mapping[str, str], overruled: Mapping[str, str]
) -> list[Notice]:
    notices = []
    if from_header:
        by_unit = {
            unit: ", ".join(name for name, u in from_header.items() if u == unit)
            for unit in dict.fromkeys(from_header.values())
        }
        parts = "; ".join(f"{names} in {unit}" for unit, names in by_unit.items())
        text = f"units from {origin}: {parts}"
        notices.append(Notice("units-from-names", "note", "", text, from_header))
    if overruled:
        parts = "; ".join(f"{name} in {text}" for name, text in overruled.items())
        text = f"the units given contradict {origin}: {parts}"
        notices.append(Notice("units-contradicted", "warning", "", text, overruled))
    return notices
