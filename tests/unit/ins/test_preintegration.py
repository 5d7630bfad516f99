"""Preintegrated increments: their covariance against theory, simulation and GTSAM."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gmwm import GaussMarkov, InputError, QuantizationNoise, RandomWalk, WhiteNoise
from gmwm.ins import Imu, SensorModels, preintegrate
from gmwm.ins.sensors import AXES

DT = 0.005
GYRO = WhiteNoise(2e-4) + GaussMarkov(3e-4, 0.5) + GaussMarkov(2e-4, 8.0)
ACCEL = WhiteNoise(2e-3) + GaussMarkov(4e-3, 0.3) + RandomWalk(1e-3) + QuantizationNoise(1e-6)
MODELS = {"gyro": GYRO, "accel": ACCEL}
WALKS = {"gyro": WhiteNoise(2e-4) + RandomWalk(3e-4), "accel": WhiteNoise(2e-3) + RandomWalk(4e-3)}


def still(n):
    return Imu(DT, np.zeros((n, 3)), np.zeros((n, 3)))


def moving(n=200, rate=1.0):
    """Rotation about changing axes, with specific forces of the size of gravity."""
    t = DT * (np.arange(n) + 0.5)
    w = rate * np.stack([np.sin(3.0 * t), 0.7 * np.cos(2.0 * t), 0.5 + 0.0 * t], axis=1)
    a = np.stack([2.0 * np.cos(t), 1.5 * np.sin(4.0 * t), 9.8 + 0.0 * t], axis=1)
    return Imu(DT, w * DT, a * DT)


def difference(measured, true):
    """Errors as `Preintegration` has them."""
    turn = Rotation.from_matrix(true.rotation.T @ measured.rotation).as_rotvec()
    return np.concatenate(
        [turn, measured.velocity - true.velocity, measured.position - true.position]
    )


def test_increments_of_a_screw_motion():
    # A constant rate about z and a force that is constant in body axes: integrals by hand.
    w, a, n = 0.8, 1.5, 400
    imu = Imu(DT, np.tile([0.0, 0.0, w * DT], (n, 1)), np.tile([a * DT, 0.0, 0.0], (n, 1)))
    found, t = preintegrate(imu, MODELS), n * DT
    assert found.duration == pytest.approx(t)
    assert found.rotation == pytest.approx(Rotation.from_rotvec([0, 0, w * t]).as_matrix())
    velocity = a / w * np.array([np.sin(w * t), 1.0 - np.cos(w * t), 0.0])
    position = a / w**2 * np.array([1.0 - np.cos(w * t), w * t - np.sin(w * t), 0.0])
    assert found.velocity == pytest.approx(velocity, abs=1e-12)
    assert found.position == pytest.approx(position, abs=1e-12)


def test_variances_of_an_imu_at_rest():
    # Without motion each axis is a chain of integrals of its own error: closed forms.
    n = 2000
    sigma, tau, t = 4e-4, 2.0, n * DT
    models = {"gyro": WhiteNoise(1e-4) + GaussMarkov(sigma, tau), "accel": WhiteNoise(1e-3)}
    found = preintegrate(still(n), models, start="stationary")
    angle = 1e-4**2 * t + 2.0 * sigma**2 * tau * (t - tau * (1.0 - np.exp(-t / tau)))
    assert np.diag(found.covariance)[:3] == pytest.approx([angle] * 3, rel=1e-4)
    assert np.diag(found.covariance)[3:6] == pytest.approx([1e-3**2 * t] * 3)
    assert np.diag(found.covariance)[6:9] == pytest.approx([1e-3**2 * t**3 / 3.0] * 3, rel=1e-5)
    assert np.diag(found.covariance)[9:] == pytest.approx([sigma**2] * 3)
    # Given the states at the start, that part of the variance is gone.
    known = preintegrate(still(n), models)
    gone = known.jacobian @ (sigma**2 * np.eye(3)) @ known.jacobian.T
    assert known.covariance + gone == pytest.approx(found.covariance, rel=1e-9, abs=1e-20)


def test_states_are_those_of_the_models():
    found = preintegrate(still(2), MODELS)
    per_gyro, per_accel = 2, 4  # two Gauss-Markov; one, a walk, and two of quantization
    m = 3 * (per_gyro + per_accel)
    assert found.covariance.shape == (9 + m, 9 + m)
    assert found.jacobian.shape == (9 + m, m)
    assert len(found.states) == 9 + m
    assert found.states[:1] == ("rotation x",)
    assert found.states[9:11] == ("gyro_x Gauss-Markov 1", "gyro_x Gauss-Markov 2")
    assert len(set(found.states)) == len(found.states)
    white = preintegrate(still(2), {"gyro": WhiteNoise(1e-4), "accel": WhiteNoise(1e-3)})
    assert white.covariance.shape == (9, 9)
    assert white.jacobian.shape == (9, 0)


def test_jacobian_is_the_derivative_of_the_increments():
    # A state that is shifted shifts the samples by what becomes of it.
    imu = moving()
    found = preintegrate(imu, MODELS)
    parts = [SensorModels.of(MODELS).models[axis].state_space(DT) for axis in AXES]
    step, column = 1e-6, 0
    for i, part in enumerate(parts):
        for j in range(part.n_states):
            x, errors = np.eye(part.n_states)[j] * step, np.zeros((imu.n, 6))
            for k in range(imu.n):
                errors[k, i] = part.output @ x
                x = part.transition @ x
            plus, minus = (
                preintegrate(imu.with_errors(s * errors[:, :3], s * errors[:, 3:]), MODELS)
                for s in (1.0, -1.0)
            )
            derivative = (difference(plus, found) - difference(minus, found)) / (2.0 * step)
            expected = found.jacobian[:9, column]
            assert derivative == pytest.approx(expected, rel=1e-6, abs=1e-9), (i, j)
            column += 1


def test_covariance_is_that_of_simulated_errors():
    # Mean normalised error squared of r runs: chi-squared of 9 r degrees of freedom over 9 r.
    rng, runs, imu = np.random.default_rng(1), 60, moving(60)
    sensors = SensorModels.of(MODELS)
    true = preintegrate(imu, MODELS, start="stationary")
    weight = np.linalg.inv(true.covariance[:9, :9])
    white = {q: WhiteNoise(1e-9) for q in ("gyro", "accel")}
    squares = []
    for _ in range(runs):
        errors = sensors.simulate(imu.n, DT, rng).total
        drawn = preintegrate(imu.with_errors(errors[:, :3], errors[:, 3:]), white)
        error = difference(drawn, true)
        squares.append(error @ weight @ error / 9.0)
    assert np.mean(squares) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / (9.0 * runs)))


@pytest.mark.parametrize("rate", [0.0, 1.0])
def test_agrees_with_combined_preintegration_of_gtsam(rate):
    # GTSAM integrates by Euler's rule: it agrees to the order of a step.
    gtsam = pytest.importorskip("gtsam")
    imu = moving(400, rate)
    found = preintegrate(imu, WALKS)
    params = gtsam.PreintegrationCombinedParams.MakeSharedU(9.81)
    params.setGyroscopeCovariance(2e-4**2 * np.eye(3))
    params.setAccelerometerCovariance(2e-3**2 * np.eye(3))
    params.setBiasOmegaCovariance(3e-4**2 * np.eye(3))
    params.setBiasAccCovariance(4e-3**2 * np.eye(3))
    params.setIntegrationCovariance(1e-20 * np.eye(3))
    if hasattr(params, "setBiasAccOmegaInit"):
        params.setBiasAccOmegaInit(np.zeros((6, 6)))
    pim = gtsam.PreintegratedCombinedMeasurements(params)
    for rotation, velocity in zip(imu.rotation, imu.velocity, strict=True):
        pim.integrateMeasurement(velocity / DT, rotation / DT, DT)
    assert found.rotation == pytest.approx(pim.deltaRij().matrix(), abs=1e-3)
    assert found.velocity == pytest.approx(pim.deltaVij(), rel=1e-2, abs=1e-2)
    # Its rotation error is that of the rotation vector; its order rotation, position, velocity,
    # biases of accelerometers and gyros.
    vector = Rotation.from_matrix(found.rotation).as_rotvec()
    to_vector = np.eye(15)
    to_vector[:3, :3] = np.linalg.inv(_right_jacobian(vector))
    ours = to_vector @ found.covariance @ to_vector.T
    order = [0, 1, 2, 6, 7, 8, 3, 4, 5, 12, 13, 14, 9, 10, 11]
    ours, theirs = ours[np.ix_(order, order)], np.asarray(pim.preintMeasCov())
    scale = np.sqrt(np.diag(theirs))
    gap = (ours - theirs) / np.outer(scale, scale)
    assert np.max(np.abs(gap)) < 0.02


def _right_jacobian(r):
    angle = np.linalg.norm(r)
    if angle < 1e-9:
        return np.eye(3)
    k = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
    return (
        np.eye(3)
        - (1.0 - np.cos(angle)) / angle**2 * k
        + (angle - np.sin(angle)) / angle**3 * k @ k
    )


def test_bad_input():
    with pytest.raises(InputError, match="start has shape"):
        preintegrate(still(2), WALKS, start=np.eye(2))
    with pytest.raises(InputError, match="choose from known, stationary"):
        preintegrate(still(2), WALKS, start="unknown")
    with pytest.raises(InputError, match="accel_x has none"):
        preintegrate(still(2), {"gyro": WhiteNoise(1e-4)})
