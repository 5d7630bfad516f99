"""Samples that are written several times."""

from __future__ import annotations

import numpy as np
import pytest
from examining import examined
from scipy.signal import lfilter

import gmwm
from gmwm.diagnosis.repeats import held_samples
from marks import every, slow


def held(times, n, seed=1, first=0, step=0.0):
    values = np.random.default_rng(seed).normal(size=n // times + 2)
    if step:
        values = step * np.rint(values / step)
    return np.repeat(values, times)[times - first :][:n]


@pytest.mark.parametrize(("times", "first"), [(2, 0), (2, 1), (5, 3), (40, 0)])
@pytest.mark.parametrize("step", [0.0, 0.5])
def test_repeated_samples_are_named_with_their_own_rate(record, times, first, step):
    n = 20_000
    x = held(times, n, first=first, step=step)
    gyro = np.random.default_rng(2).normal(size=n)
    found = gmwm.health(record(rate=200.0, gyro_x=gyro, accel_x=x))
    (notice,) = found.of("accel_x", "repeated-samples")
    assert notice.severity == "note"
    assert notice.values == {"times": times, "rate": 200.0 / times}
    assert found.repetition("accel_x") == gmwm.diagnosis.Repetition(times, first)
    assert found.repetition("gyro_x") is None
    assert not found.events("accel_x")
    assert {notice.code for notice in found.of("accel_x")} <= {
        "repeated-samples",
        "rounding",
        "clean",
    }


def test_they_are_seen_beside_missing_rows(record):
    x = held(2, 20_000)
    x[4001:4020] = np.nan
    assert gmwm.health(record(accel_x=x)).repetition("accel_x").times == 2


@pytest.mark.parametrize("measured", [(1, 1, 0), (1, 1, 0, 0, 0), (1, 1, 1, 0, 1, 0)])
def test_rows_that_are_empty_are_not_repeats(record, measured):
    x = held(1, 20_000)
    x[~np.resize(np.array(measured, bool), x.size)] = np.nan
    assert gmwm.health(record(accel_x=x)).repetition("accel_x") is None


@pytest.mark.parametrize("step", [0.0, 1.0, 4.0])
def test_samples_that_are_not_repeated(record, step):
    for seed in range(10):
        x = held(1, 5000, seed=seed, step=step)
        assert gmwm.health(record(accel_x=x)).repetition("accel_x") is None


def test_a_shock_among_them_is_found_where_it_is(record):
    x = held(4, 20_000, first=3)
    x[8003:8007] += 60.0
    found = gmwm.health(record(accel_x=x))
    ((start, stop),) = found.events("accel_x")
    assert start <= 8003 < 8007 <= stop
    assert (start - 3) % 4 == 0
    masked = found.masked(record(accel_x=x))["accel_x"]
    assert masked.missing == stop - start


def test_a_round_trip(record, tmp_path):
    found = gmwm.health(record(accel_x=held(2, 5000)))
    found.save(tmp_path / "health.json")
    assert gmwm.diagnosis.Health.load(tmp_path / "health.json").channels == found.channels


def interpolated(rate, seed, digits=None):
    """Noise of a lower rate in rows of 200 Hz, on straight lines between its samples."""
    rng = np.random.default_rng(seed)
    own = 9.8 + 0.05 * rng.normal(size=round(60 * rate) + 2)
    values = np.interp(np.arange(12_000) / 200.0, np.arange(own.size) / rate, own)
    return values if digits is None else np.round(values, digits)


@pytest.mark.parametrize(("rate", "digits"), [(63.0, None), (63.0, 6), (50.5, None), (31.0, 7)])
@pytest.mark.parametrize("seed", [0, slow(1)])
def test_linear_interpolation_is_named_and_not_modelled(rate, digits, seed):
    noise = 1e-3 * np.random.default_rng(9).normal(size=12_000)
    channels = {"accel_x": interpolated(rate, seed, digits), "gyro_x": noise}
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    rec = gmwm.Recording.from_arrays(channels, 200.0, units)
    found = gmwm.health(rec)
    (notice,) = found.of(where="accel_x")
    assert notice.code == "interpolated"
    assert notice.values["rate"] == pytest.approx(rate, rel=0.02)
    assert found.events("accel_x") == ()
    assert not found.of(where="gyro_x", code="interpolated")
    cal = gmwm.calibrate(rec, gmwm.WhiteNoise())
    assert cal.skipped["accel_x"].code == "interpolated"


@pytest.mark.parametrize("step", every(3, [0.0, 1e-4, 1e-2, 0.3, 1.0, 3.0]))
def test_noise_is_not_interpolated(step):
    noise = np.random.default_rng(3).normal(size=20_000)
    noise = np.round(noise / step) * step if step else noise
    for values in (noise, np.cumsum(noise), noise + np.sin(np.arange(noise.size) / 9.0)):
        rec = gmwm.Recording.from_arrays({"gyro_x": values}, 100.0, {"gyro": "deg/s"})
        assert not gmwm.health(rec).of(code="interpolated")
        assert not gmwm.health(rec).of(code="filled")


@pytest.mark.parametrize(("share", "severity"), [(0.03, "warning"), (0.1, "bad")])
@pytest.mark.parametrize("kind", ["white", slow("walk"), "low-pass"])
def test_samples_put_between_their_neighbours_are_named(share, severity, kind):
    rng = np.random.default_rng(5)
    noise = rng.normal(size=40_000)
    slow = {"white": noise, "walk": noise + 0.1 * np.cumsum(rng.normal(size=noise.size))}
    sound = slow.get(kind, lfilter(np.ones(4), [1.0], noise)).round(4)
    lost = np.flatnonzero(rng.random(sound.size - 2) < 1.3 * share) + 1
    lost = lost[np.diff(lost, prepend=0) > 1][: round(share * sound.size)]
    filled = sound.copy()
    filled[lost] = 0.5 * (sound[lost - 1] + sound[lost + 1])
    channels = {"gyro_x": 1e-3 * sound, "gyro_y": 1e-3 * filled}
    found = gmwm.health(gmwm.Recording.from_arrays(channels, 100.0, {"gyro": "rad/s"}))
    (notice,) = found.of(code="filled")
    assert (notice.where, notice.severity) == ("gyro_y", severity)
    assert notice.values["share"] == pytest.approx(lost.size / sound.size, rel=0.1)


@pytest.mark.parametrize("smooth", [1.0, 30.0, 1000.0])
def test_samples_of_single_precision_are_not_filled(smooth):
    noise = np.random.default_rng(6).normal(size=40_000)
    values = lfilter([1.0], [1.0, 1.0 / smooth - 1.0], noise) + 9.81
    rec = gmwm.Recording.from_arrays(
        {"gyro_x": values.astype(np.float32)}, 100.0, {"gyro": "deg/s"}
    )
    assert not gmwm.health(rec).of(code="filled")


@pytest.mark.parametrize("step", [0.1, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("law", ["normal", "laplace"])
def test_chance_explains_equal_neighbours_of_rounded_noise(step, law):
    for seed in range(10):
        noise = getattr(np.random.default_rng(seed), law)(size=5000)
        for values in (noise, np.cumsum(noise), lfilter(np.ones(4), [1.0], noise)):
            assert held_samples(examined(np.rint(values / step) * step, step=step)).share == 0.0
        # As if the temperature changed a sensitivity: hardly two samples are of one lattice.
        drifting = np.rint(noise / step) * step * (1.0 + 0.05 * np.sin(np.arange(5000) / 800.0))
        share = held_samples(examined(drifting)).share
        assert share < 0.01


@pytest.mark.parametrize("loud", [2, 5])
def test_chance_explains_equal_neighbours_of_noise_that_is_louder_at_times(loud):
    for seed in range(3):
        rng = np.random.default_rng([4, seed])
        noise = rng.normal(size=50_000) * np.where(np.arange(50_000) < 50_000 // loud, 4.0, 1.0)
        for step in (1.0, 2.8, 3.0):
            values = np.rint(noise / step) * step
            assert held_samples(examined(values, step=step)).share == 0.0
        again = np.flatnonzero(rng.random(values.size) < 0.2)[1:]
        values = np.rint(2.0 * noise)
        values[again] = values[again - 1]
        # A seventh is equal anyway, and the law gives an upper limit to what is.
        assert 0.12 < held_samples(examined(values, step=1.0)).share < 0.2


def test_a_sensor_that_is_held_keeps_the_samples_that_were_measured(record):
    noise = np.random.default_rng(5).normal(size=5000)
    values = noise.copy()
    values[100:5000:40] = values[99:4999:40]
    rec = record(gyro_x=values, gyro_y=noise)
    found = gmwm.health(rec)
    masked = found.masked(rec)
    gone = np.isnan(masked["gyro_x"].values)
    assert np.array_equal(np.flatnonzero(gone), np.arange(100, 5000, 40))
    assert masked["gyro_y"].is_complete
    assert found.channels["gyro_x"].held == pytest.approx(123 / 4999)


def test_every_fifth_sample_written_again_is_not_left_out(record):
    # Nothing would be left of how the noise goes on.
    x = np.random.default_rng(8).normal(size=20_000)
    x[4::5] = x[3::5]
    rec = record(gyro_x=x)
    found = gmwm.health(rec)
    (notice,) = found.of("gyro_x", "held")
    assert notice.severity == "bad"
    assert found.masked(rec)["gyro_x"].is_complete
    assert "samples_measured" in gmwm.calibrate(rec, gmwm.WhiteNoise())["gyro_x"].reasons
