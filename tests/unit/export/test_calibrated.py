"""Files of calibrations: the numbers of `gmwm.bound`, and files that programs can use."""

import json
import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import yaml

import gmwm
import marks
from gmwm import Channel, GaussMarkov, InputError, RandomWalk, Recording, WhiteNoise, bound, reduce
from gmwm.export import TARGETS, axis_of
from gmwm.issues import Notice
from imu_numbers import numbers

DT = 0.005
N_GYRO, K_GYRO, N_ACCEL = 4e-4, 3e-4, 1.2e-3

NUMBERS = tuple(
    f"{sensor}_{number}"
    for sensor in ("accelerometer", "gyroscope")
    for number in ("noise_density", "random_walk")
)


def recording(gyro, accel, axes="xy", n=20_000, seed=3, dt=DT):
    rng = np.random.default_rng(seed)
    kinds = (("gyro", "rad/s", gyro), ("accel", "m/s^2", accel))
    return Recording(
        tuple(
            Channel(f"{quantity}_{axis}", model.simulate(n, dt, rng), dt, quantity, unit)
            for quantity, unit, model in kinds
            for axis in axes
        ),
        "bench.csv",
    )


def kalibr_text(calibration):
    return gmwm.export(calibration, "kalibr")


def walk_where_it_is(name):
    return WhiteNoise() + RandomWalk() if name.startswith("gyro") else WhiteNoise()


@pytest.fixture(scope="module")
def calibration():
    rec = recording(WhiteNoise(N_GYRO) + RandomWalk(K_GYRO), WhiteNoise(N_ACCEL))
    return gmwm.calibrate(rec, {name: walk_where_it_is(name) for name in rec.names})


@pytest.fixture(scope="module")
def text(calibration):
    return kalibr_text(calibration)


@pytest.fixture(scope="module")
def content(text):
    return yaml.safe_load(text)


def assert_usable(content):
    assert content.keys() == {*NUMBERS, "rostopic", "update_rate"}
    for key in NUMBERS:
        assert isinstance(content[key], float), f"{key}: {content[key]!r}"
        assert 0.0 < content[key] < np.inf, f"{key}: {content[key]!r}"


def test_six_keys_and_positive_numbers(content):
    assert_usable(content)
    assert content["update_rate"] == 200
    assert content["rostopic"].startswith("/")


def test_noise_density_is_that_of_the_noisiest_axis(calibration, content):
    for sensor, quantity, truth in (
        ("gyroscope", "gyro", N_GYRO),
        ("accelerometer", "accel", N_ACCEL),
    ):
        fits = [fit for name, fit in calibration.fits.items() if name.startswith(quantity)]
        noisiest = max(fits, key=lambda fit: fit.params["N"])
        value = content[f"{sensor}_noise_density"]
        assert value == pytest.approx(noisiest.params["N"], rel=1e-5)
        low, high = noisiest.interval(0.999)["N"]
        assert low < truth < high
        assert low < value < high


def test_a_walk_that_was_not_found_is_called_an_upper_bound(text):
    # Only where the model has no slow term.
    lines = text.splitlines()
    after = {line.partition(":")[0]: below for line, below in pairwise(lines)}
    told = {key for key in NUMBERS if "no random walk was found: this is the" in after[key]}
    assert told == {"accelerometer_random_walk"}
    assert text.count("95 % upper limit") == 1


@pytest.mark.parametrize("seed", [0, marks.slow(1), marks.slow(2)])
def test_bounds_of_pure_white_noise_are_numbers(seed):
    # Six axes: where one of them leaves K all but undetermined, the file must still be usable.
    rec = recording(WhiteNoise(N_GYRO), WhiteNoise(N_ACCEL), axes="xyz", n=4000, seed=seed)
    assert_usable(yaml.safe_load(kalibr_text(gmwm.calibrate(rec, WhiteNoise()))))


