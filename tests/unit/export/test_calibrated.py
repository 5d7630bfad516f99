"""Files of calibrations: the numbers of `gmwm.bound`, and files that programs can use."""

import json
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest
import yaml

import gmwm
import marks
from gmwm import Channel, GaussMarkov, InputError, RandomWalk, Recording, WhiteNoise, bound, reduce
from gmwm.export import TARGETS
from gmwm.filter_numbers import usable
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


def explained(given, target, horizon=None):
    return TARGETS[target].explain([given], horizon)


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
    with pytest.raises(InputError, match=f"the {missing} is missing, .*: calibrate both"):
        gmwm.export(replace(calibration, fits=fits), "kalibr", path=tmp_path / "imu.yaml")
    assert list(tmp_path.iterdir()) == []


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


@pytest.fixture(scope="module")
def stepped(slow):
    """The same with a step in every axis y."""
    step = (Notice("step", "bad", "", "a step", {}),)
    fits = {n: replace(f, notices=step if n[-1] == "y" else ()) for n, f in slow.items()}
    return replace(slow, fits=fits)


@pytest.mark.parametrize("horizon", [None, marks.slow(10.0)])
def test_slow_terms_count_as_a_random_walk(slow, horizon):
    content = yaml.safe_load(gmwm.export(slow, "kalibr", horizon=horizon))
    found = bound(slow, "N+K", horizon or 60.0, shared=True)
    for sensor, quantity in (("gyroscope", "gyro"), ("accelerometer", "accel")):
        one = next(iter(found.of(quantity).values()))
        assert content[f"{sensor}_noise_density"] == pytest.approx(one.N, rel=1e-6)
        assert content[f"{sensor}_random_walk"] == pytest.approx(one.K, rel=1e-6)
        # At no frequency below the model.
        f = np.geomspace(1e-4, 50.0, 60)
        for axis in "xy":
            model = slow[f"{quantity}_{axis}"].model
            assert np.all(one.model.psd(f, DT) > 0.999 * model.psd(f, DT))
    text = gmwm.export(slow, "kalibr", horizon=horizon)
    assert "upper limit" not in text


YAML = ("kalibr", "vins", "orbslam3", "fastlio", "liosam", "kimera", "okvis2", "maplab")


@pytest.mark.parametrize(
    ("is_valid", "source"), [(True, "a long name of a file " * 20), (False, "bench.csv")]
)
@pytest.mark.parametrize("name", sorted(TARGETS))
def test_files_have_six_lines_and_yaml_twelve(slow, stepped, name, is_valid, source):
    given = slow if is_valid else stepped
    text = gmwm.export(replace(given, source=source), name)
    marks = {"gtsam-cpp": "//", "matlab": "%"}
    lines = text.splitlines()
    comments = [line for line in lines if line.startswith(marks.get(name, "#"))]
    if name == "gazebo":
        comments = text.partition("-->")[0].splitlines()
    if name in ("basalt", "glim", "state-space"):
        comments = json.loads(text)["comment"]
    assert 4 <= len([line for line in comments if "pragma" not in line]) <= 6
    assert sum("not valid, do not use: gyro_y" in line for line in comments) == (not is_valid)
    if name in YAML:
        assert len(lines) <= 12
    if name == "kalibr":
        invalid = tuple(each.partition("_")[0] for each, fit in given.items() if not fit.valid)
        marked = [
            line.partition(":")[0] for line in lines if line.endswith("do not use: not valid")
        ]
        assert marked == [key for key in NUMBERS if key.startswith(invalid)]


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
    about = TARGETS["vins"].explain([gyro, accel])
    assert "gyros at 200 Hz, accelerometers at 100 Hz" in about
    one = next(iter(bound(accel, "N+K", 60.0, shared=True).values()))
    assert yaml.safe_load(text)["acc_n"] == pytest.approx(one.N * np.sqrt(400.0), rel=1e-6)


