"""Constant errors by Gauss-Newton in a world that is linear, and the words for every fault."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from gmwm._core.notices import Notice
from gmwm.ins import tuning
from gmwm.ins.field.explanations import (
    LEVEL,
    TESTS,
    Constant,
    Explanation,
    _columns,
    _fitted,
    _parts,
    _step,
    cost,
)
from gmwm.ins.field.faults import fault_notice
from recorded import assert_as_recorded

RNG = np.random.default_rng(1)
Z, J = RNG.normal(size=(30, 2)), RNG.normal(size=(30, 2, 3))


@dataclass(frozen=True, eq=False)
class Linear:
    """A log whose innovations move in proportion to three errors; two of them are missing."""

    at: np.ndarray

    @property
    def standard(self):
        found = Z + J @ self.at
        found[[3, 7], [0, 1]] = np.nan
        return found

    @property
    def log_likelihood(self):
        return -0.5 * float(np.nansum(self.standard**2))


def errors(prior=0.5, smooth=False):
    """Of one name, and of two."""

    def change(places):
        return lambda replay, x: replace(replay, at=replay.at + np.eye(3)[places].T @ x)

    same = change([0]) if smooth else None
    one = Constant("one", ("a",), change([0]), 0.1, prior, same, "there")
    return one, Constant("two", ("b", "c"), change([1, 2]), 0.2, 2.0 * prior)


BASE = Linear(np.zeros(3))
SEEN = np.isfinite(BASE.standard.ravel())
MATRIX, RIGHT = J.reshape(60, 3)[SEEN], Z.ravel()[SEEN]


def expected(prior):
    """Least squares with a prior: estimate, covariance, and gain with what is unusual taken off."""
    inverse = np.diag([prior**-2, (2.0 * prior) ** -2, (2.0 * prior) ** -2])
    covariance = np.linalg.inv(MATRIX.T @ MATRIX + inverse)
    best = -covariance @ MATRIX.T @ RIGHT
    after = RIGHT + MATRIX @ best
    gain = 0.5 * (RIGHT @ RIGHT - after @ after) - 0.5 * best @ inverse @ best
    return best, covariance, gain


@pytest.mark.parametrize("prior", [0.02, 0.5, 100.0])
@pytest.mark.parametrize("smooth", [False, True])
def test_constant_errors_are_those_of_least_squares_with_a_prior(prior, smooth):
    first, second = _fitted(BASE, BASE, errors(prior, smooth))
    best, covariance, gain = expected(prior)
    sd = np.sqrt(np.diag(covariance))
    if smooth and abs(best[0]) > prior:
        best = None  # not as far as is possible
    if best is not None:
        assert first.values == pytest.approx({"a": best[0]}, rel=1e-6)
        assert second.values == pytest.approx({"b": best[1], "c": best[2]}, rel=1e-6)
        assert first.gain == second.gain == pytest.approx(gain, rel=1e-6)
    else:
        assert abs(first.values["a"]) == prior
    assert first.errors == pytest.approx({"a": sd[0]}, rel=1e-6)
    assert second.errors == pytest.approx({"b": sd[1], "c": sd[2]}, rel=1e-6)
    assert (first.code, first.where, second.code) == ("one", "there", "two")
    price = 0.5 * (chi2.isf(LEVEL, 1) + chi2.isf(LEVEL, 2))
    assert first.cost == pytest.approx(price, rel=1e-6)
    assert first.excess == first.gain - first.cost
    there = first.change(second.change(BASE))
    np.testing.assert_allclose(there.at, first.replay.at)


def test_an_angle_that_was_turned_before_counts_and_goes_round():
    heading = replace(errors(100.0)[0], code="heading")
    (near,) = _fitted(BASE, BASE, (heading,))
    start = 1.5 * np.pi
    here = Linear(np.array([0.3, 0.0, 0.0]))
    (far,) = _fitted(BASE, here, (heading,), start)
    wrapped = near.values["a"] - 0.3 + start - 2.0 * np.pi
    assert far.values["a"] == pytest.approx(wrapped, abs=1e-4)


def test_a_step_of_gauss_newton():
    one, two = errors(0.5)
    theta = np.array([0.1, -0.2, 0.3])
    here = Linear(theta)
    steps = np.array([0.1, 0.2, 0.2])
    columns = _columns(here, lambda x: Linear(x), steps, theta)
    np.testing.assert_allclose(np.stack(columns, axis=-1)[0], J[0], rtol=1e-9)
    move, covariance, promised = _step(here, columns, (one, two), theta)
    best, known, _ = expected(0.5)
    np.testing.assert_allclose(theta + move, best, rtol=1e-9)
    np.testing.assert_allclose(covariance, known, rtol=1e-9)
    assert promised == pytest.approx(0.5 * move @ np.linalg.inv(known) @ move)
    assert _parts((one, two)) == [slice(0, 1), slice(1, 3)]


def test_what_chance_gains_has_its_share_of_the_false_alarms():
    assert pytest.approx(tuning.CONTRADICTED / 19) == LEVEL
    assert TESTS == 19
    assert cost(3) == pytest.approx(0.5 * chi2.isf(LEVEL, 3), rel=1e-6)
    assert cost(1, 40) == pytest.approx(0.5 * chi2.isf(LEVEL / 40, 1), rel=1e-6)


STEP = {"after": 3.0, "before": 5.5}
AXES = {"x": 0.002, "y": 0.002, "z": 0.002}
ARM = {"forward": 1.0, "right": -0.3, "down": 2.0}
WANDER = {"north": 2.0, "east": 1.5, "down": 3.0, "tau": 60.0, "factor": 0.8}
FAULTS = [
    ("time-offset", "", {"time offset": 0.234}, {"time offset": 0.01}),
    ("time-offset", "", {"time offset": -17.8}, {"time offset": 0.01}),
    ("clock-step", "", {"time offset": 0.5, **STEP}, {"time offset": 0.02}),
    ("clock-step", "", {"time offset": -0.5, **STEP}, {"time offset": 0.02}),
    ("clock-drift", "", {"drift": 5e-4}, {"drift": 1.2e-5}),
    ("clock-drift", "", {"drift": -5e-4}, {"drift": 1.2e-5}),
    ("scale-error", "gyro", {"x": 0.03, "y": -0.001, "z": 0.02}, AXES),
    ("scale-error", "accel", {"x": 0.001, "y": 0.001, "z": 0.02}, AXES),
    ("scale-error", "accel", {"x": 0.003, "y": 0.001, "z": 0.002}, AXES),
    ("lever-arm", "", ARM, dict.fromkeys(ARM, 0.1)),
    ("lever-arm", "", ARM, {"forward": 0.1, "right": 2.0, "down": 2.0}),
    ("lever-arm", "", ARM, {"forward": 3.0, "right": 2.0, "down": 2.0}),
    ("heading", "", {"heading": 1.5}, {"heading": 0.02}),
    ("axis-signs", "gyro", {"x": -1.0, "y": 1.0, "z": 0.0}, {}),
    ("axis-signs", "accel", {"x": 0.0, "y": 1.0, "z": 0.0}, {}),
    ("axis-signs", "accel", {"x": -1.0, "y": 1.0, "z": -1.0}, {}),
    ("outliers", "position", {"count": 1.0, "fraction": 0.01, "time": 4.0}, {}),
    ("outliers", "position", {"count": 3.0, "fraction": 0.05, "time": 4.0}, {}),
    ("coloured", "position", WANDER, {}),
    *(("fix-noise", kind, {"factor": factor}, {}) for kind, factor in (
        ("position", 1.2), ("velocity", 3.0), ("height", 0.3))),
    *(("sensor-white-noise", "gyro", {"factor": factor}, {}) for factor in (5.0, 900.0)),
    *(("sensor-slow-errors", "accel", {"factor": factor}, {}) for factor in (0.2, 900.0)),
]  # fmt: skip


@pytest.mark.parametrize("known", [False, True])
def test_words_for_every_fault(known):
    """With standard deviations of the fixes as they were given, and assumed."""
    state = SimpleNamespace(rpy=np.array([0.0, 0.0, -1.0]))
    replay = SimpleNamespace(aiding=SimpleNamespace(lever_arm=(1.0, 0.5, -1.0)), state=state)
    sizes = {"north": 1.0, "east": 1.0, "down": 1.5}
    assumed = {
        kind: Notice("sd-assumed", "note", kind, "", sizes, f"give {kind}_sd")
        for kind in ("position", "velocity") if known
    }  # fmt: skip
    found = {
        f"{place} {code} {where}": fault_notice(
            Explanation(code, where, lambda log: log, replay, 20.0, 8.0, values, errors),
            100.0, assumed,
        )
        for place, (code, where, values, errors) in enumerate(FAULTS)
    }  # fmt: skip
    assert_as_recorded(f"ins/fault_words{'_assumed' * known}", found)
