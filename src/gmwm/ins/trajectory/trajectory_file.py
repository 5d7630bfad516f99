"""Trajectories in a delimited text: time, position and attitude, one row an epoch."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gmwm._core.files import existing_file
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import TIME, CsvTable, label, meaning, stated_seconds


def by_word(**words: str) -> dict[str, str]:
    """Word -> meaning, from words with blanks between them by meaning."""
    return {word: meant for meant, each in words.items() for word in each.split()}


POSITION_WORDS = by_word(
    latitude="latitude lat", longitude="longitude lon long lng", height="height altitude alt h hgt"
)
"""Meaning of the last word of a column's name, if it is a position."""

FACTORS = {"rad": 1.0, "deg": np.pi / 180.0, "m": 1.0, "ft": 0.3048}
"""Units of angles and lengths in SI."""

_UNITS = by_word(
    rad="rad rads radian radians",
    deg="deg degs degree degrees °",
    m="m meter meters metre metres",
    ft="ft feet",
)
_WORD = re.compile(r"°|[A-Z]?[a-z]+|[A-Z]+")


def is_time(name: str) -> bool:
    """Whether a column of this name holds time stamps."""
    return meaning(name).role == TIME


def words_of(name: str) -> list[str]:
    """Words of a column's name in lower case, without its unit if it is an angle or a length."""
    words = [word.lower() for word in _WORD.findall(name)]
    if words and words[-1] in _UNITS:
        words.pop()
    return words


@dataclass(frozen=True, eq=False)
class LogColumns:
    """Columns of a delimited text whose quantities are known by their names.

    columns: Quantity -> column.
    unused: Names of the other columns.
    """

    table: CsvTable
    columns: Mapping[str, int]
    unused: tuple[str, ...]

    @classmethod
    def find(
        cls,
        path: Path,
        quantities: Callable[[str], Sequence[str]],
        needed: Sequence[str],
        header: str,
    ) -> LogColumns:
        """Look at the header of a file.

        quantities: Quantities that a column of a name holds; empty if it is something else.
        needed: Quantities that must be there.
        header: An example that has them.
        """
        table = CsvTable.open(existing_file(path))
        columns: dict[str, int] = {}
        unused = []
        for column, name in enumerate(table.names):
            found = quantities(name)
            if not found:
                unused.append(name or str(column))
            for quantity in found:
                if quantity in columns:
                    first, second = (label(table.names, c) for c in (columns[quantity], column))
                    raise InputError(
                        f"{table.source}: columns {first} and {second} both look like {quantity}: "
                        "rename one of them"
                    )
                columns[quantity] = column
        missing = [name for name in needed if name not in columns]
        if missing:
            raise InputError(
                f"{table.source} has no column for {', '.join(missing)}: name the columns in a "
                f"header like {header}"
            )
        return cls(table, columns, tuple(unused))

    def load(self) -> dict[str, FloatArray]:
        """Values of each quantity, in the units of the file."""
        values = self.table.load(sorted(set(self.columns.values())))
        return {name: values[column] for name, column in self.columns.items()}

    def place(self, quantity: str, row: int | None = None) -> str:
        """Where a quantity or a value of it stands, for messages."""
        place = f"{self.table.source}, column {label(self.table.names, self.columns[quantity])}"
        return place if row is None else f"{place}, {self.table.where(row)}"

    def unit(self, quantity: str) -> str | None:
        """One of `FACTORS`, if the name of the column ends with it."""
        words = _WORD.findall(self.table.names[self.columns[quantity]])
        return _UNITS.get(words[-1].lower()) if words else None

    def seconds_per_stamp(self) -> float:
        """Unit of the time stamps, s."""
        return stated_seconds(self.table.source, self.table.names[self.columns[TIME]]) or 1.0

    def check_rising(self, stamps: FloatArray) -> None:
        """Reject time stamps that do not rise; the message names the line of the first."""
        steps = np.diff(stamps)
        bad = np.flatnonzero(steps <= 0.0)
        if bad.size:
            row = int(bad[0]) + 1
            what = "repeats the one before" if steps[row - 1] == 0.0 else "goes back"
            raise InputError(
                f"{self.place(TIME, row)}: time stamp {stamps[row]:.15g} {what}: delete such "
                "rows; if the clock was reset there, remove the jump from the later stamps"
            )

    def metres(self, quantity: str, values: FloatArray) -> FloatArray:
        """Lengths in m; InputError if the column is in another unit than m or ft."""
        unit = self.unit(quantity) or "m"
        if unit not in ("m", "ft"):
            raise InputError(
                f"{self.place(quantity)}: {unit} is not a unit of {quantity}: name it {quantity}_m"
            )
        return FACTORS[unit] * values

    def radians(
        self, values: Mapping[str, FloatArray], limits: Mapping[str, float]
    ) -> dict[str, FloatArray]:
        """Angles in rad.

        Without a unit in its name, an angle has that of the latitude, which is in degrees if one is
        beyond pi/2.

        values: Quantities, with the latitude.
        limits: Quantities that are angles -> largest possible size, rad.
        """
        beyond = bool(np.any(np.abs(values["latitude"]) > 0.5 * np.pi))
        common = self.unit("latitude") or ("deg" if beyond else None)
        found = {}
        for quantity, limit in limits.items():
            unit, hint = self.unit(quantity) or common, f"name it {quantity}_rad or {quantity}_deg"
            if unit not in ("rad", "deg"):
                what = (
                    f"{unit} is not a unit of angle:" if unit else "are its angles in rad or deg?"
                )
                raise InputError(f"{self.place(quantity)}: {what} {hint}")
            angle = FACTORS[unit] * values[quantity]
            bad = np.flatnonzero(np.abs(angle) > limit * (1.0 + 1e-9))
            if bad.size:
                raise InputError(
                    f"{self.place(quantity, int(bad[0]))}: a {quantity} of "
                    f"{np.degrees(angle[bad[0]]):.6g} deg: check the unit in the header"
                )
            found[quantity] = angle
        return found


