"""Errors in outages of two models, compared by hand."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from gmwm.ins import Comparison, Outage, tuning
from gmwm.ins.field.outcome import Paired, _p_value, by_part, paired, true_squares
from gmwm.ins.simulation import Ratio


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


EVEN, LESS = (1.0, 0.5, 0.0, 0.5), (0.8, 0.01, 0.0, 0.5)
"""Ratio of errors, its p-value, difference of scores, its p-value."""


def pair(ratio=1.0, p=0.5, score=0.0, score_p=0.5, error=0.05):
    return Paired(ratio, 0.9 * ratio, 1.1 * ratio, p, score, score_p, error)


def comparison(pairs, nees=None, error=0.05):
    """Of models a, b, ... with the pairs given, and their reverses."""
    names = sorted({name for two in pairs for name in two})
    nees = {name: Ratio(1.0, 0.5, 1.6, 30.0) for name in names} | (nees or {})
    every = {}
    for (a, b), (ratio, p, score, score_p) in pairs.items():
        every[a, b] = pair(ratio, p, score, score_p, error)
        every[b, a] = pair(1.0 / ratio, p, -score, score_p, error)
    outcomes = {name: SimpleNamespace(nees=nees[name]) for name in names}
    outages = tuple(Outage(30.0 * k, 20.0) for k in range(9))
    return Comparison("made up", outages, outcomes, every, 300.0)


@pytest.mark.parametrize(
    ("pairs", "code", "where"),
    [
        ({"ab": (0.8, 0.039, 0.0, 0.5)}, "better", "a"),
        ({"ab": (1.25, 0.039, 0.0, 0.5)}, "better", "b"),
        ({"ab": (0.8, 0.041, 0.0, 0.5)}, "tie", ""),
        ({"ab": (1.0, 0.5, -0.2, 0.0099)}, "more-honest", "a"),
        ({"ab": (1.0, 0.5, 0.2, 0.0099)}, "more-honest", "b"),
        ({"ab": (1.0, 0.5, -0.2, 0.0101)}, "tie", ""),
        # Errors come before scores.
        ({"ab": (0.8, 0.01, 0.2, 0.001)}, "better", "a"),
        # Of three models, three pairs share the levels.
        ({"ab": (0.8, 0.0134, 0, 0.5), "ac": LESS, "bc": EVEN}, "tie", ""),
        ({"ab": (0.8, 0.0133, 0, 0.5), "ac": LESS, "bc": EVEN}, "better", "a"),
        ({"ab": LESS, "ac": (1, 0.5, -1.0, 0.003), "bc": EVEN}, "better", "a"),
        # Each is beaten by another one: none is to be taken.
        ({"ab": LESS, "bc": LESS, "ac": (1.25, 0.01, 0, 0.5)}, "tie", ""),
    ],
)  # fmt: skip
def test_which_model_to_take(pairs, code, where):
    found = comparison({tuple(names): each for names, each in pairs.items()}).verdict
    assert (found.code, found.where) == (code, where)


def test_what_a_log_can_tell_apart():
    """A ratio of 0.9 is 0.105 in logarithms; 0.02 do not matter."""
    alike = {("a", "b"): (1.0, 0.5, 0.0, 0.5)}
    found = comparison(alike)
    beyond = 0.05 * (stats.t.isf(0.04, 8) + stats.norm.ppf(0.95))
    assert found.resolved == pytest.approx(np.exp(-0.02 - beyond))
    needed = 300.0 * (beyond / (np.log(1.0 / 0.9) - 0.02)) ** 2
    assert found.length_needed == pytest.approx(needed)
    assert f"for 10 % it would have to be {needed / 60.0:.0f} min long" in found.verdict.text
    assert f"differ by {100 * (1 - found.resolved):.0f} % or more" in found.verdict.text
    assert "would have been found" in comparison(alike, error=0.02).verdict.text


def test_models_that_believe_what_is_not_so():
    far = Ratio(2.0, 0.5, 1.6, 30.0), Ratio(0.4, 0.5, 1.6, 30.0)
    tie = comparison({("a", "b"): (1.0, 0.5, 0.0, 0.5)}, dict(zip("ab", far, strict=True))).verdict
    assert "a believes its errors to be smaller than they are, NEES 2" in tie.text
    assert "b believes its errors to be larger than they are, NEES 0.4" in tie.text
    assert tie.values["contradicted"] == "a, b"
    best = comparison({("a", "b"): (0.8, 0.01, 0.0, 0.5)}, {"b": far[0]}).verdict
    assert best.values["contradicted"] == ""
    assert best.text == "Take a: its errors after the outages are smaller."
