import math
from collections.abc import Callable

import numpy as np
import pytest

import gmwm
from free_inertial import integrate
from gmwm.ins import Trajectory, emulate, fixed_wing_loiter, helicopter_mapping
from gmwm.ins.filter.filter_kernels import step
from gmwm.ins.filter.records import Increments, Kinematics
from gmwm.ins.geometry import RATE, matrix_from_rotation_vector, matrix_from_rpy, ned_difference
from marks import slow

NORTH = (math.radians(46.5), 0.1, 400.0)
SOUTH = (math.radians(-33.0), -2.0, 20.0)
DATE_LINE = (math.radians(-17.0), math.pi - 1e-5, 5.0)


def attitude_error(found: Trajectory, true: Trajectory) -> np.ndarray:
    """Angle between two attitudes, rad."""
    between = matrix_from_rpy(found.rpy) @ np.swapaxes(matrix_from_rpy(true.rpy), 1, 2)
    x = between[:, 2, 1] - between[:, 1, 2]
    y = between[:, 0, 2] - between[:, 2, 0]
    z = between[:, 1, 0] - between[:, 0, 1]
    return 0.5 * np.sqrt(x * x + y * y + z * z)


@pytest.mark.parametrize(
    ("mission", "start"),
    [
        (helicopter_mapping, SOUTH),
        slow(helicopter_mapping, (math.radians(84.0), 3.0, 3000.0)),
        slow(gmwm.ins.car_drive, NORTH),
        (gmwm.ins.car_drive, DATE_LINE),
        (fixed_wing_loiter, SOUTH),
        slow(fixed_wing_loiter, (0.0, 0.0, 100.0)),
    ],
)
def test_a_vehicle_comes_back(
    mission: Callable[..., Trajectory], start: tuple[float, float, float]
) -> None:
    true = mission(start=start)
    found = integrate(emulate(true), true.state(0))
    assert np.max(np.abs(ned_difference(found.lla, true.lla))) < 0.1
    assert np.max(attitude_error(found, true)) < math.radians(1e-5)
    assert np.max(np.abs(found.velocity - true.velocity)) < 1e-3


def test_errors_fall_with_the_square_of_the_interval() -> None:
    def largest(dt: float) -> tuple[float, float]:
        true = helicopter_mapping(dt=dt, duration=300.0, start=NORTH)
        found = integrate(emulate(true), true.state(0))
        position = np.max(np.abs(ned_difference(found.lla, true.lla)))
        return float(position), float(np.max(attitude_error(found, true)))

    coarse, fine = largest(0.08), largest(0.02)
    # Fourfold steps: 16 for order 2; 4 would be order 1.
    assert coarse[0] > 10.0 * fine[0]
    assert coarse[1] > 10.0 * fine[1]


@pytest.mark.filterwarnings("ignore:The copy keyword")  # of their pandas calls
def test_positions_follow_pyins(interpreted_pyins) -> None:
    strapdown = pytest.importorskip("pyins.strapdown")
    pandas = pytest.importorskip("pandas")
    true = helicopter_mapping(duration=120.0, start=(*SOUTH[:2], 0.0))
    flat = Trajectory.from_arrays(
        true.dt, true.lla * [1.0, 1.0, 0.01], true.rpy
    )  # their gravity is of first order in the height
    imu = emulate(flat).with_errors(
        np.full((true.n, 3), 1e-5), np.tile([0.01, -0.02, 0.005], (true.n, 1))
    )
    found = integrate(imu, flat.state(0))

    from pyins.util import ACCEL_COLS, GYRO_COLS, LLA_COLS, RPH_COLS, TRAJECTORY_COLS

    readings = np.hstack([imu.rotation, imu.velocity])
    readings = np.vstack([readings[:1], readings])
    frame = pandas.DataFrame(readings, index=flat.time, columns=GYRO_COLS + ACCEL_COLS)
    first = np.hstack([flat.lla[0], flat.velocity[0], flat.rpy[0]])
    first[[0, 1, 6, 7, 8]] = np.degrees(first[[0, 1, 6, 7, 8]])
    integrator = strapdown.Integrator(pandas.Series(first, index=TRAJECTORY_COLS, name=0.0))
    theirs = integrator.integrate(strapdown.compute_increments_from_imu(frame, "increment"))

    lla = theirs[LLA_COLS].to_numpy() * [math.pi / 180, math.pi / 180, 1.0]
    rpy = np.radians(theirs[RPH_COLS].to_numpy())
    # The errors drive both far away, together; theirs neglects third-order terms of the steps.
    assert np.max(np.abs(ned_difference(found.lla, flat.lla))) > 50.0
    assert (
        np.max(np.abs(ned_difference(found.lla, lla))) < 0.02
    )  # theirs has 1 cm of first-order gravity in it
    other = Trajectory(flat.dt, lla, found.velocity, rpy)
    assert np.max(attitude_error(found, other)) < 1e-8


