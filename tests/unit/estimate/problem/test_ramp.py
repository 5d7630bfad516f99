"""The slope of a drift, and whether it is one."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.stats import norm

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, WhiteNoise
from gmwm.estimate.problem import detrended_covariance, gls_slope, slope_p_value
from gmwm.estimate.problem.moments import slope_dof
from gmwm.estimate.problem.ramp import Slope, Walks
from gmwm.process import as_model
from marks import slow


class TestSlopeOfAWalk:
    """`slope_p_value`: slopes of walks that the record does not resolve are accidents."""

    N, DT = 20_000, 1.0

    def p_values(self, truth, noise, seeds):
        series = [as_model(truth).simulate(self.N, self.DT, seed) for seed in seeds]
        return np.array(
            [slope_p_value(gmwm.wavelet_variance(x, self.DT), noise.psd) for x in series]
        )

    @pytest.mark.parametrize("walk", [0.0, slow(1e-4), 1e-3])
    def test_it_is_no_smaller_than_chance(self, walk):
        # Under the white noise alone, which is all that the reference holds of the walk.
        truth = WhiteNoise(1.0) + RandomWalk(walk) if walk else WhiteNoise(1.0)
        p = self.p_values(truth, WhiteNoise(1.0), range(40))
        # Binomial: of 40 more than 7 lie below 0.05 once in 10^3; the prior makes it rarer.
        assert np.sum(p < 0.05) <= 7
        assert np.sum(p < 0.002) <= 1

    def test_a_ramp_far_above_the_noise_is_none(self):
        sigma = np.sqrt(12.0 / (self.N * self.DT) ** 3)
        for sign in (1.0, -1.0):
            truth = WhiteNoise(1.0) + RateRamp(sign * 25.0 * sigma)
            assert np.all(self.p_values(truth, WhiteNoise(1.0), range(5)) < 0.002)

    def test_scale_and_sampling_do_not_matter(self):
        x = (WhiteNoise(1.0) + RandomWalk(1e-3)).simulate(self.N, 1.0, 3)
        first = slope_p_value(gmwm.wavelet_variance(x, 1.0), WhiteNoise(1.0).psd)
        other = slope_p_value(gmwm.wavelet_variance(1e-6 * x, 0.01), WhiteNoise(1e-7).psd)
        assert other == pytest.approx(first, rel=1e-6)
        back = slope_p_value(gmwm.wavelet_variance(x[::-1].copy(), 1.0), WhiteNoise(1.0).psd)
        assert back == pytest.approx(first, rel=0.05)

    def test_gaps_leave_it_as_it_is(self):
        x = (WhiteNoise(1.0) + RateRamp(1e-5)).simulate(self.N, 1.0, 3)
        whole = slope_p_value(gmwm.wavelet_variance(x, 1.0), WhiteNoise(1.0).psd)
        x[5000:6000] = np.nan
        with_gap = slope_p_value(gmwm.wavelet_variance(x, 1.0), WhiteNoise(1.0).psd)
        assert np.log(with_gap) == pytest.approx(np.log(whole), abs=3.0)

    def test_few_blocks_tell_nothing(self):
        x = 1e-3 * np.arange(4096.0) + WhiteNoise(1.0).simulate(4096, 1.0, 1)
        x[100:] = np.nan
        assert slope_p_value(gmwm.wavelet_variance(x, 1.0), WhiteNoise(1.0).psd) == 1.0


@pytest.mark.parametrize(("size", "estimated"), [(0.05, "N"), (0.05, "sigma"), (0.2, "K")])
def test_degrees_of_freedom_are_those_of_generalised_least_squares(size, estimated):
    """By dense matrices of all samples. Those of a walk were of its fast part, which is white."""
    n, error, step = 1000, 0.1 * size, 1e-4
    shape = toeplitz(np.exp(-np.arange(n) / 20.0))
    if estimated == "K":
        shape = np.minimum.outer(np.arange(n), np.arange(n)) + 1.0
    truth = {"N": 1.0, estimated: size} if estimated != "N" else {"N": 1.0, "sigma": size}

    def log_variance(N, other):
        design = np.column_stack([np.arange(n) - 0.5 * (n - 1), np.ones(n)])
        solved = np.linalg.solve(other**2 * shape + N**2 * np.eye(n), design)
        return np.log(np.linalg.inv(design.T @ solved)[0, 0])

    ends = [truth | {estimated: truth[estimated] + d} for d in (step, -step)]
    above, below = (log_variance(*each.values()) for each in ends)
    slow = RandomWalk(size) if estimated == "K" else GaussMarkov(sigma=size, tau=20.0)
    model, wv = WhiteNoise(1.0) + slow, gmwm.wavelet_variance(np.arange(float(n)) % 2, 1.0)
    found = slope_dof(model, [estimated], np.array([[error**2]]), wv)
    gradient = (above - below) / (2.0 * step)
    assert found == pytest.approx(2.0 / (gradient * error) ** 2, rel=0.03)


@pytest.mark.parametrize("walk", [0.0, 2e-3, 2e-2])
def test_walks_beside_a_slope_are_those_of_the_whole_series(walk):
    """The posterior of K and of the slope, by dense matrices of all samples."""
    n, level, rng = 120, 0.95, np.random.default_rng(7)
    x = rng.standard_normal(n) + np.cumsum(walk * rng.standard_normal(n)) + 5e-3 * np.arange(n)
    sums = np.minimum.outer(np.arange(n), np.arange(n)) + 1.0
    design = np.column_stack([np.arange(n) - 0.5 * (n - 1), np.ones(n)])
    sizes, rows = np.geomspace(1e-4, 1.0, 500), []
    for size in sizes:
        covariance = np.eye(n) + size**2 * sums
        solved = np.linalg.solve(covariance, design)
        inverse = np.linalg.inv(design.T @ solved)
        slope, _ = found = inverse @ (solved.T @ x)
        squares = (x - design @ found) @ np.linalg.solve(covariance, x - design @ found)
        logs = np.linalg.slogdet(covariance)[1] - np.linalg.slogdet(inverse)[1]
        rows.append((slope, np.sqrt(inverse[0, 0]), -0.5 * (logs + squares)))
    slopes, errors, likelihoods = np.transpose(rows)
    weight = np.exp(likelihoods - np.max(likelihoods)) * sizes
    weight /= np.sum(weight)
    walks = Walks.beside(gmwm.wavelet_variance(x, 1.0), WhiteNoise(1.0).psd)
    for probability in (0.5, 0.95):
        at = np.interp(probability, np.cumsum(weight) - 0.5 * weight, sizes)
        assert walks.quantile(probability) == pytest.approx(at, rel=0.05)
    low, high = walks.slope_interval(slopes[0], level)
    inside = norm.cdf((high - slopes) / errors) - norm.cdf((low - slopes) / errors)
    assert weight @ inside == pytest.approx(level, abs=0.003)
    assert 0.5 * (low + high) == pytest.approx(slopes[0])


def test_noise_without_slow_parts_leaves_no_slope():
    """It divided by zero, or the covariance of the blocks was singular."""
    square = gmwm.wavelet_variance(np.tile([1.0, -1.0], 2048), 1.0)
    with pytest.raises(gmwm.InputError, match="no ramp can be estimated"):
        gls_slope(square, lambda f, dt: np.zeros_like(f))
    assert np.isfinite(gls_slope(square, WhiteNoise(1.0).psd).variance)


def test_a_slope_takes_the_same_share_in_any_unit():
    wv = gmwm.wavelet_variance(WhiteNoise(1.0).simulate(4000, 1.0, 1), 1.0)
    means = np.diag(np.linspace(1.0, 2.0, wv.tau.size))
    found = []
    for unit in (1.0, 1e-6, 1e6):
        slope = Slope(0.0, (0.05 * unit) ** 2)
        response = np.full(wv.tau.size, 10.0)
        taken = detrended_covariance(wv.covariance * unit**4, means * unit**2, response, slope)
        found.append(taken / unit**4)
    assert np.all(np.diag(found[0]) > 0.0)
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], rtol=1e-9)
