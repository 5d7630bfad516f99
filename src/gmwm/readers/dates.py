"""Times that are written as dates, ISO 8601."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

DATE = re.compile(
    r"(\d{4})[-/](\d{1,2})[-/](\d{1,2})[T ]\s*(\d{1,2}):(\d{2}):(\d{2}(?:\.\d*)?)"
    r"\s?(Z|[+-]\d{2}:?\d{2})?"
)
"""A date with the time of day, and its zone if one is written."""


def seconds_of(found: re.Match[str]) -> float:
    """Seconds since 1970-01-01, without leap seconds.

    Whole days and minutes are counted by the calendar, so that a minute may have 61 s.

    Parameters
    ----------
    found : re.Match
        Of `DATE`.

    Raises
    ------
    ValueError
        If there is no such day or minute.
    """
    year, month, day, hour, minute = (int(part) for part in found.groups()[:5])
    zone = found[7]
    start = datetime(year, month, day, hour, minute, tzinfo=UTC)
    if zone and zone != "Z":
        sign = -1.0 if zone[0] == "-" else 1.0
        start -= sign * timedelta(hours=int(zone[1:3]), minutes=int(zone[-2:]))
    return start.timestamp() + float(found[6])


def date_columns(rows: Sequence[Sequence[str]]) -> dict[int, bool]:
    """Columns whose every field is a date, or empty; whether they have a zone.

    Parameters
    ----------
    rows : sequence of sequence of str
        Fields of the first lines.
    """
    result = {}
    for column in range(min(map(len, rows), default=0)):
        cells = [row[column] for row in rows if row[column]]
        found = [DATE.fullmatch(cell) for cell in cells]
        if cells and all(found):
            result[column] = any(each is not None and each[7] is not None for each in found)
    return result
