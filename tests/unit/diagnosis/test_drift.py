"""Numbers of slow changes, against the same from the definition."""

import numpy as np
import pytest
from examining import examined, only

from gmwm._core.text import per_cent
from gmwm.diagnosis import tuning
from gmwm.diagnosis.drift import drift, part_means, variance
from gmwm.diagnosis.innovations import Innovations

N = 2 * tuning.PARTS * tuning.SHORT_MEAN
"""Samples of the shortest record that is looked at."""


def test_means_of_parts_know_more_than_half_of_their_samples():
    values = np.arange(42.0)
    values[[0, 1, 2, 3, 10, 11, 12, 13, 14]] = np.nan
    np.testing.assert_allclose(part_means(values, 4), [6.5, np.nan, 24.5, 34.5])
    np.testing.assert_allclose(part_means(values, 4, 0.4), [6.5, 17.0, 24.5, 34.5])
    np.testing.assert_allclose(part_means(values, 4, 0.6), [np.nan, np.nan, 24.5, 34.5])


@pytest.mark.parametrize("slope", [0.0, 1e-4, -1e-4])
@pytest.mark.parametrize("lost", [0, 5])
def test_what_a_drift_is_said_to_be(slope, lost):
    rng = np.random.default_rng(1)
    size = N // tuning.PARTS
    level = np.repeat(rng.normal(size=tuning.PARTS), size) * (1.0 if slope == 0.0 else 3e-3)
    values = level + 0.01 * rng.normal(size=N) + slope * np.arange(N)
    values[: lost * size] = np.nan
    found = only(drift(examined(values)))
    means = np.mean(values.reshape(-1, size), axis=1)[lost:]
    place = np.arange(means.size)
    line = np.polyfit(place, means, 1)
    wander = np.sqrt(np.sum((means - np.polyval(line, place)) ** 2) / (means.size - 2))
    short = np.mean(values[lost * size :].reshape(-1, tuning.SHORT_MEAN), axis=1)
    white = np.sqrt(0.5 * np.mean(np.diff(short) ** 2) * tuning.SHORT_MEAN / size)
    expected = {"wander": wander, "white": white, "change": line[0] * tuning.PARTS}
    assert found.values == pytest.approx(expected, rel=1e-9)
    assert found.severity == ("warning" if slope else "note")
    assert found.text.startswith("drifts by" if slope else f"means of {0.01 * size:.3g} s wander")


@pytest.mark.parametrize(
    ("n", "lost", "there"), [(N, 0, True), (N - 1, 0, False), (2 * N, 32, True), (2 * N, 33, False)]
)
def test_a_level_is_looked_at_in_long_records_of_which_half_is_there(n, lost, there):
    values = np.random.default_rng(2).normal(size=n) + np.repeat([0.0, 50.0], [n // 2, n - n // 2])
    values[n - lost * (n // tuning.PARTS) :] = np.nan
    values[0] = 0.0
    if lost:
        values += np.arange(n)
    assert (only(drift(examined(values))) is not None) is there


def test_a_level_wanders_where_white_noise_would_not():
    # F of 62 and 2/3 * 127 degrees of freedom: 1.9 is exceeded with a chance of 0.1 %.
    alternating = np.tile([1.0, -1.0], N // 2)
    rng = np.random.default_rng(3)
    steps = np.repeat(rng.permuted(np.tile([0.1, -0.1], tuning.PARTS)), tuning.SHORT_MEAN)
    for size, found in ((1.2, False), (2.5, True)):
        slow = np.repeat(rng.permuted(np.tile([0.1, -0.1], 32)), N // tuning.PARTS)
        values = alternating + steps + size * np.sqrt(0.5) * slow
        assert (only(drift(examined(values))) is not None) is found


def errors_of(tenths, n=20_000):
    """Prediction errors of one size in each tenth, of either sign."""
    sizes = np.repeat(np.asarray(tenths, dtype=float), n // 10)
    signs = np.random.default_rng(4).choice([-1.0, 1.0], sizes.size)
    spread = 1.0 + 0.5 * signs[::-1]
    known = np.ones(sizes.size, dtype=bool)
    return Innovations(sizes * signs * spread, known, np.ones(sizes.size), 0.0)


def change_of(errors, usable=None, step=0.0):
    return only(variance(examined(errors.values, step=step, errors=errors, usable=usable)))


@pytest.mark.parametrize(
    ("second", "severity", "words"),
    [(1.03, None, ""), (1.1, "note", "larger"), (0.9, "note", "smaller"),
     (1.35, "warning", "larger"), (0.7, "warning", "smaller")],
)  # fmt: skip
def test_the_noise_of_the_halves(second, severity, words):
    errors = errors_of([1.0] * 5 + [second] * 5)
    found = change_of(errors)
    if severity is None:
        assert found is None
        return
    rms = [np.sqrt(np.mean(half**2)) for half in np.split(errors.values, 2)]
    tenths = np.sqrt(np.mean(errors.values.reshape(10, -1) ** 2, axis=1))
    assert found.values["first_half"] == pytest.approx(rms[0])
    assert found.values["second_half"] == pytest.approx(rms[1])
    assert found.values["loudest_tenth"] == np.argmax(tenths)
    assert found.values["loudest"] == pytest.approx(np.max(tenths))
    # A large change is one of the parts too.
    assert found.severity in (severity, "bad" if severity == "warning" else severity)
    assert f"{per_cent(abs(rms[1] / rms[0] - 1.0))} {words}" in found.text


@pytest.mark.parametrize(("loud", "reported"), [(1.15, False), (1.3, True)])
@pytest.mark.parametrize("tenth", [0, 4, 5, 9])
def test_one_loud_tenth_is_no_trend(loud, reported, tenth):
    sizes = np.ones(10)
    sizes[tenth] = loud
    found = change_of(errors_of(sizes))
    assert (found is not None) is reported
    if reported:
        assert found.values["loudest_tenth"] == tenth
        assert f"begins at {20.0 * tenth:.4g} s" in found.text
        assert found.values["first_half"] == pytest.approx(found.values["second_half"], rel=0.03)


@pytest.mark.parametrize(("step", "there"), [(2.0, True), (2.1, False)])
def test_noise_below_half_a_step_is_not_compared(step, there):
    errors = errors_of([1.0] * 5 + [2.0] * 5)
    found = change_of(errors, step=step)
    assert (found is not None) is there