def test_axes_of_one_sensor_in_two_calibrations_share_one_bound(slow):
    parts = [replace(slow, fits={n: f for n, f in slow.items() if n[-1] == axis}) for axis in "xy"]
    whole = yaml.safe_load(gmwm.export(slow, "kalibr"))
    for order in (parts, parts[::-1]):
        content = yaml.safe_load(gmwm.export(order, "kalibr"))
        for key in NUMBERS:
            assert content[key] == pytest.approx(whole[key], rel=1e-5)


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
    assert "# N+GM for outages up to 6 s, reduce" in text
    joined = " ".join(explained(calibration, "kfgins", 6.0).split())
    assert "consistent on average, since no N+GM covers a random walk" in joined
    found = reduce(calibration, "N+GM", [1.0, 3.0, 6.0], tau="shared")
    content = yaml.safe_load(text)["imunoise"]
    assert np.radians(content["arw"][0]) / 60.0 == pytest.approx(found["gyro_x"].N, rel=1e-5)
    assert content["corrtime"] * 3600.0 == pytest.approx(found["gyro_x"].tau[0], rel=1e-5)
    assert "gmwm.reduce" not in explained(calibration, "kalibr")


def test_the_file_has_the_one_correlation_time_that_costs_least(slow):
    content = yaml.safe_load(gmwm.export(slow, "kfgins"))["imunoise"]
    found = bound(slow, "N+GM", 60.0, tau="shared")
    units = {"gyro": np.radians(1.0) / 3600.0, "accel": 1e-5}
    for name, one in found.items():
        held = content["gbstd" if name[0] == "g" else "abstd"]["xyz".index(name[-1])]
        assert one.tau == pytest.approx((3600.0 * content["corrtime"],), rel=1e-5)
        assert one.sigma == pytest.approx((held * units[name[:-2]],), rel=1e-5)
    assert found.text("si") in explained(slow, "kfgins")


