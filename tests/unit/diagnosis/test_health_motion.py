"""Recordings that moved: when, and when they did not."""

from __future__ import annotations

from dataclasses import replace
from math import cos, hypot, sin

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

import gmwm
from gmwm import BiasInstability, GaussMarkov, RandomWalk, RateRamp, WhiteNoise
from gmwm.diagnosis import rest_of
from gmwm.diagnosis.motion import find_motion
from marks import every

RATE = 100.0
GRAVITY = 9.80665
BIAS = np.radians([0.4, -0.4, -0.3])


def turned(rate, attitude=(0.0, 0.0, GRAVITY)):
    """Gravity in the frame of a sensor that turns at ``rate`` (n, 3), rad/s."""
    x, y, z = attitude
    force, turns = [attitude], np.any(rate != 0.0, axis=1)
    for u, v, w in (rate[turns] / RATE).tolist():  # plain numbers: a tenth of the time of arrays
        angle = hypot(u, v, w)
        u, v, w = -u / angle, -v / angle, -w / angle
        c, s = cos(angle), sin(angle)
        along = (u * x + v * y + w * z) * (1.0 - c)  # Rodrigues' formula
        x, y, z = (
            x * c + (v * z - w * y) * s + u * along,
            y * c + (w * x - u * z) * s + v * along,
            z * c + (u * y - v * x) * s + w * along,
        )
        force.append((x, y, z))
    return np.array(force)[np.cumsum(turns) - turns]


def turn(n, start, stop, speed, axis):
    rate = np.zeros((n, 3))
    rate[int(start * RATE) : int(stop * RATE)] = np.radians(speed) * np.array(axis, dtype=float)
    return rate


@pytest.fixture
def moved(record):
    """A six-axis recording of a sensor that turns at a given rate, with the noise of a MEMS."""

    def _moved(rate, seed=0, gyro=3e-3, accel=2e-2, only=""):
        rng = np.random.default_rng(seed)
        n = rate.shape[0]
        series = {
            "gyro": rate + BIAS + gyro * rng.normal(size=(n, 3)),
            "accel": turned(rate) + accel * rng.normal(size=(n, 3)),
        }
        return record(
            **{
                f"{sensor}_{axis}": values[:, i]
                for sensor, values in series.items()
                for i, axis in enumerate("xyz")
                if sensor.startswith(only)
            }
        )

    return _moved


@pytest.mark.parametrize(
    ("seed", "only", "axis"),
    every(
        3,
        [
            (0, "", (0, 0, 1)),
            (1, "", (1, 0, 0)),
            (2, "gyro", (0, 0, 1)),
            (3, "gyro", (0.6, 0, 0.8)),
        ],
    ),
)
def test_a_turn_and_the_stretches_before_and_after(moved, seed, only, axis):
    recording = moved(turn(30_000, 100, 200, 60.0, axis), seed, only=only)
    found = gmwm.health(recording)
    assert [n.code for n in found.notices if n.severity == "bad"] == ["not-static"]
    assert "1 bad" in repr(found)
    (notice,) = found.of(code="not-static")
    assert notice.values["rate"] == pytest.approx(np.radians(60.0), rel=0.01)
    motion = find_motion(recording)
    (first, second) = motion.static
    assert first == (0.0, pytest.approx(97.0, abs=3.0))
    assert second == (pytest.approx(203.0, abs=3.0), 300.0)
    assert not found.of(code="clean")


@pytest.mark.parametrize("start", [100, 150])
def test_most_of_the_record_may_turn(moved, start):
    (stretch,) = find_motion(moved(turn(30_000, start, 300, 60.0, (0, 0, 1)))).static
    assert stretch == (0.0, pytest.approx(start, abs=6.0))


@pytest.mark.parametrize("angle", [5.0, -2.0, 20.0])
@pytest.mark.parametrize("only", ["", "accel"])
def test_a_tilt_is_no_spike(moved, angle, only):
    rec = moved(turn(30_000, 150, 151, angle, (0.6, 0.8, 0)), only=only)
    found = gmwm.health(rec)
    assert [n.code for n in found.notices if n.severity == "bad"] == ["tilt"]
    (notice,) = found.of(code="tilt")
    assert notice.values["angle"] == pytest.approx(np.radians(abs(angle)), rel=0.05)
    assert notice.values["time"] == pytest.approx(150.5, abs=2.0)
    assert notice.values["stop"] - notice.values["start"] == pytest.approx(146.0, abs=4.0)
    assert not found.of(code="event")
    # The turn itself is left out of the gyros from its begin to its end.
    if not only:
        masked = found.masked(rec)["gyro_x"].values[15_000:15_100]
        assert np.all(np.isnan(masked))


