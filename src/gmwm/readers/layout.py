"""How a delimited text is laid out: delimiter, decimal mark, header, fields, numbers and dates."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime, time, timedelta
from statistics import mode

from gmwm._core.units import SI_UNIT
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
from gmwm.readers import tuning
from gmwm.readers.names import AXES, meaning, of_dates
from gmwm.readers.registry import READABLE
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


_COMMENT_MARKS = ("#", "%", "//")
_BLACKBOX = re.compile(rb'"?Product"?\s*,\s*"?Blackbox')
_BLACKBOX_HEADER = re.compile(rb'(?m)^"?loopIteration"?\s*,')
_DELIMITERS = (";", "\t", ",", BLANKS)  # of two that explain the lines equally well, the first
_UTF8_MARK = b"\xef\xbb\xbf"
_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_LINE = re.compile(rb"[^\r\n]*(?:\r\n|\n|\r|$)")


# Scale factors by the type of the IMU: docs.novatel.com/OEM7, RAWIMUS and RAWIMUSX. The order of
# the fields: RAWIMUS of the ROS package novatel_oem6_msgs.
_NOVATEL = {
    "RAWIMU": "its last six fields are accelerometer z, -y, x and gyro z, -y, x, in counts of "
    "velocity and angle: multiply them by the manual's scale factors of your IMU and by its rate, "
    "and save them as CSV with the header time [s],gyro_x [rad/s],...,accel_x [m/s^2],...",
    "INSPVA": "it has positions and attitudes but no samples of an IMU: log RAWIMUSXA",
}


def _axes(**prefixes: str) -> dict[str, str]:
    """Name of a column -> its meaning, for the three axes of a prefix."""
    return {
        f"{prefix}{axis}": f"{sensor}_{axis} [{SI_UNIT[sensor]}]"
        for sensor, prefix in prefixes.items()
        for axis in AXES
    }


_RENAMED = (
    {"timestamp": "time [ns]"} | _axes(gyro="omega_", accel="alpha_"),  # Kalibr
    {"timestamp": "time [us]", "gyro_rad[0]": "gyro_rad[0]"},  # ulog2csv of PX4
    {"time": "time [ns]", "field.header.stamp": "field.header.stamp [ns]"},  # rostopic
)
"""Names by which an exporter is known, and their meaning."""

_GRAVITY_IN_STEPS = re.compile(rb'"?acc_1G"?\s*,\s*"?([0-9]+)')
_BLACKBOX_AXIS = re.compile(r"(gyroADC|accSmooth)\[([012])\]")
_SCALES = re.compile(rb"(?m)^([tga])scale,([0-9.eE+-]+)")
_GYROFLOW = {"t": "time [s]"} | _axes(gyro="g") | {f"a{axis}": f"accel_{axis} [g]" for axis in AXES}


def with_dialect(layout: Layout, source: str, head: bytes) -> Layout:
    """A layout with the units that a known exporter implies in its column names.

    Betaflight (blackbox_decode): time in microseconds, gyros in deg/s, accelerometers in steps, of
    which the preamble has the number per g. Sensor Logger: axes without the sensor, which is in the
    name of the file, and time in nanoseconds. Gyroflow (gcsv): scales in the preamble. Xsens DOT:
    a clock of 1 MHz, where MTi has 10 kHz. Kalibr, ulog2csv of PX4 and rostopic: units of time.
    """
    names, preamble = layout.names, head[: layout.offset]
    if names[:1] == ("loopIteration",):
        steps = _GRAVITY_IN_STEPS.search(preamble)
        meant, scales = {"time": "time [us]", "time (us)": "time [us]"}, {}
        for i, name in enumerate(names):
            if found := _BLACKBOX_AXIS.fullmatch(name):
                sensor, unit = ("gyro", " [deg/s]") if found[1] == "gyroADC" else ("accel", " [g]")
                unit = unit if steps or sensor == "gyro" else ""
                meant[name] = f"{sensor}_{AXES[int(found[2])]}{unit}"
            if steps and name.startswith("accSmooth"):
                scales[i] = 1.0 / max(int(steps[1]), 1)
        return replace(_renamed(layout, meant), scales=scales)
    if preamble.startswith(b"GYROFLOW IMU LOG"):
        sizes = {letter.decode(): float(size) for letter, size in _SCALES.findall(preamble)}
        meant = {name: new for name, new in _GYROFLOW.items() if name[0] in sizes}
        scales = {i: sizes[name[0]] for i, name in enumerate(names) if name in meant}
        return replace(_renamed(layout, meant), scales=scales)
    if b"DOT" in preamble:
        return _renamed(layout, {"SampleTimeFine": "time [us]"})
    for meant in _RENAMED:
        if set(meant) <= set(names):
            return _renamed(layout, meant)
    sensor = next((each for each in SI_UNIT if each in source.lower()), "")
    if sensor and {*AXES, "seconds_elapsed"} <= set(names):
        meant = {axis: f"{sensor}_{axis} [{SI_UNIT[sensor]}]" for axis in AXES}
        layout = _renamed(layout, {**meant, "time": "time [ns]"})
        if source.lower().startswith("accelerometer."):
            return replace(layout, notices=(*layout.notices, notice("gravity-absent", "accel")))
    return layout


def _renamed(layout: Layout, meant: dict[str, str]) -> Layout:
    return replace(layout, names=tuple(meant.get(name, name) for name in layout.names))


_LONGEST_HEADER = 1 << 16  # characters


@dataclass(frozen=True)
class Layout:
    """How to read a delimited text."""

    delimiter: str  # one character; a space stands for runs of spaces and tabs
    decimal: str  # {".", ","}
    names: tuple[str, ...]  # names of the columns, ``""`` where there is none
    tentative: bool  # whether the names, if any, come from a comment line
    trailing: bool  # whether every line of data ends with a delimiter
    offset: int  # bytes before the first line of data
    line: int  # number of that line, counted from 1
    notices: tuple[Notice, ...] = ()
    # Index of a column -> factor of its numbers.
    scales: Mapping[int, float] = field(default_factory=dict)
    # Index of a column of dates -> whether they have a zone.
    dates: Mapping[int, bool] = field(default_factory=dict)

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.names)


@dataclass(frozen=True)
class _Line:
    number: int
    offset: int
    text: str


def find_layout(source: str, head: bytes) -> Layout:
    """How a text is laid out, from the whole lines at its beginning."""
    if head.startswith(_UTF16_MARKS):
        raise InputError(f"{source} is UTF-16 text: save it as UTF-8 or ASCII")
    if b"\0" in head:
        raise InputError(f"{source} is not a text file: {READABLE}, export it as one of these")
    comments, read = _first_lines(source, head)
    lines = _without_preamble(read)
    first, following = lines[0], lines[1:]
    sample = [line.text for line in following or lines]
    delimiter = _delimiter(sample)
    if delimiter is None and following:
        raise InputError(f"{source} holds no numbers in its first lines: {READABLE}")
    if delimiter is None and len(first.text) > _LONGEST_HEADER:
        text = f"{source}, line {first.number}, has {len(first.text):,} characters"
        raise InputError(f"{text}, too many for a header: keep the columns of the IMU")
    if delimiter is None:
        raise InputError(f"{source} has a header (line {first.number}) but no data: add samples")
    decimal = _decimal(sample, delimiter)
    names = fields_of(source, first.number, first.text, delimiter, header=True)
    has_header = bool(following) and _are_names(names, decimal)
    # What pandas writes above columns without names.
    is_numbering = bool(following) and len(names) > 2 and names == [*map(str, range(len(names)))]
    data = following if has_header or is_numbering else lines
    rows = [fields_of(source, line.number, line.text, delimiter) for line in data]
    trailing = all(len(row) > 1 and not row[-1] for row in rows)
    width = mode(len(row) for row in rows) - trailing
    if has_header:
        if trailing and len(names) == width + 1 and names[-1]:
            trailing, width = False, width + 1  # a named column, every field of it empty
        names = _without_last_empty(names, width)
        if len(names) != width:
            raise InputError(
                f"{source}, line {data[0].number} and after: {width} fields where the header (line "
                f"{first.number}) has {len(names)}: give every column one name"
            )
    else:
        names = _commented_names(comments, delimiter, decimal, width)
    dates = date_columns(rows)
    named = [of_dates(name) if i in dates else name for i, name in enumerate(names or [""] * width)]
    notices = [notice("dates", "", {"column": named[i]}) for i in dates]
    if is_numbering and not has_header:
        notices.insert(0, notice("column-numbers", "", {"line": first.number}))
    if lines is not read:
        notices.append(notice("preamble", "", {"line": first.number}))
    return Layout(
        delimiter=delimiter,
        decimal=decimal,
        names=tuple(named),
        tentative=not has_header,
        trailing=trailing,
        offset=data[0].offset,
        line=data[0].number,
        notices=tuple(notices),
        dates=dates,
    )


def _first_lines(source: str, head: bytes) -> tuple[list[_Line], list[_Line]]:
    """Leading comments, and the lines from the first one that is not a comment."""
    comments, lines = list[_Line](), list[_Line]()
    start, preamble = len(_UTF8_MARK) if head.startswith(_UTF8_MARK) else 0, 0
    if _BLACKBOX.match(head, start):
        header = _BLACKBOX_HEADER.search(head, start)
        if header is None:
            text = f"{source} has the preamble of a blackbox log but no line that begins with"
            raise InputError(f"{text} loopIteration: decode the log again")
        preamble = header.start()
    for i, found in enumerate(_LINE.finditer(head, start), start=1):
        raw = found.group().strip(b" \r\n")
        if not raw.strip() or found.start() < preamble:
            continue
        text = raw.decode(errors="replace")
        if lines or not text.startswith(_COMMENT_MARKS):
            if not lines and "\ufffd" in text and b"\xef\xbf\xbd" not in raw:
                raise InputError(
                    f"{source}, line {i}: this is not UTF-8 text: save it as UTF-8; {READABLE}"
                )
            lines.append(_Line(i, found.start(), text))
            if len(lines) == tuning.LINES_OF_LAYOUT:
                break
        else:
            comments.append(_Line(i, found.start(), text))
    if not lines:
        for mark, hint in _NOVATEL.items():
            if comments and comments[0].text[1:].startswith(mark):
                raise InputError(f"{source} is a {mark} log of NovAtel: {hint}")
        what = "holds only comments" if comments else "is empty"
        raise InputError(f"{source} {what}: give a file with samples")
    return comments, lines


def _without_preamble(lines: list[_Line]) -> list[_Line]:
    """From the header on, if only lines of words and of other widths than the data's are before."""
    rows = [line.text for line in lines[len(lines) // 2 :]]
    delimiter = _delimiter(rows)
    if delimiter is None:
        return lines
    decimal = _decimal(rows, delimiter)
    with suppress(ValueError):  # quotes that do not match are reported where they are read
        fields = [split_line(row, delimiter) for row in rows]
        width, trailing = mode(map(len, fields)), all(len(f) > 1 and not f[-1] for f in fields)
        for i, line in enumerate(lines):
            cells = split_header(line.text, delimiter)
            if len(cells) in (width, width - trailing):
                return lines[i:] if i and _are_names(cells, decimal) else lines
            if all(number(cell, decimal) is not None for cell in cells):
                return lines
    return lines


def _delimiter(texts: Sequence[str]) -> str | None:
    """The delimiter that finds the most numbers, ``None`` if there is no number."""
    counts = dict.fromkeys(_DELIMITERS, 0)
    for delimiter in _DELIMITERS:
        if delimiter == BLANKS or any(delimiter in text for text in texts):
            decimal = _decimal(texts, delimiter)
            for text in texts:
                with suppress(ValueError):  # quotes that do not match
                    cells = split_line(text, delimiter)
                    counts[delimiter] += sum(_is_number(cell, decimal) for cell in cells)
    best = max(_DELIMITERS, key=lambda delimiter: counts[delimiter])
    if not counts[best]:
        return None
    # A single column has no delimiter; a comma then is the least surprising one.
    is_single = best == BLANKS and all(len(text.split()) == 1 for text in texts)
    return "," if is_single else best


def _decimal(texts: Sequence[str], delimiter: str) -> str:
    """The mark with which more fields are numbers; never a comma that parts the fields."""
    if delimiter == "," or not any("," in text for text in texts):
        return "."
    separator = None if delimiter == BLANKS else delimiter
    cells = [cell.strip(' \t"') for text in texts for cell in text.split(separator)]
    counts = {mark: sum(_is_number(cell, mark) for cell in cells) for mark in ".,"}
    return "," if counts[","] > counts["."] else "."


def _is_number(cell: str, decimal: str) -> bool:
    value = number(cell, decimal)
    return value is not None and math.isfinite(value)


def _are_names(cells: Sequence[str], decimal: str) -> bool:
    """Names have no number among them, and say something else than that there is none."""
    return not any(_is_number(cell, decimal) for cell in cells) and any(
        number(cell, decimal) is None for cell in cells
    )


def fields_of(
    source: str, number: int, text: str, delimiter: str, header: bool = False
) -> list[str]:
    """Fields of a line, which is rejected if its quotes do not match."""
    try:
        return (split_header if header else split_line)(text, delimiter)
    except ValueError as error:
        text = f"{source}, line {number}: quotes that do not match"
        raise InputError(f"{text}: correct the line") from error


def _without_last_empty(names: list[str], width: int) -> list[str]:
    """Drop what stands after a delimiter at the end of a header."""
    return names[:-1] if len(names) == width + 1 and not names[-1] else names


def _commented_names(
    comments: Sequence[_Line], delimiter: str, decimal: str, width: int
) -> list[str]:
    """The comment that is a header: as many words as columns, best with names that we know."""
    candidates = []
    for comment in reversed(comments):
        text = comment.text.lstrip("#%/").strip(" ")
        try:
            names = _without_last_empty(split_header(text, delimiter), width)
        except ValueError:
            continue
        if len(names) == width and _are_names(names, decimal):
            candidates.append(names)
    known = [names for names in candidates if any(meaning(name).role for name in names)]
    return next(iter(known + candidates), [])
