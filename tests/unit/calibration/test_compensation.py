"""What curves are for: simulation, compensation, and noise at a temperature."""

import numpy as np
import pytest

import gmwm
from gmwm import RandomWalk, WhiteNoise
from gmwm.calibration import compensated
from gmwm.filter_numbers import error_budget
from gmwm.ins import SensorModels

N, K, SIZE, DT = 1e-3, 2e-5, 4096, 0.2
GROWTH = np.log(1.5) / 40.0
MODEL = WhiteNoise() + RandomWalk()
AXES = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
UNITS = {"gyro": "rad/s", "accel": "m/s^2", "temperature": "degC"}


def cycles(low=25.0, high=65.0, size=SIZE):
    wave = np.cos(4.0 * np.pi * np.arange(size) / size)
    return 0.5 * (low + high) - 0.5 * (high - low) * wave


def recording(errors, temperature):
    arrays = dict(zip(AXES, errors.T, strict=False)) | {"temperature": temperature}
    return gmwm.Recording.from_arrays(arrays, 1.0 / DT, UNITS)


def calibrated(rec):
    words = {"temperature": "quadratic"}
    return gmwm.calibrate(rec, MODEL, covariates=words, screening=(), jobs=1)


@pytest.fixture(scope="module")
def first():
    """Of a sensor whose noise grows by a half from 25 to 65 degC."""
    rng, temperature, errors = np.random.default_rng(1), cycles(), np.empty((SIZE, 6))
    u = (temperature - 45.0) / 20.0
    for k in range(6):
        white = N / np.sqrt(DT) * np.exp(GROWTH * (temperature - 45.0)) * rng.standard_normal(SIZE)
        walk = RandomWalk(K).simulate(SIZE, DT, rng)
        errors[:, k] = white + walk + (1.0 + k) * 0.01 * (u + 0.3 * u**2)
    return calibrated(recording(errors, temperature))


def drawn(cal, temperature, seed=2):
    rng = np.random.default_rng(seed)
    return SensorModels.of(cal).simulate(SIZE, DT, rng, {"temperature": temperature}).total


@pytest.mark.slow
def test_what_is_simulated_from_a_calibration_is_calibrated_alike(first):
    temperature = cycles(27.0, 63.0)
    again = calibrated(recording(drawn(first, temperature), temperature))
    at = np.linspace(28.0, 62.0, 6)
    for axis in AXES:
        one, other = first.curves[axis], again.curves[axis]
        difference = other(at) - other(45.0) - one(at) + one(45.0)
        assert np.all(np.abs(difference) < 2.0 * other.errors(other.contrast(at))), axis
        error = 1.7 * other.scaling.error
        assert abs(other.scaling.gamma - one.scaling.gamma) < error, axis
        N_there = first[axis].params["N"] * one.noise_factor(45.0)
        assert again.at(45.0)[axis].params["N"] == pytest.approx(N_there, rel=0.1)


def test_what_a_curve_adds_is_taken_away(first):
    """Simulated with and without a temperature of the same seed, and compensated."""
    temperature = cycles(27.0, 63.0)
    with_curve = drawn(first, temperature)
    slow = SensorModels.of(first).simulate(SIZE, DT, np.random.default_rng(2)).slow
    rec = first.compensated(recording(with_curve, temperature))
    for k, axis in enumerate(AXES):
        curve = first.curves[axis].along({"temperature": temperature}, DT)
        left = rec[axis].values - (with_curve[:, k] - curve)
        assert np.std(left) < 2e-3 * np.std(curve)
    assert slow.shape == with_curve.shape
    assert [each.code for each in rec.notices] == ["curve-subtracted"]


