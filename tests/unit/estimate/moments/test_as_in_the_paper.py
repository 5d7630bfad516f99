"""Equation (9) to the letter: the ramp inside nu(theta), and searches from starting values."""

import numpy as np
import pytest

import gmwm
from gmwm import GMWM, GaussMarkov, InputError, RandomWalk, RateRamp, WhiteNoise
from marks import slow

TRUTH = WhiteNoise(0.2) + RandomWalk(0.02) + RateRamp(0.003)
SEEDS = range(12)


def series(seed, truth=TRUTH, n=6000):
    return truth.simulate(n, 1.0, np.random.default_rng([44, seed]))


@pytest.mark.parametrize("weights", ["data", slow("model")])
def test_a_ramp_in_the_moments_is_estimated_with_its_error(weights):
    """Of 12 intervals of 95 % fewer than 9 hold the truth once in 400 times."""
    method = GMWM(weights=weights, drift="moments")
    fits = [gmwm.fit(TRUTH.opened(), series(seed), 1.0, method=method) for seed in SEEDS]
    for key, value in TRUTH.params.items():
        held = [low <= value <= high for low, high in (fit.interval()[key] for fit in fits)]
        assert sum(held) >= 9, key
    assert sum(fit.valid for fit in fits) >= 11


def test_its_sign_is_that_of_the_mean_slope():
    found = gmwm.fit(TRUTH.opened(), -series(0), 1.0, method=GMWM(drift="moments"))
    mirrored = gmwm.fit(TRUTH.opened(), series(0), 1.0, method=GMWM(drift="moments"))
    assert found.params["R"] < 0.0
    assert found.params["R"] == pytest.approx(-mirrored.params["R"], rel=1e-6)
    assert found.keys == ("N", "K", "R")


def test_without_an_open_ramp_it_changes_nothing():
    for model in (WhiteNoise() + RandomWalk(), WhiteNoise() + RateRamp(0.003)):
        usual = gmwm.fit(model, series(1), 1.0)
        assert gmwm.fit(model, series(1), 1.0, method=GMWM(drift="moments")).params == usual.params


def test_a_wavelet_that_sees_no_drift_is_rejected():
    wv = gmwm.wavelet_variance(series(0), 1.0, wavelet="db2")
    with pytest.raises(InputError, match="does not see a drift"):
        gmwm.fit(TRUTH.opened(), wv, method=GMWM(drift="moments"))


SUM = WhiteNoise(0.8) + GaussMarkov(0.5, 125.0)


@pytest.mark.parametrize("start", [1.0, 30.0, SUM])
def test_a_start_leads_to_the_minimum_or_says_so(start):
    x = series(2, SUM)
    usual = gmwm.fit(SUM.opened(), x, 1.0)
    found = gmwm.fit(SUM.opened(), x, 1.0, method=GMWM(start=start))
    for key, error in usual.stderr.items():
        assert found.params[key] == pytest.approx(usual.params[key], abs=0.1 * error)
    assert found.valid


def test_a_start_in_another_valley_is_told():
    """Two processes that begin beyond all averaging times."""
    truth = GaussMarkov(1.0, 2.0) + GaussMarkov(1.0, 200.0)
    start = GaussMarkov(1e-6, 1e6) + GaussMarkov(1e-6, 1.001e6)
    found = gmwm.fit(truth.opened(), series(3, truth), 1.0, method=GMWM(start=start))
    (missed,) = (each for each in found.notices if each.code == "start-missed")
    assert missed.severity == "note"
    assert missed.values["objective"] > missed.values["least"]
    assert found.params["tau_1"] == pytest.approx(2.0, rel=0.5)


@pytest.mark.parametrize("start", [0.0, WhiteNoise(1.0), WhiteNoise() + GaussMarkov(1.0, 1.0)])
def test_a_start_that_is_none_is_rejected(start):
    with pytest.raises(InputError, match=r"start|out of range"):
        gmwm.fit(SUM.opened(), series(2, SUM), 1.0, method=GMWM(start=start))