def test_kalibr_never_gets_a_zero():
    # A channel of a walk alone has no white noise; Kalibr refuses zeros.
    rec = recording(WhiteNoise(N_GYRO), RandomWalk(1e-2), axes="x", n=4000)
    models = {"gyro_x": WhiteNoise(), "accel_x": RandomWalk()}
    assert_usable(yaml.safe_load(kalibr_text(gmwm.calibrate(rec, models))))


@pytest.mark.parametrize(("kept", "missing"), [("gyro", "accelerometer"), ("accel", "gyroscope")])
def test_both_sensors_are_needed(calibration, tmp_path, kept, missing):
    fits = {name: fit for name, fit in calibration.fits.items() if name.startswith(kept)}
    with pytest.raises(InputError, match=f"there is no {missing}: calibrate both"):
        gmwm.export(replace(calibration, fits=fits), "kalibr", path=tmp_path / "imu.yaml")
    assert list(tmp_path.iterdir()) == []


def test_the_file(calibration, text, tmp_path):
    path = tmp_path / "imu.yaml"
    assert gmwm.export(calibration, "kalibr", path=path) == text
    assert path.read_text() == text
    assert text.startswith("# bench.csv, 100 s static\n")


@pytest.mark.parametrize("source", ["", "two\nlines: of name", "a # b: {c", "x\u2028y\x00\x1b[3m"])
@pytest.mark.parametrize(
    "name", ["kalibr", "gtsam", "gtsam-cpp", "matlab", "gazebo", "basalt", "px4"]
)
def test_names_cannot_break_any_file(name, source):
    given = numbers(TARGETS[name].form, source=source + "\\")
    hostile = {f'{key}\n*/ --> %}}"\\': each for key, each in given.items()}
    text = gmwm.export(replace(given, axes=hostile), name)
    clean = gmwm.export(given, name)
    # One line more or less would be one that the program reads.
    assert all(c.isprintable() or c in "\n\t" for c in text)
    marks = {"gtsam-cpp": "//", "matlab": "%"}
    if name == "basalt":
        assert json.loads(text)["value0"] == json.loads(clean)["value0"]
        return
    if name == "gazebo":
        ElementTree.fromstring(text)
        # Between the comments.
        parts = [part.partition("-->")[2].partition("<!--")[0] for part in (text, clean)]
        assert "<imu>" in parts[0] and parts[0] == parts[1]
        return
    read = [
        [line for line in part.splitlines() if not line.startswith(marks.get(name, "#"))]
        for part in (text, clean)
    ]
    assert read[0] == read[1]
    assert not any(line.endswith("\\") for line in text.splitlines())


# -- the numbers are those of a bound -------------------------------------------------------------

SLOW = {"gyro": WhiteNoise(8e-5) + GaussMarkov(4e-5, 60.0),
        "accel": WhiteNoise(1e-3) + GaussMarkov(5e-4, 20.0)}  # fmt: skip


def fitted(gyro, accel, axes="xy", **changes):
    rec = recording(gyro, accel, axes=axes, **changes)
    return gmwm.calibrate(rec, {n: (gyro if n[0] == "g" else accel).opened() for n in rec.names})


@pytest.fixture(scope="module")
def slow():
    return fitted(SLOW["gyro"], SLOW["accel"], n=60_000, seed=5)


@pytest.mark.parametrize("horizon", [None, 10.0])
def test_slow_terms_count_as_a_random_walk(slow, horizon):
    content = yaml.safe_load(gmwm.export(slow, "kalibr", horizon=horizon))
    found = bound(slow, "N+K", horizon or 1.0, shared=True)
    for sensor, quantity in (("gyroscope", "gyro"), ("accelerometer", "accel")):
        one = next(iter(found.of(quantity).values()))
        assert content[f"{sensor}_noise_density"] == pytest.approx(one.N, rel=1e-6)
        assert content[f"{sensor}_random_walk"] == pytest.approx(one.K, rel=1e-6)
        # Not below what the model itself does at high frequencies.
        model = slow[f"{quantity}_x"].params
        assert 0.5 * model["sigma"] * np.sqrt(2.0 / model["tau"]) < one.K
    text = gmwm.export(slow, "kalibr", horizon=horizon)
    assert "upper limit" not in text