@pytest.mark.parametrize("corrected", [False, True])
def test_coning_leaves_what_savage_says(corrected: bool) -> None:
    # The axis of a body that does not turn on average describes a cone.
    angle, dt, n = 0.02, 0.01, 2000
    x = 2 * math.pi * 5.0 * dt  # phase in one interval
    phase = x * np.arange(n + 1)
    rotation = math.sin(angle) * np.stack(
        [np.diff(np.cos(phase)), np.diff(np.sin(phase)), np.zeros(n)], axis=-1
    )
    rotation[:, 2] = -x * (1.0 - math.cos(angle))

    start = matrix_from_rotation_vector(np.array([angle, 0.0, 0.0]))
    C, v, lla = start.copy(), np.zeros(3), np.zeros(3)
    for i in range(n):
        v[:] = lla[:] = 0.0  # it would fall
        before = rotation[max(i - 1, 0)] if corrected else rotation[i]
        now = Increments(*rotation[i], 0.0, 0.0, 0.0)
        step(Kinematics(C, v, lla), now, Increments(*before, 0.0, 0.0, 0.0), dt)

    # After whole turns only the frame has moved: at the equator about north.
    end = matrix_from_rotation_vector(np.array([-RATE * n * dt, 0.0, 0.0])) @ start
    error = (C @ end.T)[1, 0]
    # Savage (1998), Part 1: the integral of coning, less the product of two increments over 12.
    scale = n * math.sin(angle) ** 2
    missing = whole = 0.5 * (x - math.sin(x))
    if corrected:
        missing -= math.sin(x / 2) ** 2 * math.sin(x) / 3.0
    # His formulas are of second order in the angle.
    assert abs(error) == pytest.approx(scale * missing, abs=2.0 * angle**2 * scale * whole)


@pytest.mark.parametrize("seed", range(3))
def test_rate_and_force_that_change_linearly_leave_no_second_order_error(seed: int) -> None:
    # Sculling: the exact integral of a force in turning axes, by Gauss-Legendre quadrature.
    rng = np.random.default_rng(seed)
    dt, rate, force = 1e-4, 3.0 * rng.normal(size=(2, 3)), 10.0 * rng.normal(size=(2, 3))
    nodes, weights = np.polynomial.legendre.leggauss(5)

    def integrals(first: float) -> tuple[np.ndarray, np.ndarray]:
        middle = first + 0.5
        return dt * (rate[0] + rate[1] * middle), dt * (force[0] + force[1] * middle)

    exact = np.zeros(3)
    for u, w in zip(0.5 * (nodes + 1.0), 0.5 * weights, strict=True):
        turned = matrix_from_rotation_vector(dt * (rate[0] * u + 0.5 * rate[1] * u**2))
        exact += w * dt * turned @ (force[0] + force[1] * u)
    (angle, push), (angle_before, push_before) = integrals(0.0), integrals(-1.0)
    at = Kinematics(np.eye(3), np.zeros(3), np.array([0.5, 0.1, 0.0]))
    found = step(at, Increments(*angle, *push), Increments(*angle_before, *push_before), dt)
    sculling = (np.cross(angle_before, push) + np.cross(push_before, angle)) / 12.0
    np.testing.assert_allclose(found, exact, atol=0.02 * np.min(np.abs(sculling)), rtol=0.0)


def test_no_step_has_none_before_it() -> None:
    # One interval alone, of constant rate and force in inertial space, is exact but for the Earth.
    rotation, dt = np.array([[0.3, -0.2, 0.5]]), 1e-3
    imu = gmwm.ins.Imu(dt, rotation, np.zeros((1, 3)))
    state = gmwm.ins.NavState(np.array(NORTH), np.zeros(3), np.zeros(3))
    found = integrate(imu, state)
    expected = matrix_from_rotation_vector(rotation[0])
    np.testing.assert_allclose(matrix_from_rpy(found.rpy[1]), expected, atol=1e-7)


def test_the_attitude_stays_orthonormal() -> None:
    rng = np.random.default_rng(8)
    C, v, lla = np.eye(3), np.zeros(3), np.array(NORTH)
    for turn in rng.normal(0.0, 0.05, size=(5000, 3)):
        v[:] = 0.0  # it would fall
        now = Increments(*turn, 0.0, 0.0, -0.098)
        step(Kinematics(C, v, lla), now, now, 0.01)
    assert np.max(np.abs(C @ C.T - np.eye(3))) < 5000 * 1e-15
