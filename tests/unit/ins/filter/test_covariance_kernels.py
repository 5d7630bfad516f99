"""Error equations against the mechanization itself; covariance steps against dense algebra."""

import numpy as np
import pytest
from scipy.linalg import block_diag, expm

import gmwm
from free_inertial import integrate
from gmwm import GaussMarkov, RandomWalk, RateRamp, Resonance, Sinusoid, WhiteNoise
from gmwm.ins import Imu, NavState, SensorModels
from gmwm.ins.filter.covariance_kernels import (
    error_rates,
    measurement_update,
    propagate,
    tilt_squared,
    transition,
)
from gmwm.ins.filter.records import Kinematics, new_transition
from gmwm.ins.filter.states import SensorStates
from gmwm.ins.geometry import (
    matrix_from_rotation_vector,
    matrix_from_rpy,
    ned_difference,
    offset,
    rpy_from_matrix,
)
from gmwm.ins.sensors import AXES

DT = 0.01
# Latitude, longitude (deg), height, velocity, roll, pitch, yaw (deg).
STATES = [
    (46.5, 6.6, 400.0, (20.0, -15.0, 2.0), (5.0, -3.0, 70.0)),
    (0.0, -179.9, 0.0, (-120.0, 200.0, -9.0), (-40.0, 20.0, 179.0)),
    (-33.0, 151.0, 9000.0, (180.0, 170.0, 5.0), (30.0, 8.0, -120.0)),
    (79.5, 15.0, 50.0, (-60.0, 240.0, 0.0), (0.0, 0.0, 0.0)),
    (-79.5, 100.0, 2000.0, (0.0, -250.0, -20.0), (170.0, -60.0, 10.0)),
    (52.0, 0.0, 100.0, (0.0, 0.0, 0.0), (0.0, 0.0, 45.0)),
]
# Gravity's change with latitude and the centrifugal part of its change with height are left out of
# F: at most 0.052 m/s^2 over a radian, and 2 RATE^2.
LEFT_OUT = np.zeros((9, 9))
LEFT_OUT[5, 0], LEFT_OUT[5, 2] = 8.2e-9, 4e-8


def nav_state(case):
    lat, lon, height, velocity, rpy = case
    return NavState(
        np.array([np.radians(lat), np.radians(lon), height]), np.array(velocity), np.radians(rpy)
    )


def perturbed(state, x):
    """The estimate that has the errors x: position, dv - v x phi, and C = (I - phi x) C_true."""
    phi = x[6:]
    attitude = matrix_from_rotation_vector(-phi) @ matrix_from_rpy(state.rpy)
    velocity = state.velocity + x[3:6] + np.cross(state.velocity, phi)
    return NavState(offset(state.lla, x[:3]), velocity, rpy_from_matrix(attitude))


def end(imu, state):
    return integrate(imu, state).state(-1)


def errors(estimate, truth):
    product = matrix_from_rpy(estimate.rpy) @ matrix_from_rpy(truth.rpy).T
    turned = -0.5 * (product - product.T)
    phi = np.array([turned[2, 1], turned[0, 2], turned[1, 0]])
    dv = estimate.velocity - truth.velocity
    return np.hstack(
        [ned_difference(estimate.lla, truth.lla), dv - np.cross(truth.velocity, phi), phi]
    )


def manoeuvring(state, n, rate=(0.05, -0.08, 0.1), extra=(1.0, -2.0, 0.5)):
    """An IMU that turns and accelerates."""
    support = matrix_from_rpy(state.rpy).T @ np.array([0.0, 0.0, -9.81])
    return Imu(
        DT, np.tile(np.array(rate) * DT, (n, 1)), np.tile((support + np.array(extra)) * DT, (n, 1))
    )


def kernel_matrices(state, step):
    change = new_transition()
    transition(Kinematics(matrix_from_rpy(state.rpy), state.velocity, state.lla), step, change)
    return change


