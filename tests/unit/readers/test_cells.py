"""Fields of a line: numbers, dates and the blanks and quotes around them."""

import math
from datetime import UTC, datetime, timedelta, timezone

import pytest

from gmwm.readers import layout as cells
from gmwm.readers.table import LARGEST


def seconds(text):
    found = cells.FIELD_OF_DATE.fullmatch(text)
    assert found, text
    return cells.seconds_of(found)


DAY = datetime(2024, 2, 29, 23, 58, 7, 250_000)


ZONES = {"": 0.0, "Z": 0.0, " UTC": 0.0, "+00:00": 0.0, "-09:30": -9.5, "+0545": 5.75, "+14": 14.0,
         "-14:00": -14.0}  # fmt: skip


@pytest.mark.parametrize(
    "form",
    ["%Y-%m-%dT%H:%M:%S.%f", "%Y/%m/%d %H:%M:%S.%f", "%Y-%jt%H:%M:%S,%f", "%Y%m%dT%H%M%S.%f",
     "%Y%jT%H%M%S", "%G-W%V-%uT%H:%M:%S.%f", "%GW%V%uT%H%M%S.%f"],
)  # fmt: skip
def test_a_date_is_its_time_by_the_calendar(form):
    for zone, hours in ZONES.items():
        expected = DAY.replace(tzinfo=timezone(timedelta(hours=hours))).timestamp()
        assert seconds(DAY.strftime(form) + zone) == expected - (0.25 if "%f" not in form else 0.0)


@pytest.mark.parametrize(
    "right", ["2016-12-31T23:59:60Z", "2016-12-31T23:59:60.9", "2017-01-01T00:59:60+01:00",
              "2016-12-31T11:59:60", "2016-01-01T00:00:00", "2016-12-31T23:00:59.9Z"],
)  # fmt: skip
def test_the_last_minute_of_a_day_may_have_a_second_more(right):
    clock, rest = right[:17], float(right[17:].split("+")[0].rstrip("Z"))
    start = datetime.fromisoformat(clock + "00").replace(tzinfo=UTC).timestamp()
    assert seconds(right) == start + rest - (3600.0 if "+" in right else 0.0)


@pytest.mark.parametrize(
    "wrong", ["2016-12-31T23:59:61Z", "2016-12-31T22:59:60Z", "2016-12-31T23:58:60Z",
              "2016-12-31T23:58:60", "2016-12-31T24:00:00", "2016-12-31T23:60:00",
              "2016-02-30T01:00:00", "2015-366T01:00:00", "2016-13-01T00:00:00",
              "2015-W53-8T00:00:00", "2016-01-01T00:00:00+14:01", "2016-01-01T00:00:00-15",
              "2016-01-01T00:00:00+01:60"],
)  # fmt: skip
def test_a_date_that_no_calendar_has_is_refused(wrong):
    with pytest.raises(ValueError):
        seconds(wrong)


@pytest.mark.parametrize(
    ("cell", "decimal", "value"),
    [("12", ".", 12.0), ("-1.5e-3", ".", -1.5e-3), (".5", ".", 0.5), ("+5.", ".", 5.0),
     ("1,5", ",", 1.5), (",5E2", ",", 50.0), ("1.5", ",", None), ("1,5", ".", None),
     ("1_000", ".", None), ("e5", ".", None), ("1e", ".", None), ("0x10", ".", None),
     ("abc", ".", None), ("1 2", ".", None), ("", ".", math.nan), ("NaN", ".", math.nan),
     ("-nan", ".", math.nan), ("n/a", ".", math.nan), ("NA", ".", math.nan),
     ("#N/A", ".", math.nan),
     ("Null", ".", math.nan), ("none", ".", math.nan), ("nanny", ".", None), ("inf", ".", math.inf),
     ("-Infinity", ".", math.inf), ("infi", ".", None), ("1e999", ".", math.inf),
     (repr(LARGEST), ".", math.inf), (repr(0.99 * LARGEST), ".", 0.99 * LARGEST)],
)  # fmt: skip
def test_a_number_is_one_missing_infinite_or_text(cell, decimal, value):
    found = cells.number(cell, decimal)
    assert found == value or (value is not None and math.isnan(value) and math.isnan(found))


@pytest.mark.parametrize(
    ("line", "delimiter", "fields"),
    [("1, 2 ,\t3", ",", ["1", "2", "3"]), ("1;;3;", ";", ["1", "", "3", ""]),
     ('"a,b", "c"', ",", ["a,b", "c"]), ('"a ""b""",c', ",", ['a "b"', "c"]),
     ("  1   2\t 3 ", " ", ["1", "2", "3"]), ('"a" b', " ", ["a", "b"])],
)  # fmt: skip
def test_fields_have_no_blanks_and_no_quotes_around_them(line, delimiter, fields):
    assert cells.split_line(line, delimiter) == fields


def test_quotes_that_do_not_match_are_refused():
    with pytest.raises(ValueError, match="quotes"):
        cells.split_line('"a,b', ",")


def test_a_unit_after_a_blank_belongs_to_its_name():
    found = cells.split_header('time [s] wx (deg / s) "wy" T[degC]', " ")
    assert found == ["time [s]", "wx (deg / s)", "wy", "T[degC]"]
    assert cells.split_header("a b, c", ",") == ["a b", "c"]


def test_columns_of_dates_are_those_without_anything_else():
    date, zoned = "2024-02-29T10:00:00", "2024-02-29T10:00:00+02"
    rows = [[date, zoned, date, "", "1"], [date, "", "x", "", date, date]]
    assert cells.date_columns(rows) == {0: False, 1: True}
    assert cells.date_columns([[date], [zoned]]) == {0: True}
    assert cells.date_columns([]) == {}
