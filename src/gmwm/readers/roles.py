"""Which column is which channel."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from gmwm._core import checks
from gmwm._core.notices import Notice
from gmwm._core.units import AUXILIARY, SI_UNIT, AuxiliaryUnit, auxiliary_unit
from gmwm.errors import InputError
from gmwm.readers.names import AXES, CANONICAL, TIME, bare, meaning
from gmwm.readers.table import Table, label

Reference = str | int
"""A column's name, or its index counted from 0."""

_EXAMPLE = 'channels={"gyro_x": 0, "accel_x": 3}'


@dataclass(frozen=True)
class Given:
    """What the caller of `gmwm.read` says of a table: the arguments of that name."""

    rate: float | None
    units: Mapping[str, str]
    channels: Mapping[str, Reference] | Collection[str] | None
    time: Reference | Literal[False] | None

    def __post_init__(self) -> None:
        units = self.units
        if not isinstance(units, Mapping) or not all(
            isinstance(each, str) for each in units.values()
        ):
            raise InputError(
                f"units = {checks.shown(units)}: give that of each sensor, e.g. "
                'units={"gyro": "deg/s", "accel": "g"}'
            )


@dataclass(frozen=True)
class Roles:
    """What the columns are.

    channels: Name of a gyro's or accelerometer's channel -> index of its column.
    auxiliary: Other channels that are kept.
    time: Index of the column of time stamps.
    notices: Which columns are auxiliary, and which are not used.
    """

    channels: dict[str, int]
    auxiliary: tuple[AuxiliaryColumn, ...]
    time: int | None
    notices: tuple[Notice, ...]

    @property
    def columns(self) -> tuple[int, ...]:
        """Indices of the columns that are needed, each once, in the order of the file."""
        time = () if self.time is None else (self.time,)
        return tuple(sorted({*self.channels.values(), *time}))


@dataclass(frozen=True)
class AuxiliaryColumn:
    """A column of temperatures, voltages or time stamps of another clock.

    name: Of its channel.
    quantity: One of `AUXILIARY`.
    unit: That of the file, if it is known.
    """

    name: str
    index: int
    quantity: str
    unit: AuxiliaryUnit | None

    def __str__(self) -> str:
        return f"{self.name!r} ({self.quantity}{'' if self.unit else ', unit unknown'})"


@dataclass(frozen=True)
class Columns:
    """The names of a file's columns, for finding one by what the user calls it."""

    source: str
    names: tuple[str, ...]

    def find(self, reference: Reference, what: str) -> int:
        """Index of a column.

        what: What it is for, in messages.
        Raises InputError if there is no such column, or more than one.
        """
        if isinstance(reference, bool) or not isinstance(reference, str | int):
            raise InputError(
                f"{what} = {reference!r} is not a column: give its name or its index counted from 0"
            )
        if isinstance(reference, int):
            return self._checked(reference, what)
        for known in (self.names, [bare(n) for n in self.names]):
            for fold in (str, str.lower):
                found = [
                    i for i, name in enumerate(known) if name and fold(name) == fold(reference)
                ]
                if len(found) == 1:
                    return found[0]
                if found:
                    raise InputError(
                        f"{self.source} has {len(found)} columns {reference!r}: give the index of "
                        f"the one for {what}, counted from 0: {', '.join(map(str, found))}"
                    )
        if reference.isascii() and reference.isdigit():
            return self._checked(int(reference), what)
        raise InputError(f"{self.source} has no column {reference!r} for {what}: {self.listed()}")

    def _checked(self, index: int, what: str) -> int:
        if not 0 <= index < len(self.names):
            raise InputError(
                f"{self.source} has no column {index} for {what}: its {len(self.names)} columns "
                f"are counted from 0 to {len(self.names) - 1}"
            )
        return index

    def listed(self, most: int = 12) -> str:
        """Say which columns there are."""
        names = [name for name in self.names if name]
        if not names:
            return f"its {len(self.names)} columns have no names"
        more = f" and {len(names) - most} more" if len(names) > most else ""
        return f"its columns are {', '.join(map(repr, names[:most]))}{more}"


