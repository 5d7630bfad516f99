"""Initial states, drawn many times: their errors against the standard deviations they state."""

import numpy as np
import pytest

from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.ins import tuning
from gmwm.ins.filter.aiding import Aiding, Fixes
from gmwm.ins.geometry import RATE, gravity, matrix_from_rpy, ned_difference, offset
from gmwm.ins.increments import Imu
from gmwm.ins.logs import Measured, align
from gmwm.ins.sensors import SensorModels

DT, N, LLA = 0.1, 300, np.array([0.8, 0.2, 300.0])
RPY = np.array([0.02, -0.03, 1.1])
TIMES = np.arange(1.0, 29.0)
DRAWS = 50
QUIET = WhiteNoise(1e-9)


def steady(errors, rpy):
    """Increments of an IMU in steady motion, with errors (N, 6) in rad/s and m/s^2."""
    C = matrix_from_rpy(rpy)
    rate = C.T @ (RATE * np.array([np.cos(LLA[0]), 0.0, -np.sin(LLA[0])]))
    force = C.T @ np.array([0.0, 0.0, -gravity(LLA[0], LLA[2])])
    return Imu(DT, DT * (rate + errors[:, :3]), DT * (force + errors[:, 3:]))


def fixes(rng, kind, value, sd):
    noise = sd * rng.standard_normal((TIMES.size, 3))
    seen = offset(value, noise) if kind == "position" else value + noise
    return Fixes(kind, TIMES, seen, np.full(seen.shape, sd))


def turned(angle):
    return np.angle(np.exp(1j * angle))


def near_one(standard, expected=1.0):
    """Whether normal errors have this mean square: four of its standard deviations."""
    standard = np.ravel(standard)
    assert np.mean(standard**2) == pytest.approx(
        expected, abs=4.0 * expected * np.sqrt(2.0 / standard.size)
    )


def at_rest(gyro=QUIET, accel=QUIET, gyro_bias=1e-7, accel_bias=0.0, position_sd=1.0, heading=None):
    """States found at rest, with the fixes and with the mean of the gyros' errors later."""
    rng = np.random.default_rng(1)
    models = SensorModels.of(
        {"gyro": gyro, "accel": accel}, {"gyro": gyro_bias, "accel": accel_bias}
    )
    for _ in range(DRAWS):
        errors = models.simulate(2 * N, DT, rng).total
        seen = fixes(rng, "position", np.tile(LLA, (TIMES.size, 1)), position_sd)
        start = align(
            Measured(
                steady(errors[:N], RPY), Aiding((seen,)), models, heading=heading, heading_sd=1e-4
            )
        )
        yield start, seen, np.mean(errors[N:, :3], axis=0)


@pytest.mark.parametrize(
    ("sensors", "expected"),
    [
        ({"accel_bias": 0.05}, 1.0),
        ({"accel": QUIET + GaussMarkov(0.05, 1e4)}, 1.0),
        # The accelerometer's mean later, which the filter will believe, differs by as much again.
        ({"accel": WhiteNoise(0.02)}, 0.5),
    ],
    ids=["bias", "slow", "white"],
)
def test_tilt(sensors, expected, monkeypatch):
    monkeypatch.setattr(tuning, "TILT_FLOOR", 1e-6)
    errors = [(start.state.rpy - RPY)[:2] / start.sd.tilt for start, *_ in at_rest(**sensors)]
    near_one(errors, expected)


def test_tilt_is_no_better_than_the_ground():
    start, *_ = next(at_rest())
    assert start.sd.tilt == pytest.approx(tuning.TILT_FLOOR, rel=1e-3)


@pytest.mark.parametrize(
    ("sensors", "expected"),
    [({"gyro_bias": 2e-6}, 1.0), ({"gyro": WhiteNoise(1e-5)}, 0.5)],
    ids=["bias", "white"],
)
def test_heading_from_the_rotation_of_the_earth(sensors, expected):
    near_one(
        [turned(s.state.rpy[2] - RPY[2]) / s.sd.heading for s, *_ in at_rest(**sensors)], expected
    )


@pytest.mark.parametrize("noise", [WhiteNoise(1e-5), QUIET + RandomWalk(3e-7)], ids=str)
def test_gyros_later_against_the_mean_that_is_subtracted(noise):
    found = at_rest(gyro=noise, heading=RPY[2])
    near_one([(later - start.gyro_bias) / start.gyro_bias_sd for start, _, later in found])


def test_position_and_velocity_at_rest():
    found = [
        (
            ned_difference(start.state.lla, LLA) / start.sd.position,
            ned_difference(seen.value[-1], seen.value[0])
            / (seen.time[-1] - seen.time[0])
            / start.sd.velocity,
        )
        for start, seen, _ in at_rest(position_sd=2.0)
    ]
    for standard in zip(*found, strict=True):
        near_one(standard)


def test_heading_from_the_course():
    rng = np.random.default_rng(2)
    models = SensorModels.of({"gyro": QUIET, "accel": QUIET}, {"gyro": 1e-6, "accel": 1e-4})
    velocity, errors = np.array([6.0, 8.0, 0.0]), []
    for _ in range(DRAWS):
        heading = np.arctan2(8.0, 6.0) + tuning.CRAB_SD * rng.standard_normal()
        imu = steady(models.simulate(N, DT, rng).total, np.array([0.0, 0.0, heading]))
        positions = offset(np.tile(LLA, (TIMES.size, 1)), TIMES[:, None] * velocity)
        aiding = Aiding((
            fixes(rng, "position", positions, 1.0),
            fixes(rng, "velocity", np.tile(velocity, (TIMES.size, 1)), 0.4),
        ))  # fmt: skip
        start = align(Measured(imu, aiding, models))
        assert start.gyro_bias_sd is None
        errors.append(turned(start.state.rpy[2] - heading) / start.sd.heading)
    near_one(errors)