def test_a_shock_is_no_motion(moved):
    rate = turn(30_000, 150, 150.15, 100.0, (1, 0, 0))
    rate += turn(30_000, 150.15, 150.3, -100.0, (1, 0, 0))
    found = gmwm.health(moved(rate))
    assert not [n for n in found.notices if n.severity == "bad"]
    assert found.of("gyro_x", "event")


@pytest.mark.parametrize("at", [0, 29_994])
def test_a_shock_at_an_end_is_no_motion(moved, at):
    """All six axes of a stretch were not static for it."""
    rate = np.zeros((30_000, 3))
    rate[at : at + 6, 2] = 0.5
    found = gmwm.health(moved(rate))
    assert not found.of(code="not-static")
    assert found.of("gyro_z", "event")


def test_a_record_that_begins_moving_does_move(moved):
    rate = turn(30_000, 0, 20, 60.0, (0, 0, 1))
    assert gmwm.health(moved(rate)).of(code="not-static")


def test_an_axis_that_is_missing_warns_of_nothing(moved):
    recording = moved(np.zeros((30_000, 3)))
    gone = gmwm.Channel("accel_y", np.full(30_000, np.nan), 0.01, "accel", "m/s^2")
    channels = tuple(gone if c.name == "accel_y" else c for c in recording.channels)
    found = gmwm.health(replace(recording, channels=channels))
    assert not found.of(code="not-static")


def test_handling_by_hand(moved):
    rng = np.random.default_rng(5)
    rate = np.zeros((30_000, 3))
    box = np.ones(100) / 100.0
    for i in range(3):
        rate[10_000:20_000, i] = np.convolve(rng.normal(size=10_000), box, mode="same") * 3.0
    motion = find_motion(moved(rate))
    assert [np.round(stretch, -1).tolist() for stretch in motion.static] == [[0, 100], [200, 300]]
    # All of the time: by gravity, which turns as the gyros say, or by gyros alone.
    rate = np.tile(rate[10_000:20_000], (2, 1))
    for only in ("", "gyro"):
        motion = find_motion(moved(rate, only=only))
        assert motion.static == ()
        assert [(move.start, move.stop) for move in motion.moves] == [(0.0, 200.0)]


def test_a_boat_sways(moved):
    t = np.arange(30_000) / RATE
    rate = np.radians(0.6) * np.cos(2.0 * np.pi * t / 8.0)[:, np.newaxis] * [1.0, 0.0, 0.0]
    found = gmwm.health(moved(rate))
    (notice,) = found.of(code="not-static")
    assert "start" not in notice.values
    # Gyros that move and accelerometers that do not are no motion, but a fault or a vibration.
    still = moved(np.zeros((30_000, 3)))
    both = gmwm.Recording(
        (*moved(rate, only="gyro").channels, *(still[f"accel_{a}"] for a in "xyz"))
    )
    assert not gmwm.health(both).of(code="not-static")


def test_a_slow_tilt(moved):
    motion = find_motion(moved(turn(30_000, 0, 300, 5.0 / 300.0, (1, 0, 0))))
    (move,) = motion.moves
    assert move.tilt == pytest.approx(np.radians(5.0), rel=0.05)
    assert not move.is_tilt
    assert motion.static == ()


def test_missing_samples_hide_no_tilt(moved):
    rec = moved(turn(30_000, 150, 151, 5.0, (1, 0, 0)))
    for channel in rec.values():
        channel.values[14_500:16_500] = np.nan
        channel.values[::3] = np.nan
    (move,) = find_motion(rec).moves
    assert move.is_tilt


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    "noise",
    [
        WhiteNoise(3e-2),
        WhiteNoise(1e-4) + RandomWalk(3e-3),
        BiasInstability(1e-2),
        WhiteNoise(1e-4) + GaussMarkov(0.02, 5.0),
        WhiteNoise(1e-4) + RateRamp(5e-5),
    ],
    ids=str,
)
def test_noise_and_drift_are_no_motion(record, noise, seed):
    # Far beyond what sensors have: the levels change by more than a degree per second.
    rng = np.random.default_rng(seed)
    names = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
    series = {name: noise.simulate(30_000, 0.01, rng) for name in names}
    series["accel_z"] += GRAVITY
    assert find_motion(record(**series)).moves == ()


