"""Where the time of a run goes."""

import numpy as np
import pytest

import gmwm
from gmwm.calibration import Stopwatch, stage


@pytest.fixture(scope="module")
def recording():
    rng = np.random.default_rng(1)
    channels = {f"gyro_{axis}": rng.normal(size=3000) for axis in "xy"}
    return gmwm.Recording.from_arrays(channels, 10.0, {"gyro": "deg/s"})


def test_stages_are_counted(recording):
    with Stopwatch().running() as watch:
        gmwm.calibrate(recording, gmwm.WhiteNoise())
    assert set(watch.elapsed) == set(watch.worked) == {"health", "variance", "model", "departures"}
    assert all(each > 0.0 for each in watch.elapsed.values())


def test_without_a_watch_nothing_is_counted():
    watch = Stopwatch()
    with watch.running(), stage("one"):
        pass
    with stage("two"):
        pass
    assert set(watch.elapsed) == {"one"}