@pytest.mark.parametrize("case", STATES)
def test_error_rates_are_the_derivative_of_the_mechanization(case):
    start, n = nav_state(case), 50
    imu = manoeuvring(start, n)
    path = integrate(imu, start)
    sizes = np.repeat([100.0, 1.0, 1e-4], 3)
    found = np.empty((9, 9))
    for i, size in enumerate(sizes):
        x = np.zeros(9)
        x[i] = size
        there = [errors(end(imu, perturbed(start, s * x)), path.state(-1)) for s in (1.0, -1.0)]
        found[:, i] = (there[0] - there[1]) / (2.0 * size)
    expected, F = np.eye(9), np.empty((9, 9))
    for i in range(n):
        error_rates(
            0.5 * (path.velocity[i] + path.velocity[i + 1]),
            0.5 * (path.lla[i] + path.lla[i + 1]),
            F,
        )
        expected = expm(F * DT) @ expected
    difference = np.abs(found - expected) / (n * DT)
    assert np.all(difference < LEFT_OUT + tolerances(start))


def tolerances(state):
    """1 % of the terms that the Earth's curvature and rotation make, 1e-5 of those of gravity."""
    speed, tangent = float(np.linalg.norm(state.velocity)), abs(np.tan(state.lla[0]))
    radius, rate = 6.38e6, 7.3e-5
    blocks = [
        [0.01 * speed * (1.0 + tangent) / radius + 1e-8, 1e-7, 1e-5 * (speed + 10.0)],
        [0.01 * rate * speed / radius + 1e-12, 1e-8, 2e-5],
        [
            0.01 * (rate + speed * (1.0 + tangent**2) / radius) / radius,
            1e-4 * (1.0 + tangent) / radius,
            1e-8,
        ],
    ]
    return np.kron(blocks, np.ones((3, 3)))


@pytest.mark.parametrize("case", STATES)
def test_transition_is_that_of_the_equations(case):
    state = nav_state(case)
    F, A, _ = kernel_matrices(state, 0.1)
    # The series ends at the second order: the third is some (F h)^3 / 6.
    third = np.abs(F @ F @ F).max() * 0.1**3 / 6.0
    np.testing.assert_allclose(A, expm(0.1 * F), atol=1.5 * third + 1e-15, rtol=0.0)


@pytest.mark.parametrize("case", STATES)
@pytest.mark.parametrize("k", [1, 10])
def test_sensor_errors_do_what_they_do_to_an_integrated_imu(case, k):
    start = nav_state(case)
    imu = manoeuvring(start, k)
    path = integrate(imu, start)
    half = Imu(0.1 * k * DT, *(np.repeat(0.1 * k * each[:1], 5, axis=0)
                              for each in (imu.rotation, imu.velocity)))  # fmt: skip
    _, _, B = kernel_matrices(end(half, start), k * DT)
    found = np.empty((9, 6))
    for j in range(6):
        size = 1e-4 if j < 3 else 1e-3
        wrong = np.zeros((k, 6))
        wrong[:, j] = size
        there = [
            errors(end(imu.with_errors(s * wrong[:, :3], s * wrong[:, 3:]), start), path.state(-1))
            for s in (1.0, -1.0)
        ]
        found[:, j] = (there[0] - there[1]) / (2.0 * size * k * DT)
    # B is that of the middle of the step: what the body turns by in the step, squared, is left
    # out, and so is the position that a tilt makes within the step, g T^2 / 6.
    step = k * DT
    turned, speed, g = 0.14 * step, float(np.linalg.norm(start.velocity)), 12.0
    scale = [
        [g * step**2 / 6.0, turned * step / 6.0],
        [turned**2 / 12.0 * speed + g * step * turned / 12.0, turned**2 / 12.0],
        [turned**2 / 12.0, 1e-9],
    ]
    bound = np.kron(scale, np.ones((3, 3)))
    # A longitude is stored to 1.4e-9 m.
    bound[:3] += 3e-9 / (2.0 * step * np.repeat([1e-4, 1e-3], 3))
    assert np.all(np.abs(found - B) < bound)


