"""Channels that no sensor should give: reported or skipped, and the others are as they were."""

import numpy as np
import pytest

import gmwm
from marks import every

N = 4096
K = np.arange(N)
RNG = np.random.default_rng(4)
USUAL = 1e-3 * RNG.normal(size=N)
ODD = {
    "square wave": np.where(K // 32 % 2, 1.0, -1.0),
    "fast square wave": np.where(K // 2 % 2, 1.0, -1.0),
    "twenty decades": 10.0 ** RNG.uniform(-10, 10, N),
    "tiny": 1e-200 * RNG.normal(size=N),
    "denormal": 5e-324 * RNG.integers(-3, 4, N),
    "huge": 1e140 * RNG.normal(size=N),
    "constant": np.full(N, 1e-300),
    "alternating": np.where(K % 2, 1.0, -1.0),
    "one spike": np.where(K == 2000, 1.0, 0.0),
    "one huge spike": np.where(K == 2000, 1e100, 0.0),
    "line": np.sin(0.1 * K),
    "half dead": np.where(K < N // 2, 0.0, RNG.normal(size=N)),
    "mostly missing": np.where(K % 3, np.nan, RNG.normal(size=N)),
}


def recording(odd):
    arrays = {"gyro_y": USUAL} | ({} if odd is None else {"gyro_x": odd})
    return gmwm.Recording.from_arrays(arrays, 100.0, {"gyro": "rad/s"})


@pytest.fixture(scope="module")
def alone():
    given = recording(None)
    return gmwm.health(given), gmwm.calibrate(given, gmwm.WhiteNoise())


@pytest.mark.parametrize("name", every(3, ODD))
@pytest.mark.filterwarnings("ignore::gmwm.errors.FitWarning")
def test_the_others_are_as_they_were(name, alone):
    given = recording(ODD[name])
    examined, calibrated = alone
    found = gmwm.health(given)
    assert found.channels["gyro_y"] == examined.channels["gyro_y"]
    fits = gmwm.calibrate(given, gmwm.WhiteNoise())
    assert fits["gyro_y"].params == calibrated["gyro_y"].params
    assert str(found)
    assert str(fits)
    if "gyro_x" not in fits:
        assert fits.skipped["gyro_x"].text


@pytest.mark.parametrize("name", ["tiny", "denormal", "huge", "one huge spike"])
def test_what_no_sensor_gives_is_reported(name):
    found = gmwm.health(recording(ODD[name]))
    (notice,) = found.of("gyro_x")
    assert (notice.code, notice.severity) == ("size", "bad")
    assert notice.values["spread"] == pytest.approx(np.ptp(ODD[name]))
