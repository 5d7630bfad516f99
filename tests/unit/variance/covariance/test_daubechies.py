"""The covariance of wavelet variances against its definition, simulation and the Haar module."""

from functools import lru_cache

import numpy as np
import pytest
from series import PROCESSES as SIMPLE, distance, series_covariance

import gmwm
from gmwm.process.wavelets import wavelet
from gmwm.variance import tuning
from gmwm.variance.covariance import daubechies as module
from gmwm.variance.covariance.daubechies import wavelet_covariance
from gmwm.variance.covariance.haar import haar_covariance, line_covariance
from gmwm.variance.levels import wavelet_coefficients
from marks import slow

WALKING = gmwm.WhiteNoise(1.0) + gmwm.RandomWalk(0.1)
PROCESSES = [*SIMPLE, WALKING]
NAMES = ("haar", "db2", "db4", "sym4", "coif1", "db10")


@lru_cache
def filters(name, n):
    """A matrix a level, by which n samples become its coefficients."""
    columns = [list(wavelet_coefficients(unit, name)) for unit in np.eye(n)]
    return [np.stack(level, axis=1) for level in zip(*columns, strict=True)]


def brute_force(covariance, name):
    """2 / (M_j M_k) sum_{s,t} cov(W_js, W_kt)^2, the filters written as matrices."""
    matrices = filters(name, len(covariance))
    left = [matrix @ covariance for matrix in matrices]
    return np.array([[2.0 * np.mean((a @ b.T) ** 2) for b in matrices] for a in left])


def of(process, n, name, lines=()):
    levels = wavelet(name).levels(n)
    counts = np.array([n - wavelet(name).width(j + 1) + 1.0 for j in range(levels)])
    added = line_covariance(lines, process.psd, 1.0, name, counts)
    return wavelet_covariance(process.psd, n, 1.0, name, levels) + added


@pytest.mark.parametrize("n", [64, 130])
@pytest.mark.parametrize("name", NAMES)
def test_covariance_equals_the_sum_over_all_pairs_of_coefficients(name, n):
    for process in PROCESSES:
        expected = brute_force(series_covariance(process, n), name)
        assert distance(of(process, n, name), expected) < 2e-3, process


@pytest.mark.parametrize("n", [4, 5, 7, 9])
def test_the_shortest_series(n):
    expected = brute_force(np.eye(n), "db2")
    np.testing.assert_allclose(of(gmwm.WhiteNoise(1.0), n, "db2"), expected, rtol=1e-9)


def test_twice_integrated_noise_under_two_vanishing_moments():
    n = 200
    twice = np.linalg.matrix_power(np.tril(np.ones((n, n))), 2)
    expected = brute_force(twice @ twice.T, "db2")
    assert distance(of(gmwm.ARIMA([], 2, [], 1.0), n, "db2"), expected) < 0.01


@pytest.mark.parametrize("name", ["db2", slow("sym5"), slow("coif2")])
def test_lags_that_are_multiples_of_a_block_give_the_same_as_all_lags(name, monkeypatch):
    n = 6000
    try:
        module._lag_sums.cache_clear()
        monkeypatch.setattr(tuning, "EXACT_SAMPLES", n)
        exact = [of(process, n, name) for process in PROCESSES]
        module._lag_sums.cache_clear()
        monkeypatch.setattr(tuning, "EXACT_SAMPLES", 2048)
        assert module._lag_sums(name, n, wavelet(name).levels(n)).grid.block > 1
        for process, expected in zip(PROCESSES, exact, strict=True):
            assert distance(of(process, n, name), expected) < 0.01, process
    finally:
        module._lag_sums.cache_clear()


@pytest.mark.parametrize("excess", [1, 2, 10, 40])
def test_a_level_of_few_coefficients_in_a_long_record_is_one_square(excess):
    """Coefficients nearer to each other than a block are as good as one: the variance is 2 nu^4."""
    n = wavelet("db2").width(14) - 1 + excess
    process = gmwm.WhiteNoise(1.0)
    variance = process.wavelet_variance(2.0**13, 1.0, "db2")
    assert module._lag_sums("db2", n, 14).grid.block > excess / 2
    assert of(process, n, "db2")[-1, -1] == pytest.approx(2.0 * variance**2, rel=0.02)


@pytest.mark.parametrize("n", [50, 3000, 100_000])
def test_haar_is_the_same_as_by_its_own_module(n):
    for process in PROCESSES:
        if isinstance(process, gmwm.QuantizationNoise):
            continue  # all lobes of Haar filters have as much of it
        expected = haar_covariance(process.psd, n, 1.0)
        assert distance(of(process, n, "haar"), expected) < 0.02, process


