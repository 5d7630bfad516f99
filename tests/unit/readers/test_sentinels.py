"""Numbers that stand for no sample, on either side of where they begin to be some."""

import numpy as np
import pytest

from gmwm.readers import tuning
from gmwm.readers.samples import without_sentinels

LARGEST = 1e6


def found(values):
    clean, notices = without_sentinels("gyro_x", values, LARGEST, "row {}".format)
    return np.flatnonzero(np.isnan(clean)).tolist(), notices


def samples(n=1000):
    """Of a flat law: 90 % of them, and the quartiles, are known."""
    return np.random.default_rng(1).permutation(np.linspace(-0.5, 0.5, n))


REACH = tuning.FAR_OUTSIDE * 0.9


@pytest.mark.parametrize(
    ("number", "meaning"),
    [(999.0, "an error code"), (-9999.0, "an error code"), (99999.0, "an error code"),
     (-999.25, "an error code"), (-99.99, "an error code"), (9_999_999.0, "an error code"),
     (32767.0, "the largest integer of 16 bit"), (-32768.0, "the smallest integer of 16 bit"),
     (65535.0, "the largest integer of 16 bit"), (2.0**31 - 1, "the largest integer of 32 bit"),
     (-(2.0**23), "the smallest integer of 24 bit"), (-(2.0**63), "the smallest integer of 64 bit"),
     (1.5 * LARGEST, "beyond the range of any sensor"), (998.0, None), (32766.0, None),
     (99.0, None), (0.9 * LARGEST, None)],
)  # fmt: skip
def test_one_number_far_from_all_others(number, meaning):
    values = samples()
    values[400] = number
    rows, notices = found(values)
    assert rows == ([400] if meaning else [])
    for notice in notices:
        assert f"a sample is {number:.10g}, {meaning}, first at row 400" in notice.text
        assert notice.values == {"count": 1, "value": number, "row": 400}


@pytest.mark.parametrize(("nearer", "rows"), [(1.01, []), (0.99, [7])])
def test_a_code_is_twenty_widths_away(nearer, rows):
    values = samples() * 999.0 / REACH * nearer
    values[7] = 999.0
    assert found(values)[0] == rows


@pytest.mark.parametrize(("count", "severity"), [(3, "warning"), (100, "warning"), (101, "bad")])
def test_more_than_a_tenth_is_bad(count, severity):
    values = samples()
    rows = np.arange(1, 2 * count, 2)
    values[rows] = -9999.0
    gone, (notice,) = found(values)
    assert gone == rows.tolist()
    assert notice.severity == severity
    assert f"{count:,} samples are -9999" in notice.text


@pytest.mark.parametrize(
    ("places", "is_none"),
    [
        ([100, 300], False),  # twice may be chance
        ([100, 300, 500], True),
        ([100, 101, 300, 301], True),
    ],
)
def test_a_number_that_comes_again_from_nowhere(places, is_none):
    values = samples()
    values[places] = 123.456
    assert found(values)[0] == (places if is_none else [])


@pytest.mark.parametrize(("leading", "is_none"), [(1, True), (2, False)])
def test_what_something_leads_to_is_a_sample(leading, is_none):
    values = samples()
    places = 50 * np.arange(1, 16)
    values[places] = 80.0
    values[places[:leading] - 1] = 30.0 + np.arange(leading)
    gone = found(values)[0]
    assert gone == (places.tolist() if is_none else [])


def test_several_numbers_have_a_notice_each_and_the_absurd_ones_share_one():
    values = samples()
    values[[10, 20, 30, 40]] = [999.0, -9999.0, 3e7, -5e8]
    gone, notices = found(values)
    assert gone == [10, 20, 30, 40]
    assert [each.values["value"] for each in notices] == [-9999.0, 999.0, -5e8]
    assert "2 samples are -500000000 and the like" in notices[-1].text
    assert notices[-1].values["row"] == 30


def test_without_any_nothing_is_copied():
    values = samples()
    assert without_sentinels("x", values, LARGEST, str)[0] is values
    nothing = np.full(5, np.nan)
    assert without_sentinels("x", nothing, LARGEST, str)[0] is nothing
    codes = np.full(5, 999.0)
    assert without_sentinels("x", codes, LARGEST, str)[0] is codes


@pytest.mark.parametrize("leading", [True, False])
def test_a_sensor_that_stays_at_the_end_of_its_range_is_none(leading):
    """Samples of turns that clipped were missing: what leads to a run counts, not its length."""
    values = samples()
    values[300:400] = 2.0 * REACH
    if leading:
        values[[299, 400]] = 1.7 * REACH
    rows, _ = found(values)
    assert rows == ([] if leading else [*range(300, 400)])
