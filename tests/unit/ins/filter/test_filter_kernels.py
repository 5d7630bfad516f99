"""Rows, residuals, corrections and the loop of the navigation filter."""

import numpy as np
import pytest

from gmwm import AR, GaussMarkov, RandomWalk, RateRamp, Resonance, WhiteNoise
from gmwm.ins import SensorModels
from gmwm.ins.filter import KINDS
from gmwm.ins.filter.filter_kernels import _advance, correct
from gmwm.ins.filter.measurements import MEASUREMENTS, observe, observe_since
from gmwm.ins.filter.records import Keyframe, Kinematics, Samples
from gmwm.ins.filter.states import SensorStates
from gmwm.ins.geometry import (
    matrix_from_rotation_vector,
    matrix_from_rpy,
    ned_difference,
    offset,
    rpy_from_matrix,
)

DT = 0.01
ATTITUDE = np.array([0.3, -0.4, 2.1])
VELOCITY = np.array([40.0, -25.0, 3.0])
RATE = np.array([0.2, -0.5, 0.7])
LEVER = np.array([1.5, -0.4, -2.0])
BEFORE, WAY = matrix_from_rpy(np.array([-0.2, 0.1, 1.7])), np.array([12.0, -30.0, 4.0])
PLACES = [(0.8, 0.1, 300.0), (-0.6, np.pi - 1e-8, 20.0), (1.38, -np.pi, 5000.0)]


def measured(kind, C, v, lla):
    """What an instrument without errors reads."""
    return {
        "position": lambda: offset(lla, C @ LEVER),
        "velocity": lambda: v + C @ np.cross(RATE, LEVER),
        "standstill": lambda: v,
        "height": lambda: np.array([lla[2], 0.0, 0.0]),
        "attitude": lambda: rpy_from_matrix(C),
        "odometer": lambda: C.T @ v,
        "displacement": lambda: BEFORE.T @ WAY,
        "rotation": lambda: rpy_from_matrix(BEFORE.T @ C),
    }[kind]()


def estimated(C, v, lla, x):
    """The estimate that has the errors x."""
    turned = matrix_from_rotation_vector(-x[6:])
    return turned @ C, turned @ v + x[3:6], offset(lla, x[:3])


def difference(kind, component, value, C, v, lla, h=None):
    h = np.full(9, np.nan) if h is None else h
    return observe(KINDS[kind], component, value, Kinematics(C, v, lla), RATE, LEVER, h)


@pytest.mark.parametrize("lla", PLACES[:2])
@pytest.mark.parametrize("kind", ["displacement", "rotation"])
def test_rows_since_a_keyframe_are_derivatives_by_both_poses(kind, lla):
    lla = np.array(lla)
    there = offset(lla, WAY)
    value, C = measured(kind, matrix_from_rpy(ATTITUDE), VELOCITY, lla), matrix_from_rpy(ATTITUDE)

    def residual(component, x, h):
        now = Kinematics(*estimated(C, VELOCITY, there, x[:9]))
        keyframe = np.concatenate([x[9:12], np.zeros(3), x[12:]])
        before = Kinematics(*estimated(BEFORE, VELOCITY, lla, keyframe))
        return observe_since(KINDS[kind], component, value, now, Keyframe(before, 9), h)

    for component in range(3):
        h, found, unused = np.full(15, np.nan), np.zeros(15), np.zeros(15)
        assert residual(component, np.zeros(15), h) == pytest.approx(0.0, abs=2e-3)
        for i in range(15):
            x = np.zeros(15)
            x[i] = 1e-2 if i < 3 or 9 <= i < 12 else 1e-4
            ends = [residual(component, s * x, unused) for s in (1.0, -1.0)]
            found[i] = (ends[0] - ends[1]) / (2.0 * x[i])
        # The way is counted on the ellipsoid at the keyframe: 1e-7 per metre, times a tangent.
        np.testing.assert_allclose(found, h, atol=2e-3)


