"""Remedies, verdicts and what is taken off, from notices made by hand."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import Channel, WhiteNoise
from gmwm.calibration.channel import ChannelModel, advise_cut, with_validity
from gmwm.calibration.departures import Departure, _independent, _without
from gmwm.issues import Notice

NAMES = ("gyro_x", "accel_y")
FITS = {
    name: gmwm.fit(
        WhiteNoise(),
        Channel(name, WhiteNoise(1.0).simulate(1000, 1.0, 2), 1.0, name.split("_")[0], "rad/s"),
    )
    for name in NAMES
}


def departed(kind, lower, upper, *, evident=True, severity="warning", removable=True):
    values = {
        "time_lower": lower, "time_upper": upper, "evident": evident, "removable": removable,
    }  # fmt: skip
    return Notice(kind, severity, "", "", values, "cut")


def models(*notices):
    """The first channel with these, the second without any."""
    fits = {name: replace(fit, notices=()) for name, fit in FITS.items()}
    fits["gyro_x"] = replace(FITS["gyro_x"], notices=notices)
    return {name: ChannelModel(fit, None) for name, fit in fits.items()}


STEP, DRIFT = departed("step", 40.0, 50.0), departed("drift-at-start", 0.0, 20.0)


@pytest.mark.parametrize(
    ("notices", "part"),
    [
        ((STEP, DRIFT), (50.0, 100.0)),
        ((departed("step", 80.0, 90.0), departed("step", 75.0, 95.0)), (0.0, 75.0)),
        ((departed("step", 10.0, 60.0), departed("step", 20.0, 30.0)), (60.0, 100.0)),
        ((departed("transient", 0.0, 10.0), departed("step", 80.0, 81.0)), (30.0, 80.0)),
        ((departed("transient", 0.0, 30.0), departed("step", 95.0, 96.0)), (90.0, 95.0)),
    ],
)
def test_the_longest_part_without_any(notices, part):
    found, (advice,) = advise_cut(models(*notices), 100.0)
    assert (advice.values["start"], advice.values["stop"]) == part
    assert advice.values["of"] == 100.0 and advice.values["removable"]
    assert advice.hint == "calibrate that part"
    assert f"{part[1] - part[0]:,.0f} s of 100 s" in advice.text
    for notice in found["gyro_x"].fit.notices:
        assert notice.values["together"] and "remove_departures=True" in notice.hint
    assert found["accel_y"].fit.notices == ()


@pytest.mark.parametrize(
    ("notices", "length"),
    [
        ((STEP,), 100.0),
        ((STEP, DRIFT), 0.0),
        ((STEP, departed("step", 10.0, 20.0, severity="note")), 100.0),
        ((STEP, departed("slow-period", 10.0, 20.0)), 100.0),
        ((STEP, departed("transient", 0.0, 40.0)), 50.0),
    ],
)
def test_one_that_is_evident_has_its_own_remedy(notices, length):
    given = models(*notices)
    assert advise_cut(given, length) == (given, [])


def test_what_cannot_be_taken_off_is_cut():
    kept = departed("step", 70.0, 80.0, removable=False)
    found, (advice,) = advise_cut(models(STEP, kept), 100.0)
    assert not advice.values["removable"]
    assert {n.hint for n in found["gyro_x"].fit.notices} == {
        "calibrate the longest part without any"
    }


def issue(code, severity="bad", where=""):
    return Notice(code, severity, where, "text")


@pytest.mark.parametrize(
    ("issues", "still", "spoilt"),
    [
        ([issue("not-static")], True, NAMES),
        ([issue("not-static")], False, ()),
        ([issue("tilt")], True, ("accel_y",)),
        ([issue("tilt")], False, ("accel_y",)),
        ([issue("rate-changes")], False, NAMES),
        ([issue("gravity")], True, NAMES),  # increments, the gyro's too
        ([issue("gravity", "bad", "accel")], True, ("accel_y",)),
        ([issue("gravity", "warning", "accel")], True, ()),
        ([issue("counts", "bad", "gyro")], True, ("gyro_x",)),
        ([issue("swapped")], True, NAMES),
        ([issue("stuck", "bad", "gyro_x")], True, ("gyro_x",)),
        ([issue("stuck", "warning", "gyro_x")], True, ()),
        ([issue("drift", "bad", "gyro_x")], True, ()),
        ([issue("length")], True, ()),
    ],
)
def test_issues_that_spoil_a_channel(issues, still, spoilt):
    found = with_validity(models(), issues, still=still)
    for name in NAMES:
        own = [notice.code for notice in found[name].fit.notices]
        assert own[:1] == [issues[0].code] * (name in spoilt)
        assert found[name].fit.valid is (name not in spoilt)


def test_an_issue_that_comes_twice_is_named_once():
    twice = [issue("stuck", "bad", "gyro_x")] * 2
    assert len(with_validity(models(), twice, still=True)["gyro_x"].fit.notices) == 1


TIME = np.arange(0.0, 100.0)
CURVES = {
    "step": (TIME > 40.0).astype(float),
    "transient": np.exp(-TIME / 40.0),
    "drift-at-start": np.where(TIME < 40.0, 1.0 - TIME / 40.0, 0.0),
    "slow-period": np.cos(2.0 * np.pi * TIME / 40.0 - 0.7),
}


@pytest.mark.parametrize("kind", CURVES)
def test_what_is_taken_off_is_the_curve_of_its_size(kind):
    found = Departure(kind, (40.0, 37.0, 42.0), (2.0, 1.5, 2.5), 1.0, 0.1, 0.7)
    np.testing.assert_allclose(found.curve(TIME), CURVES[kind], atol=1e-12)
    channel = Channel("gyro_x", 2.0 * CURVES[kind] + 5.0, 1.0, "gyro", "rad/s")
    left = _without(channel, [found]).values
    gone = [38, 39, 40, 41] if kind == "step" else []
    assert np.flatnonzero(np.isnan(left)).tolist() == gone
    np.testing.assert_allclose(np.delete(left, gone), 5.0)
    assert _without(channel, []) is channel


def test_combinations_of_curves_have_the_covariance_of_their_sizes():
    rng = np.random.default_rng(1)
    curves = np.array([CURVES["step"], (TIME > 60.0).astype(float), rng.normal(size=100)])
    centred = curves - np.mean(curves, axis=1)[:, None]
    correlation = np.linalg.inv(centred @ centred.T)
    scale = np.sqrt(np.diag(correlation))
    errors = np.array([0.1, 0.2, 0.3])
    expected = correlation / np.outer(scale, scale) * np.outer(errors, errors)
    found = _independent(curves, errors)
    np.testing.assert_allclose(found.T @ found, expected)
