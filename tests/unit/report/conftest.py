"""One small calibration for every test of the page."""

import numpy as np
import pytest

import gmwm
from gmwm import Channel, QuantizationNoise, RandomWalk, Recording, WhiteNoise
from gmwm.issues import Notice

DT = 0.01
WALK = WhiteNoise(4e-4) + RandomWalk(3e-4)


def channel(name, values, quantity):
    unit = {"gyro": "rad/s", "accel": "m/s^2"}.get(quantity, "V")
    return Channel(name, values, DT, quantity, unit)


@pytest.fixture(scope="session")
def recording():
    rng = np.random.default_rng(4)
    n = 8000
    white = WhiteNoise(1e-3)
    return Recording(
        (
            channel("gyro_x", WALK.simulate(n, DT, rng), "gyro"),
            channel("gyro_y", np.zeros(n), "gyro"),
            channel("accel_x", white.simulate(n, DT, rng), "accel"),
            channel("voltage", white.simulate(n, DT, rng), None),
        ),
        source="bench.csv",
        notices=(Notice("columns-not-used", "note", "", "column not used: 'temp'"),),
    )


@pytest.fixture(scope="session")
def calibration(recording):
    models = {
        "gyro_x": WALK.opened(),
        "gyro_y": WhiteNoise(1e-3),
        "accel_x": WhiteNoise() + QuantizationNoise() + RandomWalk(),
        "voltage": WhiteNoise(),
    }
    return gmwm.calibrate(recording, models)
