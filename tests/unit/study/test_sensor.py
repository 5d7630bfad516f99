"""Figures 1, 5 and 6 and Tables V and VI of one sensor, on short records."""

import numpy as np
import pytest

from gmwm import InputError, RandomWalk, Recording, WhiteNoise
from gmwm.study import reproduce_sensor, sensor
from marks import slow

UNITS = {"gyro": "rad/s", "accel": "m/s^2"}


def recording(axes=("gyro_x", "accel_z"), seed=0):
    model, rng = WhiteNoise(1e-3) + RandomWalk(3e-4), np.random.default_rng(seed)
    columns = {axis: model.simulate(3_000, 0.05, rng) for axis in axes}
    return Recording.from_arrays(columns, 20.0, UNITS, source="test.csv")


@pytest.mark.parametrize("figure", [slow("fig1"), slow("fig5"), "fig6"])
def test_gyro_and_accelerometer_are_drawn(tmp_path, figure):
    text, paths = reproduce_sensor(figure, tmp_path, seed=0, recordings=[recording()])
    assert "gyro_x" in text and "accel_z" in text
    assert [path.name for path in paths] == [f"{figure}.{end}" for end in ("txt", "png", "svg")]
    assert all(path.stat().st_size > 100 for path in paths)


def test_table_6_has_the_paper_beside_what_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr(sensor, "static_recording", lambda seed: recording(seed=seed))
    given = [recording(("gyro_x",), 5)]
    text, paths = reproduce_sensor("table6", tmp_path, seed=3, recordings=given)
    gyro, accel = text.split("accel_z")
    assert "test.csv" in gyro and "test.csv" not in accel
    for name, unit, paper in (("N", "deg/h/sqrt(Hz)", "140"), ("sigma_2", "deg/h", "65")):
        assert [name, unit, paper] in [line.split()[:3] for line in gyro.splitlines()]
    assert ["tau_2", "s", "500"] in [line.split()[:3] for line in accel.splitlines()]
    assert [path.name for path in paths] == ["table6.txt"]


def test_a_recording_without_either_channel_is_rejected(tmp_path):
    with pytest.raises(InputError, match="channels gyro_x and accel_z are missing"):
        reproduce_sensor("fig6", tmp_path, seed=0, recordings=[recording(("gyro_y",))])
