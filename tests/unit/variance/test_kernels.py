"""Hot loops of the wavelet variance against plain numpy, at sizes about those of their pieces."""

import math

import numpy as np
import pytest

from gmwm.variance.kernels import cumulative, difference_powers, slope, survey
from gmwm.variance.levels import haar_coefficients, haar_moments

SIZES = [1, 2, 3, 255, 1023, 1024, 1025, 2600]


def series(n, gaps=True):
    rng = np.random.default_rng(n)
    values = rng.normal(3.0, 1.0, n)
    if gaps and n > 2:
        values[rng.random(n) < 0.2] = np.nan
    return values


@pytest.mark.parametrize("n", SIZES)
def test_a_survey_is_the_count_sum_and_range_of_what_exists(n):
    values = series(n)
    found = survey(values)
    there = values[~np.isnan(values)]
    expected = (n - there.size, np.sum(there), np.min(there), np.max(there))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("n", SIZES)
def test_powers_of_first_differences(n):
    values = series(n)
    steps = np.diff(values)
    steps = steps[~np.isnan(steps)]
    expected = (steps.size, np.sum(steps**2), np.sum(steps**4))
    np.testing.assert_allclose(difference_powers(values), expected, rtol=1e-12)


@pytest.mark.parametrize("n", SIZES)
def test_a_cumulative_sum_passes_over_what_is_missing(n):
    values = series(n)
    expected = np.concatenate([[0.0], np.nancumsum(values - 2.0)])
    np.testing.assert_allclose(cumulative(values, 2.0), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("parts", [[0], [0, 700], [0, 1, 1300, 2599]])
def test_one_slope_through_parts_of_levels_of_their_own(parts):
    values = series(2600)
    place = np.arange(values.size, dtype=float)
    own = np.searchsorted(parts, place, side="right")
    regressors = np.column_stack([place, *(own == k for k in range(1, len(parts) + 1))])
    there = ~np.isnan(values)
    expected = np.linalg.lstsq(regressors[there], values[there], rcond=None)[0][0]
    assert slope(values, np.array(parts)) == pytest.approx(expected, rel=1e-9)
    assert slope(values[:1], np.array([0])) == 0.0


@pytest.mark.parametrize(
    "ends", [[(0, 5000)], [(3, 40), (47, 2046), (2050, 9000)], [(7, 8), (9, 73)]]
)
def test_moments_are_those_of_the_coefficients_of_each_run(ends):
    runs = np.array(ends)
    integral = cumulative(series(runs[-1, 1] + 9, gaps=False), 3.0)
    longest = int(np.max(runs[:, 1] - runs[:, 0]))
    averaging = 2 ** np.arange(longest.bit_length() - 1)
    expected = []
    for m in averaging.tolist():
        w = np.concatenate([haar_coefficients(integral, a, b, m) for a, b in ends])
        expected.append((np.mean(w), np.mean(w**2)))
    found = haar_moments(integral, runs, averaging.astype(float))
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-14)


def test_a_cumulative_sum_is_right_to_the_last_digit():
    """In numpy's, 56 units of the last digit are lost at the end."""
    values = np.random.default_rng(0).uniform(0.5, 1.5, 200 * 1024 + 700)
    found = cumulative(values, 0.0)
    for place in (1, 256, 257, 1025, 5000, 100 * 1024 + 300, 200 * 1024, values.size):
        exact = math.fsum(values[:place])
        assert abs(found[place] - exact) <= np.spacing(exact)
