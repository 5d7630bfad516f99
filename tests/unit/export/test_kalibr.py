"""Kalibr's imu.yaml: what it holds, and that Kalibr could use it."""

import re
from dataclasses import replace

import numpy as np
import pytest
import yaml

import gmwm
from gmwm import Channel, GaussMarkov, InputError, RandomWalk, Recording, WhiteNoise
from gmwm.export.kalibr import kalibr_text, write_kalibr

DT = 0.005
N_GYRO, K_GYRO, N_ACCEL = 4e-4, 3e-4, 1.2e-3

KEYS = {
    "accelerometer_noise_density",
    "accelerometer_random_walk",
    "gyroscope_noise_density",
    "gyroscope_random_walk",
    "rostopic",
    "update_rate",
}
UNITS = {
    "accelerometer_noise_density": "m/s^2/sqrt(Hz)",
    "accelerometer_random_walk": "m/s^3/sqrt(Hz)",
    "gyroscope_noise_density": "rad/s/sqrt(Hz)",
    "gyroscope_random_walk": "rad/s^2/sqrt(Hz)",
}


def recording(gyro, accel, axes="xy", n=20_000, seed=3):
    rng = np.random.default_rng(seed)
    kinds = (("gyro", "rad/s", gyro), ("accel", "m/s^2", accel))
    return Recording(
        tuple(
            Channel(f"{quantity}_{axis}", model.simulate(n, DT, rng), DT, quantity, unit)
            for quantity, unit, model in kinds
            for axis in axes
        ),
        "bench.csv",
    )


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
    assert content.keys() == KEYS
    for key in UNITS:
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


def test_random_walk_is_that_of_the_walkiest_axis(calibration, content):
    fits = [calibration[name] for name in ("gyro_x", "gyro_y")]
    walkiest = max(fits, key=lambda fit: fit.params["K"])
    assert content["gyroscope_random_walk"] == pytest.approx(walkiest.params["K"], rel=1e-5)
    low, high = walkiest.interval(0.999)["K"]
    assert low < K_GYRO < high


def test_fast_terms_count_as_white_noise():
    # A correlation time of 20 ms averages out at 1 s, with a density of sigma sqrt(2 tau).
    fast = WhiteNoise(N_ACCEL) + GaussMarkov(2e-2, 0.02)
    rec = recording(WhiteNoise(N_GYRO), fast, axes="x")
    models = {"gyro_x": WhiteNoise(), "accel_x": fast.opened()}
    content = yaml.safe_load(kalibr_text(gmwm.calibrate(rec, models)))
    expected = np.sqrt(N_ACCEL**2 + 2.0 * 2e-2**2 * 0.02)
    assert content["accelerometer_noise_density"] == pytest.approx(expected, rel=0.05)


def line_of(text, key):
    return next(line for line in text.splitlines() if line.startswith(key))


def block_of(text, key):
    """The line of a key and the comments under it."""
    lines = text.splitlines()
    start = lines.index(line_of(text, key))
    end = start + 1
    while lines[end].startswith("#"):
        end += 1
    return "\n".join(lines[start:end])


def test_each_value_has_its_unit_and_its_axes_beside_it(text, calibration):
    for key, unit in UNITS.items():
        assert line_of(text, key).endswith(f"# {unit}")
        for name in calibration:
            kind = "gyro" if key.startswith("gyro") else "accel"
            assert (name in block_of(text, key)) is name.startswith(kind)
    assert "# Hz" in line_of(text, "update_rate")


def test_a_walk_that_was_not_found_is_called_an_upper_bound(text):
    assert "upper bound" in block_of(text, "accelerometer_random_walk")
    assert "no random walk was found" in block_of(text, "accelerometer_random_walk")
    assert "upper bound" not in block_of(text, "gyroscope_random_walk")
    assert "upper bound" not in block_of(text, "accelerometer_noise_density")


def test_bounds_of_pure_white_noise_are_numbers():
    # Six axes: where one of them leaves K all but undetermined, the file must still be usable.
    for seed in range(3):
        rec = recording(WhiteNoise(N_GYRO), WhiteNoise(N_ACCEL), axes="xyz", n=4000, seed=seed)
        content = yaml.safe_load(kalibr_text(gmwm.calibrate(rec, WhiteNoise())))
        assert_usable(content)


def test_a_bound_grows_tighter_with_a_longer_record():
    values = []
    for n in (2000, 64_000):
        rec = recording(WhiteNoise(N_GYRO), WhiteNoise(N_ACCEL), axes="x", n=n, seed=13)
        content = yaml.safe_load(kalibr_text(gmwm.calibrate(rec, WhiteNoise())))
        values.append(content["accelerometer_random_walk"])
    assert values[1] < 0.2 * values[0]


def test_kalibr_never_gets_a_zero():
    # A channel of a walk alone has no white noise; Kalibr refuses zeros.
    rec = recording(WhiteNoise(N_GYRO), RandomWalk(1e-2), axes="x", n=4000)
    models = {"gyro_x": WhiteNoise(), "accel_x": RandomWalk()}
    assert_usable(yaml.safe_load(kalibr_text(gmwm.calibrate(rec, models))))


@pytest.mark.parametrize(("kept", "missing"), [("gyro", "accelerometer"), ("accel", "gyroscope")])
def test_both_sensors_are_needed(calibration, tmp_path, kept, missing):
    fits = {name: fit for name, fit in calibration.fits.items() if name.startswith(kept)}
    with pytest.raises(InputError, match=f"there is no {missing}: calibrate both"):
        write_kalibr(replace(calibration, fits=fits), tmp_path / "imu.yaml")
    assert list(tmp_path.iterdir()) == []


def test_the_file(calibration, text, tmp_path):
    path = tmp_path / "imu.yaml"
    assert write_kalibr(calibration, path) == path
    assert path.read_text() == text
    assert re.match(r"# bench\.csv, 100 s static\n", text)


def test_a_folder_that_is_not_there(calibration, tmp_path):
    with pytest.raises(InputError, match=r"imu\.yaml: cannot be written"):
        write_kalibr(calibration, tmp_path / "nowhere" / "imu.yaml")


@pytest.mark.parametrize("source", ["", "two\nlines: of name", "a # b: {c"])
def test_the_name_of_the_source_cannot_break_the_file(calibration, source):
    assert_usable(yaml.safe_load(kalibr_text(replace(calibration, source=source))))