@pytest.mark.parametrize("lla", PLACES)
@pytest.mark.parametrize(
    "kind", [kind for kind in KINDS if not MEASUREMENTS[KINDS[kind]].is_relative]
)
def test_rows_are_the_derivatives_of_the_residuals(kind, lla):
    C, v, lla = matrix_from_rpy(ATTITUDE), VELOCITY, np.array(lla)
    value = measured(kind, C, v, lla)
    for component in range(MEASUREMENTS[KINDS[kind]].components):
        h, found = np.full(9, np.nan), np.zeros(9)
        # The way to the antenna is straight in the residual and half-way on the Earth in `offset`.
        assert difference(kind, component, value, C, v, lla, h) == pytest.approx(0.0, abs=3e-6)
        for i in range(9):
            x = np.zeros(9)
            x[i] = 1.0 if i < 3 else 1e-4
            there = [difference(kind, component, value, *estimated(C, v, lla, s * x))
                     for s in (1.0, -1.0)]  # fmt: skip
            found[i] = (there[0] - there[1]) / (2.0 * x[i])
        # Metres and metres per second; the Earth's curvature is 1e-7 per metre, times a tangent.
        np.testing.assert_allclose(found, h, atol=3e-6)


@pytest.mark.parametrize("turns", [-2, -1, 1, 3])
def test_full_turns_of_longitude_do_not_count(turns):
    C, lla = matrix_from_rpy(ATTITUDE), np.array(PLACES[1])
    value = measured("position", C, VELOCITY, lla)
    value[1] += 2.0 * np.pi * turns
    assert difference("position", 1, value, C, VELOCITY, lla) == pytest.approx(0.0, abs=2e-5)


@pytest.mark.parametrize("lla", PLACES)
@pytest.mark.parametrize("scale", [1.0, 10.0])
def test_a_correction_takes_the_errors_off(lla, scale):
    x = scale * np.array([0.3, -0.5, 0.2, 0.04, -0.02, 0.05, 2e-4, -3e-4, 5e-4])
    truth = matrix_from_rpy(ATTITUDE), VELOCITY, np.array(lla)
    C, v, position = (each.copy() for each in estimated(*truth, x))
    taken = x.copy()
    correct(Kinematics(C, v, position), taken)
    assert not np.any(taken)
    # What is left is of third order in the angle.
    angle = np.linalg.norm(x[6:])
    np.testing.assert_allclose(C, truth[0], atol=angle**3)
    np.testing.assert_allclose(v, VELOCITY, atol=angle**3 * np.linalg.norm(VELOCITY))
    np.testing.assert_allclose(ned_difference(position, truth[2]), 0.0,
                               atol=1e-8 + 1e-6 * scale**2)  # fmt: skip
    np.testing.assert_allclose(C @ C.T, np.eye(3), atol=1e-13)


def tables(term):
    models = {"gyro": WhiteNoise(1.0), "accel": WhiteNoise(1.0), "gyro_y": term}
    return SensorStates.of(SensorModels.of(models), DT, 1)


def predicted(states, x, n):
    """Errors of gyro_y that the states predict over n samples."""
    at = Kinematics(np.eye(3), np.zeros(3), np.array(PLACES[0]))
    middle = Kinematics(np.eye(3), np.zeros(3), np.zeros(3))
    samples, x, carry, found = (
        Samples(np.zeros((n, 3)), np.zeros((n, 3)), DT),
        x.copy(),
        np.zeros(7),
        [],
    )
    for i in range(n):
        _advance(i, i + 1, samples, states.table, at, x, carry, middle)
        found.append(-carry[1] / DT)
        assert not np.any(carry[[0, 2, 3, 4, 5]])
    return np.array(found)


def test_a_gauss_markov_estimate_decays_and_a_random_walk_stays():
    found = predicted(tables(GaussMarkov(1.0, 0.5) + RandomWalk(1.0)), np.array([2.0, 3.0]), 100)
    time = DT * np.arange(100)
    np.testing.assert_allclose(found, 2.0 * np.exp(-time / 0.5) + 3.0)


@pytest.mark.parametrize("term", [Resonance(1.0, 3.0, 0.1), AR([1.6, -0.8], 1.0), RateRamp(2.0)])
def test_pairs_of_states_are_predicted_by_their_model(term):
    form, x = term.state_space(DT), np.array([0.7, -0.3])
    expected = [form.output @ np.linalg.matrix_power(form.transition, k) @ x for k in range(50)]
    np.testing.assert_allclose(predicted(tables(term), x, 50), expected, atol=1e-12)