def test_comments_hold_consistency_and_other_horizons(slow):
    text = gmwm.export(slow, "openvins")
    assert "; NEES" in text
    joined = " ".join(line.lstrip("# ") for line in text.splitlines())
    for horizon in (10, 60, 600):
        one = next(iter(bound(slow, "N+K", horizon, shared=True).of("gyro").values()))
        assert f"{horizon} s: {one.N:.3e}, {one.K:.3e}" in joined


def test_per_axis_files_have_the_bound_of_each_axis(slow):
    found = bound(slow, "N+GM", 60.0)
    root = ElementTree.fromstring(gmwm.export(slow, "gazebo"))
    for axis in "xy":
        noise = root.find(f"angular_velocity/{axis}/noise")
        one = found[f"gyro_{axis}"]
        tau = float(noise.find("dynamic_bias_correlation_time").text)
        assert tau == pytest.approx(one.tau[0], rel=1e-6)
    # Axis z was not calibrated: its numbers bound those of the others.
    z = root.find("angular_velocity/z/noise")
    assert float(z.find("stddev").text) == pytest.approx(
        max(found[f"gyro_{axis}"].N for axis in "xy") * np.sqrt(1.0 / DT), rel=1e-6
    )


def test_two_recordings_of_different_rates(slow):
    gyro, accel = (
        replace(slow, fits={n: f for n, f in slow.items() if n.startswith(q)}, rate=rate)
        for q, rate in (("gyro", 200.0), ("accel", 100.0))
    )
    content = yaml.safe_load(gmwm.export([gyro, accel], "kalibr"))
    assert content["update_rate"] == 200.0
    text = gmwm.export((gyro, accel), "vins")
    assert "gyros at 200 Hz, accelerometers at 100 Hz" in text
    one = next(iter(bound(accel, "N+K", 1.0, shared=True).values()))
    assert yaml.safe_load(text)["acc_n"] == pytest.approx(one.N * np.sqrt(400.0), rel=1e-6)


def test_axes_of_one_sensor_in_two_calibrations_have_the_larger_numbers(slow):
    # A bound over the axes of one of them would not be one of the other's.
    parts = [replace(slow, fits={n: f for n, f in slow.items() if n[-1] == axis}) for axis in "xy"]
    for order in (parts, parts[::-1]):
        content = yaml.safe_load(gmwm.export(order, "kalibr"))
        found = bound(slow, "N+K", 1.0).of("gyro").values()
        assert content["gyroscope_random_walk"] == pytest.approx(max(each.K for each in found))
        assert content["gyroscope_noise_density"] == pytest.approx(max(each.N for each in found))


def test_without_a_rate():
    # Only files that depend on it need it.
    given = numbers("N+K", rate=float("nan"))
    for name in ("px4", "liosam", "okvis2", "maplab", "gtsam", "glim", "pyins"):
        gmwm.export(given, name)
    for name in ("kalibr", "vins", "fastlio", "ros-covariance", "matlab", "basalt"):
        with pytest.raises(InputError, match="hold no sampling rate"):
            gmwm.export(given, name)


def test_a_walk_without_a_place_for_it_is_reduced_and_the_file_says_so(calibration):
    # No stationary process bounds it.
    fits = {name: fit for name, fit in calibration.items() if name.endswith("x")}
    calibration = replace(calibration, fits=fits)
    text = gmwm.export(calibration, "kfgins", horizon=6.0)
    joined = " ".join(line.lstrip("# ") for line in text.splitlines())
    assert "gyro_x: a random walk, which N+GM cannot bound" in joined
    assert "whose filter has the right errors at the horizon" in joined
    found = reduce(calibration, "N+GM", [1.0, 3.0, 6.0], tau="shared")
    content = yaml.safe_load(text)["imunoise"]
    assert np.radians(content["arw"][0]) / 60.0 == pytest.approx(found["gyro_x"].N, rel=1e-5)
    assert content["corrtime"] * 3600.0 == pytest.approx(found["gyro_x"].tau[0], rel=1e-5)
    assert "gmwm.reduce" not in gmwm.export(calibration, "kalibr")


