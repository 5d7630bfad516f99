"""Binary files without a header."""

from __future__ import annotations

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.readers import read
from gmwm.readers.formats.binary import LAYOUTS, layout_of

RATE, N = 128.0, 200  # steps that floating point has exactly


def records(layout, seed=1):
    rng = np.random.default_rng(seed)
    found = np.zeros(N, dtype=layout.record)
    found["time"] = 5.0 + np.arange(N) / RATE
    found["values"] = rng.integers(-900, 900, (N, 6))
    # Gravity on the last axis, in whole units.
    found["values"][:, 5] = np.rint(9.8 / RATE / layout.accel) + rng.integers(-2, 3, N)
    if layout.kind == "f8":
        small = 1e-4 / np.repeat([layout.gyro, layout.accel], 3)
        found["values"] = rng.normal(size=(N, 6)) * small
        found["values"][:, 5] += 9.8 / RATE / layout.accel
    return found


@pytest.mark.parametrize("name", LAYOUTS)
def test_every_layout_comes_back_exactly(tmp_path, name):
    layout, path = LAYOUTS[name], tmp_path / "imu.bin"
    written = records(layout)
    path.write_bytes(written.tobytes())
    found = read(path, layout=name.lower(), units={"accel": "m/s^2"})
    assert found.rate == pytest.approx(RATE, rel=1e-12)
    for i, channel in enumerate(found.values()):
        unit = layout.gyro if i < 3 else layout.accel
        np.testing.assert_array_equal(channel.values, written["values"][:, i] * (unit * RATE))


def test_the_scales_are_those_of_the_formats():
    assert LAYOUTS["IMAR"].gyro == 0.1 * np.pi / 180 / 3600
    assert LAYOUTS["LN200IG"].gyro == 4.0 * LAYOUTS["LN200"].gyro == 2.0**-19
    assert [LAYOUTS[name].record.itemsize for name in ("IMAR", "IXSEA", "KF-GINS")] == [32, 56, 56]


def test_rates_of_another_type_and_order(tmp_path):
    layout = layout_of("float32,0.5,2,rates,big")
    written = records(layout)
    written["values"] = np.random.default_rng(2).integers(-9, 9, (N, 6))
    written["values"][:, 5] = 4.9
    path = tmp_path / "imu.dat"
    path.write_bytes(written.tobytes())
    found = read(path, layout="float32,0.5,2,rates,big")
    np.testing.assert_array_equal(found["gyro_y"].values, 0.5 * written["values"][:, 1])
    np.testing.assert_array_equal(found["accel_z"].values, 2.0 * written["values"][:, 5])


def test_a_partial_last_record_is_reported(tmp_path):
    path = tmp_path / "imu.bin"
    path.write_bytes(records(LAYOUTS["LN200"]).tobytes() + b"\0" * 11)
    found = read(path, layout="LN200", units={"accel": "m/s^2"})
    (notice,) = [each for each in found.notices if each.code == "partial-record"]
    assert notice.values == {"bytes": 11}
    assert found.n == N


@pytest.mark.parametrize(
    ("layout", "words"),
    [
        ("IXSEA", "are not seconds of a clock: give the layout"),
        ("LN300", "layout 'LN300' is unknown: give one of IMAR"),
        ("int8,1,1", "is unknown"),
        ("int32,1", "is unknown"),
        ("int32,1,1,middle", "'middle' is unknown"),
        ("int32,0,1", "positive scales"),
    ],
)
def test_a_wrong_layout(tmp_path, layout, words):
    path = tmp_path / "imu.bin"
    path.write_bytes(records(LAYOUTS["LN200"]).tobytes())
    with pytest.raises(InputError, match=words) as caught:
        read(path, layout=layout)
    assert caught.value.code == "layout"


@pytest.mark.parametrize(
    ("own", "other"),
    [("KF-GINS", "IXSEA"), ("IXSEA", "KF-GINS"), ("IMAR", "LN200"),
     ("KF-GINS", "float64,1,1,rates")],
)  # fmt: skip
def test_a_layout_in_which_gravity_does_not_show(tmp_path, own, other):
    path = tmp_path / "imu.bin"
    path.write_bytes(records(LAYOUTS[own]).tobytes())
    assert "gravity" not in {each.code for each in read(path, layout=own).notices}
    with pytest.raises(InputError, match="times gravity: the file has another layout") as caught:
        read(path, layout=other)
    assert caught.value.code == "layout"
    assert read(path, layout=other, units={"accel": "m/s^2"}).n == N


def test_too_short(tmp_path):
    path = tmp_path / "imu.bin"
    path.write_bytes(records(LAYOUTS["LN200"]).tobytes()[:320])
    with pytest.raises(InputError, match="10 records of 32, but needs at least 64"):
        read(path, layout="LN200")


def test_infinite_numbers(tmp_path):
    written = records(LAYOUTS["IXSEA"])
    written["values"][150, 2] = np.inf
    path = tmp_path / "imu.bin"
    path.write_bytes(written.tobytes())
    with pytest.raises(InputError, match=r"record 150 .* inf is not a usable number"):
        read(path, layout="IXSEA")
