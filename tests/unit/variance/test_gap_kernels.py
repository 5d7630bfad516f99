"""Hot loops of series with gaps against plain loops."""

import numpy as np
import pytest

from gmwm.variance.gaps import window_centres, window_count
from gmwm.variance.kernels import cumulative, masked_coefficients
from gmwm.variance.stream_kernels import (
    COUNT,
    FINE,
    FOURTH,
    LOST_FOURTH,
    LOST_MEAN,
    LOST_SQUARE,
    MEAN,
    SCARCITY,
    SQUARE,
    complete_windows,
    gappy_windows,
    sum_of,
)
from gmwm.variance.streaming import _Series


def windows_of(values, present, m):
    """Haar coefficients of neighbouring means of what is there, by a loop."""
    for t in range(values.size - 2 * m + 1):
        first, second = slice(t, t + m), slice(t + m, t + 2 * m)
        yield t, values[first], present[first], values[second], present[second]


@pytest.mark.parametrize(("number", "new"), [(70, 0), (70, 40), (9, 3), (3, 0)])
def test_windows_of_a_complete_row(number, new):
    values = np.random.default_rng(3).normal(size=number)
    found = _Series().sums
    complete_windows(values, new, 0, found, np.empty((2, number)))
    sums = found.levels
    for level in range(FINE):
        m = 2**level
        w = np.array([
            0.5 * (np.mean(b) - np.mean(a))
            for t, a, _, b, _ in windows_of(values, values, m) if t + 2 * m - 1 >= new
        ])  # fmt: skip
        assert sums[level, COUNT] == w.size
        found = sums[level, MEAN] + sums[level, LOST_MEAN]
        assert found == pytest.approx(np.sum(w), abs=1e-12)
        found = sums[level, SQUARE] + sums[level, LOST_SQUARE]
        assert found == pytest.approx(np.sum(w**2), rel=1e-12)
    assert sum_of(values) == pytest.approx(np.sum(values))


def test_windows_of_single_samples_with_gaps():
    rng = np.random.default_rng(4)
    values, present = rng.normal(5.0, 1.0, 50), (rng.random(50) < 0.7).astype(float)
    found = _Series().sums
    gappy_windows(values, present, 10, 0, found, np.empty((2, 51)))
    sums, totals = found.levels, found.totals
    both = (present[1:] > 0.0) & (present[:-1] > 0.0)
    both[:9] = False
    w = 0.5 * np.diff(values)[both]
    assert sums[0, COUNT] == w.size and sums[0, SCARCITY] == 0.0
    assert sums[0, MEAN] + sums[0, LOST_MEAN] == pytest.approx(np.sum(w))
    assert sums[0, SQUARE] + sums[0, LOST_SQUARE] == pytest.approx(np.sum(w**2))
    assert totals[FOURTH] + totals[LOST_FOURTH] == pytest.approx(np.sum(w**4))


def test_only_runs_that_hold_a_window_have_centres():
    runs = np.array([[0, 3], [5, 20], [30, 37], [40, 48]])
    assert window_centres(runs, 8).tolist() == [[9, 17], [44, 45]]
    assert window_count(runs, 8.0) == 9.0


def test_coefficients_are_differences_of_means_of_what_is_there():
    rng = np.random.default_rng(5)
    values, present, m = rng.normal(size=80), rng.random(80) < 0.8, 8
    there = np.append(0, np.cumsum(present))
    runs = np.array([[0, 30], [40, 80]])
    found, expected, scarcity = np.empty(15 + 25), [], 0.0
    for start, stop in runs:
        for _, a, p, b, q in windows_of(values[start:stop], present[start:stop], m):
            expected.append(0.5 * (np.mean(b[q]) - np.mean(a[p])))
            scarcity += 0.25 * (1.0 / np.sum(p) + 1.0 / np.sum(q) - 2.0 / m)
    sums = cumulative(np.where(present, values, np.nan), 0.0)
    assert masked_coefficients(sums, there, runs, m, found) == pytest.approx(scarcity)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
