"""``gmwm bound``, ``gmwm reduce`` and ``gmwm certify``."""

import json

import pytest

import gmwm
from gmwm import FilterNumbers, GaussMarkov, WhiteNoise

MODELS = {
    "gyro_x": WhiteNoise(1e-4) + GaussMarkov(2e-3, 3.0),
    "accel_x": WhiteNoise(1e-3) + GaussMarkov(2e-2, 2.0),
}


@pytest.fixture(scope="module")
def calibration(tmp_path_factory):
    recording = gmwm.Recording.from_arrays(
        {name: model.simulate(3000, 0.1, i) for i, (name, model) in enumerate(MODELS.items())},
        10.0,
        {"gyro": "rad/s", "accel": "m/s^2"},
    )
    opened = {name: model.opened() for name, model in MODELS.items()}
    found = gmwm.calibrate(recording, opened, screening=())
    return found.save(tmp_path_factory.mktemp("calibration") / "calibration.json")


def test_bound_prints_and_saves_what_python_gives(run, calibration, tmp_path):
    code, printed, _ = run("bound", calibration, "--horizon", 10, "-o", "numbers.json")
    assert code == 0
    expected = gmwm.bound(gmwm.load(calibration), horizon=10.0)
    assert str(expected) in printed
    assert "wrote numbers.json" in printed
    _, printed, _ = run("bound", calibration, "--horizon", 10, "--units", "si")
    assert expected.text("si") in printed
    assert gmwm.load(tmp_path / "numbers.json").to_dict() == expected.to_dict()


def test_bound_prints_the_limit_of_a_walk_that_was_not_found(run, tmp_path):
    """It printed K = 0, by which filters divide; exports and pages had the limit."""
    x = WhiteNoise(1e-4).simulate(3000, 0.1, 1)
    rec = gmwm.Recording.from_arrays({"gyro_x": x}, 10.0, {"gyro": "rad/s"})
    cal = gmwm.calibrate(rec, "N", screening=())
    code, printed, _ = run("bound", cal.save(tmp_path / "white.json"), "-o", "white_numbers.json")
    assert code == 0
    found = gmwm.load(tmp_path / "white_numbers.json")["gyro_x"]
    assert pytest.approx(gmwm.calibration.upper_limit(cal["gyro_x"], "K")) == found.K
    assert found.upper == {"K"}
    assert "K" not in found.stderr
    assert "<= " in printed


def test_options_reach_the_bound(run, calibration):
    code, printed, _ = run(
        "bound", calibration, "--form", "N+K+GM", "--level", 0.9, "--shared", "--gyro-bias", 0.01,
        "--tau", 2.5, "--json",
    )  # fmt: skip
    assert code == 0
    found = FilterNumbers.from_dict(json.loads(printed))
    assert found.shared
    assert found["gyro_x"].form == "N+K+GM"
    assert found["gyro_x"].tau == (2.5,)
    assert found["gyro_x"].initial_sd >= 0.01 > found["accel_x"].initial_sd
    assert not any(n.code == "uncertainty-not-covered" for n in found.notices)


def test_reduce(run, calibration):
    code, printed, _ = run("reduce", calibration, "--outages", "5,20", "--json")
    assert code == 0
    found = FilterNumbers.from_dict(json.loads(printed))
    assert found.to_dict() == gmwm.reduce(gmwm.load(calibration), outages=(5.0, 20.0)).to_dict()
    code, printed, _ = run("reduce", calibration, "--keyframe", "0.5", "--json")
    assert (code, json.loads(printed)["channels"]["gyro_x"]["horizon_s"]) == (0, 0.5)
    assert list(found["gyro_x"].nees) == [5.0, 20.0, 200.0]


def test_certify_a_file_and_numbers(run, calibration, tmp_path):
    (tmp_path / "imu.yaml").write_text(
        "gyroscope_noise_density: 1e-4\ngyroscope_random_walk: 1e-6\n"
        "accelerometer_noise_density: 1e-3\naccelerometer_random_walk: 2e-5\n"
    )
    code, printed, _ = run("certify", calibration, "--imu", "imu.yaml", "-o", "certificate.json")
    assert code == 0
    expected = gmwm.load(tmp_path / "certificate.json")
    assert str(expected) in printed
    assert [(each.N, each.K) for each in expected.numbers.values()] == [(1e-4, 1e-6), (1e-3, 2e-5)]
    code, again, _ = run("certify", calibration, "-N", "1e-4,1e-3", "-K", "1e-6,2e-5")
    assert code == 0
    assert str(expected) in again