def roles_of(table: Table, given: Given) -> Roles:
    """Decide which column is which channel.

    What the caller says goes first, then the columns' names, then their number; the units decide
    what one or three columns without names are.

    Raises InputError if it cannot be decided, or no channel is a gyro's or an accelerometer's.
    """
    columns = Columns(table.source, table.names)
    units, channels, time = given.units, given.channels, given.time
    given_time = None if time is None or time is False else columns.find(time, "time")
    notices: list[Notice] = []
    if isinstance(channels, Mapping):
        chosen = _given_channels(columns, channels)
        stamps = [i for i in _time_columns(columns) if i not in chosen.values()]
    else:
        chosen = _named_channels(columns)
        stamps = _time_columns(columns)
        if not chosen:
            known = {given_time, *stamps}
            rest = [i for i in range(len(columns.names)) if i not in known]
            if not rest or (any(columns.names[i] for i in rest) and not table.tentative):
                raise InputError(
                    f"{columns.source}: no column is known as a gyro's or an accelerometer's, "
                    f"{columns.listed()}: say which is which, e.g. {_EXAMPLE}",
                    "channel-unknown",
                )
            chosen, stamp = _by_number(columns, rest, bool(known - {None}), units)
            stamps = [stamp] if stamp is not None else stamps
        chosen = _only(columns, chosen, channels)
    chosen_time = _choose_time(columns, given_time, stamps, time, notices)
    auxiliary = _given_auxiliary(columns, chosen, units)
    chosen = {name: i for name, i in chosen.items() if name not in {a.name for a in auxiliary}}
    if not isinstance(channels, Mapping):
        left = {*chosen.values(), chosen_time, *(() if time is not False else stamps)}
        auxiliary += _found_auxiliary(columns, left, chosen, units)
    if auxiliary:
        text = f"auxiliary channels: {', '.join(map(str, auxiliary))}"
        values = {column.name: column.quantity for column in auxiliary}
        notices.append(Notice("columns-auxiliary", "note", "", text, values))
    used = {*chosen.values(), chosen_time, *(column.index for column in auxiliary)}
    ignored = [label(columns.names, i) for i in range(len(columns.names)) if i not in used]
    if ignored:
        plural = "s" if len(ignored) > 1 else ""
        text = f"column{plural} not used: {', '.join(ignored)}"
        notices.append(Notice("columns-not-used", "note", "", text, {"count": len(ignored)}))
    if not chosen:
        raise InputError(
            f"{table.source}: every channel is auxiliary: name one of a gyro or an accelerometer, "
            'e.g. channels={"gyro_x": 1}',
            "channel-unknown",
        )
    return Roles(chosen, tuple(auxiliary), chosen_time, tuple(notices))


def _given_auxiliary(
    columns: Columns, chosen: Mapping[str, int], units: Mapping[str, str]
) -> list[AuxiliaryColumn]:
    """Those of the chosen channels that are auxiliary by unit, by name, or by the column's name."""
    found = []
    for name, index in chosen.items():
        unit = auxiliary_unit(units.get(name, ""))
        column = meaning(columns.names[index])
        if unit is not None:
            found.append(AuxiliaryColumn(name, index, unit.quantity, unit))
        elif (role := meaning(name).role) in AUXILIARY or (
            role is None and column.role in AUXILIARY and name not in units
        ):
            unit = auxiliary_unit(column.unit or "")
            found.append(AuxiliaryColumn(name, index, role or str(column.role), unit))
    return found


