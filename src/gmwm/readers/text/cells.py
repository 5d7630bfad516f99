"""One line of a delimited text: its fields, and the number or the date in a field."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from datetime import UTC, date, datetime, time, timedelta

from gmwm.readers.table import LARGEST

BLANKS = " "  # the delimiter that stands for runs of spaces and tabs
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


_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
_MONTH = rf"\d{{1,2}}-(?:{'|'.join(_MONTHS)})-\d{{4}}"  # 05-Jan-2023, of MATLAB


def _date(fraction: str, zone: str) -> re.Pattern[str]:
    """Day, hour, minute and second in groups 1 to 4 or, without marks, 5 to 8; the zone in 9."""
    second = rf"(\d{{2}}(?:{fraction}\d*)?)"
    return re.compile(
        rf"(?:(\d{{4}}(?:[-/]\d{{1,2}}[-/]\d{{1,2}}|-\d{{3}}|-W\d\d-\d)|{_MONTH})[Tt ]\s*"
        rf"(\d{{1,2}}):(\d{{2}}):{second}"
        rf"|(\d{{7,8}}|\d{{4}}W\d{{3}})[Tt](\d{{2}})(\d{{2}}){second})\s?([Zz]|UTC|GMT|{zone})?"
    )


DATE = _date(r"\.", r"[+-]\d{2}:?\d{2}")
"""A date with the time of day, and its zone if one is written, within a text."""

FIELD_OF_DATE = _date("[.,]", r"[+-]\d{2}(?::?\d{2})?")
"""The same as a field of its own, as ISO 8601 allows it."""

_LARGEST_ZONE = timedelta(hours=14)  # of Kiribati
_MINUTE, _LEAP_MINUTE = 60.0, 61.0  # s


def split_line(line: str, delimiter: str) -> list[str]:
    """Fields of a line without blanks or quotes around them; ValueError if quotes do not match."""
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
    """The number in a field without blanks around it, by its decimal mark, "." or ",".

    NaN where the field is empty or a usual word for a missing sample, infinity where the number is
    infinite or too large for use, ``None`` where the field is text.
    """
    if _NUMBERS[decimal].fullmatch(cell):
        value = float(cell.replace(",", "."))
        return value if abs(value) < LARGEST else math.inf
    if _MISSING.fullmatch(cell):
        return math.nan
    return math.inf if _INFINITE.fullmatch(cell) else None


def seconds_of(found: re.Match[str]) -> float:
    """Seconds since 1970-01-01 of a match of `DATE` or `FIELD_OF_DATE`, without leap seconds.

    The last minute of a day of UTC may have 61 s. ValueError if there is no such time.
    """
    day, hour, minute, second = (part for part in found.groups()[:8] if part is not None)
    start = datetime.combine(_day(day), time(int(hour), int(minute)), tzinfo=UTC)
    zone = found[9]
    if zone and zone[0] in "+-":
        away = timedelta(hours=int(zone[1:3]), minutes=int(zone[3:].lstrip(":") or 0))
        if away > _LARGEST_ZONE or int(zone[3:].lstrip(":") or 0) > 59:
            raise ValueError("no zone")
        start += away if zone[0] == "-" else -away
    seconds = float(second.replace(",", "."))
    is_last = start.minute == 59 and (start.hour == 23 or not zone)
    if seconds >= (_LEAP_MINUTE if is_last else _MINUTE):
        raise ValueError("no second")
    return start.timestamp() + seconds


def _day(text: str) -> date:
    """Date by month, day of the year (2026-123) or week (2026-W12-3), with or without marks."""
    if "W" in text:
        return date.fromisoformat(text)
    if "-" in text and text[-8:-5] in _MONTHS:
        return date(int(text[-4:]), _MONTHS.index(text[-8:-5]) + 1, int(text[:-9]))
    plain = re.sub("[-/]", "", text)
    if len(plain) == 7 and len(text) <= 8:
        found = datetime.strptime(plain, "%Y%j").date()
        if found.year != int(plain[:4]):  # it takes a 366th day of any year
            raise ValueError("no day")
        return found
    parts = re.split("[-/]", text) if text != plain else (text[:4], text[4:6], text[6:])
    return date(*map(int, parts))


def date_columns(rows: Sequence[Sequence[str]]) -> dict[int, bool]:
    """Columns whose every field in these rows is a date, or empty; whether they have a zone."""
    result = {}
    for column in range(min(map(len, rows), default=0)):
        cells = [row[column] for row in rows if row[column]]
        found = [FIELD_OF_DATE.fullmatch(cell) for cell in cells]
        if cells and all(found):
            result[column] = any(each is not None and each[9] is not None for each in found)
    return result