BLOCKS = {
    "gyro_x": WhiteNoise(1e-4) + GaussMarkov(2e-4, 0.05) + GaussMarkov(1e-4, 40.0),
    "gyro_y": WhiteNoise(2e-4) + RandomWalk(1e-5) + Sinusoid(1e-4, 3.0),
    "gyro_z": gmwm.QuantizationNoise(1e-6) + RateRamp(1e-6),
    "accel_x": WhiteNoise(1e-3) + Resonance(1e-3, 8.0, 0.1),
    "accel_y": gmwm.AR([1.5, -0.7], 1e-6) + WhiteNoise(1e-3) + gmwm.ARIMA([0.4], 1, [], 1e-8),
    "accel_z": GaussMarkov(1e-3, 5.0) + RandomWalk(1e-4),
}
SENSORS = SensorModels.of(BLOCKS, bias_sd={"gyro_x": 1e-4, "accel": 1e-3})


def dense(sensors, dt):
    """Transition, noise, output (6 rows) and white variances of all states, from the processes."""
    forms = [(i, term.state_space(dt)) for i, axis in enumerate(AXES)
             for term in sensors.models[axis].terms]  # fmt: skip
    white = np.zeros(6)
    Phi, Q, rows = [], [], []
    for i, axis in enumerate(AXES):
        walk = False
        for j, form in forms:
            if i != j:
                continue
            white[i] += form.measurement_noise
            if form.n_states:
                Phi.append(form.transition)
                Q.append(form.process_noise)
                rows.append((i, form.output))
                walk |= form.names == ("random walk",)
        if sensors.bias_sd[axis] > 0.0 and not walk:
            Phi.append(np.eye(1))
            Q.append(np.zeros((1, 1)))
            rows.append((i, np.ones(1)))
    H = np.zeros((6, sum(output.size for _, output in rows)))
    first = 0
    for i, output in rows:
        H[i, first : first + output.size] = output
        first += output.size
    return block_diag(*Phi), block_diag(*Q), H, white


def random_covariance(n, rng, scale):
    root = rng.standard_normal((n, n)) * scale[:, None]
    return root @ root.T


def propagated(P, change, states, k):
    """P after `propagate`, in a copy."""
    assert states.m + 9 == len(P)
    P = P.copy()
    propagate(P, change, states.table, k)
    return P


@pytest.mark.parametrize("extra", [0, 3])
@pytest.mark.parametrize("k", [1, 3, 10])
@pytest.mark.parametrize("seed", [1, 2])
def test_carry_is_dense_propagation_sample_by_sample(k, seed, extra):
    rng = np.random.default_rng(seed)
    slow = (("a", 1.0, 0.3), ("b", 2.0, 0.3), ("c", 0.5, 0.3))[:extra]
    states = SensorStates.of(SENSORS, DT, 10, slow=slow)
    Phi, Q, H, white = dense(SENSORS, DT)
    if extra:
        decay = np.exp(-DT / 0.3)
        Phi = block_diag(Phi, decay * np.eye(3))
        Q = block_diag(Q, np.diag([1.0, 4.0, 0.25]) * (1.0 - decay**2))
        H = np.hstack([H, np.zeros((6, 3))])
    m = states.m
    assert Phi.shape == (m, m)
    scale = np.hstack([np.repeat([5.0, 0.3, 1e-3], 3), np.sqrt(np.diag(Q)) + 1e-4])
    P = random_covariance(9 + m, rng, scale)
    change = kernel_matrices(nav_state(STATES[0]), k * DT)
    _, A, B = change
    # Navigation errors wait for the integrals (6) of the sensor errors, then take all at once.
    one = np.eye(9 + m + 6)
    one[9 : 9 + m, 9 : 9 + m] = Phi
    one[9 + m :, 9 : 9 + m] = H * DT
    added = block_diag(np.zeros((9, 9)), Q, np.diag(white * DT**2))
    whole = block_diag(P, np.zeros((6, 6)))
    for _ in range(k):
        whole = one @ whole @ one.T + added
    last = np.eye(9 + m, 9 + m + 6)
    last[:9, :9], last[:9, 9 + m :] = A, B
    expected = last @ whole @ last.T
    found = propagated(P, change, states, k)
    unit = np.sqrt(np.diag(expected))
    unit[unit == 0.0] = 1.0
    np.testing.assert_allclose(found / unit / unit[:, None], expected / unit / unit[:, None],
                               rtol=0.0, atol=1e-12)  # fmt: skip
    np.testing.assert_array_equal(found, found.T)


