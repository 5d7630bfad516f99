"""Columns of an IMU log: signs, holes and values that stay, from samples made by hand."""

import numpy as np
import pytest

from gmwm import InputError
from gmwm.ins import tuning
from gmwm.ins.field.imu_file import _fill, _longest_run, _Record, _signs

DT = 0.02
MOST = round(tuning.LONGEST_FILLED / DT)


def record(n=50):
    samples = np.arange(6.0 * n).reshape(n, 6)
    return _Record(samples[:, :3].copy(), samples[:, 3:].copy(), DT, "a.csv", ())


def test_a_minus_before_a_column_turns_it():
    found = _signs({"gyro_x": "-wx", "gyro_y": "wy", "gyro_z": "-3", "accel_x": 4, "accel_y": "-"})
    columns = {"gyro_x": "wx", "gyro_y": "wy", "gyro_z": 3, "accel_x": 4, "accel_y": "-"}
    assert found == (columns, frozenset({"gyro_x", "gyro_z"}))
    assert _signs(None) == (None, frozenset())


def test_holes_are_filled_along_a_line():
    truth, given = record(), record()
    given.rate[10 : 10 + MOST, 1] = np.nan
    given.force[[1, 12, 48], 2] = np.nan
    (notice,) = _fill(given)
    np.testing.assert_allclose(given.rate, truth.rate)
    np.testing.assert_allclose(given.force, truth.force)
    assert notice.values == {"count": MOST + 2, "longest": MOST}  # one row has two
    assert _fill(given) == ()


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (slice(10, 11 + MOST), f"sample 11 of gyro_y, 0.2 s .* {MOST + 1} in a row: up to {MOST}"),
        ([0], "sample 1 of gyro_y, 0 s"),
        ([49], "sample 50 of gyro_y, 0.98 s"),
    ],
)
def test_a_hole_that_is_too_long_or_at_an_end_is_refused(rows, words):
    given = record()
    given.rate[rows, 1] = np.nan
    with pytest.raises(InputError, match=words):
        _fill(given)


@pytest.mark.parametrize(
    ("values", "run"),
    [
        ([1.0, 2.0, 3.0], (0, 1)),
        ([1.0, 1.0, 3.0], (0, 2)),
        ([1.0, 2.0, 2.0, 2.0, 3.0, 3.0], (1, 3)),
        ([1.0, 2.0, 3.0, 3.0], (2, 2)),
        ([5.0] * 4, (0, 4)),
    ],
)
def test_the_longest_run_of_equal_values(values, run):
    assert _longest_run(np.array(values)) == run


def test_a_run_goes_on_from_window_to_window(monkeypatch):
    values = np.array([0.0, 1, 2, 2, 2, 2, 2, 3, 3, 4, 5])
    for size in (1, 2, 3, 4, 11):
        monkeypatch.setattr(
            "gmwm.ins.field.imu_file.windows",
            lambda n, size=size: [slice(k, min(k + size, n)) for k in range(0, n, size)],
        )
        assert _longest_run(values) == (2, 5)
