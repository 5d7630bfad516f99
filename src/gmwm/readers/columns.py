"""Which column is which channel, and in what unit."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from gmwm._core import checks
from gmwm._core.units import AUXILIARY, SI_UNIT, Unit, auxiliary_unit, is_other_unit, sensor_unit
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
from gmwm.readers import tuning
from gmwm.readers.names import AXES, CANONICAL, NUMBERS_OF_SENSORS, TIME, bare, meaning
from gmwm.readers.table import Table, label

Reference = str | int  # a column's name, or its index counted from 0

_EXAMPLE = 'channels={"gyro_x": 0, "accel_x": 3}'


@dataclass(frozen=True)
class Given:
    """What the caller of `gmwm.read` says of a table: the arguments of that name."""

    rate: float | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    channels: Mapping[str, Reference] | Collection[str] | None = None
    time: Reference | Literal[False] | None = None

    def __post_init__(self) -> None:
        units = self.units
        if not (isinstance(units, Mapping) and all(isinstance(u, str) for u in units.values())):
            hint = 'give a unit for each sensor, e.g. units={"gyro": "deg/s", "accel": "g"}'
            raise InputError(f"units = {checks.shown(units)}: {hint}")


@dataclass(frozen=True)
class AuxiliaryColumn:
    """A column of temperatures, voltages or time stamps of another clock."""

    name: str  # name of its channel
    index: int
    quantity: str  # one of `AUXILIARY`
    unit: Unit  # in the file; without a text if unknown

    def __str__(self) -> str:
        return f"{self.name!r} ({self.quantity}{'' if self.unit.kept else ', unit unknown'})"


@dataclass(frozen=True)
class Units:
    """In what units the channels are."""

    known: dict[str, Unit]  # of each channel
    missing: dict[str, str]  # sensor, or channel of another name, without a unit -> what lacks it
    notices: tuple[Notice, ...]


@dataclass(frozen=True)
class Roles:
    """What the columns are."""

    channels: dict[str, int]  # name of a gyro's or accelerometer's channel -> index of its column
    auxiliary: tuple[AuxiliaryColumn, ...]  # other channels that are kept
    time: int | None  # index of the column of time stamps
    ignored: int | None  # that of such a column whose stamps contradict a stated rate, perhaps
    units: Units
    notices: tuple[Notice, ...]  # auxiliary columns, and columns that are not used

    @property
    def columns(self) -> tuple[int, ...]:
        """Indices of the columns that are needed, each once, in the order of the file."""
        time = () if self.time is None else (self.time,)
        return tuple(sorted({*self.channels.values(), *time}))


def roles_of(table: Table, given: Given) -> Roles:
    """Decide which column is which channel: as the caller says, by their names, by their number.

    The units decide what one or three columns without names are. The rate of ``given`` is the
    file's where the caller gives none.
    """
    time: int | None = None
    if given.time is not None and given.time is not False:
        time = find_column(table, given.time, "time")
    chosen, stamps = _chosen(table, given, time)
    if given.time is None and stamps:
        time = stamps[0]
    auxiliary = _given_auxiliary(table, chosen, given.units)
    chosen = {name: i for name, i in chosen.items() if name not in {a.name for a in auxiliary}}
    if not isinstance(given.channels, Mapping):
        left = {*chosen.values(), time, *(() if given.time is not False else stamps)}
        auxiliary += _found_auxiliary(table, left, chosen, given.units)
    if not chosen:
        hint = 'name one of a gyro or an accelerometer, e.g. channels={"gyro_x": 1}'
        raise InputError(f"{table.source}: every channel is auxiliary: {hint}", "channel-unknown")
    _check_one_sensor(table, {*chosen.values(), time})
    known = (*chosen, *(column.name for column in auxiliary))
    for key in given.units:
        if key not in SI_UNIT and key not in known:
            text = f"units has {key!r}, which is neither gyro nor accel nor a channel"
            raise InputError(f"{text}: choose a channel from {', '.join(known)}")
    units = _units_of(table, chosen, given.units)
    names, notices = table.names, list[Notice]()
    if given.time is None and len(stamps) > 1:
        this, others = label(names, stamps[0]), ", ".join(label(names, i) for i in stamps[1:])
        notices.append(notice("time-column", "", {"column": time}, used=this, others=others))
    if auxiliary:
        values = {column.name: column.quantity for column in auxiliary}
        listed = ", ".join(map(str, auxiliary))
        notices.append(notice("columns-auxiliary", "", values, listed=listed))
    used = {*chosen.values(), time, *(column.index for column in auxiliary)}
    unused = [label(names, i) for i in range(len(names)) if i not in used]
    if unused:
        count = {"count": len(unused)}
        notices.append(notice("columns-not-used", "", count, listed=", ".join(unused)))
    ignored = None
    if given.time is False and given.rate is not None:
        stamped = (i for i, m in enumerate(table.meanings) if m.role == TIME and m.seconds)
        ignored = next(stamped, None)
    return Roles(chosen, tuple(auxiliary), time, ignored, units, tuple(notices))


def _chosen(table: Table, given: Given, time: int | None) -> tuple[dict[str, int], list[int]]:
    """The column of each channel, and those that may have its time stamps."""
    names, channels = table.names, given.channels
    stamps = [i for i, each in enumerate(table.meanings) if each.role == TIME]
    if isinstance(channels, Mapping):
        if not channels:
            raise InputError(f"channels names no channel: give the column of each, e.g. {_EXAMPLE}")
        each_axis = dict(_each_axis(table, channels))
        chosen = {name: find_column(table, each, name) for name, each in each_axis.items()}
        stamps = [i for i in stamps if i not in chosen.values()]
    else:
        chosen = _named_channels(table)
        if not chosen:
            known = {time, *stamps}
            rest = [i for i in range(len(names)) if i not in known]
            if not rest or (any(names[i] for i in rest) and not table.tentative):
                text = f"{table.source}: no column is known as a gyro's or an accelerometer's"
                hint = f"{_listed(table)}: say which is which, e.g. {_EXAMPLE}"
                raise InputError(f"{text}, {hint}", "channel-unknown")
            chosen, stamp = _by_number(table, rest, bool(known - {None}), given.units)
            stamps = [stamp] if stamp is not None else stamps
        chosen = _only(table, chosen, channels)
    return chosen, stamps


def _check_one_sensor(table: Table, columns: Collection[int | None]) -> None:
    """Raise InputError if another column says that the rows are of several sensors in turns."""
    for index, name in enumerate(table.names):
        if index in columns or bare(name).lower() not in NUMBERS_OF_SENSORS:
            continue
        try:
            first = next(table.segments([index], tuning.FEWEST_OF_BLOCK), {index: np.zeros(0)})
        except InputError:  # words
            continue
        numbers = first[index][~np.isnan(first[index])]
        several = np.unique(numbers).size
        turns = np.count_nonzero(np.diff(numbers))
        if 1 < several <= tuning.MOST_SENSORS and turns > tuning.IN_TURNS * numbers.size:
            text = f"{table.source}, {table.column(index)}: rows of {several} sensors come in turns"
            raise InputError(f"{text}: keep one sensor's rows", "several-sensors")


def _each_axis(table: Table, channels: Mapping[str, Reference]) -> Iterator[tuple[str, Reference]]:
    """The channels, with the three axes of a sensor for an array of them: ``gyro`` = ``wb``."""
    for name, column in channels.items():
        axes = [f"{column}_{axis}" for axis in AXES]
        if name in SI_UNIT and column not in table.names and {*axes} <= {*map(bare, table.names)}:
            yield from zip((f"{name}_{axis}" for axis in AXES), axes, strict=True)
        else:
            yield name, column


def find_column(table: Table, reference: Reference, what: str) -> int:
    """Index of a column that the user names; ``what`` it is for, in messages."""
    if isinstance(reference, bool) or not isinstance(reference, str | int):
        hint = "give its name or its index counted from 0"
        raise InputError(f"{what} = {reference!r} is not a column: {hint}")
    index = reference if isinstance(reference, int) else None
    if isinstance(reference, str):
        for known in (table.names, [bare(name) for name in table.names]):
            for fold in (str, str.lower):
                wanted = fold(reference)
                found = [i for i, name in enumerate(known) if name and fold(name) == wanted]
                if len(found) == 1:
                    return found[0]
                if found:
                    raise InputError(
                        f"{table.source} has {len(found)} columns {reference!r}: give the index of "
                        f"the column for {what}, counted from 0: {', '.join(map(str, found))}"
                    )
        if not (reference.isascii() and reference.isdigit()):
            text = f"{table.source} has no column {reference!r} for {what}"
            raise InputError(f"{text}: {_listed(table)}")
        index = int(reference)
    if index is None or not 0 <= index < len(table.names):
        raise InputError(
            f"{table.source} has no column {index} for {what}: its {len(table.names)} columns "
            f"are counted from 0 to {len(table.names) - 1}"
        )
    return index


def _listed(table: Table, most: int = 12) -> str:
    names = [name for name in table.names if name]
    if not names:
        return f"its {len(table.names)} columns have no names"
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"its columns are {', '.join(map(repr, names[:most]))}{more}"


def _named_channels(table: Table) -> dict[str, int]:
    found = dict[str, int]()
    for channel in CANONICAL:
        indices = [i for i, each in enumerate(table.meanings) if each.role == channel]
        if len(indices) > 1:
            names = " and ".join(label(table.names, i) for i in indices[:2])
            text = f"{table.source}: columns {names} may both be {channel}: choose one"
            example = f'channels={{"{channel}": {indices[0]}}}'
            raise InputError(f"{text}, e.g. {example}", "channel-unknown")
        if indices:
            found[channel] = indices[0]
    return found


def _by_number(
    table: Table, rest: Sequence[int], has_time: bool, units: Mapping[str, str]
) -> tuple[dict[str, int], int | None]:
    """Channels by how many columns there are: one or two sensors, or one axis, perhaps time."""
    stamp = None
    if not has_time and len(rest) in (4, 7):
        stamp, rest = rest[0], rest[1:]
    if len(rest) == len(CANONICAL):
        return dict(zip(CANONICAL, rest, strict=True)), stamp
    if len(rest) not in (1, len(AXES)):
        text = f"{table.source} has {len(table.names)} columns without names that are known"
        raise InputError(f"{text}: say which is which, e.g. {_EXAMPLE}", "channel-unknown")
    sensors = [sensor for sensor in SI_UNIT if sensor in units]
    if len(sensors) != 1:
        raise InputError(
            f"{table.source}: column names do not show whether this is a gyro or an "
            f'accelerometer: name it, e.g. channels={{"gyro_x": {rest[0]}}}, or give the unit of '
            "only one of them",
            "channel-unknown",
        )
    names = [f"{sensors[0]}_{axis}" for axis in AXES]
    return dict(zip(names, rest, strict=False)), stamp


def _only(table: Table, found: dict[str, int], names: Collection[str] | None) -> dict[str, int]:
    """The channels that the caller names, if any; auxiliary ones are kept whether named or not."""
    if names is None:
        return found
    wanted = {names} if isinstance(names, str) else set(names)
    kept = {each.role for each in table.meanings} & {*AUXILIARY}
    kept |= {bare(table.names[i]) for i, m in enumerate(table.meanings) if m.role in AUXILIARY}
    for name in wanted - kept:
        if name not in found and not any(name == each.partition("_")[0] for each in found):
            text = f"{table.source} has no channel {name!r}: it has {', '.join(found)}"
            raise InputError(text, "channel-unknown")
    sensors = {name: name.partition("_")[0] for name in found}
    return {n: column for n, column in found.items() if not wanted.isdisjoint((n, sensors[n]))}


def _given_auxiliary(
    table: Table, chosen: Mapping[str, int], units: Mapping[str, str]
) -> list[AuxiliaryColumn]:
    """Chosen channels that are auxiliary by unit, by name, or by the column's name."""
    found = []
    for name, index in chosen.items():
        unit = auxiliary_unit(units.get(name, ""))
        column = table.meanings[index]
        if unit is not None:
            found.append(AuxiliaryColumn(name, index, unit.quantity, unit))
        elif (role := meaning(name).role) in AUXILIARY or (
            role is None and column.role in AUXILIARY and name not in units
        ):
            quantity, own = role or str(column.role), column.unit
            own = own if own and own.quantity in AUXILIARY else Unit("", quantity, "")
            found.append(AuxiliaryColumn(name, index, quantity, own))
    return found