@pytest.mark.parametrize("process", [gmwm.WhiteNoise(1.0), gmwm.GaussMarkov(1.0, 40.0), WALKING,
                                     gmwm.RandomWalk(1.0)], ids=repr)  # fmt: skip
@pytest.mark.parametrize("name", ["db2", "coif1"])
def test_covariance_is_that_of_simulated_series(process, name):
    n, runs = 2000, 200
    rng = np.random.default_rng(11)
    waves = np.array(
        [
            [
                np.mean(level**2)
                for level in wavelet_coefficients(process.simulate(n, 1.0, rng), name)
            ]
            for _ in range(runs)
        ]
    )
    predicted = of(process, n, name)
    mean = process.wavelet_variance(2.0 ** np.arange(waves.shape[1]), 1.0, name)
    error = np.sqrt(np.diag(predicted) / runs)
    assert np.max(np.abs(np.mean(waves, axis=0) - mean) / error) < 4.5
    # The sampling error of a covariance of chi-square-like quantities of few degrees of freedom.
    dof = 2.0 * mean**2 / np.diag(predicted)
    scale = np.sqrt(np.diag(predicted))
    spread = np.sqrt((2.0 + 12.0 / np.minimum.outer(dof, dof)) / runs)
    found = np.cov(waves, rowvar=False)
    assert np.max(np.abs(found - predicted) / np.outer(scale, scale) / spread) < 4.5


def under(model, n, name, dt=1.0):
    """As ``of``, but that Haar's is by its own module."""
    if name == "haar":
        return haar_covariance(model.psd, n, dt)
    return wavelet_covariance(model.psd, n, dt, name, wavelet(name).levels(n))


@pytest.mark.parametrize("n", [64, 1000, 4099, 100_000, slow(3_000_000)])
@pytest.mark.parametrize("name", ["haar", "db2", "db6", "coif5"])
def test_covariance_is_symmetric_and_positive_definite(name, n):
    model = gmwm.WhiteNoise(1.0) + gmwm.GaussMarkov(0.3, 40.0) + gmwm.RandomWalk(1e-3)
    found = under(model, n, name)
    np.testing.assert_array_equal(found, found.T)
    scale = np.sqrt(np.diag(found))
    assert np.linalg.eigvalsh(found / np.outer(scale, scale))[0] > 1e-3


@pytest.mark.parametrize("name", ["haar", "db3"])
def test_sampling_interval_is_only_a_unit(name):
    fast = gmwm.WhiteNoise(1.0) + gmwm.GaussMarkov(0.3, 0.4)
    slow = gmwm.WhiteNoise(10.0) + gmwm.GaussMarkov(0.3, 40.0)
    np.testing.assert_allclose(under(fast, 1000, name, 0.01), under(slow, 1000, name), rtol=1e-9)


def test_fewer_levels_are_a_corner_of_all():
    full = of(WALKING, 5000, "db2")
    for levels in (1, 4, len(full)):
        corner = wavelet_covariance(WALKING.psd, 5000, 1.0, "db2", levels)
        np.testing.assert_allclose(corner, full[:levels, :levels], rtol=1e-9)


def test_lines_beyond_the_band_act_at_their_alias():
    noise = gmwm.GaussMarkov(1.0, 5.0)
    alias = of(noise, 1024, "db2", lines=((0.2, 0.5), (0.03, 2.0)))
    np.testing.assert_allclose(of(noise, 1024, "db2", lines=((1.2, 0.5), (-2.03, 2.0))), alias)
    assert np.all(alias > of(noise, 1024, "db2"))


def test_lines_against_simulation():
    model = gmwm.WhiteNoise(1.0) + gmwm.Sinusoid(2.0, 0.03)
    n, runs = 1024, 400
    rng = np.random.default_rng(8)
    waves = [
        [np.mean(level**2) for level in wavelet_coefficients(model.simulate(n, 1.0, rng), "db3")]
        for _ in range(runs)
    ]
    predicted = np.diag(of(model, n, "db3", lines=model.lines()))
    ratio = np.var(waves, axis=0, ddof=1)[:6] / predicted[:6]
    assert np.all(np.abs(ratio - 1.0) < 4.5 * np.sqrt(2.5 / runs)), ratio


def test_a_spectrum_that_is_none_is_refused():
    with pytest.raises(gmwm.InputError, match="psd gives"):
        wavelet_covariance(lambda f, dt: np.nan * f, 200, 1.0, "db2", 3)


def test_no_signal_has_no_covariance():
    found = wavelet_covariance(lambda f, dt: 0.0 * f, 200, 1.0, "db2", 6)
    np.testing.assert_array_equal(found, 0.0)
