"""Times of day and the hour of summer, on either side of where they begin."""

import numpy as np
import pytest

from gmwm.readers.clock.civil_time import is_time_of_day, seconds_of_day, without_summer_time


def written(seconds):
    """Seconds of a day as the number hhmmss.ss."""
    minutes, second = np.divmod(np.asarray(seconds, dtype=float), 60.0)
    hours, minute = np.divmod(minutes, 60.0)
    return 10_000.0 * (hours % 24) + 100.0 * minute + second


def test_a_time_of_day_is_its_seconds_over_midnights():
    seconds = np.arange(86_000.0, 3 * 86_400.0, 7.25)
    np.testing.assert_allclose(seconds_of_day(written(seconds)), seconds, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("stamps", "expected"),
    [
        (written(np.arange(3500.0, 3800.0, 1.0)), True),
        (written(np.arange(3500.0, 3800.0, 5.0)), True),  # a twelfth pass a minute
        (written(np.arange(3500.0, 3800.0, 10.0)), False),  # a sixth
        (written(np.arange(1.0, 59.0)), False),  # none
        (written(np.arange(86_399.0, 86_399.9, 0.1)), False),
        (written(np.arange(50.0, 70.0)) - 100.0, False),
        (written(np.arange(50.0, 70.0)) + 239_900.0, False),
        (np.arange(0.0, 300.0), False),
    ],
)
def test_minutes_that_follow_a_fifty_ninth_second(stamps, expected):
    assert is_time_of_day(stamps) is expected


def clock(step, *changes):
    """200 stamps, and (row, seconds) by which a step is more."""
    steps = np.full(200, step)
    for row, more in changes:
        steps[row] += more
    return 1e9 + np.cumsum(steps)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("step", "off", "is_summer"),
    [(0.01, 0.0, True), (0.01, 0.24, True), (0.01, 0.26, False), (0.01, -0.24, True),
     (0.01, -0.26, False), (10.0, 19.0, True), (10.0, -21.0, False), (300.0, 359.0, True),
     (300.0, 361.0, False)],
)  # fmt: skip
def test_a_step_of_an_hour_to_two_steps_is_summer_time(sign, step, off, is_summer):
    stamps = clock(step, (70, sign * 3600.0 + off))
    found, notices = without_summer_time(stamps, "row {}".format)
    if not is_summer:
        assert found is stamps and notices == []
        return
    np.testing.assert_allclose(found, stamps - sign * 3600.0 * (np.arange(200) >= 70))
    (notice,) = notices
    assert notice.values == {"row": 70, "changes": 1, "hour": sign * 3600.0}
    assert ("jump by" if sign > 0 else "go back by") in notice.text
    assert "row 70" in notice.text


def test_it_is_set_twice_a_year_and_no_more():
    twice = clock(0.5, (20, 3600.0), (150, -3600.0))
    found, (notice,) = without_summer_time(twice, str)
    np.testing.assert_allclose(np.diff(found), 0.5)
    assert notice.values == {"row": 20, "changes": 2, "hour": 3600.0}
    thrice = clock(0.5, (20, 3600.0), (90, 3600.0), (150, -3600.0))
    assert without_summer_time(thrice, str)[0] is thrice
    unknown = np.full(5, np.nan)
    assert without_summer_time(unknown, str)[0] is unknown