def table_of(text):
    """Cells of the numbers of each axis in the comments of a file."""
    rows = (line.lstrip("# ").split() for line in text.splitlines())
    return {row[0]: row[1:] for row in rows if row and re.fullmatch("(gyro|accel)_[xyz]", row[0])}


def test_the_table_has_the_one_correlation_time_of_the_file_and_what_it_costs(slow):
    text = gmwm.export(slow, "kfgins")
    content = yaml.safe_load(text)["imunoise"]
    found = bound(slow, "N+GM", 60.0, tau="shared")
    units = {"gyro": np.radians(1.0) / 3600.0, "accel": 1e-5}
    for name, (N, sigma, tau, _, *nees) in table_of(text).items():
        held = content["gbstd" if name[0] == "g" else "abstd"]["xyz".index(name[-1])]
        assert float(tau) == pytest.approx(3600.0 * content["corrtime"], rel=1e-3)
        assert float(sigma) == pytest.approx(held * units[name[:-2]], rel=1e-3)
        assert float(N) == pytest.approx(found[name].N, rel=1e-3)
        expected = found[name].nees.values()
        assert [float(v) for v in nees] == pytest.approx(list(expected), rel=0.01)


@pytest.mark.parametrize(("form", "target"), [("N+K", "kalibr"), ("N+GM", "kfgins")])
def test_consistency_that_saved_numbers_do_not_know(slow, form, target):
    saved = gmwm.export(bound(slow, form, 60.0), target)
    assert all("-" in cells or len(cells) == 4 for cells in table_of(saved).values())
    assert "NEES is not known where the file holds other numbers" in saved
    # The calibration, and numbers that the axes share, know it.
    known = gmwm.export(slow, target, horizon=60.0)
    assert not any("-" in cells for cells in table_of(known).values())
    assert "NEES is not" not in known
    if form == "N+K":
        assert "NEES is not" not in gmwm.export(bound(slow, form, 60.0, shared=True), target)


@pytest.mark.parametrize(
    ("given", "target", "options", "message"),
    [
        (None, "ros", {}, "target = 'ros': choose from kalibr, openvins"),
        (None, "kalibr", {"form": "N+GM"}, r"form N\+GM: Kalibr holds N\+K only"),
        (None, "kalibr", {"form": "N"}, "form = 'N': choose from"),
        (None, "kalibr", {"horizon": 0.0}, "horizon = 0.0: give a positive time"),
        (None, "kalibr", {"horizon": 1.0}, "the numbers are for 60 s: leave the horizon out"),
        (None, "gazebo", {}, r"the numbers have the form N\+K, the file holds N\+GM"),
        (
            [numbers("N+K"), numbers("N+K", quantities=("gyro",))],
            "kalibr",
            {},
            "gyro_x is given twice",
        ),
        (3, "kalibr", {}, "3 has no numbers to export"),
        ([], "kalibr", {}, "no numbers to export"),
    ],
)
def test_bad_input(given, target, options, message):
    with pytest.raises(InputError, match=message):
        gmwm.export(numbers("N+K") if given is None else given, target, **options)


def test_the_full_model_has_no_horizon(slow):
    with pytest.raises(InputError, match="the full model has no horizon"):
        gmwm.export(slow, "state-space", horizon=3.0)
    small = json.loads(gmwm.export(slow, "state-space", horizon=3.0, form="N+K+GM"))
    states = small["channels"]["gyro_x"]["states"]
    assert states in (["random walk", "Gauss-Markov"], ["Gauss-Markov", "random walk"])


def test_the_room_is_its_function():
    # Whichever was imported first.
    import gmwm.export as room

    assert room(numbers("N+K"), "glim") == gmwm.export(numbers("N+K"), "glim")


