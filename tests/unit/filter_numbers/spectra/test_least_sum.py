"""Small linear programs, against a general solver and by hand."""

import numpy as np
import pytest
from scipy.optimize import linprog

from gmwm.filter_numbers.spectra.dominance import least_sum


@pytest.mark.parametrize("m", [2, 3, 4])
def test_as_a_general_solver_finds(m):
    rng = np.random.default_rng(m)
    rows = 10.0 ** rng.uniform(-2.0, 2.0, (12, 40, m))
    least = np.where(np.arange(m) == 0, 0.01, 0.0)
    for own, found in zip(rows, least_sum(rows, least), strict=True):
        bounds = [(value, None) for value in least]
        peer = linprog(np.ones(m), -own, -np.ones(40), bounds=bounds, method="highs")
        assert np.sum(found) == pytest.approx(peer.fun, rel=1e-6)
        assert np.min(own @ found) > 1.0 - 1e-12
        assert np.all(found >= least)


def test_constraints_far_apart_hold_each_to_its_own_precision():
    """Of spectra that span twenty decades: x = (1, 1e-12) meets both exactly."""
    rows = np.array([[[1.0, 0.0], [0.0, 1e12]]])
    assert least_sum(rows, np.zeros(2))[0] == pytest.approx([1.0, 1e-12], rel=1e-12, abs=0.0)


def test_limits_alone_may_be_enough_and_a_row_of_zeros_cannot_be_met():
    rows = np.ones((2, 5, 2))
    rows[1, 3] = 0.0
    found = least_sum(rows, np.array([2.0, 0.0]))
    assert found[0] == pytest.approx([2.0, 0.0])
    assert np.all(np.isnan(found[1]))


def test_rows_that_are_all_the_same_do_not_go_round_in_circles():
    found = least_sum(np.ones((1, 300, 3)), np.zeros(3))
    assert np.sum(found) == pytest.approx(1.0)
