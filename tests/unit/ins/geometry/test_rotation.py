import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from gmwm.ins.geometry import (
    matrix_from_rotation_vector,
    matrix_from_rpy,
    orthonormalise,
    rotation_coefficients,
    rpy_from_matrix,
    turn_body,
    turn_navigation,
)

ANGLES = st.floats(-4 * math.pi, 4 * math.pi)
PITCHES = st.floats(-math.pi / 2, math.pi / 2)


@given(ANGLES, PITCHES, ANGLES)
def test_matrices_are_those_of_scipy(roll: float, pitch: float, yaw: float) -> None:
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    np.testing.assert_allclose(matrix_from_rpy(np.array([roll, pitch, yaw])), expected, atol=1e-14)


@given(ANGLES, st.sampled_from([-1.0, 1.0]), st.floats(0, 1e-3) | st.just(0.0), ANGLES)
def test_angles_give_the_matrix_back_even_straight_up(
    roll: float, sign: float, off: float, yaw: float
) -> None:
    C = matrix_from_rpy(np.array([roll, sign * (math.pi / 2 - off), yaw]))
    rpy = rpy_from_matrix(C)
    assert np.all(np.isfinite(rpy))
    np.testing.assert_allclose(matrix_from_rpy(rpy), C, atol=1e-11)


def test_axes_are_forward_right_down() -> None:
    # Heading east, nose up by 30 deg: forward points east and up, right points south.
    C = matrix_from_rpy(np.radians([0.0, 30.0, 90.0]))
    np.testing.assert_allclose(C[:, 0], [0, math.cos(math.pi / 6), -0.5], atol=1e-15)
    np.testing.assert_allclose(C[:, 1], [-1, 0, 0], atol=1e-15)
    # Banked to the right, the right wing points down.
    assert matrix_from_rpy(np.radians([20.0, 0.0, 0.0]))[2, 1] > 0


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-5, 0.0999, 0.1001, 1.0, 3.14, math.pi, 7.0])
def test_rotation_vectors(size: float) -> None:
    rng = np.random.default_rng(3)
    axes = rng.normal(size=(20, 3))
    vectors = size * axes / np.linalg.norm(axes, axis=1, keepdims=True)
    expected = Rotation.from_rotvec(vectors).as_matrix()
    np.testing.assert_allclose(matrix_from_rotation_vector(vectors), expected, atol=1.5e-15)


@pytest.mark.parametrize("square", [0.0, 1e-20, 1e-6, 0.00999999, 0.0100001, 0.5, 9.0])
def test_coefficients_have_full_precision(square: float) -> None:
    with mpmath.workdps(60):
        a = mpmath.sqrt(mpmath.mpf(square)) if square else mpmath.mpf("1e-15")
        exact = (mpmath.sin(a) / a, (1 - mpmath.cos(a)) / a**2, (a - mpmath.sin(a)) / a**3)
    # (a - sin a) loses the digits that a^2/6 is short of 1: two at the change from the series.
    assert rotation_coefficients(square)[:2] == pytest.approx(exact[:2], rel=4e-16)
    assert rotation_coefficients(square)[2] == pytest.approx(float(exact[2]), rel=2e-13)


def cross(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def test_turns_act_on_their_own_side() -> None:
    rng = np.random.default_rng(4)
    C = matrix_from_rpy(np.array([0.3, -0.2, 2.0]))
    body, frame = rng.normal(size=3), 1e-5 * rng.normal(size=3)
    found = C.copy()
    turn_body(found, *body)
    np.testing.assert_allclose(found, C @ expm(cross(body)), atol=1e-14)
    found = C.copy()
    turn_navigation(found, *frame)
    np.testing.assert_allclose(found, expm(-cross(frame)) @ C, atol=3e-15)


def test_orthonormalise_squares_the_error() -> None:
    rng = np.random.default_rng(5)
    C = matrix_from_rpy(np.array([0.3, -0.2, 2.0]))
    for error in (1e-2, 1e-4, 1e-8):
        off = C + error * rng.uniform(-1, 1, size=(3, 3))
        nearest = Rotation.from_matrix(off).as_matrix()
        orthonormalise(off)
        assert np.max(np.abs(off.T @ off - np.eye(3))) < 30 * error**2 + 1e-15
        assert np.max(np.abs(off - nearest)) < 30 * error**2 + 1e-15
