"""`compare`: what is compared, what is reported, and input that cannot be used."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import Calibration, InputError, RandomWalk, WhiteNoise
from gmwm.estimate import estimate
from gmwm.issues import Notice

ACCEL = WhiteNoise(1e-2) + RandomWalk(5e-3)
N = 5000


def calibration(seed, factor=1.0, rate=100.0, units=("rad/s", "m/s^2"), more=()):
    """One of a gyro and an accelerometer; ``factor`` multiplies the white noise of the gyro."""
    gyro = WhiteNoise(1e-3 * factor) + RandomWalk(1e-3)
    truths = {"gyro_x": gyro, "accel_x": ACCEL} | dict.fromkeys(more, gyro)
    data = {
        key: truth.simulate(N, 1.0 / rate, 10 * seed + i)
        for i, (key, truth) in enumerate(truths.items())
    }
    if units == ("deg/s", "g"):
        data["gyro_x"] = np.degrees(data["gyro_x"])
        data["accel_x"] = data["accel_x"] / 9.80665
    recording = gmwm.Recording.from_arrays(
        data, rate, dict(zip(("gyro", "accel"), units, strict=True))
    )
    fits = {key: estimate(truths[key].opened(), recording[key]) for key in data}
    return Calibration(fits, {}, f"/data/day{seed}.csv.gz", rate, N)


@pytest.fixture(scope="module")
def three():
    """The second in other units, the third with a larger N; one axis is in the first only."""
    return [
        calibration(1, more=["gyro_y"]),
        calibration(2, units=("deg/s", "g")),
        calibration(3, factor=1.25),
    ]


@pytest.fixture(scope="module")
def compared(three):
    """With the first recording given twice."""
    return gmwm.compare([*three, three[0]])


def codes(found):
    return [notice.code for notice in found.notices]


def test_a_changed_axis_differs_and_the_other_agrees(compared):
    assert compared.labels == ("day1", "day2", "day3")
    assert compared["accel_x"].state == "agree"
    assert compared["gyro_y"].state == "untested"
    gyro = compared["gyro_x"]
    assert gyro.state == "differ"
    named = {d.part: d for d in gyro.differences}["N"]
    assert named.ratios[2] == max(named.ratios)
    assert 0.15 < named.extent < 0.35
    assert "curves-differ" in codes(compared)


def test_numbers_of_all_recordings_come_from_one_structure(compared):
    structure = compared["gyro_x"].structure
    assert structure.model == "white noise + random walk"
    n = [own["N"].value for own in structure.numbers.values()]
    assert n == pytest.approx([1e-3, 1e-3, 1.25e-3], rel=0.03)
    text = str(compared)
    low, high = (f"{x * 180.0 / np.pi * 60.0:.3g}" for x in (min(n), max(n)))
    assert f"gyro_x   N {low} to {high} deg/sqrt(h)" in text
    assert text.index("Sensor numbers") < text.index("Filter numbers")


def test_covering_numbers_bound_every_recording(compared):
    for axis in (compared["gyro_x"], compared["accel_x"]):
        for label, fit in axis.fits.items():
            own = gmwm.bound(fit, horizon=60.0)
            # Of white noise and a walk the bound is the model itself.
            assert axis.for_filter("N")[0] >= own.N * (1.0 - 1e-6)
            assert axis.for_filter("K")[0] >= own.K * (1.0 - 1e-6)
            assert axis.covering[label].nees[60.0] <= 1.05


def test_the_reversed_order_gives_the_same_verdicts(three, compared):
    back = gmwm.compare(three[::-1])
    for name, axis in compared.items():
        assert back[name].state == axis.state
        assert back[name].p_value == pytest.approx(axis.p_value, rel=1e-5, nan_ok=True)
        value, is_limit = axis.for_filter("N")
        assert back[name].for_filter("N") == (pytest.approx(value, rel=1e-3), is_limit)


def test_the_same_file_twice_is_one_recording(three, compared):
    with pytest.raises(InputError, match="is the same recording as"):
        gmwm.compare([three[0], three[0]])
    (notice,) = [n for n in compared.notices if n.code == "same-recording"]
    assert notice.values["other"] == "day1"


@pytest.mark.parametrize(
    ("sources", "message"),
    [
        ([], "two recordings or more"),
        ("cal.json", "not a list"),
        (3, "not a list"),
        ([1, 2], "neither a calibration nor"),
        (["/nowhere.json", "/nowhere.json"], "cannot be read"),
    ],
)
def test_what_cannot_be_compared_is_one_sentence(sources, message):
    with pytest.raises(InputError, match=message):
        gmwm.compare(sources)


def test_other_rates_are_not_compared_level_by_level(three):
    fast = calibration(4, rate=200.0)
    with pytest.raises(InputError) as refused:
        gmwm.compare([three[0], fast])
    assert str(refused.value) == (
        "there is nothing to compare: day1: gyro_x: at 100 Hz, day4 at 200 Hz; give recordings of "
        "one rate that have a channel in common"
    )


def test_what_is_no_noise_or_missing_is_left_out_and_named(three, compared):
    assert compared["gyro_y"].left_out["day2"].code == "channel-missing"
    step = Notice("step", "bad", "", "a step")
    stepped = replace(three[1]["gyro_x"], notices=(step,))
    dead = Notice("constant", "bad", "accel_x", "constant at 1")
    second = replace(three[1], fits={"gyro_x": stepped}, skipped={"accel_x": dead})
    with pytest.raises(InputError, match="nothing to compare: day2: gyro_x: a step"):
        gmwm.compare([three[0], second])
    found = gmwm.compare({"a": three[0], "b": second, "c": three[2]})
    assert found["accel_x"].left_out["b"].code == "channel-skipped"
    gyro = found["gyro_x"]
    assert list(gyro.fits) == ["a", "c"] and gyro.left_out["b"].values["reason"] == "step"