def _found_auxiliary(
    columns: Columns,
    used: Collection[int | None],
    chosen: Mapping[str, int],
    units: Mapping[str, str],
) -> list[AuxiliaryColumn]:
    """Columns that are not used otherwise and are auxiliary by their names."""
    found: list[AuxiliaryColumn] = []
    for index, column in enumerate(columns.names):
        role = meaning(column)
        quantity = "clock" if role.role == TIME else role.role
        if index in used or quantity not in AUXILIARY:
            continue
        name = bare(column)
        if name in chosen or name in {other.name for other in found}:
            name = f"{name}_{index}"
        unit = auxiliary_unit(units.get(name, role.unit or ""))
        if quantity == "clock" and role.seconds is not None:
            unit = AuxiliaryUnit("clock", "s", role.seconds)
        found.append(AuxiliaryColumn(name, index, quantity, unit))
    return found


def _given_channels(columns: Columns, channels: Mapping[str, Reference]) -> dict[str, int]:
    if not channels:
        raise InputError(f"channels names no channel: give the column of each, e.g. {_EXAMPLE}")
    return {name: columns.find(reference, name) for name, reference in channels.items()}


def _only(columns: Columns, found: dict[str, int], names: Collection[str] | None) -> dict[str, int]:
    """Those channels that the caller names, if he names some."""
    if names is None:
        return found
    wanted = {names} if isinstance(names, str) else set(names)
    for name in wanted:
        if name not in found and not any(name == each.partition("_")[0] for each in found):
            raise InputError(
                f"{columns.source} has no channel {name!r}: it has {', '.join(found)}",
                "channel-unknown",
            )
    return {
        name: column
        for name, column in found.items()
        if not wanted.isdisjoint((name, name.partition("_")[0]))
    }


def _named_channels(columns: Columns) -> dict[str, int]:
    found: dict[str, int] = {}
    roles = [meaning(name).role for name in columns.names]
    for channel in CANONICAL:
        indices = [i for i, role in enumerate(roles) if role == channel]
        if len(indices) > 1:
            names = " and ".join(label(columns.names, i) for i in indices[:2])
            raise InputError(
                f"{columns.source}: columns {names} may both be {channel}: choose one, "
                f'e.g. channels={{"{channel}": {indices[0]}}}',
                "channel-unknown",
            )
        if indices:
            found[channel] = indices[0]
    return found


def _time_columns(columns: Columns) -> list[int]:
    return [i for i, name in enumerate(columns.names) if meaning(name).role == TIME]


def _by_number(
    columns: Columns, rest: Sequence[int], has_time: bool, units: Mapping[str, str]
) -> tuple[dict[str, int], int | None]:
    """Channels by how many columns there are: one or two sensors, or one axis, perhaps time."""
    stamp = None
    if not has_time and len(rest) in (4, 7):
        stamp, rest = rest[0], rest[1:]
    if len(rest) == len(CANONICAL):
        return dict(zip(CANONICAL, rest, strict=True)), stamp
    if len(rest) not in (1, len(AXES)):
        raise InputError(
            f"{columns.source} has {len(columns.names)} columns without names that are known: say "
            f"which is which, e.g. {_EXAMPLE}",
            "channel-unknown",
        )
    sensors = [sensor for sensor in SI_UNIT if sensor in units]
    if len(sensors) != 1:
        raise InputError(
            f"{columns.source}: column names do not show whether this is a gyro or an "
            f'accelerometer: say it, e.g. channels={{"gyro_x": {rest[0]}}}, or give the unit of '
            "only one of them",
            "channel-unknown",
        )
    names = [f"{sensors[0]}_{axis}" for axis in AXES]
    return dict(zip(names, rest, strict=False)), stamp


def _choose_time(
    columns: Columns,
    given: int | None,
    stamps: Sequence[int],
    time: Reference | Literal[False] | None,
    notices: list[Notice],
) -> int | None:
    if time is False or given is not None:
        return given
    if len(stamps) > 1:
        others = ", ".join(label(columns.names, i) for i in stamps[1:])
        text = f"time is column {label(columns.names, stamps[0])}; time= selects {others}"
        notices.append(Notice("time-column", "note", "", text, {"column": stamps[0]}))
    return stamps[0] if stamps else None
