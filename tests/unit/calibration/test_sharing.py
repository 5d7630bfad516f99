"""Slow errors that channels share: how often none pass for some, and what is said of them."""

import numpy as np
import pytest

import gmwm
from gmwm import Channel, GaussMarkov, Model, RandomWalk, Recording, WhiteNoise, wavelet_covariance
from gmwm.calibration.sharing import SHARED, sharing

DT = 0.25
MODELS = {
    "gyro_x": WhiteNoise(1.0) + GaussMarkov(0.5, 20.0),
    "gyro_y": WhiteNoise(2.0) + GaussMarkov(0.4, 100.0) + GaussMarkov(0.4, 10.0),
    "accel_x": WhiteNoise(1.0) + RandomWalk(0.03),
    "accel_y": Model((WhiteNoise(1.0),)),
}


def drawn(rng, n=4096):
    return [Channel(name, model.simulate(n, DT, rng), DT) for name, model in MODELS.items()]


def test_independent_channels_are_found_to_share_at_the_level_of_the_test():
    """Of 3 pairs in 60 recordings 5 %, with a standard error of 1.6 % or somewhat more."""
    rng = np.random.default_rng(1)
    found = [each for _ in range(60) for each in sharing(MODELS, wavelet_covariance(drawn(rng)))]
    assert len(found) == 180  # accel_y has no slow errors to share
    p_values = np.array([each.p_value for each in found])
    assert np.mean(p_values < 0.05) == pytest.approx(0.05, abs=0.045)
    assert np.mean(p_values) == pytest.approx(0.5, abs=0.09)


def test_the_correlation_of_shared_errors_is_found():
    rng, slow, estimates = np.random.default_rng(2), GaussMarkov(1.0, 20.0), []
    model = WhiteNoise(1.0) + slow
    for _ in range(20):
        common = slow.simulate(4096, DT, rng)
        own = [0.8 * common + 0.6 * slow.simulate(4096, DT, rng) for _ in range(2)]
        white = [WhiteNoise(1.0).simulate(4096, DT, rng) for _ in range(2)]
        channels = [Channel(n, s + w, DT) for n, s, w in zip("ab", own, white, strict=True)]
        (found,) = sharing(dict.fromkeys("ab", model), wavelet_covariance(channels))
        estimates.append(found.correlation)
    assert np.mean(estimates) == pytest.approx(0.64, abs=0.1)


def recording(rng, shared, n=20_000):
    slow = shared * GaussMarkov(0.01, 20.0).simulate(n, 0.1, rng)
    arrays = {
        name: slow
        + (WhiteNoise(0.01) + GaussMarkov(0.005, 20.0)).simulate(n, 0.1, rng)
        + (9.81 if name == "accel_z" else 0.0)
        for name in ("accel_x", "accel_y", "accel_z")
    }
    return Recording.from_arrays(arrays, 10.0, {"accel": "m/s^2"})


def test_a_calibration_names_the_channels():
    found = gmwm.calibrate(recording(np.random.default_rng(3), 1.0), "N + GM")
    (notice,) = [n for n in found.notices if n.code == SHARED]
    assert (notice.values["pairs"], notice.values["tested"]) == (3, 3)
    assert notice.values["correlation"] == pytest.approx(0.8, abs=0.15)
    assert notice.severity == "note" and "accel_x and accel_y (0." in notice.text
    alone = gmwm.calibrate(recording(np.random.default_rng(4), 0.0), "N + GM")
    assert not [n for n in alone.notices if n.code == SHARED]


def test_shared_vibration_is_no_shared_slow_error():
    rng, n = np.random.default_rng(5), 40_000
    vibration, slow = GaussMarkov(0.5, 0.5), RandomWalk(0.03)
    both, model = vibration.simulate(n, 0.1, rng), WhiteNoise(0.1) + vibration + slow
    for shared in (0.0, 0.8):
        common, channels = slow.simulate(n, 0.1, rng), []
        for name in "ab":
            own = RandomWalk(0.03 * np.sqrt(1.0 - shared**2))
            alone = (WhiteNoise(0.1) + own).simulate(n, 0.1, rng)
            channels.append(Channel(name, both + shared * common + alone, 0.1))
        (found,) = sharing(dict.fromkeys("ab", model), wavelet_covariance(channels))
        assert found.correlation == pytest.approx(shared**2, abs=4.0 * found.stderr)
        assert (found.p_value < 0.001) == (shared > 0.0)
