import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gmwm.errors import InputError
from gmwm.ins import Imu, Trajectory, emulate
from gmwm.ins.geometry import RATE, gravity, matrix_from_rpy, offset

PLACE = np.array([math.radians(46.0), 0.1, 250.0])


def standing(rpy: np.ndarray, dt: float = 0.01, place: np.ndarray = PLACE) -> Imu:
    return emulate(Trajectory.from_arrays(dt, np.tile(place, (len(rpy), 1)), rpy))


@pytest.mark.parametrize("lat", [-60.0, 0.0, 46.0, 89.0])
@pytest.mark.parametrize("n", [1, 2, 3, 7])
def test_standing_still_it_senses_earth_rate_and_gravity(lat: float, n: int) -> None:
    rpy = np.array([0.2, -0.4, 2.0])
    place = np.array([math.radians(lat), 3.0, 250.0])
    imu = standing(np.tile(rpy, (n + 1, 1)), 0.02, place)
    C = matrix_from_rpy(rpy)
    rate = RATE * np.array([math.cos(place[0]), 0.0, -math.sin(place[0])])
    force = np.array([0.0, 0.0, -gravity(place[0], 250.0)])
    assert imu.n == n
    np.testing.assert_allclose(imu.rotation, np.tile(0.02 * C.T @ rate, (n, 1)), atol=1e-17)
    np.testing.assert_allclose(imu.velocity, np.tile(0.02 * C.T @ force, (n, 1)), rtol=1e-13)


def test_increments_are_integrals_in_the_turning_body() -> None:
    # Rolling at a constant rate, gravity turns through the body axes: sines and cosines.
    rate, dt = 3.0, 0.02
    roll = rate * dt * np.arange(200)
    imu = standing(np.stack([roll, np.zeros(200), np.zeros(200)], axis=-1), dt)
    g = gravity(PLACE[0], PLACE[2])
    # A three-point rule leaves (rate dt)^6 / 2016000 of the interval.
    np.testing.assert_allclose(imu.velocity[:, 1], g / rate * np.diff(np.cos(roll)), atol=1e-13)
    np.testing.assert_allclose(imu.velocity[:, 2], -g / rate * np.diff(np.sin(roll)), atol=1e-13)
    earth = RATE * math.cos(PLACE[0])
    np.testing.assert_allclose(imu.rotation[:, 0], (rate + earth) * dt, rtol=1e-12)


def test_along_the_equator_centripetal_and_coriolis_lift() -> None:
    # On a circle of radius a + h in inertial space, whatever of it the Earth does by herself.
    speed, h, dt, n = 200.0, 1000.0, 0.1, 300
    radius = 6378137.0 + h
    lon = speed / radius * dt * np.arange(n + 1)
    lla = np.stack([np.zeros(n + 1), lon, np.full(n + 1, h)], axis=-1)
    imu = emulate(Trajectory.from_arrays(dt, lla, np.tile([0.0, 0.0, math.pi / 2], (n + 1, 1))))
    inertial = RATE + speed / radius
    down = (RATE**2 - inertial**2) * radius + gravity(0.0, h)
    np.testing.assert_allclose(imu.velocity[:, 2] / dt, -down, rtol=1e-9)
    np.testing.assert_allclose(imu.velocity[:, :2], 0.0, atol=1e-8)
    np.testing.assert_allclose(imu.rotation[:, 1] / dt, -inertial, rtol=1e-9)