def test_a_walk_that_is_not_there_has_its_bound_at_every_horizon(calibration):
    text = kalibr_text(calibration)
    comments = " ".join(line.strip("# ") for line in text.splitlines() if line.startswith("#"))
    assert ", 0.000e+00" not in comments
    walk = float(yaml.safe_load(text)["accelerometer_random_walk"])
    outlook = comments.partition("accel N, K for all axes by horizon:")[2].partition("gyro_x")[0]
    assert outlook.count(f"< {walk:.3e}") == 3


# -- what the comments say is true of the file ----------------------------------------------------


def rows_of(text, mark="# "):
    """Cells of the tables in the comments, by the name of the row and its place."""
    lines = [line.removeprefix(mark).split() or [""] for line in text.splitlines()]
    return [cells for cells in lines if re.fullmatch(r"shared|(gyro|accel)_\w", cells[0])]


def test_shared_numbers_and_those_of_each_axis_have_their_own_consistency(slow):
    text = gmwm.export(slow, "openvins")
    own, shared = bound(slow, "N+K", 1.0), bound(slow, "N+K", 1.0, shared=True)
    found = rows_of(text)
    names = ["shared", "gyro_x", "gyro_y", "shared", "accel_x", "accel_y"]
    assert [row[0] for row in found] == names
    content = yaml.safe_load(text.partition("\n")[2])["imu0"]
    both = [row for row in found if row[0] == "shared"]
    for row, sensor in zip(both, ("gyroscope", "accelerometer"), strict=True):
        N, K = (content[f"{sensor}_{what}"] for what in ("noise_density", "random_walk"))
        assert [float(cell) for cell in row[1:3]] == pytest.approx([N, K], rel=1e-3)
    for name, *cells in found:
        if name != "shared":
            values = [float(cell) for cell in cells]
            assert values[:3] == pytest.approx(
                [own[name].N, own[name].K, own[name].initial_sd], rel=1e-3
            )
            # After 1 and 10 s, each with the shared numbers and with its own.
            pairs = zip(shared[name].nees.values(), own[name].nees.values(), strict=True)
            assert values[3:] == pytest.approx([v for pair in pairs for v in pair], rel=5e-3)
    assert "by axis" not in text


def test_consistency_is_that_of_the_upper_bound_where_the_file_holds_one(calibration):
    text = gmwm.export(calibration, "gtsam")
    squares = text.partition("BiasAccCovariance(np.diag([")[2]
    walk = np.sqrt(float(squares.split(",")[0]))
    row = next(row for row in rows_of(text) if row[0] == "accel_x")
    assert (row[2], float(row[3])) == ("<", pytest.approx(walk, rel=1e-3))
    # More walk than none is more cautious.
    without = bound(calibration["accel_x"], "N+K", 1.0).nees.values()
    assert all(float(cell) < nees for cell, nees in zip(row[-2:], without, strict=True))


@pytest.mark.parametrize("tau", [None, 7.0])
def test_a_slow_process_that_was_not_found_rises_as_the_largest_walk_does(calibration, tau):
    fit = calibration["accel_x"]
    axis = axis_of("accel_x", bound(fit, "N+GM", 60.0), 100.0, fit, tau)
    assert (axis.tau, axis.upper) == (tau or 60.0, {"sigma"})
    walk = gmwm.calibration.upper_limit(fit, "K")
    high = np.array([1.0])
    ratio = GaussMarkov(axis.sigma, axis.tau).psd(high, 1e-6) / RandomWalk(walk).psd(high, 1e-6)
    assert ratio == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    ("topics", "expected"),
    [
        ((), "/imu0"),
        (("/imu/data_raw",), "/imu/data_raw"),
        (("/imu", "/imu"), "/imu"),
        (("/gyro", "/accel"), "/imu0"),
        (("/imu: {x}\n",), "/imu0"),
    ],
)
def test_the_topic_is_that_of_the_bag_where_it_is_one(calibration, topics, expected):
    found = tuple(Notice("topic", "note", "", "", {"topic": name}) for name in topics)
    text = gmwm.export(replace(calibration, notices=(*calibration.notices, *found)), "kalibr")
    assert yaml.safe_load(text)["rostopic"] == expected
    assert ("set to the topic of your bag" in text) is (expected == "/imu0")
