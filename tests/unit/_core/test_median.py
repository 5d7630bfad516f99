"""The median by one partial sort."""

import numpy as np
import pytest

from gmwm._core.typing import median


@pytest.mark.filterwarnings("ignore:Mean of empty slice", "ignore:invalid value")
@pytest.mark.parametrize("n", [0, 1, 2, 3, 10, 101, 5000])
@pytest.mark.parametrize("missing", [0, 1, 3])
@pytest.mark.parametrize("digits", [0, 12])
def test_it_is_that_of_numpy_bit_for_bit(n, missing, digits):
    values = np.random.default_rng(n).normal(size=n).round(digits)
    values[:missing] = np.nan
    before = values.copy()
    assert np.array_equal(median(values), np.median(values), equal_nan=True)
    np.testing.assert_array_equal(values, before)
    assert np.array_equal(median(values, overwrite=True), np.median(before), equal_nan=True)
