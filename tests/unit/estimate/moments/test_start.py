"""Where searches begin: terms of many shapes have several minima, and only one is the lowest."""

import pytest

import gmwm
from gmwm import ARMA
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
