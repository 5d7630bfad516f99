"""The spectrum that has given wavelet variances, and means over several recordings."""

import numpy as np
import pytest

from gmwm import RandomWalk, WhiteNoise, wavelet_variance
from gmwm.process import quadrature
from gmwm.process.spectral import haar_variance
from gmwm.variance import PooledVariance, tuning
from gmwm.variance.pilot import _limit_slopes, _Places, _points, pilot_psd

DT, M = 0.01, 2.0 ** np.arange(14)


@pytest.mark.parametrize(
    "process", [WhiteNoise(0.3), RandomWalk(2.0), WhiteNoise(0.3) + RandomWalk(2.0)]
)
def test_its_variances_are_those_given_and_its_level_that_of_the_process(process):
    variance = process.haar_variance(DT * M, DT)
    psd = pilot_psd(variance, M, DT)
    np.testing.assert_allclose(haar_variance(psd, DT * M, DT), variance, rtol=0.03)
    f = np.geomspace(0.3 / (DT * M[-1]), 0.2 / DT, 20)
    np.testing.assert_allclose(psd(f, DT), process.psd(f, DT), rtol=0.3)


def test_below_its_knots_it_goes_on_with_the_slope_of_the_lowest_three():
    knots = np.array([0.0, 1.0, 3.0, 4.0, 5.0])
    level = np.array([5.0, 4.0, 2.0, 2.0, 7.0])
    x = np.array([-3.0, 0.5, 3.5, 9.0])
    np.testing.assert_allclose(
        _Places(x, knots).interpolated(level), [5.0 + 3.0 * 3.0 / 4.0, 4.5, 2.0, 7.0]
    )
    np.testing.assert_allclose(
        _Places(x[:1], knots).interpolated(-level), [-5.0]
    )  # it does not rise
    np.testing.assert_allclose(
        _Places(x[:1], knots).interpolated(100.0 * level), [506.0]
    )  # nor faster
    np.testing.assert_allclose(_Places(x, knots[:1]).interpolated(level[:1]), 5.0)
    np.testing.assert_allclose(_Places(x[:1], knots[:2]).interpolated(level[:2]), [8.0])


@pytest.mark.parametrize("first, levels", [(0, 1), (0, 2), (0, 13), (3, 5), (1, 20)])
def test_few_points_of_an_octave_give_the_variances_of_all_nodes(first, levels):
    averaging = 2.0 ** np.arange(first, first + levels)
    grid, (x, weight) = quadrature(tuple(averaging)), _points(tuple(averaging))
    knots = np.log(tuning.HAAR_PEAK / averaging)[::-1]
    steepest = tuning.PILOT_STEEPEST * np.log(2.0)
    step = np.random.default_rng(levels).uniform(-steepest, steepest, levels)
    step[levels // 2 :] = steepest * (-1.0) ** np.arange(levels - levels // 2)
    level = np.cumsum(step)
    density = np.exp(_Places(np.log(grid.frequency), knots).interpolated(level))
    expected = 2.0 * (grid.gain @ (grid.weight * density))
    found = weight @ np.exp(_Places(x, knots).interpolated(level))
    np.testing.assert_allclose(found, expected, rtol=1e-11)


def test_from_octave_to_octave_a_power_of_two_and_a_half_is_the_most():
    most = tuning.PILOT_STEEPEST * np.log(2.0)
    found = _limit_slopes(np.array([0.0, 10.0, 10.1, 0.0]))
    np.testing.assert_allclose(found, [0.0, most, 2.0 * most, most])
    gentle = np.array([1.0, 1.0 + 0.99 * most, 1.0])
    np.testing.assert_allclose(_limit_slopes(gentle), gentle)


def test_several_recordings_count_by_their_degrees_of_freedom():
    rng = np.random.default_rng(1)
    parts = [wavelet_variance(rng.normal(size=n), dt=1.0) for n in (1000, 5000, 300)]
    pooled = PooledVariance.of(parts)
    assert pooled.n_all == 6300
    np.testing.assert_allclose(np.sum(pooled.shares, axis=0), 1.0)
    for j in range(pooled.tau.size):
        there = [part for part in parts if part.tau.size > j]
        weight = np.array([part.dof[j] for part in there])
        expected = weight @ [part.variance[j] for part in there] / np.sum(weight)
        assert pooled.variance[j] == pytest.approx(expected)
        assert pooled.counts[j] == sum(part.counts[j] for part in there)
    psd = WhiteNoise(1.0).psd
    whole = pooled.covariance_under(psd)
    alone = [part.covariance_under(psd) for part in parts]
    share = pooled.shares[:, 0]
    assert whole[0, 0] == pytest.approx(
        sum(w**2 * each[0, 0] for w, each in zip(share, alone, strict=True))
    )
    last = pooled.tau.size - 1
    assert whole[last, last] == pytest.approx(alone[1][last, last])
