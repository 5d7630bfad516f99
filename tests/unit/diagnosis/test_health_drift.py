"""Drift, changes of the noise, and what channels have in common."""

import numpy as np
import pytest
from scipy.stats import binom

import gmwm
from gmwm import Channel, RandomWalk, Recording, WhiteNoise
from gmwm.diagnosis.tuning import FALSE_ALARM
from marks import slow

DT = 0.01


def white(n, seed):
    return np.random.default_rng(seed).normal(size=n)


def of_kind(record, x, kind):
    return gmwm.health(record(gyro_x=x)).of("gyro_x", kind)


def test_white_noise_does_not_drift(record):
    runs = 25
    count = sum(bool(of_kind(record, white(10_000, seed), "drift")) for seed in range(runs))
    assert count <= binom.isf(1e-6, runs, FALSE_ALARM)


def test_a_ramp_is_told_with_its_size(record):
    x = white(20_000, 1) + np.linspace(-5.0, 5.0, 20_000)
    (notice,) = of_kind(record, x, "drift")
    assert notice.severity == "warning"
    # Standard error of the change: sigma (12/n)^(1/2) = 0.024.
    assert notice.values["change"] == pytest.approx(10.0, abs=0.12)


def test_a_random_walk_wanders_and_does_not_drift(record):
    runs = 40
    ramps = 0
    for seed in range(runs):
        x = gmwm.simulate(WhiteNoise(0.1) + RandomWalk(0.2), n=10_000, dt=DT, seed=seed)
        (notice,) = of_kind(record, x, "drift")
        ramps += notice.severity == "warning"
    assert ramps <= binom.isf(1e-6, runs, FALSE_ALARM)


def test_size_of_the_wander(record):
    # Means of parts of length T/64 of white noise plus a slow sine of amplitude 0.5.
    n = 64_000
    x = white(n, 2) + 0.5 * np.sin(2 * np.pi * 5.3 * np.arange(n) / n)
    (notice,) = of_kind(record, x, "drift")
    assert notice.values["wander"] == pytest.approx(0.5 / np.sqrt(2.0), rel=0.1)
    assert notice.values["white"] == pytest.approx(1.0 / np.sqrt(1000.0), rel=0.15)


@pytest.mark.parametrize("model", [WhiteNoise(0.1), slow(RandomWalk(1.0))])
def test_noise_of_one_size_does_not_change(record, model):
    runs = 50
    count = 0
    for seed in range(runs):
        x = gmwm.simulate(model, n=6000, dt=DT, seed=seed)
        count += bool(of_kind(record, x, "variance"))
    # Two tests, and the logarithm of a variance is normal for many samples only.
    assert count <= binom.isf(1e-6, runs, 3.0 * FALSE_ALARM)


@pytest.mark.parametrize(("factor", "severity"), [(1.12, "note"), (1.5, "bad")])
def test_noise_that_grows(record, factor, severity):
    x = white(100_000, 3)
    x[50_000:] *= factor
    (notice,) = of_kind(record, x, "variance")
    assert notice.severity == severity
    ratio = notice.values["second_half"] / notice.values["first_half"]
    assert ratio == pytest.approx(factor, rel=0.03)


@pytest.mark.parametrize(("at", "factor"), [(30_000, 1.2), (70_000, 0.85)])
def test_when_the_noise_changed_is_said_and_by_how_much(record, at, factor):
    """To a part of 64, and the sizes to three standard errors of 30,000 samples."""
    x = white(100_000, 12)
    x[at:] *= factor
    (notice,) = of_kind(record, x, "variance")
    found = notice.values
    assert abs(found["changed"] - DT * at) <= 1.5 * DT * x.size / 64
    assert found["size_after"] / found["size_before"] == pytest.approx(factor, rel=0.02)
    assert "it changes at about" in notice.text and "root mean square" in notice.text


def test_a_loud_tenth_is_placed(record):
    x = white(100_000, 4)
    x[42_000:48_000] *= 1.6
    (notice,) = of_kind(record, x, "variance")
    assert notice.values["loudest_tenth"] == 4
    assert "begins at 400 s" in notice.text


def test_crosstalk_is_found_whatever_the_slow_noise(record):
    n = 50_000
    common, walks = white(n, 5), np.random.default_rng(6).normal(size=(2, n)).cumsum(axis=1)
    x = white(n, 7) + 0.5 * common + 0.05 * walks[0]
    y = white(n, 8) + 0.5 * common + 0.05 * walks[1]
    found = gmwm.health(record(gyro_x=x, gyro_y=y, gyro_z=white(n, 9)))
    (notice,) = found.of(code="crosstalk")
    assert "gyro_x and gyro_y" in notice.text
    assert notice.values["correlation"] == pytest.approx(0.2, abs=0.02)  # 0.25 / 1.25


@pytest.mark.parametrize(("kind", "slope"), [("walk", 0.5), ("slow", 0.08)])
def test_temperature_that_a_channel_follows(kind, slope):
    """From one of 64 parts to the next a slow one changes by less than the noise of their means."""
    n, rng = 40_000, np.random.default_rng(11)
    walk = rng.normal(size=n).cumsum() * 0.02
    warm = walk if kind == "walk" else np.sin(8.0 * np.pi * np.arange(n) / n)
    channels = (
        Channel("gyro_x", rng.normal(size=n) + slope * warm, DT, "gyro", "rad/s"),
        Channel("gyro_y", rng.normal(size=n), DT, "gyro", "rad/s"),
        Channel("temp", warm, DT, "temperature", "degC"),
    )
    (notice,) = gmwm.health(Recording(channels)).of(code="temperature")
    assert notice.where == "gyro_x"
    assert notice.values["slope"] == pytest.approx(slope, rel=0.25)
