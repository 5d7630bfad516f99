"""Columns of logs: quantities by the words in their names, units, and where a value stands."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from gmwm._core.files import existing_file
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import TIME, CsvTable, label, meaning


def by_word(words: Mapping[str, str]) -> dict[str, str]:
    """What each word stands for, of what is written with blanks between words."""
    return {word: meant for meant, each in words.items() for word in each.split()}


POSITION_WORDS = by_word({
    "latitude": "latitude lat",
    "longitude": "longitude lon long lng",
    "height": "height altitude alt h hgt",
})  # fmt: skip
"""What the last word of a column's name says, if it is a position."""

FACTORS = {"rad": 1.0, "deg": np.pi / 180.0, "m": 1.0, "ft": 0.3048}
"""Units of angles and lengths in SI."""

_UNITS = by_word({
    "rad": "rad rads radian radians",
    "deg": "deg degs degree degrees °",
    "m": "m meter meters metre metres",
    "ft": "ft feet",
})  # fmt: skip
_WORD = re.compile(r"°|[A-Z]?[a-z]+|[A-Z]+")
_QUARTER = 0.5 * np.pi * (1.0 + 1e-9)


def open_log(path: Path) -> CsvTable:
    """Look at the beginning of a delimited text.

    Raises InputError if there is no such file, it is a directory, or no table.
    """
    return CsvTable.open(existing_file(path))


def find_columns(
    table: CsvTable, quantities: Callable[[str], Sequence[str]], needed: Sequence[str], header: str
) -> tuple[dict[str, int], list[str]]:
    """The column of each quantity, and the names of columns that are none.

    quantities: What a column of a name holds; empty if it is something else.
    needed: Quantities that there must be.
    header: An example that has them.
    Raises InputError if two columns look like one quantity, or one that is needed has none.
    """
    columns: dict[str, int] = {}
    unused = []
    for column, name in enumerate(table.names):
        found = quantities(name)
        if not found:
            unused.append(name or str(column))
        for quantity in found:
            if quantity in columns:
                raise InputError(
                    f"{table.source}: columns {label(table.names, columns[quantity])} and "
                    f"{label(table.names, column)} both look like {quantity}: rename one of them"
                )
            columns[quantity] = column
    missing = [name for name in needed if name not in columns]
    if missing:
        raise InputError(
            f"{table.source} has no column for {', '.join(missing)}: name the columns in a header "
            f"like {header}"
        )
    return columns, unused


def is_time(name: str) -> bool:
    """Whether a column holds time stamps."""
    return meaning(name).role == TIME


def words_of(name: str) -> list[str]:
    """Words of a column's name, in lower case, its unit left out if it is an angle or a length."""
    words = [word.lower() for word in _WORD.findall(name)]
    if words and words[-1] in _UNITS:
        words.pop()
    return words


def unit_of(name: str) -> str | None:
    """rad, deg, m or ft, if the name ends with one of them."""
    words = _WORD.findall(name)
    return _UNITS.get(words[-1].lower()) if words else None


def place(table: CsvTable, column: int, row: int) -> str:
    """Where a value stands, for messages."""
    return f"{table.source}, column {label(table.names, column)}, {table.where(row)}"


def angle_factor(table: CsvTable, column: int, quantity: str, common: str | None) -> float:
    """What a column of angles is to be multiplied by to come to rad.

    quantity: For the message.
    common: {"rad", "deg", None}, the unit if the name has none.
    Raises InputError if the unit is not known, or none of an angle.
    """
    unit = unit_of(table.names[column]) or common
    where = f"{table.source}, column {label(table.names, column)}"
    if unit is None:
        raise InputError(
            f"{where}: are its angles in rad or deg? name it {quantity}_rad or {quantity}_deg"
        )
    if unit not in ("rad", "deg"):
        raise InputError(
            f"{where}: {unit} is not a unit of angle: name it {quantity}_rad or {quantity}_deg"
        )
    return FACTORS[unit]


def length_factor(table: CsvTable, column: int, quantity: str) -> float:
    """What a column of lengths is to be multiplied by to come to m; see `angle_factor`."""
    unit = unit_of(table.names[column]) or "m"
    if unit not in ("m", "ft"):
        raise InputError(
            f"{table.source}, column {label(table.names, column)}: {unit} is not a unit of "
            f"{quantity}: name it {quantity}_m"
        )
    return FACTORS[unit]


def angle_unit(name: str, latitude: FloatArray) -> str | None:
    """Unit of the latitudes of a column, from its name or because they are beyond pi/2."""
    beyond = bool(np.any(np.abs(latitude) > 0.5 * np.pi))
    return unit_of(name) or ("deg" if beyond else None)


def check_angles(
    table: CsvTable, column: int, quantity: str, angle: FloatArray, limit: float = _QUARTER
) -> None:
    """Refuse what no such angle can be (rad): most often a wrong unit in the header.

    Raises InputError with the line of the first.
    """
    bad = np.flatnonzero(np.abs(angle) > limit)
    if bad.size:
        raise InputError(
            f"{place(table, column, int(bad[0]))}: a {quantity} of "
            f"{np.degrees(angle[bad[0]]):.6g} deg: check the unit in the header"
        )


def check_rising(table: CsvTable, column: int, stamps: FloatArray) -> None:
    """Refuse time stamps that do not rise.

    Raises InputError with the line of the first.
    """
    steps = np.diff(stamps)
    bad = np.flatnonzero(steps <= 0.0)
    if bad.size:
        row = int(bad[0]) + 1
        what = "repeats the one before" if steps[row - 1] == 0.0 else "goes back"
        raise InputError(
            f"{place(table, column, row)}: time stamp {stamps[row]:.15g} {what}: take such rows "
            "out or, if a clock was set there, the step"
        )
