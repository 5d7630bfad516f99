"""One line of a delimited text: its fields, and the number in a field."""

from __future__ import annotations

import csv
import math
import re

from gmwm.readers.table import LARGEST

BLANKS = " "
"""The delimiter that stands for runs of spaces and tabs."""

_RUN_OF_BLANKS = re.compile(r"[ \t]+")

# A name keeps the unit in brackets that follows it after a blank: "wx [rad s^-1]".
_NAME_AND_UNIT = re.compile(r"[^\s\[(]+(?:[ \t]*(?:\[[^\]]*\]|\([^)]*\)))?|\S+")

# Not what float() takes: that has 1_000 and the digits of every script too.
_NUMBERS = {
    mark: re.compile(rf"[+-]?(?:[0-9]+(?:{point}[0-9]*)?|{point}[0-9]+)(?:[eE][+-]?[0-9]+)?")
    for mark, point in ((".", r"\."), (",", ","))
}

_MISSING = re.compile(r"[+-]?nan|n/?a|#n/a|null|none|", re.IGNORECASE)
_INFINITE = re.compile(r"[+-]?inf(?:inity)?", re.IGNORECASE)


def split_line(line: str, delimiter: str) -> list[str]:
    """Fields of a line, without blanks around them and without quotes.

    Raises
    ------
    ValueError
        If the quotes do not match.
    """
    if delimiter == BLANKS:
        return [cell.strip('"') for cell in _RUN_OF_BLANKS.split(line.strip(" \t"))]
    if '"' not in line:
        return [cell.strip(" \t") for cell in line.split(delimiter)]
    try:
        rows = list(csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True))
    except csv.Error as error:
        raise ValueError("quotes that do not match") from error
    return [cell.strip(" \t") for cell in rows[0]]


def split_header(line: str, delimiter: str) -> list[str]:
    """Fields of a line of names; as `split_line`, but a unit may follow a blank."""
    if delimiter == BLANKS:
        return [name.strip('"') for name in _NAME_AND_UNIT.findall(line)]
    return split_line(line, delimiter)


def number(cell: str, decimal: str) -> float | None:
    """The number in a field.

    Parameters
    ----------
    cell : str
        Without blanks around it.
    decimal : {".", ","}
        Decimal mark.

    Returns
    -------
    float or None
        NaN where the field is empty or one of the usual words for a missing sample, infinity where
        the number is infinite or too large for use, ``None`` where the field is text.
    """
    if _NUMBERS[decimal].fullmatch(cell):
        value = float(cell.replace(",", "."))
        return value if abs(value) < LARGEST else math.inf
    if _MISSING.fullmatch(cell):
        return math.nan
    return math.inf if _INFINITE.fullmatch(cell) else None
