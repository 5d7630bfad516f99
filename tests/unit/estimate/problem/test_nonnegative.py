"""Non-negative least squares against another implementation."""

import numpy as np
import pytest
from scipy.optimize import nnls

from gmwm.estimate.problem import objectives_with, solve_nonnegative


def _problems():
    rng = np.random.default_rng(5)
    for k in range(120):
        rows, count = rng.integers(1, 25), rng.integers(1, 40)
        if k % 3:
            matrix = rng.standard_normal((rows, count))
        else:  # curves of Gauss-Markov processes, nearly copies of each other
            tau, at = np.exp(rng.uniform(-3.0, 8.0, count)), 2.0 ** np.arange(rows)[:, None]
            matrix = np.minimum(1.0, at / tau) / (1.0 + (at / tau) ** 2)
        exact = matrix @ np.maximum(rng.standard_normal(count), 0.0)
        yield matrix, exact + (k % 2) * rng.standard_normal(rows)


def _least(matrix, y):
    length = np.sqrt(np.sum(matrix**2, axis=0))
    return nnls(matrix / np.where(length > 0.0, length, 1.0), y)[1] ** 2


def test_no_solution_is_better_and_none_is_negative():
    for matrix, y in _problems():
        x, residual = solve_nonnegative(matrix, y)
        assert np.all(x >= 0.0)
        np.testing.assert_allclose(residual, y - matrix @ x, atol=1e-9 * np.linalg.norm(y))
        assert residual @ residual <= _least(matrix, y) + 1e-13 * (y @ y)


@pytest.mark.parametrize("scale", [1e-60, 1e-12, 1e12, 1e60])
def test_units_do_not_matter(scale):
    rng = np.random.default_rng(6)
    matrix, y = rng.random((20, 5)), rng.random(20)
    x, _ = solve_nonnegative(matrix, y)
    scaled, _ = solve_nonnegative(scale * matrix, y)
    np.testing.assert_allclose(scale * scaled, x, rtol=1e-12)


def test_columns_that_depend_on_each_other_or_are_nothing():
    column = np.array([1.0, 2.0, 3.0])
    matrix = np.column_stack([column, column, np.zeros(3), -column])
    x, residual = solve_nonnegative(matrix, column)
    assert x[0] + x[1] == pytest.approx(1.0)
    assert x[2] == 0.0 == x[3]
    np.testing.assert_allclose(residual, 0.0, atol=1e-15)
    assert np.all(solve_nonnegative(-matrix[:, :2], column)[0] == 0.0)
    assert solve_nonnegative(np.zeros((3, 0)), column)[0].size == 0


def test_each_candidate_beside_the_columns():
    matrix, y = next(_problems())
    both = np.column_stack([matrix, matrix[:, :3] ** 2])
    alone = [_least(np.column_stack([matrix, each]), y) for each in (matrix[:, :3] ** 2).T]
    found = objectives_with(matrix, both[:, -3:], y)
    np.testing.assert_allclose(found, alone, atol=1e-13 * (y @ y))
    none = objectives_with(np.zeros((y.size, 0)), both, y)
    np.testing.assert_allclose(
        none, [_least(each[:, None], y) for each in both.T], atol=1e-13 * (y @ y)
    )
