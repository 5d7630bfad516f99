"""Figures 1, 5 and 6 and Tables V and VI of one sensor, on short records."""

import numpy as np
import pytest

from gmwm import InputError, RandomWalk, Recording, WhiteNoise
from gmwm.study import reproduce_sensor
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


def test_a_recording_without_either_channel_is_rejected(tmp_path):
    with pytest.raises(InputError, match="channels gyro_x and accel_z are missing"):
        reproduce_sensor("fig6", tmp_path, seed=0, recordings=[recording(("gyro_y",))])