def test_certify_json_of_a_program_and_what_bound_saved(run, calibration, tmp_path):
    entries = {"gyro_noise_std": [1e-4] * 3, "gyro_bias_std": [1e-6] * 3}
    entries |= {"accel_noise_std": [1e-3] * 3, "accel_bias_std": [2e-5] * 3}
    (tmp_path / "basalt.json").write_text(json.dumps({"value0": entries}, indent=1))
    run("bound", calibration, "-o", "numbers.json")
    found = {}
    for name in ("basalt.json", "numbers.json"):
        code, printed, _ = run("certify", calibration, "--imu", name, "--json")
        assert code == 0
        found[name] = json.loads(printed)["checks"]
    assert len(found["basalt.json"]) > 0
    assert all(check["nees"] < 1.001 for check in found["numbers.json"])


def test_units_of_imperfections(run, calibration):
    code, printed, _ = run(
        "certify", calibration, "-N", "1e-4,1e-3", "-K", "1e-6,2e-5", "--motion", "car",
        "--scale-error", 0.5, "--misalignment", 0.2, "--g-sensitivity", 0.01, "--time-offset", 5,
        "--vibration-rectification", 0.1, "--vibration", 0.5, "--json",
    )  # fmt: skip
    assert code == 0
    expected = gmwm.certify(
        gmwm.load(calibration), {"gyro": (1e-4, 1e-6), "accel": (1e-3, 2e-5)}, motion="car",
        imperfections=gmwm.Imperfections(
            0.005, 3.490658503988659e-3, 1.7797461903e-5, 0.005, 1.0197162e-5, 4.903325
        ),
    )  # fmt: skip
    found = json.loads(printed)["causes"]
    assert [cause["name"] for cause in found] == [cause.name for cause in expected.causes]
    for cause, other in zip(found, expected.causes, strict=True):
        assert (cause["N"], cause["K"]) == pytest.approx((other.N, other.K), rel=1e-5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("certify", "CAL"), "--imu FILE, or -N GYRO,ACCEL and -K GYRO,ACCEL"),
        (("certify", "CAL", "-N", "1,1"), "-N and -K belong together"),
        (("certify", "CAL", "-N", "1", "-K", "1,1"), "-N 1: write a positive number for gyro and"),
        (("certify", "CAL", "-N", "1,x", "-K", "1,1"), "-N 1,x: write a positive number"),
        (("certify", "CAL", "--imu", "none.yaml"), "none.yaml: cannot be read"),
        (("certify", "CAL", "--imu", "none.json"), "none.json: cannot be read"),
        (("certify", "CAL", "-N", "1,1", "-K", "1,1", "--outages", "a"), "--outages a: write sec"),
        (("certify", "CAL", "-N", "1,1", "-K", "1,1", "--motion", "boat"), "motion 'boat' is not"),
        (("certify", "CAL", "-N", "1,1", "-K", "1,1", "--scale-error", "1"), "add --motion drone"),
        (("certify", "CAL", "-N", "1,1", "-K", "1,1", "--scale-error", "-1"), "scale_error = -0"),
        (("bound", "none.json"), "none.json: cannot be read"),
        (("bound", "CAL", "--form", "N"), "form = 'N': choose from"),
        (("bound", "CAL", "--horizon", "-1"), "horizon = -1"),
        (("bound", "CAL", "--level", "2"), "level = 2"),
        (("reduce", "CAL", "--outages", "10,x"), "--outages 10,x: write seconds"),
        (("reduce", "CAL", "--form", "K"), "form = 'K': choose from"),
    ],
)
def test_bad_input_is_one_sentence(run, calibration, arguments, message):
    code, printed, told = run(*(calibration if each == "CAL" else each for each in arguments))
    assert code == 2
    assert printed == ""
    assert message in told
    assert told.count("\n") == 1