def test_beyond_its_range_a_curve_is_held_and_that_is_said(first):
    temperature, still = cycles(45.0, 85.0), np.zeros((SIZE, 6))
    rec = first.compensated(recording(still, temperature))
    (said,) = rec.notices
    assert (said.code, said.severity) == ("curve-subtracted", "bad")
    assert said.values["share"] == pytest.approx(np.mean(temperature > 65.8), abs=0.02)
    assert "outside 25 to 65 degC" in said.sentence
    curve = first.curves["gyro_x"]
    hot = -rec["gyro_x"].values[np.argmax(temperature)]
    assert hot == pytest.approx(float(curve(curve.main.high) - curve(45.0)), rel=1e-2)
    with pytest.raises(gmwm.InputError, match="known from 25 to 65 degC"):
        drawn(first, temperature)
    with pytest.raises(gmwm.InputError, match="no channel 'temperature'"):
        first.compensated(gmwm.Recording.from_arrays({"gyro_x": still[:, 0]}, 5.0, UNITS))
    volts = gmwm.Recording.from_arrays(
        {"gyro_x": still[:, 0], "temperature": temperature}, 5.0, UNITS | {"temperature": "V"}
    )
    with pytest.raises(gmwm.InputError, match="is in V, its curve in degC"):
        first.compensated(volts)


def test_numbers_at_a_temperature_follow_the_noise(first):
    """N by the growth, K not at all; a second temperature takes the place of the first."""
    cold, hot = first.at(27.0), first.at(63.0)
    for axis in AXES:
        ratio = float(np.exp(36.0 * first.curves[axis].scaling.gamma))
        assert hot[axis].params["N"] / cold[axis].params["N"] == pytest.approx(ratio)
        assert hot[axis].params["K"] == first[axis].params["K"]
        assert hot.at(27.0)[axis].params["N"] == pytest.approx(cold[axis].params["N"])
        relative = hot[axis].stderr["N"] / hot[axis].params["N"]
        assert relative > first[axis].stderr["N"] / first[axis].params["N"]
        shares = [cal[axis].implied[0] / cal[axis].wv.variance[0] for cal in (first, hot)]
        assert shares[1] == pytest.approx(shares[0], rel=0.1)
    numbers = [gmwm.bound(cal["gyro_x"], horizon=10.0) for cal in (cold, hot)]
    assert numbers[1].N > 1.2 * numbers[0].N
    errors = [error_budget(cal, (1.0,)).total()["attitude"][0] for cal in (cold, hot)]
    assert errors[1] > 1.2 * errors[0]
    assert hot.source.endswith("at 63 degC")
    with pytest.raises(gmwm.InputError, match="known from 25 to 65 degC"):
        first.at(80.0)


def test_the_noise_of_a_record_is_its_mean_square(first):
    """A filter's noise over a log is that of the log's temperatures."""
    rec = recording(np.zeros((SIZE, 6)), np.full(SIZE, 60.0))
    noise = compensated(rec, first.curves)[1]
    for axis in AXES:
        assert noise[axis] == pytest.approx(float(first.curves[axis].noise_factor(60.0)))
    same = compensated(recording(np.zeros((SIZE, 6)), cycles()), first.curves)[1]
    assert same["gyro_x"] == pytest.approx(1.0, abs=0.01)


def test_noise_that_follows_the_temperature_spoils_no_fit():
    """Cycles make it come and go, which was taken for vibration; real vibration beside it is."""
    n, rate = 36_000, 10.0
    temperature = cycles(size=n)
    x = np.random.default_rng(5).standard_normal(n)
    x *= 1e-3 * np.exp(1.5 * GROWTH * (temperature - 45.0))
    bursts = np.where(np.arange(n) // 900 % 3 == 0, 1.4, 1.0)
    arrays = {"gyro_x": x, "gyro_y": x[::-1] * bursts, "temperature": temperature}
    rec = gmwm.Recording.from_arrays(arrays, rate, UNITS)
    words = {"temperature": "linear"}
    cal = gmwm.calibrate(rec, "N", covariates=words, jobs=1)
    (grows,) = [each for each in cal["gyro_x"].notices if each.code == "noise-scales"]
    assert grows.severity == "warning"
    assert cal["gyro_x"].valid and not cal["gyro_y"].valid
    assert [n.where for n in cal.notices if n.code == "variance"] == ["gyro_y"]
    assert not gmwm.calibrate(rec, "N", jobs=1)["gyro_x"].valid
