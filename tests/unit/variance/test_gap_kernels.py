"""Hot loops of series with gaps against plain loops, and what a filling is made of."""

import numpy as np
import pytest

from gmwm.variance.gaps import Gaps, Runs, window_centres, window_count
from gmwm.variance.kernels import cumulative, fill, neighbours
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


@pytest.mark.parametrize("slope", [0.0, -0.3])
def test_a_gap_gets_the_weighted_mean_of_its_boxes_and_a_line(slope):
    rng = np.random.default_rng(1)
    values = rng.normal(size=60) + slope * np.arange(60.0)
    edges = np.array([[12, 17], [30, 31], [40, 44]])
    block, boxes = np.array([1, 1, 2]), np.array([4, 3, 2])
    weights = rng.random((3, 4))
    for row, count in zip(weights, boxes, strict=True):
        row[:count] /= np.sum(row[:count])
    for start, stop in edges:
        values[start:stop] = np.nan
    given = values.copy()
    fill(values, cumulative(given, 0.0), edges, block, boxes, weights, slope)
    for (start, stop), size, count, row in zip(edges, block, boxes, weights, strict=True):
        mean, near, far = 0.0, 0, size
        for i in range(count):
            left, right = given[start - far : start - near], given[stop + near : stop + far]
            # Of a box with a gap in it, the sum of what is there is taken.
            mean += row[i] * (np.nansum(left) + np.nansum(right)) / (2.0 * (far - near))
            near, far = far, 2 * far
        place = np.arange(start, stop) - 0.5 * (start + stop - 1)
        np.testing.assert_allclose(values[start:stop], mean + slope * place)
    there = ~np.isnan(given)
    np.testing.assert_array_equal(values[there], given[there])


def test_pairs_of_gaps_are_counted_by_kind_and_distance():
    rng = np.random.default_rng(2)
    centre, kind = np.sort(rng.integers(0, 200, 40)), rng.integers(-1, 3, 40)
    found = neighbours(centre, kind, 3, 25)
    expected = np.zeros((3, 3, 25), dtype=int)
    for g in range(40):
        for other in range(g + 1, 40):
            apart = centre[other] - centre[g]
            if apart < 25 and kind[g] >= 0 and kind[other] >= 0:
                expected[kind[g], kind[other], apart] += 1
    np.testing.assert_array_equal(found, expected)


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


def test_gaps_of_a_pattern_by_hand():
    """Samples missing at 20, at 30 to 32, and at 60 to 231 but for two, an island."""
    values = np.zeros(400)
    values[[20, *range(30, 33), *range(60, 142), *range(144, 232)]] = np.nan
    gaps = Gaps.of(Runs.of(values))
    assert gaps.edges.tolist() == [[20, 21], [30, 33], [60, 232]]
    assert gaps.octave.tolist() == [0, 2, 8]  # 1, 3 and 172 samples
    assert gaps.block.tolist() == [1, 1, 4]  # 172 samples are 43 blocks of four
    assert gaps.length.tolist() == [1, 3, 43]
    # Nine samples to the next gap hold boxes to 1, 2, 4 and 8; the single one is passed by far
    # longer gaps, not by one of three samples.
    assert gaps.boxes.tolist() == [4, 4, 4]
    assert (gaps.span, gaps.runs.present, gaps.runs.longest) == (400, 226, 168)
    assert [gaps.filled(m).tolist() for m in (2.0, 4.0, 8.0, 16.0, 512.0, 1024.0)] == [
        [False, False, False], [True, False, False], [True, False, False],
        [True, True, False], [True, True, False], [True, True, True],
    ]  # fmt: skip
    assert gaps.joined(4.0).tolist() == [[0, 30], [33, 60], [142, 144], [232, 400]]
    assert gaps.joined(16.0).tolist() == [[0, 60], [142, 144], [232, 400]]
    # Of 8 samples in a row, 8 windows cover sample 20; of 32, as many as begin at 0 to 20.
    assert gaps.covered(4).tolist() == [8 / 8]
    assert gaps.covered(16).tolist() == [21 / 32, 29 / 32]
