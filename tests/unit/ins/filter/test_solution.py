"""Solutions: errors against a truth, normalised innovations."""

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.ins import FilterInnovations, Solution, Trajectory
from gmwm.ins.filter.filter import unmodified
from gmwm.ins.geometry import matrix_from_rotation_vector, matrix_from_rpy


def made(time, lla, velocity, matrix):
    k = len(time)
    empty = np.zeros((0, 3))
    return Solution(
        time=np.asarray(time), before=np.zeros(k, dtype=bool), lla=lla, velocity=velocity,
        matrix=matrix, covariance=np.tile(np.diag(np.arange(1.0, 10.0) ** 2), (k, 1, 1)),
        sensor_errors=np.zeros((k, 6)), sensor_covariance=np.zeros((k, 6, 6)),
        innovations=FilterInnovations(
            np.zeros(0), np.zeros(0, dtype=np.int64), empty, empty, np.zeros(0, dtype=bool)
        ),
        state_names=(), states=np.zeros(0), state_covariance=np.zeros((0, 0)),
    )  # fmt: skip


@pytest.fixture
def truth():
    n = 20
    lla = np.tile([0.7, np.pi - 1e-7, 100.0], (n + 1, 1))
    rpy = np.tile([0.1, -0.2, 3.1], (n + 1, 1))
    return Trajectory(0.5, lla, np.tile([3.0, 4.0, 0.0], (n + 1, 1)), rpy)


def test_errors_are_estimate_less_truth(truth):
    phi = np.array([1e-3, -2e-3, 3e-3])
    time = np.array([0.0, 2.0, 10.0])
    at = (time / truth.dt).astype(int)
    # East of the truth, which is on the other side of the date line.
    lla = truth.lla[at] + [1e-6, 2e-7 - 2.0 * np.pi, 5.0]
    matrix = matrix_from_rotation_vector(-phi) @ matrix_from_rpy(truth.rpy[at])
    solution = made(time, lla, truth.velocity[at] + [0.1, -0.2, 0.3], matrix)
    found = solution.errors(truth)
    np.testing.assert_allclose(found[:, 2], -5.0)
    np.testing.assert_allclose(found[:, 0], 6.3644e6 * 1e-6, rtol=1e-3)
    np.testing.assert_allclose(found[:, 1], 6.387e6 * np.cos(0.7) * 2e-7, rtol=1e-3)
    np.testing.assert_allclose(found[:, 3:6], np.tile([0.1, -0.2, 0.3], (3, 1)))
    np.testing.assert_allclose(found[:, 6:], np.tile(phi, (3, 1)), rtol=1e-5)
    np.testing.assert_array_equal(solution.sd, np.tile(np.arange(1.0, 10.0), (3, 1)))


def test_a_truth_that_ends_too_early_is_refused(truth):
    solution = made([0.0, 10.5], truth.lla[:2], truth.velocity[:2], np.tile(np.eye(3), (2, 1, 1)))
    with pytest.raises(InputError, match=r"ends at 10 s, before the solution at 10\.5 s"):
        solution.errors(truth)


def test_innovations_are_normalised_and_gaps_are_no_zeros():
    value = np.array([[2.0, np.nan, np.nan], [1.0, -2.0, 3.0], [np.nan] * 3])
    sd = np.array([[4.0, np.nan, np.nan], [1.0, 2.0, 1.0], [np.nan] * 3])
    found = FilterInnovations(
        np.arange(3.0), np.array([2, 0, 0]), value, sd, np.ones(3, dtype=bool)
    )
    np.testing.assert_allclose(found.nis, [0.25, 11.0, np.nan])
    np.testing.assert_array_equal(np.isnan(found.standard), np.isnan(value))


def test_modified_covariance_is_that_of_a_turned_velocity_error():
    rng = np.random.default_rng(1)
    root, v = rng.standard_normal((9, 9)), np.array([30.0, -20.0, 4.0])
    P = root @ root.T
    draws = rng.multivariate_normal(np.zeros(9), P, 200_000)
    u = draws[:, 3:6] - np.cross(v, draws[:, 6:])
    expected = np.cov(np.hstack([draws[:, :3], u, draws[:, 6:]]).T)
    unit = np.sqrt(np.diag(expected))
    found = unmodified(P, -v)
    # A covariance of n draws scatters by sqrt(2/n), 0.3 %, of the standard deviations.
    assert np.abs((found - expected) / np.outer(unit, unit)).max() < 0.016
    np.testing.assert_allclose(unmodified(found, v), P, atol=1e-10)
    stack = unmodified(np.stack([P, P]), np.stack([v, 0.0 * v]))
    np.testing.assert_allclose(stack[1], P)
    np.testing.assert_allclose(unmodified(stack[0], -v), P, atol=1e-10)
