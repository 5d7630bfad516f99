"""Times written as dates: lines of a log with seconds in their place."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gmwm._core.files import existing_file
from gmwm.errors import InputError
from gmwm.readers import DATE, seconds_of

_WEEK = re.compile(r"^\s*(\d{4})\s+(\d{1,6}\.\d+)(?=\s)")
_GPS_WEEKS = 315964800  # s from 1970-01-01 to 1980-01-06, on one calendar
_WEEK_LENGTH = 604800
_RTKLIB = re.compile(r"^%\s*(GPST|UTC|JST)\s")
_LOOKED_AT = 1 << 16  # bytes
_NAMES = {"sdn(m)": "sd_north", "sde(m)": "sd_east", "sdu(m)": "sd_up", "vn(m/s)": "velocity_north",
          "ve(m/s)": "velocity_east", "vu(m/s)": "velocity_up", "sdvn": "sd_velocity_north",
          "sdve": "sd_velocity_east", "sdvu": "sd_velocity_up", "latitude(deg)": "latitude_deg",
          "longitude(deg)": "longitude_deg", "height(m)": "height_m",
          "ns": "satellites"}  # fmt: skip
"""Columns of RTKLIB; others keep their names."""


@contextmanager
def in_seconds(path: Path) -> Iterator[tuple[Path, str]]:
    """The file with dates as seconds since 1970-01-01, and the name of its time scale.

    Lines keep their numbers, so that messages about them hold. A file without dates is passed on as
    it is, with no name. Written dates are counted on the calendar that they are in: GPS time is
    ahead of UTC by the leap seconds.

    path: ISO 8601 dates, or a solution of RTKLIB (``.pos``, dates or GPS weeks).
    Raises InputError if there is no such file, or a date is none.
    """
    existing_file(path)
    if path.suffix.lower() == ".gz":
        yield path, ""
        return
    with path.open("rb") as stream:
        head = stream.read(_LOOKED_AT).decode(errors="replace")
    scale = next((found[1] for line in head.splitlines() if (found := _RTKLIB.match(line))), "")
    if not scale and not DATE.search(head):
        yield path, ""
        return
    with tempfile.TemporaryDirectory() as folder:
        numbers = Path(folder) / path.name
        with path.open(errors="replace") as lines, numbers.open("w") as out:
            for number, line in enumerate(lines, 1):
                out.write(_line(line.rstrip("\r\n"), bool(scale), f"{path.name}, line {number}"))
        yield numbers, scale or "UTC"


def _line(text: str, rtklib: bool, place: str) -> str:
    if rtklib and text.startswith("%"):
        if not _RTKLIB.match(text):
            return "#\n"
        names = ["time_s", *text[1:].split()[1:]]
        return ",".join(_NAMES.get(name, name.partition("(")[0]) for name in names) + "\n"
    if rtklib and (week := _WEEK.match(text)):
        seconds = _GPS_WEEKS + int(week[1]) * _WEEK_LENGTH + float(week[2])
        text = f"{seconds:.6f} " + text[week.end() :]
    else:
        text = DATE.sub(lambda found: f"{_seconds(found, place):.6f}", text)
    return (",".join(text.split()) if rtklib else text) + "\n"


def _seconds(found: re.Match[str], place: str) -> float:
    try:
        return seconds_of(found)
    except ValueError as error:
        raise InputError(f"{place}: {found[0]} is not a date: {error}; correct the line") from None
