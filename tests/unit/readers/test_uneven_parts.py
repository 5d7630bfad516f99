"""Parts of the search for an uneven clock, from stamps made by hand; columns by what they are."""

import numpy as np
import pytest

from gmwm import InputError
from gmwm.readers import tuning
from gmwm.readers.clock.uneven import (
    _bursts,
    _costs,
    _likeliest,
    _rough_interval,
    _rows_that_follow,
    _smooth,
    _start,
)
from gmwm.readers.names import meaning
from gmwm.readers.roles import Columns


@pytest.mark.parametrize(
    ("stamps", "burst", "of_row"),
    [
        ([1, 2, 3, 4], 1, [1, 1, 1, 1]),
        ([1, 1, 1, 2, 2, 2], 3, [3, 3, 3, 3, 3, 3]),
        ([1, 1, 2, 3], 1, [2, 2, 1, 1]),  # half of the rows are not most of them
        ([1, 1, 2, 2, 3], 2, [2, 2, 2, 2, 1]),
        ([1, 1, 1, 1, 2, 3, 3], 4, [4, 4, 4, 4, 1, 2, 2]),
    ],
)
def test_rows_of_one_stamp_are_counted(stamps, burst, of_row):
    found = _bursts(np.array(stamps, dtype=float))
    assert found[0] == burst and found[1].tolist() == of_row


def test_rows_that_follow_at_the_same_stamp():
    stamps = np.array([1.0, 1, 1, 2, 3, 3])
    same = np.zeros(6, dtype=bool)
    assert _rows_that_follow(stamps, same, 3, 10).tolist() == [2, 1, 0, 0, 1, 0]
    same[1] = True  # a copy is no row
    assert _rows_that_follow(stamps, same, 3, 10).tolist() == [1, 1, 0, 0, 1, 0]


@pytest.mark.parametrize(
    ("burst", "extent", "later", "follow"),
    [
        (3, 10, 84.0, [2, 1, 0, 2, 1, 0]),  # the clock was set within three rows
        (3, 10, -4.0, [2, 1, 0, 2, 1, 0]),
        (3, 84, 84.0, [2, 1, 0, 0, 1, 0]),  # rows may have been lost
        (2, 10, 84.0, [2, 1, 0, 0, 1, 0]),  # they are more than a burst
    ],
)
def test_rows_of_a_burst_in_which_the_clock_is_set(burst, extent, later, follow):
    stamps = np.array([3.0, 3, 3, 6, 6 + later, 6 + later])
    same = np.zeros(6, dtype=bool)
    assert _rows_that_follow(stamps, same, burst, extent).tolist() == follow


@pytest.mark.parametrize(
    ("first", "follow"), [(2, [3, 2, 1, 0, 3, 2, 1, 0]), (3, [2, 1, 0, 1, 0, 3, 2, 1, 0])]
)
def test_a_clock_that_is_set_within_the_first_burst(first, follow):
    stamps = np.repeat([0.0, -5.0, 4.0], [first, 2, 4])
    same = np.zeros(stamps.size, dtype=bool)
    assert _rows_that_follow(stamps, same, 4, 10).tolist() == follow


