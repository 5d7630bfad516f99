"""The covariance of the wavelet variances against its definition, summed term by term."""

import numpy as np
import pytest
from scipy.signal import correlate
from series import PROCESSES, distance, series_covariance

import gmwm
from gmwm.variance import tuning
from gmwm.variance.covariance import haar as module
from gmwm.variance.covariance.haar import dyadic_levels, haar_covariance, integrals, mean_covariance


def filters(n, averaging):
    """All Haar coefficients free of end effects as matrices, one a level."""
    result = []
    for m in averaging.astype(int):
        count = n - 2 * m + 1
        matrix = np.zeros((count, n))
        for t in range(count):
            matrix[t, t : t + m] = -0.5 / m
            matrix[t, t + m : t + 2 * m] = 0.5 / m
        result.append(matrix)
    return result


def brute_force(process, n, averaging=None):
    series = series_covariance(process, n)
    levels = filters(n, dyadic_levels(n) if averaging is None else averaging)
    squares = np.empty((len(levels), len(levels)))
    means = np.empty_like(squares)
    for j, first in enumerate(levels):
        for k, second in enumerate(levels):
            cross = first @ series @ second.T
            squares[j, k] = 2.0 * np.mean(cross**2)
            means[j, k] = np.mean(cross)
    return squares, means


@pytest.mark.parametrize("n", [64, 200, 333])
@pytest.mark.parametrize("process", PROCESSES, ids=repr)
def test_covariance_equals_the_sum_over_all_pairs_of_coefficients(process, n):
    expected, means = brute_force(process, n)
    found = haar_covariance(process.psd, n, 1.0)
    # The finite-lag ends of the fine levels are the approximation that is left.
    assert distance(found, expected) < 0.04
    np.testing.assert_allclose(np.diag(found), np.diag(expected), rtol=0.04)
    coarse = slice(module._lag_sums(n).first, None)
    found = mean_covariance(process.psd, n, 1.0)
    assert distance(found[coarse, coarse], means[coarse, coarse]) < 0.02


@pytest.mark.parametrize("process", PROCESSES, ids=repr)
def test_any_averaging_times_are_those_between_the_octaves(process):
    m = np.array([1, 3, 4, 6, 10, 12, 20, 31, 40, 79])
    expected = brute_force(process, 160, m)[0]
    found = haar_covariance(process.psd, 160, 1.0, averaging=m)
    assert distance(found, expected) < 0.04
    octaves = haar_covariance(process.psd, 30_000, 1.0)
    places = [0, 3, 7, 10, 13]
    some = haar_covariance(process.psd, 30_000, 1.0, averaging=2.0 ** np.array(places))
    np.testing.assert_allclose(some, octaves[np.ix_(places, places)], rtol=1e-5)


@pytest.mark.parametrize("process", PROCESSES, ids=repr)
def test_means_of_blocks_give_the_same_as_all_samples(process, monkeypatch):
    n = 1500
    exact = haar_covariance(process.psd, n, 1.0)
    monkeypatch.setattr(tuning, "EXACT_SAMPLES", 256)
    monkeypatch.setattr(tuning, "BLOCKS", 128)
    module._lag_sums.cache_clear()
    blocks = haar_covariance(process.psd, n, 1.0)
    module._lag_sums.cache_clear()
    assert distance(blocks, exact) < 0.03


@pytest.mark.parametrize("first", [1, 256, 4096, 65_536])
def test_integrals_are_sums_over_lags_where_lobes_are_no_longer_resolved(first):
    """Of differences of white noise, to whose variance every lobe of the gains adds as much."""
    averaging = np.array([first, 2 * first])
    found = integrals(gmwm.QuantizationNoise(1.0).psd, 1.0, averaging.astype(float))
    own, other = (np.convolve(np.repeat([-0.5 / m, 0.5 / m], m), [1.0, -1.0]) for m in averaging)
    for j, k, one, two in ((0, 0, own, own), (0, 1, own, other), (1, 1, other, other)):
        expected = 2.0 * np.sum(correlate(one, two, method="fft") ** 2)
        assert found[j, k] == pytest.approx(expected, rel=1e-6, abs=0.0)
