"""Errors in outages of two models, compared by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from gmwm.ins import tuning
from gmwm.ins.field.outcome import _p_value, by_part, paired, true_squares


def outcome(error, score, reference=(0.0, 0.0, 0.0)):
    return SimpleNamespace(
        error=np.asarray(error, dtype=float), reference_variance=np.array(reference),
        score=np.asarray(score, dtype=float),
    )  # fmt: skip


def test_root_mean_squares_by_part():
    squares = np.array([[9.0, 16.0, 4.0], [1.0, 24.0, 0.0]])
    assert by_part(squares) == pytest.approx({"horizontal": 5.0, "vertical": np.sqrt(2.0)})
    one = outcome([[1.0, -2.0, 3.0]], [0.0], (0.5, 0.25, 1.0))
    np.testing.assert_allclose(true_squares(one), [[1.5, 4.25, 10.0]])


def test_a_ratio_and_its_interval():
    rng = np.random.default_rng(1)
    count, scale = 9, np.array([1.0, 4.0, 0.25])
    first, second = (rng.normal(size=(count, 3)) * np.sqrt(scale) for _ in range(2))
    scores = rng.normal(size=(2, count))
    found = paired(outcome(2.0 * first, scores[0]), outcome(second, scores[1]), scale)
    a, b = (np.sum(each**2 / scale, axis=1) for each in (2.0 * first, second))
    assert found.ratio == pytest.approx(np.sqrt(np.sum(a) / np.sum(b)))
    without = [
        0.5 * np.log(np.sum(np.delete(a, k)) / np.sum(np.delete(b, k))) for k in range(count)
    ]
    error = np.sqrt((count - 1) / count * np.sum((without - np.mean(without)) ** 2))
    assert found.error == pytest.approx(error)
    width = stats.t.ppf(0.975, count - 1) * error
    assert np.log([found.lower, found.upper]) == pytest.approx(
        np.log(found.ratio) + np.array([-width, width])
    )
    assert found.score == pytest.approx(np.mean(scores[0] - scores[1]))
    back = paired(outcome(second, scores[1]), outcome(2.0 * first, scores[0]), scale)
    assert back.ratio == pytest.approx(1.0 / found.ratio)
    assert (back.p_value, back.score_p_value) == pytest.approx((found.p_value, found.score_p_value))
    by_hand = stats.t.sf((abs(np.log(found.ratio)) - tuning.TIE_RATIO) / error, count - 1)
    by_hand += stats.t.sf((abs(np.log(found.ratio)) + tuning.TIE_RATIO) / error, count - 1)
    assert found.p_value == pytest.approx(by_hand)


def test_without_scatter_a_difference_is_one_or_none():
    assert _p_value(0.02, 0.02, 0.0, 8) == 1.0
    assert _p_value(0.02, -0.03, 0.0, 8) == 0.0
