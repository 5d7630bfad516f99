"""Terms too faint to be chosen: what the data leave open is covered, and no more than that."""

from functools import cache

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.estimate import left_open

TRUTH = WhiteNoise(1.22e-4) + GaussMarkov(2e-5, 8.0) + RandomWalk(1.5e-6)
DT, SAMPLES = 0.05, 36_000


@cache
def selected(seed):
    """A selection of half an hour in which the Gauss-Markov term is too faint to be chosen."""
    return gmwm.select(gmwm.wavelet_variance(TRUTH.simulate(SAMPLES, DT, seed), DT))


@pytest.fixture(scope="module")
def chosen():
    return [selected(seed) for seed in range(5)]


@pytest.mark.slow
def test_intervals_of_a_selected_model_hold_a_term_too_faint_to_be_chosen():
    """Those of the model and its rivals alone hold the truth in two of three records."""
    tau = np.array([5.0, 20.0])
    true = np.sqrt(2.0 * TRUTH.haar_variance(tau, DT))
    held = np.zeros(2)
    for each in map(selected, range(16)):
        _, low, high = each.fit.deviation_interval(tau, rivals=[r.model for r in each.rivals])
        held += (low <= true) & (true <= high)
    assert np.all(held >= 14)  # of 16 at 95 %: less once in twenty


def test_numbers_of_a_level_dominate_a_term_too_faint_to_be_chosen(chosen):
    """Those of the confidence region alone lay below the truth in 19 of 20 records."""
    tau = np.geomspace(6.0, 60.0, 5)
    need = TRUTH.haar_variance(tau, DT)
    bounds = (gmwm.bound(each.fit, horizon=60.0, level=0.95).model for each in chosen[:3])
    assert all(np.all(model.haar_variance(tau, DT) >= need) for model in bounds)


@pytest.mark.parametrize(("level", "squared"), [(0.68, 0.989), (0.95, 3.841)])
def test_they_are_as_far_from_the_data_as_the_level_allows(chosen, level, squared):
    """Their chi-square exceeds that of the fit by the quantile squared, or less if held back."""
    rises = []
    for fit in (each.fit for each in chosen):
        at = fit.moments
        models = left_open(fit, level)
        assert len(models) >= 10
        rest = [at.target - at.scales.curve(model) for model in (fit.model, *models)]
        first, *others = (each @ np.linalg.solve(at.covariance, each) for each in rest)
        rises.append(max(others) - first)
    assert np.max(rises) == pytest.approx(squared, rel=0.2)
    assert np.count_nonzero(np.array(rises) > 0.5 * squared) >= 3


def test_a_parameter_that_changes_nothing_leaves_an_interval():
    """As the bandwidth of a low-pass above half the sampling rate; the matrix was singular."""
    x = np.random.default_rng(4320).normal(0.0, 1e-3, (446, 600))[-1]
    found = gmwm.select(x, 0.1).fit
    value, low, high = found.deviation_interval(found.wv.tau, rivals=())
    assert np.all((low > 0.0) & (low <= value) & (value <= high) & np.isfinite(high))
