"""Where searches begin: terms of many shapes have several minima, and only one is the lowest."""

import numpy as np
import pytest

import gmwm
from gmwm import ARMA, GaussMarkov
from gmwm.process import as_model
from marks import slow

TRUTH = ARMA([1.2, -0.5], [0.4], 1.0)


@pytest.mark.parametrize("seed", [0, slow(4), slow(7)])
def test_a_right_model_of_many_shapes_is_found_from_any_series(seed):
    """The shape on the grid that fits best lies in the valley of another minimum, ma_1 = 1."""
    x = TRUTH.simulate(20_000, 1.0, seed=seed)
    fit = gmwm.fit(as_model(TRUTH).opened(), x, 1.0)
    assert fit.valid and fit.discrepancy == 0.0
    lower, upper = fit.interval(0.999)["ma_1"]
    assert lower < 0.4 < upper < 0.9


def of_sum(terms, orders):
    shape = ARMA(*orders).shape_of_sum(terms, 1.0)
    return ARMA(shape[: orders[0]], shape[orders[0] :], 1.0)


@pytest.mark.parametrize(
    ("terms", "orders"),
    [
        ([GaussMarkov(1.0, 125.0), GaussMarkov(2.0, 20.0), GaussMarkov(3.0, 0.5)], (3, 2)),
        ([GaussMarkov(1.0, 125.0), GaussMarkov(0.0, 20.0), GaussMarkov(3.0, 0.5)], (3, 3)),
        ([GaussMarkov(1e-3, 30.0), GaussMarkov(2.0, 5.0)], (2, 1)),
    ],
)
def test_the_ARMA_form_of_a_sum_has_its_autocovariance(terms, orders):
    lag = np.arange(60)
    whole = sum(term.autocovariance(lag, 1.0) for term in terms)
    found = of_sum(terms, orders).autocovariance(lag, 1.0)
    assert found / found[0] == pytest.approx(whole / whole[0], rel=1e-8)


@pytest.mark.slow
def test_an_ARMA_is_fitted_as_well_as_the_sum_that_it_nests():
    """Section IV-C of Stebler et al. (2012): the objective was 115 beside 10.5, with 17 notices."""
    sigma2, beta = (2.5e-6, 4.5e-6, 29.5e-6), (0.008, 0.05, 2.0)
    terms = [GaussMarkov(np.sqrt(s), 1.0 / b) for s, b in zip(sigma2, beta, strict=True)]
    x = gmwm.simulate(sum(terms[1:], terms[0]), n=200_000, dt=1.0, seed=1)
    wv = gmwm.wavelet_variance(x, 1.0)
    nested, fit = (gmwm.fit(model, wv) for model in (3 * GaussMarkov(), ARMA(3, 2)))
    assert fit.objective == pytest.approx(nested.objective, rel=1e-3)
    assert fit.valid and len(fit.notices) <= 2