@pytest.mark.parametrize("seed", range(3))
def test_an_accelerometer_that_wanders_is_no_slow_tilt(record, seed):
    rng = np.random.default_rng(seed)
    series = {f"accel_{a}": RandomWalk(3e-2).simulate(30_000, 0.01, rng) for a in "xyz"}
    angle = np.hypot(series["accel_x"][-1], series["accel_y"][-1]) / GRAVITY
    assert angle > np.radians(0.5)
    series["accel_z"] += GRAVITY
    assert find_motion(record(**series)).moves == ()


def test_what_moved_is_calibrated_from_its_stretches_at_rest(moved):
    recording = moved(turn(12_000, 40, 80, 60.0, (0, 0, 1)))
    recording = replace(recording, channels=recording.channels[2::3])
    cal = gmwm.calibrate(recording, WhiteNoise())
    assert not any("recording_static" in fit.reasons for fit in cal.values())
    (notice,) = [each for each in cal.notices if each.code == "still-stretches"]
    assert notice.values["total"] == pytest.approx(80.0, abs=2.0)
    cal = gmwm.calibrate(recording, WhiteNoise(), still=False)
    assert "not-static" in {each.code for each in cal.notices}


@pytest.mark.parametrize(
    ("speed", "axis"),
    [(6.0, (0.0, 1.0, 0.0)), (6.0, (0.0, 0.1, 1.0)), (1.0, (0.0, 0.6, 0.8)), (20.0, (1, 0, 0))],
)
@pytest.mark.parametrize("only", ["", "accel"])
def test_a_turntable_that_turns_all_the_time(moved, speed, axis, only):
    axis = np.array(axis) / np.linalg.norm(axis)
    rec = moved(turn(12_000, 0, 120, speed, axis), only=only)
    motion = find_motion(rec)
    assert motion.turns_steadily
    assert motion.static == ()
    (move,) = motion.moves
    assert np.degrees(move.rate) == pytest.approx(speed, rel=0.1)
    assert rest_of(rec).stretches == ()
    (notice,) = gmwm.health(rec).of(code="not-static")
    assert notice.values["rate"] == move.rate


def test_drifts_and_walks_of_accelerometers_do_not_turn(record):
    rng = np.random.default_rng(6)
    n = 30_000
    force = 0.02 * rng.normal(size=(n, 3)) + [0.0, 0.0, GRAVITY]
    walk = np.cumsum(rng.normal(size=(n, 3)), axis=0) * 1.0 / np.sqrt(n)
    drift = np.linspace(0.0, 1.0, n)[:, None] * rng.normal(size=3)
    for slow in (walk, drift, walk + drift):
        series = dict(zip("xyz", (force + slow).T, strict=True))
        rec = record(**{f"accel_{axis}": each for axis, each in series.items()})
        assert not find_motion(rec).turns_steadily


def test_motion_of_one_recording_is_not_that_of_the_next(moved):
    spun = moved(turn(9_000, 30, 60, 60.0, (0, 0, 1)))
    first = find_motion(spun)
    assert find_motion(spun) is first
    flat = moved(np.zeros((9_000, 3)))
    assert find_motion(flat).moves == ()
    assert find_motion(spun).moves == first.moves != ()


@pytest.mark.parametrize("shared", [True, False])
def test_steady_vibration_is_seen_where_axes_share_it(record, shared):
    """A band of noise from the first sample to the last, of one axis, is a noise like any other."""
    n, rng = 20_000, np.random.default_rng(1)
    band = sosfilt(butter(4, [0.3, 0.8], "band", output="sos"), rng.standard_normal(n))
    shaking = 4.0 * band / np.std(band)
    axes = {
        f"accel_{axis}": 2e-2 * (rng.standard_normal(n) + shaking * (shared or axis == "z"))
        for axis in "xyz"
    }
    found = gmwm.health(record(**axes))
    assert not [notice for notice in found.notices if notice.severity == "bad"]
    assert len(found.of(code="crosstalk")) == (3 if shared else 0)
