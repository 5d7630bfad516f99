"""Random walks that a record leaves open."""

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.calibration.channel import UNRESOLVED, with_largest_walk
from marks import every

N, RATE = 1e-4, 100.0


def recorded(truth, n=180_000, seed=1):
    x = truth.simulate(n, 1 / RATE, seed=seed)
    return gmwm.Recording.from_arrays({"gyro_x": x}, RATE, {"gyro": "rad/s"})


def told(calibration):
    return [notice for notice in calibration.notices if notice.code == UNRESOLVED]


@pytest.mark.parametrize(
    "slow", every(2, [RandomWalk(3e-7), GaussMarkov(6e-6, 2000.0)]), ids=["walk", "Gauss-Markov"]
)
def test_slow_noise_that_is_not_seen_lies_within_the_interval_of_rivals(slow):
    truth = WhiteNoise(N) + slow
    tau = np.array([60.0, 600.0])
    there = np.sqrt(2.0 * truth.haar_variance(tau, 1 / RATE))
    missed = 0
    for seed in range(4):
        found = gmwm.calibrate(recorded(truth, seed=seed))
        _, lower, upper = found["gyro_x"].deviation_interval(
            tau, 0.95, found.rivals.get("gyro_x", ())
        )
        missed += not np.all((lower < there) & (there < upper))
    assert missed <= 1  # of 4 with a chance of 0.05 each: two come once in 71 such tests


def test_the_notice_says_how_large_it_may_be():
    found = gmwm.calibrate(recorded(WhiteNoise(N)))
    fit, (largest,) = found["gyro_x"], found.rivals["gyro_x"]
    (notice,) = told(found)
    assert (notice.severity, notice.where) == ("note", "gyro_x")
    assert fit.model.title() == "white noise"
    assert largest.title() == "white noise + random walk"
    assert notice.values["K"] == largest.params["K"] > 0.0
    ratio = largest.haar_variance(np.array([600.0]), 0.01) / fit.model.haar_variance(
        np.array([600.0]), 0.01
    )
    assert notice.values["growth"] == pytest.approx(np.sqrt(float(ratio[0])))
    assert f"{notice.values['K'] * 180 / np.pi * 3600 * 60:.2g} deg/h/sqrt(h)" in notice.text
    again = gmwm.Calibration.from_dict(found.to_dict())
    assert again.rivals == found.rivals and again.notices == found.notices
    shown = f"{notice.values['K'] * 180 / np.pi * 3600 * 60:.2g} deg/h/sqrt(h)"
    assert shown in notice.text


def test_nothing_is_told_where_a_walk_is_known_or_would_not_matter():
    walk = gmwm.calibrate(recorded(WhiteNoise(N) + RandomWalk(5e-6)))
    assert walk["gyro_x"].params["K"] > 0.0 and not told(walk)
    given = gmwm.calibrate(recorded(WhiteNoise(N)), WhiteNoise())
    assert not told(given) and not given.rivals
    # Ten days at 1 Hz.
    long = gmwm.wavelet_variance(WhiteNoise(N).simulate(864_000, 1.0, seed=3), 1.0)
    assert with_largest_walk(gmwm.fit(WhiteNoise(), long)) is None
    ramp = gmwm.fit(WhiteNoise() + gmwm.RateRamp(), long)
    assert with_largest_walk(ramp) is None
