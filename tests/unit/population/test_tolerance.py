"""Tolerance limits: against published factors, and against what they promise."""

import numpy as np
import pytest
from scipy.stats import beta, norm

from gmwm.population import (
    content_of_largest,
    needed_units,
    one_sided_factor,
    rank_of_limit,
    rank_of_limits,
    two_sided_factor,
)

RUNS = 40_000


@pytest.mark.parametrize(
    ("n", "content", "confidence", "one", "two"),
    [
        # ISO 16269-6:2014, tables; Krishnamoorthy and Mathew (2009), tables B1 and B2
        (2, 0.95, 0.95, 26.260, 36.519),
        (5, 0.95, 0.95, 4.203, 5.077),
        (10, 0.95, 0.95, 2.911, 3.393),
        (20, 0.95, 0.95, 2.396, 2.760),
        (43, 0.90, 0.99, 1.8740, 2.2228),  # NIST e-Handbook, 7.2.6.3, the first
    ],
)
def test_factors_are_those_of_the_tables(n, content, confidence, one, two):
    assert one_sided_factor(n, content, confidence) == pytest.approx(one, rel=3e-4)
    assert two_sided_factor(n, content, confidence) == pytest.approx(two, rel=3e-4)


@pytest.mark.parametrize("n", [3, 8, 25])
def test_limits_hold_as_often_as_they_promise(n):
    rng = np.random.default_rng(n)
    x = rng.standard_normal((RUNS, n))
    mean, sd = x.mean(axis=1), x.std(axis=1, ddof=1)
    below = norm.cdf(mean + one_sided_factor(n) * sd)
    half = two_sided_factor(n) * sd
    inside = norm.cdf(mean + half) - norm.cdf(mean - half)
    bound = 4.0 * np.sqrt(0.95 * 0.05 / RUNS)
    assert abs(np.mean(below >= 0.95) - 0.95) < bound
    assert abs(np.mean(inside >= 0.95) - 0.95) < bound


def test_limits_of_any_distribution_take_59_and_93_units():
    assert (needed_units(), needed_units(0.9, 0.9)) == (59, 22)
    assert (rank_of_limit(58), rank_of_limit(59)) == (None, 1)
    assert (rank_of_limits(92), rank_of_limits(93)) == (None, 1)
    assert rank_of_limit(1) is rank_of_limits(1) is None
    assert content_of_largest(59) == pytest.approx(0.95, abs=1e-3)


@pytest.mark.parametrize("n", [59, 92, 93, 181, 1000])
def test_ranks_are_the_last_that_hold(n):
    """The r-th largest of uniform values has a beta distribution, and so has what lies between."""
    r = rank_of_limit(n)
    assert beta.sf(0.95, n - r + 1, r) >= 0.95 > beta.sf(0.95, n - r, r + 1)
    r = rank_of_limits(n)
    if r is not None:
        assert beta.sf(0.95, n - 2 * r + 1, 2 * r) >= 0.95 > beta.sf(0.95, n - 2 * r - 1, 2 * r + 2)