_HEADER = "time_s,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,yaw_deg"
_WORDS = POSITION_WORDS | by_word(roll="roll bank", pitch="pitch", yaw="yaw heading hdg azimuth")
_NOT_THE_VALUE = frozenset(
    {"std", "sigma", "var", "cov", "err", "error", "rate", "ref", "acc", "accuracy", "dot"}
)
_UNEVEN = 0.1  # of the sampling interval: at 20 m/s and 100 Hz, 2 cm
_QUARTER, _MANY_TURNS = 0.5 * np.pi, 1e4  # rad; a log that counts turns stays far below
_LIMITS = {"latitude": _QUARTER, "pitch": _QUARTER}
_LIMITS |= dict.fromkeys(("longitude", "roll", "yaw"), _MANY_TURNS)


def read_log(path: Path) -> tuple[float, float, FloatArray, FloatArray]:
    """First time stamp, sampling interval, s, positions and attitudes, (n + 1, 3), of a log.

    Raises InputError if a column is missing, a value is missing or impossible, or the time stamps
        are not even.
    """
    log = LogColumns.find(path, _quantities, (TIME, *_LIMITS, "height"), _HEADER)
    values = log.load()
    for name, column in values.items():
        bad = np.flatnonzero(np.isnan(column))
        if bad.size:
            raise InputError(
                f"{log.place(name, int(bad[0]))}: no value: fill the gap, or use the part of "
                "the file before or after it"
            )
    dt = _interval(log, values[TIME])
    found = log.radians(values, _LIMITS) | {"height": log.metres("height", values["height"])}
    return (
        float(values[TIME][0]) * log.seconds_per_stamp(),
        dt,
        np.stack([found[name] for name in ("latitude", "longitude", "height")], axis=-1),
        np.stack([found[name] for name in ("roll", "pitch", "yaw")], axis=-1),
    )


def _quantities(name: str) -> tuple[str, ...]:
    """Time, latitude, ... or none if the column is something else."""
    if is_time(name):
        return (TIME,)
    words = words_of(name)
    if not words or not _NOT_THE_VALUE.isdisjoint(words) or words[-1] not in _WORDS:
        return ()
    return (_WORDS[words[-1]],)


def _interval(log: LogColumns, stamps: FloatArray) -> float:
    """Sampling interval of evenly spaced time stamps, s."""
    n = stamps.size - 1
    if n < 1:
        raise InputError(f"{log.table.source} has a single row: give at least two epochs")
    log.check_rising(stamps)
    steps = np.diff(stamps)
    usual = float(np.median(steps))
    gaps = np.flatnonzero(np.abs(steps - usual) > 0.5 * usual)
    dt = float(stamps[-1] - stamps[0]) / n
    late = np.flatnonzero(np.abs(stamps - stamps[0] - dt * np.arange(n + 1)) > _UNEVEN * dt)
    if gaps.size or late.size:
        row = int(gaps[0]) + 1 if gaps.size else int(late[0])
        raise InputError(
            f"{log.place(TIME, row)}: time stamp {stamps[row]:.15g} is off the even spacing "
            f"of {usual:.6g}: resample the log to even steps, or use the part before or after"
        )
    return dt * log.seconds_per_stamp()
