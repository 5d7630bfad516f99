"""Upper bounds hold, also for a walk that can hardly be seen."""

import numpy as np
import pytest
from scipy.stats import binom

import gmwm
from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.estimate.problem import Coordinates
from gmwm.estimate.result.bound import quantile_above_zero, upper_amplitude

MODEL = WhiteNoise() + RandomWalk()


@pytest.mark.parametrize("walk", [5e-4, 1e-3, 1.7e-3])
def test_bounds_of_a_walk_near_the_threshold_lie_above_it(walk):
    # Under the noise without the walk 30, 26 and 16 of 100 bounds lay below.
    runs, below = 60, 0
    truth = WhiteNoise(1.0) + RandomWalk(walk)
    for seed in range(runs):
        fit = gmwm.fit(MODEL, truth.simulate(20_000, 1.0, seed), 1.0)
        below += fit.upper_bounds.get("K", np.inf) < walk
    assert below <= binom.isf(1e-3, runs, 0.05)


def bound(centre, deviation, at):
    processes = (WhiteNoise(1.0), RandomWalk(1e-3))
    return upper_amplitude(Coordinates(MODEL), processes, 1, centre, deviation, at, 20_000, 1.0)


def test_it_is_no_lower_than_under_the_noise_alone():
    for centre in (-1e-6, 0.0, 1e-6):
        assert bound(centre, 5e-7, 0.0) > quantile_above_zero(centre, 5e-7)


def test_it_rises_with_the_estimate_and_its_error():
    bounds = [bound(centre, 5e-7, 0.0) for centre in (-1e-6, 0.0, 5e-7, 1e-6)]
    assert bounds == sorted(bounds)
    assert bound(0.0, 1e-6, 0.0) > bound(0.0, 5e-7, 0.0)


def test_the_error_of_white_noise_hardly_grows():
    coordinates = Coordinates(GaussMarkov() + WhiteNoise())
    processes = (GaussMarkov(1.0, 20.0), WhiteNoise(1e-3))
    found = upper_amplitude(coordinates, processes, 1, 0.0, 1e-4, 0.0, 20_000, 1.0)
    assert found == pytest.approx(quantile_above_zero(0.0, 1e-4), rel=0.25)


def test_what_nothing_bounds_stays_infinite():
    assert bound(0.0, np.inf, 0.0) == np.inf
