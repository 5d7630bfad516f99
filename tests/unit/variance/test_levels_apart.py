"""Gaps in which the level changes: nothing is filled across them."""

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, Resonance, WhiteNoise

N = 5000
NOISE = np.random.default_rng(0).standard_normal(N)


def masked(x, m):
    """Mean square of the Haar coefficients that no missing sample takes part in."""
    sums, gone = (
        np.concatenate([[0.0], np.cumsum(each)]) for each in (np.nan_to_num(x), np.isnan(x))
    )
    part = (2.0 * sums[m:-m] - sums[: -2 * m] - sums[2 * m :]) / (2.0 * m)
    return np.mean(part[gone[2 * m :] == gone[: -2 * m]] ** 2)


@pytest.mark.parametrize("half", [5, 50, 100])
@pytest.mark.parametrize("step", [100.0, -5.0])
def test_variances_are_those_of_what_exists(half, step):
    x = NOISE + np.where(np.arange(N) < N // 2, 0.0, step)
    x[N // 2 - half : N // 2 + half] = np.nan
    found = gmwm.wavelet_variance(x, dt=0.01)
    averaging = np.rint(found.tau / 0.01).astype(int)
    assert averaging[-1] == 1024  # half of the longest run
    assert found.variance == pytest.approx([masked(x, m) for m in averaging], rel=1e-9)


def test_the_other_gaps_are_filled():
    x = NOISE + np.where(np.arange(N) < 2000, 0.0, 30.0)
    x[1990:2010] = np.nan
    x[np.random.default_rng(1).random(N) < 0.01] = np.nan
    x[0], x[-1] = NOISE[0], NOISE[-1] + 30.0
    found = gmwm.wavelet_variance(x, dt=0.01)
    truth = 0.01 / (2.0 * found.tau)
    assert found.tau[-1] == 10.24
    assert found.variance[:10] == pytest.approx(truth[:10], rel=0.5)
    assert np.all(found.variance[10:] < 10.0 * truth[10:])  # of a step of 30: 1e4 and more


@pytest.mark.parametrize(
    "noise",
    [WhiteNoise(0.1) + RandomWalk(0.5), GaussMarkov(1.0, 0.2), WhiteNoise(0.1) + RateRamp(0.5),
     WhiteNoise(0.02) + Resonance(1.0, 10.0, 0.01)],
    ids=["N + K", "GM", "N + R", "resonance"],
)  # fmt: skip
def test_noise_is_not_taken_for_a_change(noise):
    for seed in range(5):
        rng = np.random.default_rng(seed)
        x = noise.simulate(N, 0.01, rng)
        x[1 + np.flatnonzero(rng.random(N - 2) < 0.01)] = np.nan
        x[1000:1100] = np.nan
        assert gmwm.wavelet_variance(x, dt=0.01).tau.size == 12  # as of a complete record


def test_a_calibration_names_the_step_and_its_curve_is_that_of_the_noise():
    x = 1e-3 * (NOISE + np.where(np.arange(N) < N // 2, 0.0, 20.0))
    x[N // 2 - 20 : N // 2 + 20] = np.nan
    rec = gmwm.Recording.from_arrays({"accel_x": x}, 100.0, {"accel": "m/s^2"})
    fit = gmwm.calibrate(rec, WhiteNoise())["accel_x"]
    assert "stationary" in fit.reasons
    assert fit.params["N"] == pytest.approx(1e-4, rel=0.04)
