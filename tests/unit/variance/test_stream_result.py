"""What gaps do to the levels of a stream, from counts made by hand."""

import numpy as np
import pytest

from gmwm.variance import tuning
from gmwm.variance.gaps import spread_by_lengths, unmasked
from gmwm.variance.streaming import effects

J = 12
M = 2.0 ** np.arange(J)


def without(square, scarcity, gaps):
    """Variances of a stream with such gaps, and their change."""
    longest = tuning.LONGEST_WITHIN
    return unmasked(square, scarcity, lambda finer: spread_by_lengths(finer, gaps, 0.0, longest))


@pytest.mark.parametrize("length", [1, 4])
def test_of_white_noise_what_is_added_is_the_variance_of_the_samples_that_are_gone(length):
    gaps = np.array([[100, 100 * length]])
    truth, scarcity = 0.5 / M, 1e-3 / M
    found, change = without(truth + scarcity, scarcity, gaps)
    long = length < tuning.LONGEST_WITHIN * M
    assert np.any(long) and not np.all(long)
    np.testing.assert_allclose(found[long], truth[long], rtol=2e-2 if length == 1 else 5e-2)
    np.testing.assert_allclose(found[~long], (truth + scarcity)[~long])
    added = (truth + scarcity - found)[long]
    np.testing.assert_allclose(change[long] * found[long], added, rtol=1e-2)
    assert np.all(change[~long] == 0.0)


def test_without_gaps_nothing_is_added():
    none = np.zeros((20, 2), dtype=np.int64)
    found, change = without(1.0 / M, np.ones(J), none[:0])
    np.testing.assert_allclose(found, 1.0 / M)
    assert np.all(change == 0.0)
    n = 10_000
    step = np.maximum(M / tuning.STREAMING_STARTS, 1.0)
    windows = np.floor(n / step) - 2.0 * M / step + 1.0
    what = effects(n, 0, none, windows, np.zeros(J))
    np.testing.assert_allclose(what.inflation, 1.0)
    np.testing.assert_allclose(what.counts, windows * step)


def test_what_is_taken_off_leaves_a_part():
    square, gaps = 1.0 / M, np.array([[1000, 1000]])
    found, _ = without(square, 100.0 * np.ones(J), gaps)
    least = square / (1.0 + tuning.LARGEST_CHANGE)
    assert np.all(found >= least * (1.0 - 1e-12)) and np.any(np.isclose(found, least))