def test_noise_over_many_steps_needs_no_start():
    """From P = 0: the variances of white noise and what it is integrated to."""
    sensors = SensorModels.of({"gyro": WhiteNoise(1e-4), "accel": WhiteNoise(2e-3)})
    states = SensorStates.of(sensors, DT, 10)
    still = nav_state(STATES[-1])
    change = kernel_matrices(still, 10 * DT)
    P = np.zeros((9, 9))
    for _ in range(100):
        P = propagated(P, change, states, 10)
    t = 10.0
    angle, speed = 1e-4**2 * t, 2e-3**2 * t
    np.testing.assert_allclose(np.diag(P)[6:], angle, rtol=1e-4)
    # Tilt of the horizontal axes turns gravity into acceleration: g^2 N^2 t^3 / 3.
    np.testing.assert_allclose(np.diag(P)[3:5], speed + 9.81**2 * angle * t**2 / 3.0, rtol=0.002)
    np.testing.assert_allclose(P[5, 5], speed, rtol=1e-3)
    np.testing.assert_allclose(P[2, 2], speed * t**2 / 3.0, rtol=2e-3)


def joseph(P, H, R):
    S = H @ P @ H.T + R
    K = P @ H.T @ np.linalg.inv(S)
    left = np.eye(len(P)) - K @ H
    return left @ P @ left.T + K @ R @ K.T, K


@pytest.mark.parametrize("state", [-1, 9, 13])
def test_an_update_is_the_textbook_one(state):
    rng = np.random.default_rng(5)
    n = 15
    P = random_covariance(n, rng, np.hstack([np.full(9, 3.0), np.full(6, 0.4)]))
    H, R = np.zeros((3, n)), np.diag([0.5, 2.0, 0.1])
    H[:, :9] = rng.standard_normal((3, 9))
    if state >= 0:
        H[:, state] = -1.0
    z, x, K = rng.standard_normal(3), np.zeros(n), np.zeros(n)
    expected, gain = joseph(P, H, R)
    S = H @ P @ H.T + R
    nis = 0.0
    for i in range(3):
        found, variance = measurement_update(P, H[i], R[i, i], z[i], x, K)
        nis += found**2 / variance
    np.testing.assert_allclose(P, expected, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(x, gain @ z, rtol=1e-9, atol=1e-12)
    assert nis == pytest.approx(z @ np.linalg.solve(S, z), rel=1e-9)
    np.testing.assert_array_equal(P, P.T)


def test_a_very_exact_measurement_leaves_a_covariance():
    rng = np.random.default_rng(7)
    P = random_covariance(12, rng, np.ones(12))
    h, x, K = np.zeros(9), np.zeros(12), np.zeros(12)
    h[4] = 1.0
    for _ in range(1000):
        measurement_update(P, h, 1e-8, 0.0, x, K)
    assert P[4, 4] == pytest.approx(1e-11, rel=1e-3)
    assert np.linalg.eigvalsh(P).min() > -1e-13 * np.linalg.eigvalsh(P).max()


def test_the_square_of_a_tilt_has_the_mean_square_that_is_allowed_for():
    """Fixed tilts, drawn: mean square of g phi^2 / 2 over a while, in steps of any length."""
    rng = np.random.default_rng(8)
    root = np.array([[0.02, 0.0], [0.012, 0.03]])
    P = np.zeros((9, 9))
    P[6:8, 6:8] = root @ root.T
    g, gathered = 9.8, 0.0
    for step in (0.1, 0.5, 0.4):
        gathered = tilt_squared(P, g, step, gathered)
    tilts = rng.standard_normal((400_000, 2)) @ root.T
    errors = 0.5 * g * np.sum(tilts**2, axis=1)
    assert P[5, 5] == pytest.approx(np.mean(errors**2), rel=0.03)
    assert gathered == pytest.approx(np.sqrt(P[5, 5]), rel=1e-12)
    assert np.count_nonzero(P) == 5  # nothing else is touched