@pytest.mark.parametrize("burst", [1, 4])
def test_the_interval_is_that_of_rows_and_not_of_stamps(burst):
    stamps = np.repeat(0.5 * burst * np.arange(500.0), burst)
    same = np.zeros(stamps.size, dtype=bool)
    assert _rough_interval(stamps, same, burst) == pytest.approx(0.5)
    late = stamps + np.where(np.arange(stamps.size) // burst % 50 == 7, 40.0, 0.0)
    assert _rough_interval(late, same, burst) == pytest.approx(0.5)
    same[1::2] = burst == 4  # every second is a copy
    assert _rough_interval(stamps, same, burst) == pytest.approx(0.5 if burst == 1 else 1.0)
    assert _rough_interval(np.ones(5), same[:5], 1) == 0.0
    assert _rough_interval(np.array([1.0, 2.5]), same[:2] & False, 1) == pytest.approx(1.5)


def test_the_clock_starts_where_most_rows_say():
    x = np.arange(20.0) + 0.25
    x[1] += 30.0
    assert _start(x) == pytest.approx(0.25)


@pytest.mark.parametrize(("copies", "cheap"), [(0.8, False), (0.81, True)])
def test_copies_cost_nothing_where_stamps_repeat_with_their_samples_only(copies, cheap):
    stamps = np.repeat(np.arange(100.0), 2)
    same = np.zeros(200, dtype=bool)
    repeats = np.arange(1, 200, 2)
    same[repeats[: round(copies * 100)]] = True
    found = _costs(stamps, same)
    usual = [*tuning.CLOCK_COSTS, 0.0]
    assert found.tolist() == ([usual[0], 0.0, *usual[2:4], usual[1]] if cheap else usual)


def test_the_slow_part_ends_where_the_clock_was_set():
    size = tuning.ROWS_OF_TREND
    late = np.concatenate([np.full(3 * size, 2.0), np.full(3 * size, -5.0)])
    late[size] = 90.0  # a stall
    is_set = np.zeros(late.size, dtype=bool)
    is_set[3 * size] = True
    np.testing.assert_allclose(_smooth(late, is_set), np.repeat([2.0, -5.0], 3 * size))


# -- columns --------------------------------------------------------------------------------------

COLUMNS = Columns("a.csv", ("t [s]", "Gyro", "gyro", "ax [g]", "ax", "7", ""))


@pytest.mark.parametrize(
    ("reference", "index"),
    [("t [s]", 0), ("t", 0), ("T", 0), ("Gyro", 1), ("gyro", 2), ("ax [g]", 3), ("AX [G]", 3),
     ("ax", 4), ("7", 5), (0, 0), (6, 6), ("3", 3), ("6", 6)],
)  # fmt: skip
def test_a_column_is_found_by_name_or_index(reference, index):
    assert COLUMNS.find(reference, "accel_x") == index


@pytest.mark.parametrize(
    ("reference", "words"),
    [("GYRO", "has 2 columns 'GYRO': .* 1, 2"), (7, "no column 7 .* its 7 columns .* 0 to 6"),
     (-1, "no column -1"), ("8", "no column 8"), ("x", "no column 'x' for accel_x"),
     (True, "accel_x = True is not a column"), (1.0, "accel_x = 1.0 is not a column"),
     ("", "no column ''")],
)  # fmt: skip
def test_a_column_that_is_none(reference, words):
    with pytest.raises(InputError, match=words):
        COLUMNS.find(reference, "accel_x")


@pytest.mark.parametrize(("count", "more"), [(12, ""), (13, " and 1 more"), (20, " and 8 more")])
def test_so_many_columns_are_listed(count, more):
    text = Columns("a.csv", tuple(f"c{i}" for i in range(count))).listed()
    assert "c11" in text and "c12" not in text and text.endswith(more)
    assert "have no names" in Columns("a.csv", ("", "")).listed()


@pytest.mark.parametrize(
    ("name", "unit"),
    [("temp deg c", "deg c"), ("temp_c", "c"), ("temp_degC", None), ("temp x", None),
     ("temp [K]", "K"), ("T [degC]", "degC")],
)  # fmt: skip
def test_a_unit_of_temperature_in_one_or_two_words(name, unit):
    assert meaning(name).role == "temperature"
    assert unit is None or meaning(name).unit == unit


@pytest.mark.parametrize("shorter", [1.0, 1.05, 1.1, 1.15, 1.2, 1.3, 1.4])
def test_the_likeliest_interval_is_that_of_which_all_rows_are_multiples(shorter):
    same = np.zeros(600, dtype=bool)
    x = np.arange(600.0) / shorter
    assert _likeliest(x, same, _costs(x, same)) == shorter
