"""The cone fit: what channels share of each part of their noise."""

import numpy as np
import pytest

from gmwm import GaussMarkov, InputError, RandomWalk, WhiteNoise, wavelet_covariance
from gmwm.estimate import fit_shared
from gmwm.estimate.shared import cone_least_squares
from unit.variance.test_cross import channels


def test_the_minimum_over_cones_meets_its_conditions():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(20, 13))
    information, target = root.T @ root, rng.normal(size=13) * 30.0
    x = cone_least_squares(information, target, 2, 3)
    slope = (information @ x - target)[:12].reshape(2, 6)
    first, second = np.triu_indices(3)
    for own, gradient in zip(x[:12].reshape(2, 6), slope, strict=True):
        matrix, dual = np.zeros((3, 3)), np.zeros((3, 3))
        matrix[first, second] = matrix[second, first] = own
        # Off the diagonal an element stands for two of the matrix.
        dual[first, second] = dual[second, first] = gradient * np.where(first == second, 1.0, 0.5)
        assert np.linalg.eigvalsh(matrix)[0] > 0.0 and np.linalg.eigvalsh(dual)[0] > -1e-3
        assert abs(np.trace(matrix @ dual)) < 1e-3
    assert abs((information @ x - target)[12]) < 1e-6


def test_without_active_cones_it_is_least_squares():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(200, 3))
    information = root.T @ root
    inside = np.array([2.0, 0.5, 1.0])
    found = cone_least_squares(information, information @ inside, 1, 2)
    np.testing.assert_allclose(found, inside, atol=1e-5)


PARTS = (WhiteNoise(1.0), GaussMarkov(1.0, 40.0), RandomWalk(1.0))


def psd(deviations, correlation):
    scale = np.diag(deviations)
    same = correlation * np.ones((len(scale),) * 2)
    return scale @ (same + (1.0 - correlation) * np.eye(len(scale))) @ scale


TRUTH = np.array([psd([1.0, 0.8, 1.2], 0.0), psd([0.5, 0.4, 0.6], 0.6), psd([0.01, 0.02, 0.01], 0)])


def test_intervals_hold_the_truth():
    """94 % of elements on average; of few runs, whose elements are dependent, 85 %."""
    rng, inside = np.random.default_rng(3), []
    start = (PARTS[0], GaussMarkov(1.0, 20.0), PARTS[2])
    for _ in range(12):
        found = fit_shared(start, wavelet_covariance(channels(rng, 8192, 1.0, TRUTH, PARTS)))
        low, high = found.interval()
        inside.append((low < TRUTH) & (high > TRUTH))
        assert np.all(np.linalg.eigvalsh(found.matrices) > -1e-12)
    assert np.mean(inside) > 0.85


def test_the_scale_of_a_channel_is_that_of_its_elements():
    data = [channels(np.random.default_rng(4), 4096, 1.0, TRUTH, PARTS) for _ in range(2)]
    data[1][0].values[:] *= 1e-4
    plain, scaled = (fit_shared(PARTS, wavelet_covariance(each)) for each in data)
    unit = np.diag([1e-4, 1.0, 1.0])
    np.testing.assert_allclose(scaled.matrices, unit @ plain.matrices @ unit, rtol=1e-3, atol=1e-9)


def test_parts_of_one_shape_are_rejected():
    data = wavelet_covariance(channels(np.random.default_rng(5), 512))
    with pytest.raises(InputError, match="give each part once"):
        fit_shared([RandomWalk(1.0), RandomWalk(1.0)], data)


def test_copies_are_rejected():
    one, other = channels(np.random.default_rng(5), 512)
    other.values[:] = -2.0 * one.values
    with pytest.raises(InputError, match="a and b have the same samples"):
        fit_shared(PARTS, wavelet_covariance([one, other]))