def wavy(n: int, dt: float, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    t = dt * np.arange(n + 1)
    ned = np.stack(
        [300 * np.sin(0.1 * t), 15 * t + 40 * np.cos(0.2 * t), 5 * np.sin(0.3 * t)], axis=-1
    )
    rpy = np.stack(
        [0.3 * np.sin(0.7 * t), 0.2 * np.cos(0.5 * t), 2.5 + 0.8 * np.sin(0.2 * t)], axis=-1
    )
    return offset(start, ned), rpy


def brute_force(lla: np.ndarray, rpy: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Rates and specific forces from differences in inertial space, at inner epochs."""
    t = dt * np.arange(len(lla))
    lat, lon = lla[:, 0], lla[:, 1] + RATE * t
    e2 = 6.69437999014e-3
    normal = 6378137.0 / np.sqrt(1 - e2 * np.sin(lat) ** 2)
    out = (normal + lla[:, 2]) * np.cos(lat)
    up = ((1 - e2) * normal + lla[:, 2]) * np.sin(lat)
    place = np.stack([out * np.cos(lon), out * np.sin(lon), up], axis=-1)
    # North-east-down axes in inertial space: about z by the longitude, about y by -(90 deg + lat).
    frame = Rotation.from_euler("ZY", np.stack([lon, -0.5 * np.pi - lat], axis=-1))
    body = frame * Rotation.from_euler("ZYX", rpy[:, ::-1])
    weight = np.array([gravity(a, b) for a, b in lla[:, [0, 2]]])
    pull = frame.apply(np.stack([0 * weight, 0 * weight, weight], axis=-1))
    pull[:, :2] += RATE**2 * place[:, :2] * -1.0
    acceleration = (
        -place[4:] + 16 * place[3:-1] - 30 * place[2:-2] + 16 * place[1:-3] - place[:-4]
    ) / (12 * dt * dt)
    force = body[2:-2].inv().apply(acceleration - pull[2:-2])
    one = (body[1:-3].inv() * body[3:-1]).as_rotvec() / (2 * dt)
    two = (body[:-4].inv() * body[4:]).as_rotvec() / (4 * dt)
    return (4 * one - two) / 3, force


@pytest.mark.parametrize("start", [PLACE, [-1.2, math.pi - 1e-5, 30.0], [0.0, -1.0, 2000.0]])
def test_rates_and_forces_are_those_of_inertial_space(start: np.ndarray) -> None:
    dt = 0.05
    lla, rpy = wavy(801, dt, np.asarray(start))
    imu = emulate(Trajectory.from_arrays(dt, lla, rpy))
    rate, force = brute_force(lla, rpy, dt)
    # Integrals by Simpson's rule on the differences, over two intervals.
    for sensed, seen, bound in ((imu.rotation, rate, 2e-7), (imu.velocity, force, 2e-5)):
        two = sensed[:-1] + sensed[1:]
        expected = dt / 3 * (seen[:-2] + 4 * seen[1:-1] + seen[2:])
        np.testing.assert_allclose(two[2:-2][100:-100], expected[100:-100], atol=bound)


def test_increments_are_those_of_pyins() -> None:
    sim = pytest.importorskip("pyins.sim")
    dt, n = 0.01, 3000
    lla, rpy = wavy(n, dt, np.array([0.7, 1.0, 0.0]))
    lla[:, 2] *= 0.01  # their gravity is of first order in the height
    imu = emulate(Trajectory.from_arrays(dt, lla, rpy))
    degrees = lla * np.array([180 / np.pi, 180 / np.pi, 1.0])
    _, theirs = sim.generate_imu(
        dt * np.arange(n + 1), degrees, np.degrees(rpy), sensor_type="increment"
    )
    inner = slice(200, -200)
    expected = theirs.to_numpy()[1:]
    np.testing.assert_allclose(imu.rotation[inner], expected[inner, :3], atol=1e-9)
    # Their splines run in space, where rounding is 1e-9 m, and ours over the ellipsoid: twice
    # differentiated this is some 1e-5 m/s^2, and 1e-7 m/s an increment.
    np.testing.assert_allclose(imu.velocity[inner], expected[inner, 3:], atol=1e-6)
    assert np.max(np.abs(np.mean((imu.velocity - expected[:, 3:])[inner], axis=0))) < 1e-9


def test_jumps_by_full_turns_change_nothing() -> None:
    lla, rpy = wavy(200, 0.02, PLACE)
    rpy[:, 2] += 2 * np.pi - 2.5
    turned, moved = rpy.copy(), lla.copy()
    turned[:, 2] = (rpy[:, 2] + np.pi) % (2 * np.pi) - np.pi
    turned[50:, 0] += 2 * np.pi
    moved[100:, 1] -= 2 * np.pi
    one = emulate(Trajectory.from_arrays(0.02, lla, rpy))
    other = emulate(Trajectory.from_arrays(0.02, moved, turned))
    np.testing.assert_allclose(other.rotation, one.rotation, atol=1e-13)
    np.testing.assert_allclose(other.velocity, one.velocity, atol=1e-6)


def test_angles_that_jump_are_refused() -> None:
    rpy = np.zeros((9, 3))
    rpy[4:, 0] = rpy[4:, 2] = 3.0  # over the top of a looping
    with pytest.raises(InputError, match=r"roll turns by 172 deg from epoch 3 to 4"):
        standing(rpy)


def test_errors_are_added() -> None:
    imu = standing(np.zeros((6, 3)))
    gyro, accel = np.full((5, 3), 1e-3), np.arange(15.0).reshape(5, 3)
    wrong = imu.with_errors(gyro, accel)
    np.testing.assert_allclose(wrong.rotation - imu.rotation, 1e-5, rtol=1e-10)
    np.testing.assert_allclose(wrong.velocity - imu.velocity, 0.01 * accel, atol=1e-15)
    assert (imu.n, imu.rate) == (5, 100.0)
    with pytest.raises(InputError, match=r"accel_errors has shape \(4, 3\)"):
        imu.with_errors(gyro, accel[:4])
    gyro[3, 1] = np.nan
    with pytest.raises(InputError, match="gyro_errors is not finite at index 3"):
        imu.with_errors(gyro, accel)
