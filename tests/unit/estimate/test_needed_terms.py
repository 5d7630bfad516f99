"""A term is needed where the model without it misses an averaging time, and only there."""

import pytest

import gmwm
from gmwm import GaussMarkov, RandomWalk, WhiteNoise

SLOW = WhiteNoise(1.0) + GaussMarkov(0.5, 20.0) + GaussMarkov(0.3, 600.0)


def fitted(model, truth, seed, n=20_000):
    return gmwm.fit(model, truth.simulate(n, 1.0, seed), 1.0)


@pytest.mark.parametrize("seed", [1, 3])
def test_a_slow_process_without_which_the_data_are_missed_is_not_redundant(seed):
    # Of 12 fits of the true model 11 were called not valid, 10 of them excluded without the term.
    fit = fitted(SLOW.opened(), SLOW, seed)
    smaller = gmwm.fit(WhiteNoise() + GaussMarkov(), fit.wv)
    assert smaller.goodness.loses_to(fit.goodness)
    assert fit.valid, fit.message


@pytest.mark.parametrize("seed", [4, 18])
def test_a_walk_without_which_the_data_are_missed_is_above_zero(seed):
    # Its own error grows with it: by that error none that is seen a few times is above zero.
    truth = WhiteNoise(1e-3) + RandomWalk(4e-6)
    fit = gmwm.fit(truth.opened(), truth.simulate(36_000, 0.1, seed), 0.1)
    assert fit.valid and not fit.upper_bounds
    low, high = fit.interval()["K"]
    assert 0.0 < low < 4e-6 < high


@pytest.mark.parametrize("seed", range(3))
def test_a_term_that_the_truth_does_not_have_stays_redundant(seed):
    truth = WhiteNoise(1.0) + GaussMarkov(0.5, 20.0)
    fit = fitted(WhiteNoise() + 2 * GaussMarkov(), truth, seed)
    assert "terms_needed" in fit.reasons
    assert gmwm.fit(truth.opened(), fit.wv).valid


def test_a_walk_that_the_truth_does_not_have_stays_bounded():
    for seed in range(4):
        fit = fitted(WhiteNoise() + RandomWalk(), WhiteNoise(1.0), seed)
        assert "K" in fit.upper_bounds and not fit.valid
