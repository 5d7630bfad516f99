"""The level of discrepancy: when it starts and what it is."""

import numpy as np
import pytest

from gmwm.estimate.moments.weights import Discrepancy, moment_estimate
from gmwm.estimate.problem.moments import Compared

LEVELS = 12
TARGET = 2.0 ** -np.arange(LEVELS)
COVARIANCE = np.diag((0.01 * TARGET) ** 2)


def compared(residual):
    return Compared(TARGET, TARGET - residual, COVARIANCE, TARGET, np.zeros(LEVELS))


@pytest.mark.parametrize("delta", [0.02, 0.1, 1.0])
def test_it_is_what_makes_the_sum_of_squares_its_degrees_of_freedom(delta):
    # Residuals of one size in units of the error that the discrepancy would give.
    dof = 9
    size = np.sqrt(dof / LEVELS) * np.hypot(0.01, delta)
    residual = size * TARGET * np.where(np.arange(LEVELS) % 2, 1.0, -1.0)
    found = moment_estimate(compared(residual), dof)
    assert found == pytest.approx(delta, rel=1e-4)


def test_none_where_chance_explains_the_residuals():
    residual = 0.01 * TARGET * np.sqrt(9 / LEVELS)
    assert moment_estimate(compared(0.999 * residual), 9) == 0.0
    assert 0.0 < moment_estimate(compared(1.01 * residual), 9) < 0.01
    assert moment_estimate(compared(1e3 * TARGET), 9) == pytest.approx(10.0)


def update(each, size):
    residual = size * TARGET * np.where(np.arange(LEVELS) % 2, 1.0, -1.0)
    return each.update(compared(residual), 9)


def test_it_starts_where_the_residuals_are_no_chance_and_settles():
    each = Discrepancy(None, True)
    assert not update(each, 0.01) and each.value == 0.0
    assert update(each, 0.1)
    first = each.value
    assert first == pytest.approx(np.sqrt(LEVELS / 9) * 0.1, rel=0.01)
    assert not update(each, 0.1) and each.value == pytest.approx(first)


@pytest.mark.parametrize(("given", "over"), [(0.05, True), (0.0, True), (None, False)])
def test_one_that_is_given_or_not_known_stays(given, over):
    each = Discrepancy(given, over)
    assert not update(each, 0.3)
    each.start_at(0.5)
    assert each.value == (given or 0.0)


def test_it_starts_at_what_was_found_elsewhere_if_that_is_notable():
    for value, taken in ((0.015, 0.0), (0.03, 0.03)):  # the grid of a mixture is as far off as 2 %
        each = Discrepancy(None, True)
        each.start_at(value)
        assert each.value == taken
