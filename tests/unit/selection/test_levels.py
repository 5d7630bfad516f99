"""Levels decide where the sum over all of them does not; ramp or walk."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, WhiteNoise
from gmwm.estimate.problem.ramp import Slope
from gmwm.selection.ranking import candidate_of
from gmwm.selection.select import _choose
from gmwm.selection.ties import ramp_or_walk


@pytest.mark.parametrize("seed", [4, 18])
def test_a_walk_stays_where_the_model_without_it_misses_a_level(seed):
    """Without K the data exceed the model at the longest times, and the fit passed for valid."""
    x = (WhiteNoise(1e-3) + RandomWalk(4e-6)).simulate(36_000, 0.1, seed)
    fit = gmwm.select(x, dt=0.1).fit
    assert gmwm.fit(WhiteNoise(), fit.wv).goodness.loses_to(fit.goodness)
    assert fit.valid and fit.params["K"] > 0.0


def test_a_walk_that_predictions_of_minutes_feel_is_not_the_simpler_choice():
    """It ties with a Gauss-Markov process of 300 s under weights of its own, 68 % off at 1024 s."""
    x = (WhiteNoise(1.0) + GaussMarkov(0.3, 300.0)).simulate(8192, 1.0, 29)
    fit = gmwm.select(x, dt=1.0, max_gauss_markov=2).fit
    assert gmwm.fit(WhiteNoise() + RandomWalk(), fit.wv).goodness.is_poor
    assert fit.valid and set(fit.params) == {"N", "sigma", "tau"}


@pytest.mark.parametrize("seed", [8, 14, 16, 33])
def test_a_valid_model_is_chosen_although_one_that_is_not_has_the_better_criterion(seed):
    """White noise alone wins by 3 to 5, and misses a level that the slow term describes."""
    x = WhiteNoise(1e-4).simulate(60_000, 0.02, 900 + seed)
    x += GaussMarkov(2e-5, 10.0).simulate(60_000, 0.02, seed)
    chosen = gmwm.select(x, dt=0.02)
    assert chosen.fit.valid and chosen.chosen is not chosen.ranking[0]


def test_a_slope_that_a_walk_explains_as_well_is_reported_with_both_numbers():
    # 8 standard errors of a slope under white noise alone: K of 3.5e-6 does the same in an hour.
    slope = 8.0 * np.sqrt(12e-6 / 3600.0**3)
    truth = WhiteNoise(1e-3) + RateRamp(slope)
    fit = gmwm.select(truth.simulate(36_000, 0.1, 5000), dt=0.1).fit
    assert "R" not in fit.params
    (notice,) = (each for each in fit.notices if each.code == "ramp-or-walk")
    assert notice.values["slope"] == pytest.approx(slope, rel=0.5)
    assert notice.values["walk"] == fit.params["K"] > 0.0


@pytest.mark.parametrize("tau", [0.5, 500.0])
def test_ramp_or_walk_names_the_slow_term(tau):
    x = WhiteNoise(1e-3).simulate(2000, 0.1, 1)
    fit = gmwm.fit(WhiteNoise(), x, dt=0.1)
    slow = replace(fit, model=WhiteNoise(1e-3) + GaussMarkov(1e-4, tau))
    assert f"Gauss-Markov term of tau = {tau:g} s" in ramp_or_walk(slow, Slope(1e-7, 1e-16)).text
    assert "too slow" in ramp_or_walk(fit, Slope(1e-7, 1e-16)).text


@pytest.mark.parametrize(("unit", "shown"), [("V", "V/s from slow"), ("", "u/s from slow")])
def test_ramp_or_walk_has_the_unit_of_the_samples(unit, shown):
    x = WhiteNoise(1e-3).simulate(2000, 0.1, 1)
    fit = gmwm.fit(WhiteNoise(), gmwm.Channel("level", x, 0.1, None, unit))
    assert shown in ramp_or_walk(fit, Slope(1e-7, 1e-16)).text


def test_where_no_candidate_is_supported_the_part_that_is_takes_its_place():
    wv = gmwm.wavelet_variance(
        (WhiteNoise(1.0) + GaussMarkov(0.7, 30.0)).simulate(8192, 1.0, 3), dt=1.0
    )
    too_large = gmwm.fit(WhiteNoise() + GaussMarkov() + RandomWalk(), wv)
    assert not too_large.valid
    candidate, fit = _choose((candidate_of(too_large),), wv)
    assert fit.valid and candidate.model.title() == "white noise + Gauss-Markov"
