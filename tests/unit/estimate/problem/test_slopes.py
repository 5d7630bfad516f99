"""Slopes, whitened residuals and the nodes of a spectrum, against definitions."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.linalg import toeplitz

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, WhiteNoise
from gmwm.estimate import tuning
from gmwm.estimate.problem import (
    chi_square,
    difference_covariance,
    gls_slope,
    slope_p_value,
    weight_root,
)
from gmwm.estimate.problem.information import density, frequency_nodes
from gmwm.estimate.problem.ramp import Slope, ols_slope
from gmwm.estimate.result.bound import quantile_above_zero

DT = 0.5
WV = gmwm.wavelet_variance((WhiteNoise(1.0) + RandomWalk(0.01)).simulate(600, DT, 1), dt=DT)


def spoilt(*gone):
    blocks = WV.blocks.copy()
    blocks[list(gone)] = np.nan
    return replace(WV, blocks=blocks)


@pytest.mark.parametrize("gone", [(), (10,), (0, 1, 40, 41, 42)])
def test_a_least_squares_slope_has_a_level_for_each_run(gone):
    wv = spoilt(*gone)
    there = np.flatnonzero(~np.isnan(wv.blocks))
    run = np.cumsum(np.diff(there, prepend=there[0]) > 1)
    columns = np.column_stack([there * wv.block * DT, *(run == k for k in np.unique(run))])
    expected = np.linalg.lstsq(columns.astype(float), wv.blocks[there], rcond=None)[0][0]
    assert ols_slope(wv).value == pytest.approx(expected)
    assert ols_slope(wv).variance == 0.0


@pytest.mark.parametrize("gone", [(), (10,), (0, 1, 40, 41, 42)])
@pytest.mark.parametrize("noise", [WhiteNoise(1.0), WhiteNoise(1.0) + RandomWalk(0.05)])
def test_a_generalised_slope_is_that_of_differences_beside_each_other(gone, noise):
    wv = spoilt(*gone)
    step = wv.block * DT
    column = difference_covariance(noise.psd, DT, wv.block, wv.blocks.size)
    first = np.flatnonzero(~np.isnan(wv.blocks[1:]) & ~np.isnan(wv.blocks[:-1]))
    covariance = toeplitz(column)[np.ix_(first, first)]
    weights = np.linalg.solve(covariance, np.ones(first.size))
    difference = wv.blocks[first + 1] - wv.blocks[first]
    found = gls_slope(wv, noise.psd)
    assert found.value == pytest.approx(weights @ difference / np.sum(weights) / step)
    assert found.variance == pytest.approx(1.0 / np.sum(weights) / step**2)


def test_differences_of_means_of_white_noise_and_a_walk():
    block = 8
    white = difference_covariance(WhiteNoise(3.0).psd, DT, block, 50)
    expected = np.zeros(49)
    expected[:2] = np.array([2.0, -1.0]) * 9.0 / DT / block
    np.testing.assert_allclose(white, expected, rtol=2e-3, atol=1e-3 * expected[0])
    walk = difference_covariance(RandomWalk(2.0).psd, DT, block, 50)
    assert walk[2:] == pytest.approx(0.0, abs=2e-3 * walk[0])
    step = 4.0 * DT  # variance of a step
    draws = np.cumsum(np.random.default_rng(1).normal(size=(4000, 3 * block)), axis=1)
    means = draws.reshape(4000, 3, block).mean(axis=2)
    by_hand = np.cov(np.diff(means, axis=1).T) * step
    assert walk[0] == pytest.approx(np.mean(np.diag(by_hand)), rel=0.06)
    assert walk[1] == pytest.approx(by_hand[0, 1], rel=0.1)


@pytest.mark.parametrize("count", [tuning.FEWEST_BLOCKS, tuning.FEWEST_BLOCKS - 1])
def test_a_slope_needs_some_blocks(count):
    wv = replace(WV, blocks=np.arange(float(count)) ** 2)
    enough = count == tuning.FEWEST_BLOCKS
    if enough:
        assert ols_slope(wv).value > 0.0
        assert 0.0 <= slope_p_value(wv, WhiteNoise(1.0).psd) < 1.0
        return
    assert slope_p_value(wv, WhiteNoise(1.0).psd) == 1.0
    for slope in (ols_slope, lambda each: gls_slope(each, WhiteNoise(1.0).psd)):
        with pytest.raises(gmwm.InputError, match="no samples in a row"):
            slope(wv)


def test_what_detrending_takes_is_given_back():
    slope = Slope(0.3, 0.02)
    ramp = RateRamp(np.sqrt(0.02)).haar_variance(WV.tau, DT)
    np.testing.assert_allclose(slope.variance * WV.drift_response**2, ramp, rtol=1e-9)


# -- residuals ------------------------------------------------------------------------------------


def test_a_root_of_the_weights_is_one():
    rng = np.random.default_rng(4)
    root = rng.normal(size=(5, 5)) * np.array([[1.0], [1e-6], [1e3], [1.0], [2.0]])
    covariance = root @ root.T
    found = weight_root(covariance)
    np.testing.assert_allclose(found @ covariance @ found.T, np.eye(5), atol=1e-6)
    twins = weight_root(np.ones((2, 2)) + 1e-14 * np.eye(2))
    assert np.max(np.abs(twins)) < 1e4  # no weight for rounding


@pytest.mark.parametrize("dof", [2.0, 10.0, 1000.0])
@pytest.mark.parametrize("taken", [0.0, 3.0])
def test_cube_roots_of_a_chi_square_are_standard(dof, taken):
    """Also where a slope took a part, which is added as a constant: 0.65 off at the 5 % point."""
    own, added = np.array([3.0]), np.array([taken])
    covariance = np.array([[2.0 * 9.0 / dof]])
    for p in (0.05, 0.5, 0.95):
        target, implied = own * stats.chi2.ppf(p, dof) / dof + added, own + added
        standard, square = chi_square(target, implied, covariance, implied, added)
        assert standard[0] == pytest.approx(stats.norm.ppf(p), abs=0.1)
        assert square == pytest.approx(standard[0] ** 2)


def test_a_chi_square_of_correlated_levels():
    covariance = np.array([[4e-4, 2e-4], [2e-4, 9e-4]])
    implied = np.array([1.0, 2.0])
    off = np.array([0.02, -0.03])
    standard, square = chi_square(implied + off, implied, covariance, implied)
    np.testing.assert_allclose(standard, off / np.sqrt(np.diag(covariance)), rtol=0.05, atol=0.02)
    assert square == pytest.approx(off @ np.linalg.solve(covariance, off), rel=0.05)


@pytest.mark.parametrize("n", [100, 5000])
def test_nodes_integrate_over_the_frequencies_of_a_record(n):
    f, weight = frequency_nodes(n, DT)
    low, high = 0.25 / (n * DT), 0.5 / DT
    assert low < f[0] < 1.1 * low and 0.99 * high < f[-1] < high
    assert np.sum(weight) == pytest.approx(n * DT * (high - low))
    assert np.sum(weight / f) == pytest.approx(n * DT * np.log(high / low))
    parts = (WhiteNoise(2.0), GaussMarkov(1.0, 3.0))
    np.testing.assert_allclose(density(parts, f, DT), sum(p.psd(f, DT) for p in parts))


@pytest.mark.parametrize("centre", [-2.0, 0.0, 3.0, 50.0])
def test_a_quantile_of_what_is_above_zero(centre):
    found = quantile_above_zero(centre, 2.0)
    law = stats.truncnorm(-centre / 2.0, np.inf, centre, 2.0)
    assert found == pytest.approx(law.ppf(0.95))
