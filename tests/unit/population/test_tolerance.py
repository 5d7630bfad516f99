"""Tolerance limits: against published factors, and against what they promise."""

import numpy as np
import pytest
from scipy.stats import beta, norm

from gmwm.population import needed_units
from gmwm.population.spread import one_sided_factor, rank_of_limit

RUNS = 40_000


@pytest.mark.parametrize(
    ("n", "content", "confidence", "one"),
    [
        # ISO 16269-6:2014, tables; Krishnamoorthy and Mathew (2009), tables B1 and B2
        (2, 0.95, 0.95, 26.260),
        (5, 0.95, 0.95, 4.203),
        (10, 0.95, 0.95, 2.911),
        (20, 0.95, 0.95, 2.396),
        (43, 0.90, 0.99, 1.8740),  # NIST e-Handbook, 7.2.6.3, the first
    ],
)
def test_factors_are_those_of_the_tables(n, content, confidence, one):
    assert one_sided_factor(n, content, confidence) == pytest.approx(one, rel=3e-4)


@pytest.mark.parametrize("n", [3, 8, 25])
def test_limits_hold_as_often_as_they_promise(n):
    rng = np.random.default_rng(n)
    x = rng.standard_normal((RUNS, n))
    mean, sd = x.mean(axis=1), x.std(axis=1, ddof=1)
    below = norm.cdf(mean + one_sided_factor(n) * sd)
    bound = 4.0 * np.sqrt(0.95 * 0.05 / RUNS)
    assert abs(np.mean(below >= 0.95) - 0.95) < bound


def test_a_limit_of_any_distribution_takes_59_units():
    assert (needed_units(), needed_units(0.9, 0.9)) == (59, 22)
    assert (rank_of_limit(58), rank_of_limit(59)) == (None, 1)
    assert rank_of_limit(1) is None


@pytest.mark.parametrize("n", [59, 92, 93, 181, 1000])
def test_ranks_are_the_last_that_hold(n):
    """The r-th largest of uniform values has a beta distribution."""
    r = rank_of_limit(n)
    assert beta.sf(0.95, n - r + 1, r) >= 0.95 > beta.sf(0.95, n - r, r + 1)
