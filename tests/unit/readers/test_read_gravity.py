"""The mean of an accelerometer at rest against its unit."""

from __future__ import annotations

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.readers import read

HEADER = "gx [deg/s],gy [deg/s],gz [deg/s],ax [{0}],ay [{0}],az [{0}]"
BARE = "gx,gy,gz,ax,ay,az"


def at_rest(samples, norm):
    tilt = np.array([0.3, -0.4, np.sqrt(0.75)])
    return np.column_stack([samples[:, :3], norm * (tilt + 1e-3 * samples[:, 3:])])


@pytest.mark.parametrize(
    ("norm", "unit", "likely"),
    [(1.02, "m/s^2", "g"), (9.8, "g", "m/s^2"), (1003.0, "g", "mg"), (0.98, "mg", "g")],
)
def test_a_unit_that_gravity_contradicts(write, samples, norm, unit, likely):
    path = write(at_rest(samples, norm), HEADER.format(unit))
    with pytest.raises(InputError, match=f"gravity in {likely.replace('^', '.')}") as caught:
        read(path, rate=100.0)
    assert caught.value.code == "accel-unit-missing"
    path = write(at_rest(samples, norm), BARE)
    recording = read(path, rate=100.0, units={"gyro": "deg/s", "accel": unit})
    found = recording.notices[0]
    assert (found.code, found.severity) == ("gravity", "bad")
    assert found.values["likely"] == likely


@pytest.mark.parametrize(
    ("norm", "unit"),
    [(1.02, "g"), (9.5, "m/s^2"), (985.0, "mg"), (0.0, "g"), (0.0, "m/s^2"), (0.8, "m/s^2")],
)
def test_gravity_or_none_at_all(write, samples, norm, unit):
    path = write(at_rest(samples, norm), HEADER.format(unit))
    notices = read(path, rate=100.0).notices
    assert "gravity" not in {notice.code for notice in notices}


@pytest.mark.parametrize(
    ("norm", "unit"), [(4.9, "m/s^2"), (2.0, "g"), (3.0, "m/s^2"), (16384.0, "m/s^2")]
)
def test_a_scale_that_no_unit_explains(write, samples, norm, unit):
    """Of another range, or counts."""
    found = read(write(at_rest(samples, norm), HEADER.format(unit)), rate=100.0)
    (notice,) = [each for each in found.notices if each.code == "gravity"]
    assert notice.severity == "warning"
    assert "times gravity: a sensor at rest reads 1 g" in notice.text


def test_samples_without_gravity_may_be_noisy(write, samples):
    path = write(np.column_stack([samples[:, :3], 3.0 * samples[:, 3:] + 1.5]), BARE)
    found = read(path, rate=1.0, units={"gyro": "deg/s", "accel": "m/s^2"})
    assert "gravity" not in {notice.code for notice in found.notices}
