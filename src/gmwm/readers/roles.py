"""Which column is which channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from gmwm._core.notices import Notice
from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.readers.names import AXES, CANONICAL, TIME, bare, meaning
from gmwm.readers.table import label

Reference = str | int
"""A column's name, or its index counted from 0."""

_EXAMPLE = 'channels={"gyro_x": 0, "accel_x": 3}'


@dataclass(frozen=True)
class Roles:
    """What the columns are.

    Attributes
    ----------
    channels : dict of str to int
        Channel name -> index of its column.
    time : int or None
        Index of the column of time stamps.
    notices : tuple of Notice
        Which columns are not used.
    """

    channels: dict[str, int]
    time: int | None
    notices: tuple[Notice, ...]

    @property
    def columns(self) -> tuple[int, ...]:
        """Indices of all columns that are needed, each once, in the order of the file."""
        time = () if self.time is None else (self.time,)
        return tuple(sorted({*self.channels.values(), *time}))


@dataclass(frozen=True)
class Columns:
    """The names of a file's columns, for finding one by what the user calls it."""

    source: str
    names: tuple[str, ...]

    def find(self, reference: Reference, what: str) -> int:
        """Index of a column.

        Parameters
        ----------
        reference : str or int
        what : str
            What it is for, in messages.

        Raises
        ------
        InputError
            If there is no such column, or more than one.
        """
        if isinstance(reference, bool) or not isinstance(reference, str | int):
            raise InputError(
                f"{what} = {reference!r} is no column: give its name or its index counted from 0"
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


def assign_roles(
    columns: Columns,
    tentative: bool,
    units: Mapping[str, str],
    channels: Mapping[str, Reference] | None,
    time: Reference | Literal[False] | None,
) -> Roles:
    """Decide which column is which channel.

    What the caller says goes first, then the columns' names, then their number.

    Parameters
    ----------
    columns : Columns
    tentative : bool
        Whether names that mean nothing may be overlooked.
    units : mapping of str to str
        Those that the caller gave; they tell what one or three columns without names are.
    channels, time
        As in `gmwm.read`.

    Raises
    ------
    InputError
        If it cannot be decided.
    """
    given_time = None if time is None or time is False else columns.find(time, "time")
    notices: list[Notice] = []
    if channels is not None:
        chosen = _given_channels(columns, channels)
        stamps = [i for i in _time_columns(columns) if i not in chosen.values()]
    else:
        chosen = _named_channels(columns)
        stamps = _time_columns(columns)
        if not chosen:
            taken = {given_time, *stamps}
            rest = [i for i in range(len(columns.names)) if i not in taken]
            if not rest or (any(columns.names[i] for i in rest) and not tentative):
                raise InputError(
                    f"{columns.source}: no column is known as a gyro's or an accelerometer's, "
                    f"{columns.listed()}: say which is which, e.g. {_EXAMPLE}"
                )
            chosen, stamp = _by_number(columns, rest, bool(taken - {None}), units)
            stamps = [stamp] if stamp is not None else stamps
    chosen_time = _choose_time(columns, given_time, stamps, time, notices)
    used = {*chosen.values(), chosen_time}
    ignored = [label(columns.names, i) for i in range(len(columns.names)) if i not in used]
    if ignored:
        plural = "s" if len(ignored) > 1 else ""
        text = f"column{plural} not used: {', '.join(ignored)}"
        notices.append(Notice("columns-not-used", "note", "", text, {"count": len(ignored)}))
    return Roles(chosen, chosen_time, tuple(notices))


def _given_channels(columns: Columns, channels: Mapping[str, Reference]) -> dict[str, int]:
    if not channels:
        raise InputError(f"channels names no channel: say which column is which, e.g. {_EXAMPLE}")
    return {name: columns.find(reference, name) for name, reference in channels.items()}


def _named_channels(columns: Columns) -> dict[str, int]:
    found: dict[str, int] = {}
    roles = [meaning(name).role for name in columns.names]
    for channel in CANONICAL:
        indices = [i for i, role in enumerate(roles) if role == channel]
        if len(indices) > 1:
            names = " and ".join(label(columns.names, i) for i in indices[:2])
            raise InputError(
                f"{columns.source}: columns {names} may both be {channel}: say which to use, "
                f'e.g. channels={{"{channel}": {indices[0]}}}'
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
            f"which is which, e.g. {_EXAMPLE}"
        )
    sensors = [sensor for sensor in SI_UNIT if sensor in units]
    if len(sensors) != 1:
        raise InputError(
            f"{columns.source}: column names do not tell whether this is a gyro or an "
            f'accelerometer: say it, e.g. channels={{"gyro_x": {rest[0]}}}, or give the unit of '
            "only one of them"
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
