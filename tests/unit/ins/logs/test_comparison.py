"""Sensor models compared on logs whose truth is known but not used."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from emulated_logs import emulated_log
from gmwm.errors import InputError
from gmwm.ins import Comparison, Outage, Paired, compare, tuning
from gmwm.ins.geometry import ned_difference
from gmwm.ins.logs import Replay, align, paired, smooth
from gmwm.ins.simulation import Ratio
from gmwm.study.demo import sensors


@pytest.fixture(scope="module")
def drive():
    return emulated_log(21, duration=500.0, rate=20.0)


@pytest.fixture(scope="module")
def alike(drive):
    """Two equal models and one that is nearly so."""
    return compare(drive[0], {"a": sensors(), "b": sensors(), "c": sensors(slow=1.01)})


@pytest.fixture(scope="module")
def equal(drive):
    """Two equal models."""
    return compare(drive[0], {"right": sensors(), "sure": sensors()})


def replay_of(log):
    alignment = align(log)
    return Replay.of(log, alignment), alignment


def test_the_smoothed_position_is_as_good_as_it_claims_and_better_than_the_filter(drive):
    log, truth = drive
    replay, alignment = replay_of(log)
    times = np.arange(30.3, 480.0, 15.0)
    smoothed = smooth(replay, times)
    epochs = np.rint(times / log.imu.dt).astype(int) + alignment.epoch
    error = ned_difference(smoothed.lla, truth.lla[epochs])
    standard = error / np.sqrt(np.einsum("kii->ki", smoothed.covariance))
    # Fixes 15 s apart are nearly independent: 90 draws, four of their standard deviations.
    assert np.mean(standard**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / standard.size))
    index = [int(np.argmin(np.abs(smoothed.solution.time - each))) for each in times]
    forward = ned_difference(smoothed.solution.lla[index], truth.lla[epochs])
    assert np.mean(error**2) < 0.5 * np.mean(forward**2)
    assert np.all(
        np.einsum("kii->ki", smoothed.covariance)
        < np.einsum("kii->ki", smoothed.solution.covariance[index, :3, :3])
    )


def test_at_the_last_fix_the_smoother_is_the_filter(drive):
    replay, _ = replay_of(drive[0])
    last = replay.imu.n * replay.imu.dt
    smoothed = smooth(replay, np.array([last]))
    assert np.allclose(ned_difference(smoothed.lla[0], smoothed.solution.lla[-1]), 0.0, atol=1e-6)
    ratio = smoothed.covariance[0] / smoothed.solution.covariance[-1, :3, :3]
    assert np.diag(ratio) == pytest.approx(1.0, rel=0.02)


def test_models_that_are_much_worse_are_named(drive, tmp_path):
    found = compare(drive[0], {"right": sensors(), "loose": sensors(slow=30.0, gyro=20.0)})
    verdict = found.verdict
    assert (verdict.code, verdict.where) in {("better", "right"), ("more-honest", "right")}
    pair = found.pairs["right", "loose"]
    assert pair.ratio < 0.9
    assert pair.lower < pair.ratio < pair.upper
    assert found.pairs["loose", "right"].ratio == pytest.approx(1.0 / pair.ratio)
    assert max(map(len, str(found).splitlines())) <= 80
    json.dumps(found.to_dict(), allow_nan=False)
    figure = found.plot()
    drawn = figure.axes[0].lines[0].get_ydata()
    assert drawn == pytest.approx(np.hypot(*found.outcomes["right"].error[:, :2].T))
    assert [each.get_text() for each in figure.axes[2].get_yticklabels()] == ["loose / right"]
    assert "<svg" in found.report(tmp_path / "comparison.html").read_text()


def test_an_overconfident_model_with_the_same_errors_is_less_honest(drive):
    found = compare(drive[0], {"right": sensors(), "sure": sensors(slow=0.3)})
    assert found.outcomes["sure"].nees.value > found.outcomes["right"].nees.value
    assert found.pairs["right", "sure"].score < 0.0


def test_a_tie_names_the_models_whose_own_prediction_is_contradicted(equal):
    """Errors that are as large, of which one model predicts half: it was "as good as the other"."""
    honest = Ratio(1.0, 0.8, 1.2, 1.0)
    outcomes = {
        "right": replace(equal.outcomes["right"], nees=honest),
        "sure": replace(equal.outcomes["sure"], nees=replace(honest, value=1.64)),
    }
    verdict = replace(equal, outcomes=outcomes).verdict
    assert (verdict.code, verdict.values["contradicted"]) == ("tie", "sure")
    assert "but sure is overconfident, NEES 1.64." in verdict.text
    assert "right is" not in verdict.text
    outcomes["right"] = replace(outcomes["right"], nees=replace(honest, value=0.5))
    assert "right is conservative, NEES 0.5; sure" in replace(equal, outcomes=outcomes).verdict.text
    outcomes = {name: replace(each, nees=honest) for name, each in outcomes.items()}
    assert "NEES" not in replace(equal, outcomes=outcomes).verdict.text


def test_a_model_that_predicts_its_errors_badly_is_no_tie(equal):
    """The headline was a tie, with a NEES of 3.4 behind it."""
    honest = Ratio(1.0, 0.8, 1.2, 1.0)
    outcomes = {name: replace(each, nees=honest) for name, each in equal.outcomes.items()}
    outcomes["sure"] = replace(outcomes["sure"], nees=replace(honest, value=3.4))
    verdict = replace(equal, outcomes=outcomes).verdict
    assert (verdict.code, verdict.where) == ("more-honest", "right")
    assert "sure is overconfident, NEES 3.4" in verdict.text
    outcomes["right"] = replace(outcomes["right"], nees=replace(honest, value=0.2))
    verdict = replace(equal, outcomes=outcomes).verdict
    assert verdict.text.startswith("Errors of right and sure are equal") and "none" in verdict.text


def test_equal_models_are_a_tie(alike):
    assert alike.verdict.code == "tie"
    assert alike.pairs["a", "b"].ratio == 1.0
    assert 0.0 < alike.resolved < 1.0


def test_intervals_of_few_outages_cover_what_they_claim(alike):
    """Outages whose errors differ by a factor of 1.4, 1 sigma, and models that are nearly alike.

    By the delta method 91 % were covered.
    """
    outcome, none = alike.outcomes["a"], np.zeros(3)
    rng, runs, inside = np.random.default_rng(17), 3000, 0
    for _ in range(runs):
        sd = np.exp(0.35 * rng.standard_normal((8, 3)))
        error = sd * rng.standard_normal((8, 3))
        other = 0.95 * error + np.sqrt(1.0 - 0.95**2) * sd * rng.standard_normal((8, 3))
        a, b = (
            replace(outcome, error=each, score=np.arange(8.0), reference_variance=none)
            for each in (error, other)
        )
        pair = paired(a, b, np.ones(3))
        inside += pair.lower < 1.0 < pair.upper
    assert inside / runs > 0.93 - 2.0 * np.sqrt(0.93 * 0.07 / runs)


def test_errors_against_the_smoother_are_those_against_the_truth(drive):
    """The reference's own uncertainty is added to the mean square, not forgotten."""
    log, _ = drive
    outcome = compare(log, {"a": sensors(), "b": sensors(slow=2.0)}, 10.0).outcomes["a"]
    assert outcome.rms["horizontal"] ** 2 == pytest.approx(
        np.mean(np.sum(outcome.error[:, :2] ** 2, axis=1)) + np.sum(outcome.reference_variance[:2])
    )
    assert 0.5 < outcome.nees.value < 2.0


def test_what_cannot_be_compared_is_refused(drive):
    log, _ = drive
    with pytest.raises(InputError, match="two sensor models or more"):
        compare(log, {"a": sensors()})
    with pytest.raises(InputError, match="enough for 7 outages of 60 s: 8 are needed"):
        compare(log, {"a": sensors(), "b": sensors()}, 60.0)
    with pytest.raises(InputError, match="600 s or less"):
        compare(log, {"a": sensors(), "b": sensors()}, 1e4)


# -- verdicts from pairs made by hand -------------------------------------------------------------


def outcome(error, score):
    return SimpleNamespace(squares=np.asarray(error, dtype=float) ** 2, score=np.asarray(score))


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


def test_equal_outcomes_are_a_tie_for_sure():
    error, score = np.random.default_rng(2).normal(size=(9, 3)), np.zeros(9)
    pair = paired(outcome(error, score), outcome(error, score), np.ones(3))
    assert (pair.p_value, pair.score_p_value) == (1.0, 1.0)


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
    assert f"for 10 % record {needed / 60.0:.0f} min" in found.verdict.text
    assert f"differences of {100 * (1 - found.resolved):.0f} % or more" in found.verdict.text
    assert "would have been found" in comparison(alike, error=0.02).verdict.text
