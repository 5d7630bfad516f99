"""Upper bounds hold, also for a walk that can hardly be seen."""

import numpy as np
import pytest
from scipy.stats import binom

import gmwm
from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.estimate.problem.parameters import Coordinates
from gmwm.estimate.result.bound import quantile_above_zero, upper_amplitude
from marks import slow

MODEL = WhiteNoise() + RandomWalk()
WV = gmwm.wavelet_variance(WhiteNoise(1.0).simulate(20_000, 1.0, 1), 1.0)


@pytest.mark.parametrize("walk", [1e-3, slow(5e-4), slow(1.7e-3)])
def test_bounds_of_a_walk_near_the_threshold_lie_above_it(walk):
    # Under the noise without the walk 30, 26 and 16 of 100 bounds lay below.
    runs, below = 15, 0
    truth = WhiteNoise(1.0) + RandomWalk(walk)
    for seed in range(runs):
        fit = gmwm.fit(MODEL, truth.simulate(20_000, 1.0, seed), 1.0)
        below += fit.upper_bounds.get("K", np.inf) < walk
    assert below <= binom.isf(1e-3, runs, 0.05)


def bound(centre, deviation, at):
    processes = (WhiteNoise(1.0), RandomWalk(1e-3))
    return upper_amplitude(Coordinates(MODEL), processes, 1, (centre, deviation, at), WV)


def test_it_is_no_lower_than_under_the_noise_alone():
    for centre in (-5e-8, 0.0, 5e-8):
        assert bound(centre, 3e-8, 0.0) > quantile_above_zero(centre, 3e-8)


def test_it_rises_with_the_estimate_and_its_error():
    # White noise beside a slow process: its error hardly grows with it.
    x = (GaussMarkov(1.0, 20.0) + WhiteNoise(0.1)).simulate(20_000, 1.0, 1)
    wv = gmwm.wavelet_variance(x, 1.0)
    coordinates = Coordinates(GaussMarkov() + WhiteNoise())
    processes = (GaussMarkov(1.0, 20.0), WhiteNoise(1e-3))

    def of(centre, deviation):
        return upper_amplitude(coordinates, processes, 1, (centre, deviation, 0.0), wv)

    bounds = [of(centre, 1e-4) for centre in (-1e-4, 0.0, 1e-4, 3e-4)]
    assert bounds == sorted(set(bounds))
    assert of(0.0, 2e-4) > 1.5 * of(0.0, 1e-4)
    assert of(0.0, 1e-4) == pytest.approx(quantile_above_zero(0.0, 1e-4), rel=0.25)


def test_what_stands_in_for_a_term_leaves_it_no_more_than_the_data():
    # A fast Gauss-Markov process and white noise: neither is excluded beside the other.
    for seed in range(4):
        truth = GaussMarkov(1.0, 0.2)
        fit = gmwm.fit(WhiteNoise() + GaussMarkov(), truth.simulate(2000, 1.0, seed), 1.0)
        for key, bound in fit.upper_bounds.items():
            term = WhiteNoise(bound) if key == "N" else GaussMarkov(bound, fit.params["tau"])
            assert np.isfinite(bound)
            assert np.all(term.haar_variance(fit.wv.tau, 1.0) < 2.0 * fit.wv.upper)


def test_what_the_fit_does_not_bound_is_bounded_by_the_data():
    assert 0.0 < bound(0.0, np.inf, 0.0) < 0.1
