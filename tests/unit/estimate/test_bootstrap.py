"""Parametric bootstrap of the method of moments."""

import numpy as np
import pytest
from scipy.stats import kstest

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, WhiteNoise

TRUTH = WhiteNoise(1.0) + GaussMarkov(0.7, 40.0)


@pytest.fixture(scope="module")
def fit():
    return gmwm.fit(TRUTH.opened(), TRUTH.simulate(50_000, 1.0, 1), dt=1.0)


def test_estimates_scatter_as_their_standard_errors_say(fit):
    drawn = gmwm.bootstrap(fit, runs=400, seed=1)
    assert drawn.keys == ("N", "sigma", "tau")
    for key, error in fit.stderr.items():
        # A standard deviation of 400 draws is known to 3.5 %; tau is a little skew.
        assert drawn.stderr[key] == pytest.approx(error, rel=0.2)
        low, high = drawn.interval()[key]
        assert (low, high) == pytest.approx(fit.interval()[key], abs=0.6 * error)


@pytest.mark.slow
def test_drawn_variances_give_what_simulated_series_give():
    fit = gmwm.fit(TRUTH.opened(), TRUTH.simulate(4000, 1.0, 2), dt=1.0)
    fast = gmwm.bootstrap(fit, runs=300, seed=1)
    rng = np.random.default_rng(1)
    series = [fit.model.simulate(4000, 1.0, rng) for _ in range(30)]
    full = [gmwm.fit(TRUTH.opened(), x, dt=1.0).params for x in series]
    for k, key in enumerate(fast.keys):
        a, b = np.log(fast.draws[:, k]), np.log([params[key] for params in full])
        # Standard deviations of 30 and 300 draws: 13 % and 4 %, more where they are skew.
        assert np.std(a) == pytest.approx(np.std(b), rel=0.4)
        assert abs(np.mean(a) - np.mean(b)) < 4.0 * np.std(b) / np.sqrt(30)


def test_all_recordings_of_a_joint_fit_are_drawn():
    white = WhiteNoise(2.0)
    fit = gmwm.fit(WhiteNoise(), [white.simulate(n, 1.0, n) for n in (500, 9500)], 1.0)
    drawn = gmwm.bootstrap(fit, runs=100, seed=1)
    # Of the first recording alone it would be 4.5 times as large; 100 draws know it to 7 %.
    assert drawn.stderr["N"] == pytest.approx(fit.stderr["N"], rel=0.3)


def test_a_ramp_is_drawn_too():
    truth = TRUTH + RateRamp(1e-3)
    fit = gmwm.fit(truth.opened(), truth.simulate(10_000, 1.0, 3), dt=1.0)
    drawn = gmwm.bootstrap(fit, runs=100)
    assert drawn.stderr["R"] == pytest.approx(fit.stderr["R"], rel=0.3)


def test_the_same_seed_gives_the_same_draws(fit):
    a, b, c = (gmwm.bootstrap(fit, runs=5, seed=s).draws for s in (1, 1, 2))
    np.testing.assert_array_equal(a, b)
    assert np.any(a != c)


def test_given_parameters_are_not_drawn():
    model = WhiteNoise() + GaussMarkov(tau=40.0)
    fit = gmwm.fit(model, TRUTH.simulate(5000, 1.0, 1), dt=1.0)
    assert gmwm.bootstrap(fit, runs=3).keys == ("N", "sigma")


def test_p_values_of_a_needless_term_are_not_small():
    """Under the smaller model they are uniform, but for the lump at one of no gain at all."""
    p_values = []
    for seed in range(30):
        fit = gmwm.fit(WhiteNoise(), WhiteNoise(1.0).simulate(4096, 1.0, seed), dt=1.0)
        p_values.append(gmwm.bootstrap_test(fit, WhiteNoise() + RandomWalk(), runs=39))
    assert kstest(p_values, "uniform", alternative="greater").pvalue > 1e-3


def test_a_term_that_is_there_is_needed(fit):
    small = gmwm.fit(WhiteNoise(), fit.wv)
    assert gmwm.bootstrap_test(small, TRUTH.opened(), runs=39) == 1 / 40
    assert gmwm.bootstrap_test(fit, WhiteNoise() + 2 * GaussMarkov(), runs=39) > 1 / 40


def test_bad_input(fit):
    with pytest.raises(gmwm.InputError, match="2 or more"):
        gmwm.bootstrap(fit, runs=1)
    with pytest.raises(gmwm.InputError, match="between 0 and 1"):
        gmwm.bootstrap(fit, runs=2).interval(95)
    with pytest.raises(gmwm.InputError, match="give a model with more terms"):
        gmwm.bootstrap_test(fit, WhiteNoise())
    exact = gmwm.fit(WhiteNoise(), WhiteNoise(1.0).simulate(100, 1.0, 1), dt=1.0, method="mle")
    with pytest.raises(gmwm.InputError, match="fit by method='gmwm'"):
        gmwm.bootstrap(exact)
