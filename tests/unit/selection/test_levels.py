"""Levels decide where the sum over all of them does not; ramp or walk."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, WhiteNoise
from gmwm.estimate.problem import Slope
from gmwm.selection.ties import loses_at_a_level, ramp_or_walk


def levels(p):
    return SimpleNamespace(goodness=SimpleNamespace(largest_p=p))


def test_a_smaller_model_loses_only_at_a_level_that_the_larger_one_keeps():
    assert loses_at_a_level(levels(0.002), levels(0.6))
    assert not loses_at_a_level(levels(0.3), levels(0.6))
    assert not loses_at_a_level(levels(0.002), levels(0.003))


@pytest.mark.parametrize("seed", [4, 18])
def test_a_walk_that_is_only_bounded_stays_where_the_model_without_it_misses_a_level(seed):
    """Without K the data exceed the model at the longest times, and the fit passed for valid."""
    x = (WhiteNoise(1e-3) + RandomWalk(4e-6)).simulate(36_000, 0.1, seed)
    selection = gmwm.select(x, dt=0.1)
    smaller = gmwm.fit(WhiteNoise(), selection.fit.wv)
    assert smaller.valid and smaller.goodness.largest_p < 0.01
    assert selection.fit.params["K"] > 0.0
    assert selection.fit.upper_bounds["K"] > 4e-6


def test_a_slope_that_a_walk_explains_as_well_is_reported_with_both_numbers():
    # 8 standard errors of a slope under white noise alone: K of 3.5e-6 does the same in an hour.
    slope = 8.0 * np.sqrt(12e-6 / 3600.0**3)
    truth = WhiteNoise(1e-3) + RateRamp(slope)
    fit = gmwm.select(truth.simulate(36_000, 0.1, 5000), dt=0.1).fit
    assert "R" not in fit.params
    (notice,) = (each for each in fit.notices if each.code == "ramp-or-walk")
    assert notice.values["slope"] == pytest.approx(slope, rel=0.5)
    assert notice.values["walk"] == fit.params["K"] > 0.0


def test_ramp_or_walk_names_the_slow_term():
    x = WhiteNoise(1e-3).simulate(2000, 0.1, 1)
    fit = gmwm.fit(WhiteNoise(), x, dt=0.1)
    slow = replace(fit, model=WhiteNoise(1e-3) + GaussMarkov(1e-4, 500.0))
    assert "Gauss-Markov term of tau = 500 s" in ramp_or_walk(slow, Slope(1e-7, 1e-16)).text
    assert "too slow" in ramp_or_walk(fit, Slope(1e-7, 1e-16)).text
