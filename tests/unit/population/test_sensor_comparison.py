"""`compare`: what is compared, what is reported, and input that cannot be used."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import Calibration, InputError, RandomWalk, WhiteNoise
from gmwm.estimate import estimate
from gmwm.issues import Notice
from gmwm.population import labelled

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


@pytest.mark.parametrize(
    ("paths", "labels"),
    [
        (["monday/calibration.json", "friday/calibration.json"], ("monday", "friday")),
        (["/x/u1/day/cal.json", "/x/u2/day/cal.json"], ("u1", "u2")),
        (["a/1/cal.json", "a/2/cal.json", "b/1/cal.json"], ("a/1", "a/2", "b/1")),
        (["out/monday.json", "out/friday.json"], ("monday", "friday")),
        (["calibration.json", "friday/calibration.json"], ("static", "friday")),
        (["same/calibration.json", "same/calibration.json"], ("static", "static (2)")),
        (["", ""], ("static", "static (2)")),
    ],
)
def test_recordings_of_one_name_are_distinguished_by_their_paths(three, paths, labels):
    alike = [replace(each, source="static.csv") for each in [*three, three[0]][: len(paths)]]
    assert tuple(labelled(alike, paths)) == labels
    assert tuple(labelled([*alike, three[2]], [*paths, ""])) == (*labels, "day3")


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


def test_a_comparison_shows_itself(compared, tmp_path):
    assert repr(compared).startswith("<SensorComparison of 3 recordings, 3 axes: 1 agree")
    assert max(map(len, str(compared).splitlines())) <= 80
    assert list(compared.to_frame()["state"]) == ["differ", "agree", "untested"]
    content = json.loads(json.dumps(compared.to_dict(), allow_nan=False))
    assert content["channels"]["gyro_x"]["state"] == "differ"
    sheet = tmp_path / "sheet.yaml"
    sheet.write_text("gyro: {N: 3 deg/sqrt(h)}\n")
    text = compared.report(tmp_path / "c.html", datasheet=sheet).read_text()
    assert text.count('<svg viewBox="0 0 380') == 3
    assert 'class="sheet"' in text
    assert not re.search("<script|https?:|url\\(", text)


def test_a_number_that_is_not_known_is_null_in_json(compared):
    axis = compared["gyro_x"]
    unknown = {label: replace(each, predicted=()) for label, each in axis.covering.items()}
    with_nan = replace(axis, covering=unknown)
    content = json.loads(json.dumps(with_nan.to_dict(), allow_nan=False))
    assert content["filter_numbers"]["day1"]["nees"] is None
    assert content["filter_numbers"]["day1"]["N"] == axis.for_filter("N")[0]


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


def test_one_file_alone_is_refused(three):
    with pytest.raises(InputError, match="two recordings or more"):
        gmwm.compare(three[:1])


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


def test_a_calibration_without_its_curve_is_refused_in_one_sentence(three, tmp_path):
    kept, cut = (
        each.save(tmp_path / f"{name}.json") for name, each in zip("ab", three[:2], strict=True)
    )
    content = json.loads(cut.read_text())
    del content["channels"]["gyro_x"]["wavelet_variance"]
    cut.write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"b\.json") as refused:
        gmwm.compare([kept, cut])
    assert "\n" not in str(refused.value)