@pytest.mark.parametrize(
    ("given", "target", "options", "message"),
    [
        (None, "ros", {}, "target = 'ros': choose from kalibr, openvins"),
        (None, "kalibr", {"form": "N+GM"}, r"form N\+GM: Kalibr takes N\+K only"),
        (None, "kalibr", {"form": "N"}, "form = 'N': choose from"),
        (None, "kalibr", {"horizon": 0.0}, "horizon = 0.0: give a positive time"),
        (None, "kalibr", {"horizon": 1.0}, "the numbers are for 60 s: leave the horizon out"),
        (None, "gazebo", {}, r"the numbers have the form N\+K, but the file needs N\+GM"),
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


def test_a_walk_that_is_not_there_has_its_limit_at_every_horizon(calibration):
    walk = yaml.safe_load(kalibr_text(calibration))["accelerometer_random_walk"]
    fits = {name: fit for name, fit in calibration.items() if name[0] == "a"}
    for horizon in (10.0, 60.0, 600.0):
        found = usable(fits, horizon=horizon, shared=True)["accel_x"]
        assert pytest.approx(walk, rel=1e-6) == found.K
    assert "K is the 95 % upper limit" in explained(calibration, "kalibr")


def test_consistency_is_that_of_the_limit_where_the_file_holds_one(calibration):
    text = gmwm.export(calibration, "gtsam")
    squares = text.partition("BiasAccCovariance(np.diag([")[2]
    found = usable(calibration)["accel_x"]
    assert np.sqrt(float(squares.split(",")[0])) == pytest.approx(found.K, rel=1e-5)
    # More walk than none is more cautious.
    without = bound(calibration["accel_x"].model, "N+K", 60.0, dt=DT)
    assert all(found.nees[time] < nees for time, nees in without.nees.items())


@pytest.fixture(scope="module")
def open_walks():
    """Without a walk; one gyro has a fast Gauss-Markov term, beside which a walk is left open."""
    gyro = WhiteNoise(N_GYRO) + GaussMarkov(N_GYRO, 0.1)
    found = gmwm.calibrate(recording(gyro, WhiteNoise(N_ACCEL)), WhiteNoise())
    fit = replace(found["gyro_x"], model=gyro)
    return replace(found, fits={**found.fits, "gyro_x": fit}, rivals={"gyro_x": (gyro + WALK,)})


WALK = RandomWalk(4e-5)


def test_one_value_for_all_covers_the_walk_that_each_axis_leaves_open(open_walks):
    closed = replace(open_walks, rivals={})
    limit = gmwm.calibration.upper_limit(closed["gyro_y"], "K")
    assert 0.0 < bound(closed["gyro_x"], "N+K", 60.0).K < 0.1 * limit
    text = kalibr_text(closed)
    assert yaml.safe_load(text)["gyroscope_random_walk"] == pytest.approx(limit, rel=1e-5)
    assert "no such term was found: gyro K, accel K" in text
    shared = bound(closed, shared=True)["gyro_x"]
    assert limit == shared.K and "K" in shared.upper and "K" not in shared.stderr


@pytest.mark.parametrize("form", ["N+K", "N+K+GM", "N+GM"])
def test_the_numbers_of_an_axis_cover_the_walk_that_a_fast_term_leaves_open(open_walks, form):
    found = bound(open_walks, form)["gyro_x"]
    assert found.upper == {"K" if "K" in form else "sigma"}
    f = np.geomspace(1.0 / 60.0, 50.0, 50)
    with_walk = open_walks["gyro_x"].model + WALK
    assert np.all(found.model.psd(f, DT) > 0.7 * with_walk.psd(f, DT))
    assert bound(open_walks, form).to_dict() == usable(open_walks, form).to_dict()


def test_the_library_has_the_limit_of_a_walk_as_files_have(calibration):
    fit = calibration["accel_x"]
    for found in (bound(fit), bound(calibration)["accel_x"], usable(calibration)["accel_x"]):
        assert gmwm.calibration.upper_limit(fit, "K") == pytest.approx(found.K)
        assert found.upper == {"K"}


def test_numbers_that_do_not_cover_an_open_walk_are_not_called_safe(open_walks):
    small, right = (
        gmwm.certify(
            open_walks, {"gyro": (1.2 * N_GYRO, K), "accel": (N_ACCEL, 1e-3)}, keyframe=1.0
        )
        for K in (1e-9, 1e-3)
    )
    assert "but only without the random walk that is left open" in " ".join(str(small).split())
    assert "- take the row 'error model'" in str(small)
    (told,) = (each for each in small.notices if each.code == "walk-not-covered")
    assert told.where == "gyro" and told.values["nees"] > 1.2
    assert "safe on all axes, if" in " ".join(str(right).split())


@pytest.mark.parametrize("tau", [None, 7.0])
def test_a_slow_process_that_was_not_found_rises_as_the_largest_walk_does(calibration, tau):
    fit = calibration["accel_x"]
    found = usable({"accel_x": fit}, "N+GM", 7.0 if tau else 60.0)["accel_x"]
    assert found.tau == (tau or 60.0,)
    (limit,) = (n for n in found.notices if n.code == "upper-limit")
    assert limit.values == {"sigma": found.sigma[0]}
    walk = gmwm.calibration.upper_limit(fit, "K")
    high = np.array([1.0])
    ratio = found.model.terms[1].psd(high, 1e-6) / RandomWalk(walk).psd(high, 1e-6)
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


def test_K_of_a_record_shorter_than_the_outage_is_not_for_use(calibration, text):
    """Terminal and page said so, the file and the certificate did not."""
    lines = [line for line in text.splitlines() if line.endswith("do not use: record too short")]
    assert [line.split(":")[0] for line in lines] == [NUMBERS[1], NUMBERS[3]]
    certificate = gmwm.certify(calibration, {"gyro": (N_GYRO, K_GYRO), "accel": (N_ACCEL, 1e-6)})
    assert "record is too short for this horizon" in " ".join(certificate.text().split())