def _found_auxiliary(
    table: Table, used: Collection[int | None], chosen: Collection[str], units: Mapping[str, str]
) -> list[AuxiliaryColumn]:
    """Columns without another use that are auxiliary by their names."""
    found: list[AuxiliaryColumn] = []
    for index, role in enumerate(table.meanings):
        quantity = "clock" if role.role == TIME else role.role
        if index in used or quantity not in AUXILIARY:
            continue
        name = bare(table.names[index])
        if name in chosen or name in {other.name for other in found}:
            name = f"{name}_{index}"
        unit = auxiliary_unit(units[name]) if name in units else role.unit
        if quantity == "clock" and role.seconds is not None:
            unit = Unit("s", "clock", "s", role.seconds)
        found.append(AuxiliaryColumn(name, index, quantity, unit or Unit("", quantity, "")))
    return found


def _units_of(table: Table, channels: Mapping[str, int], units: Mapping[str, str]) -> Units:
    """Unit of every channel, as the user gives it (by channel, else by sensor) or the header."""
    found, from_header, overruled = dict[str, Unit](), dict[str, str](), dict[str, str]()
    missing: dict[str, str] = {}  # one channel of each sensor stands for the others
    for channel, column in channels.items():
        header = table.meanings[column]
        sensor = _sensor(channel) or _sensor(header.role or "")
        given, own = units.get(channel, units.get(sensor)), header.unit
        if given is None and own is None:
            other = f" ({header.stated!r} does not fit)" if header.stated else ""
            missing.setdefault(sensor or channel, channel + other)
            continue
        stated = own.text if own else header.stated
        unit = stated if given is None else given
        try:
            found[channel] = sensor_unit(unit, sensor)
        except InputError as error:
            raise InputError(f"{table.source}, channel {channel}: {error}") from error
        if given is None:
            from_header[channel] = unit
        elif is_other_unit(stated, given):
            overruled[channel] = f"{stated}, not {given}"
    notices, origin = [], table.origin
    if from_header:
        listed = "; ".join(
            f"{', '.join(name for name, u in from_header.items() if u == unit)} in {unit}"
            for unit in dict.fromkeys(from_header.values())
        )
        notices.append(notice("units-from-names", "", from_header, origin=origin, listed=listed))
    if overruled:
        listed = "; ".join(f"{name} in {text}" for name, text in overruled.items())
        notices.append(notice("units-contradicted", "", overruled, origin=origin, listed=listed))
    return Units(found, missing, tuple(notices))


def _sensor(name: str) -> str:
    """The sensor whose name a channel's name begins with, or nothing."""
    return next((sensor for sensor in SI_UNIT if name.lower().startswith(sensor)), "")
