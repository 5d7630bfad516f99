"""Stretches at rest of a field log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm.diagnosis import find_still, rest_of
from gmwm.diagnosis.still import loudness
from gmwm.errors import InputError
from gmwm.process import Resonance, WhiteNoise
from marks import slow

RATE = 100.0
GYRO, ACCEL = 1e-4, 1e-3  # u/sqrt(Hz)


def log(*phases, seed=1, rate=RATE):
    """A recording of phases ("rest", "idle" or "move", s), and the stretches at rest."""
    rng = np.random.default_rng(seed)
    bias, force = rng.normal(0.0, 2e-3, 3), np.array([0.1, -0.2, 9.79])
    parts, rest, begin = [], [], 0.0
    for what, length in phases:
        t = np.arange(round(length * rate))[:, None] / rate
        samples = np.column_stack([bias + 0.0 * t, force + 0.0 * t])
        if what != "rest":  # an engine: a line, and broad vibration
            size = 0.05 if what == "idle" else 0.5
            samples[:, 3:] += size * np.sin(6.28 * 23.0 * t + rng.uniform(0.0, 6.0, 3))
            samples[:, 3:] += 0.3 * size * rng.normal(size=(t.size, 3))
            samples[:, :3] += 0.05 * size * np.sin(6.28 * 23.0 * t + rng.uniform(0.0, 6.0, 3))
        if what == "move":
            samples[:, :3] += 0.3 * np.sin(6.28 * 0.2 * t + [0.0, 1.0, 2.0])
            samples[:, 3:] += 1.5 * np.sin(6.28 * 0.1 * t)
        if what == "rest":
            rest.append((begin, begin + length))
        parts.append(samples)
        begin += length
    values = np.concatenate(parts)
    values += rng.normal(size=values.shape) * np.sqrt(rate) * np.repeat([GYRO, ACCEL], 3)
    names = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    return gmwm.Recording.from_arrays(dict(zip(names, values.T, strict=True)), rate, units), rest


FLIGHT = (("rest", 40.3), ("idle", 12.0), ("move", 50.0), ("idle", 8.0), ("rest", 30.0))
STOPS = (("rest", 25.0), ("move", 20.0), ("rest", 15.7), ("move", 25.0), ("rest", 12.0))
DRIVE = (*STOPS, ("idle", 30.0))


@pytest.mark.parametrize("phases", [FLIGHT, DRIVE, FLIGHT[::-1], DRIVE[::-1]])
@pytest.mark.parametrize(("seed", "rate"), [(1, 100.0), (2, 200.0), (3, 63.0)])
def test_stretches_are_found_to_a_second(phases, seed, rate):
    recording, rest = log(*phases, seed=seed, rate=rate)
    found = find_still(recording)
    assert len(found.stretches) == len(rest)
    assert np.max(np.abs(np.array(found.stretches) - rest)) < 1.0
    assert found.longest == pytest.approx(max(b - a for a, b in rest), abs=1.0)


@pytest.mark.parametrize("freedom", [3, 5])
@pytest.mark.parametrize("phases", [FLIGHT, STOPS])
def test_noise_of_heavy_tails_is_at_rest_whole(phases, freedom):
    """Where blocks with large samples are left out, the noise of the others is too small."""
    recording, rest = log(*phases)
    rng = np.random.default_rng(4)
    drawn = rng.standard_t(freedom, size=(6, recording.n))
    channels = [
        replace(c, values=c.values + np.sqrt(RATE) * (ACCEL if c.quantity == "accel" else GYRO) * x)
        for c, x in zip(recording.channels, drawn, strict=True)
    ]
    found = find_still(replace(recording, channels=tuple(channels)))
    assert len(found.stretches) == len(rest)
    assert np.max(np.abs(np.array(found.stretches) - rest)) < 1.0


@pytest.mark.parametrize(("on", "period"), [(0.25, 2.0), (0.5, 2.0), (0.8, 3.0)])
def test_what_shakes_now_and_then_is_no_rest(on, period):
    recording, _ = log(("rest", 60.0), ("move", 40.0), ("rest", 60.0))
    t, rng = np.arange(recording.n) / RATE, np.random.default_rng(5)
    shaken = (t > 100.0) & (t % period < on)
    channels = [
        replace(c, values=c.values + 3.0 * np.nanstd(c.values[:5000]) * shaken * noise)
        for c, noise in zip(recording.channels, rng.normal(size=(6, recording.n)), strict=True)
    ]
    found = find_still(replace(recording, channels=tuple(channels)))
    assert len(found.stretches) == 1
    assert found.stretches[0][1] == pytest.approx(60.0, abs=1.0)


def test_an_engine_is_no_rest_though_it_is_the_quietest_there_is():
    recording, _ = log(("idle", 40.0), ("move", 30.0), ("idle", 20.0))
    found = find_still(recording)
    assert found.stretches == ()
    assert len(found.vibrating) == 2
    assert found.timeline[0] == found.timeline[-1] == "~"
    (moves,) = gmwm.health(recording).of(code="not-static")
    assert "start" not in moves.values
    assert "those without motion vibrate" in moves.hint


def test_health_names_the_stretch_that_calibrate_uses():
    recording, _ = log(("idle", 40.0), ("move", 30.0), ("rest", 20.0))
    (stretch,) = find_still(recording).stretches
    (moves,) = gmwm.health(recording).of(code="not-static")
    assert (moves.values["start"], moves.values["stop"]) == stretch


def vibrating(size, *stretches, seconds=300.0, seed=1, axes=range(6), line=True):
    """A recording at rest that vibrates in some stretches, in standard deviations of the noise."""
    recording, _ = log(("rest", seconds), seed=seed)
    rng = np.random.default_rng([seed, 1])
    t = np.arange(recording.n) / RATE
    on = np.any([(t >= a) & (t < b) for a, b in stretches], axis=0)
    for axis in axes:
        channel = recording.channels[axis]
        deviation = np.sqrt(RATE) * (GYRO if channel.quantity == "gyro" else ACCEL)
        wave = np.sqrt(2.0) * np.sin(6.28 * 23.0 * t + axis) if line else rng.normal(size=t.size)
        channel.values[:] += size * deviation * on * wave
    return recording


@pytest.mark.parametrize("line", [True, False])
@pytest.mark.parametrize("share", [0.05, 0.6])
@pytest.mark.parametrize("size", [1.5, slow(3.0), 10.0])
def test_what_only_vibrates_is_no_rest(size, share, line):
    begin, end = 100.0, 100.0 + 300.0 * share
    found = rest_of(vibrating(size, (begin, end), axes=range(3, 6), line=line))
    assert found is not None
    wanted = [(0.0, begin), (end, 300.0)]
    assert np.max(np.abs(np.array(found.stretches) - wanted)) < 1.5


def test_what_is_shaken_between_short_stops_has_no_stretch():
    found = rest_of(vibrating(10.0, *((s, s + 12.0) for s in range(8, 300, 20)), line=False))
    assert found is not None
    assert found.stretches == ()
    assert found.longest == pytest.approx(8.0, abs=1.0)


@pytest.mark.parametrize(
    "kind",
    ["student", "laplace", "walk", "rounded", "line", "resonance", "warm-up", "shocks", "steps"],
)
def test_noise_whose_scatter_varies_is_at_rest(kind):
    recording, _ = log(("rest", 300.0))
    rng = np.random.default_rng(3)
    n = recording.n
    t, shocks = np.arange(n) / RATE, rng.integers(n - 150, size=5)
    for channel in recording.channels:
        values = channel.values
        deviation = np.sqrt(RATE) * (GYRO if channel.quantity == "gyro" else ACCEL)
        if kind == "student":
            values += deviation * rng.standard_t(3, n)
        elif kind == "laplace":
            values += deviation * rng.laplace(size=n)
        elif kind == "walk":
            values += 0.3 * deviation * np.cumsum(rng.normal(size=n))
        elif kind == "rounded":
            values += 0.02 * deviation * np.cumsum(rng.normal(size=n))
            values[:] = np.round(values / (4.0 * deviation)) * 4.0 * deviation
        elif kind == "line":
            values += 10.0 * deviation * np.sin(6.28 * 17.0 * t)
        elif kind == "resonance":
            narrow = Resonance(5.0 * deviation, 11.0, 0.005)
            values += gmwm.simulate(narrow, n, 1.0 / RATE, seed=rng)
        elif kind == "warm-up":
            values += 1.5 * deviation * np.exp(-t / 150.0) * rng.normal(size=n)
        elif kind == "shocks":
            for at in shocks:
                values[at : at + 150] += 50.0 * deviation * rng.normal(size=150)
        elif kind == "steps":
            for at in rng.integers(n, size=10):
                values[at:] += 2.0 * deviation * rng.normal()
    assert rest_of(recording) is None


def test_a_shock_does_not_cut_a_stretch():
    recording, _ = log(*FLIGHT)
    recording["accel_x"].values[2000:2020] += 3.0
    assert len(find_still(recording).stretches) == 2


def test_less_than_a_second_at_rest_at_the_beginning():
    recording, rest = log(("rest", 1.0), ("move", 12.0), ("rest", 20.0))
    assert np.max(np.abs(np.array(find_still(recording).stretches) - rest[1:])) < 1.0


def test_a_boat_is_never_at_rest():
    recording, _ = log(("rest", 120.0))
    t = np.arange(recording.n) / RATE
    recording["gyro_x"].values[:] += 0.02 * np.cos(6.28 * 0.1 * t)
    recording["accel_y"].values[:] += 9.8 * 0.02 / 0.628 * np.sin(6.28 * 0.1 * t)
    assert find_still(recording).stretches == ()


@pytest.mark.parametrize("seed", range(3))
def test_noise_of_one_axis_is_not_cut_up_beside_what_is_twice_as_loud(seed):
    # A block of one axis has a sixth of the samples, and scatters the more by chance.
    noise = WhiteNoise(GYRO).simulate(72_000, 1.0 / RATE, seed)
    noise[36_000:] *= 2.0
    recording = gmwm.Recording.from_arrays({"gyro_x": noise}, RATE, {"gyro": "rad/s"})
    found = rest_of(recording)
    (stretch,) = found.stretches
    assert stretch == pytest.approx((0.0, 360.0), abs=1.0)


def test_they_are_calibrated_jointly():
    recording, rest = log(*FLIGHT)
    recording = replace(recording, channels=recording.channels[::5])
    cal = gmwm.calibrate(recording, WhiteNoise())
    for name, fit in cal.items():
        low, high = fit.interval(0.999)["N"]
        assert low < (GYRO if name.startswith("gyro") else ACCEL) < high
        assert len(fit.wv.parts) == 2
        assert fit.valid
    (notice,) = [each for each in cal.notices if each.code == "still-stretches"]
    assert notice.values["stretches"] == 2
    assert notice.values["longest"] == pytest.approx(40.0, abs=1.0)
    assert notice.values["total"] == pytest.approx(sum(b - a for a, b in rest), abs=3.0)
    assert cal.n * recording.dt == pytest.approx(notice.values["total"], abs=0.1)


def test_a_log_without_rest_is_refused_with_the_longest_stretch():
    recording, _ = log(("move", 40.0), ("rest", 6.0), ("move", 30.0))
    with pytest.raises(InputError, match=r"longest stretch at rest has 5\.\d+ s") as caught:
        gmwm.calibrate(recording, WhiteNoise())
    assert caught.value.code == "no-rest"
    one = replace(recording, channels=recording.channels[:1])
    assert gmwm.calibrate(one, WhiteNoise(), still=False).n == recording.n


def test_a_short_lull_does_not_make_the_rest_loud():
    """Four seconds at a third of the noise are no level to compare with, forty are one."""
    noise = np.random.default_rng(3).chisquare(24, (800, 1)) / 24.0
    for blocks, found in ((16, 0), (160, 640)):
        scatter = noise.copy()
        scatter[:blocks] *= 0.1
        loud = loudness(scatter, np.zeros(1)).loud
        assert np.count_nonzero(loud) == pytest.approx(found, abs=5)
