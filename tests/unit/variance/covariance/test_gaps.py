"""Series with missing samples: the coefficients that exist, and their covariance."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.linalg import toeplitz
from scipy.stats import chi2

import gmwm
from gmwm import GaussMarkov, Model, RandomWalk, RateRamp, WhiteNoise
from gmwm.variance.covariance.gaps import gappy_covariance, gappy_mean_covariance
from gmwm.variance.runs import Runs


def with_gaps(x, gaps):
    x = np.array(x, dtype=float)
    for start, stop in gaps:
        x[start:stop] = np.nan
    return x


PATTERNS = [
    [(100, 103)],
    [(0, 40), (150, 200), (290, 300)],
    [(k, k + 1) for k in range(37, 300, 37)],
    [(k, k + 60) for k in range(30, 270, 90)],
]


def coefficients(n, gaps):
    """All Haar coefficients that exist as matrices, one a level."""
    present = ~np.isnan(with_gaps(np.zeros(n), gaps))
    result = []
    m = 1
    while True:
        rows = []
        for t in range(n - 2 * m + 1):
            if np.all(present[t : t + 2 * m]):
                row = np.zeros(n)
                row[t : t + m], row[t + m : t + 2 * m] = -0.5 / m, 0.5 / m
                rows.append(row)
        if not rows:
            return result
        result.append(np.array(rows))
        m *= 2


def series_covariance(process, n):
    if isinstance(process, RandomWalk):
        k = np.arange(n, dtype=float)
        return process.K**2 * np.minimum.outer(k, k)
    return toeplitz(process.autocovariance(np.arange(n), 1.0))


@pytest.mark.parametrize("gaps", PATTERNS, ids=["one", "long", "scattered", "short runs"])
def test_variance_is_that_of_the_coefficients_that_exist(gaps):
    x = with_gaps(np.random.default_rng(1).standard_normal(300).cumsum(), gaps)
    filled = np.where(np.isnan(x), 1e6, x)
    expected = [np.mean((w @ filled) ** 2) for w in coefficients(300, gaps)]
    found = gmwm.wavelet_variance(x, dt=0.5)
    np.testing.assert_allclose(found.variance, expected, rtol=1e-9)
    np.testing.assert_allclose(found.counts, [len(w) for w in coefficients(300, gaps)])
    np.testing.assert_allclose(found.tau, 0.5 * 2.0 ** np.arange(len(expected)))


@pytest.mark.parametrize("gaps", PATTERNS, ids=["one", "long", "scattered", "short runs"])
@pytest.mark.parametrize(
    "process", [WhiteNoise(1.0), GaussMarkov(1.0, 10.0), RandomWalk(1.0)], ids=repr
)
def test_covariance_equals_the_sum_over_all_pairs(process, gaps):
    n = 300
    levels, series = coefficients(n, gaps), series_covariance(process, n)
    squares = np.array([[2.0 * np.mean((a @ series @ b.T) ** 2) for b in levels] for a in levels])
    means = np.array([[np.mean(a @ series @ b.T) for b in levels] for a in levels])
    runs, m = Runs.of(with_gaps(np.zeros(n), gaps)), 2.0 ** np.arange(len(levels))
    found = gappy_covariance(process.psd, runs, 1.0, m)
    scale = np.sqrt(np.outer(np.diag(squares), np.diag(squares)))
    assert np.max(np.abs(found - squares) / scale) < 0.05
    found = gappy_mean_covariance(process.psd, runs, 1.0, m)
    scale = np.sqrt(np.outer(np.diag(means), np.diag(means)))
    assert np.max(np.abs(found - means) / scale) < 0.05


@pytest.mark.parametrize("n", [300, 5000, 100_000])
def test_without_gaps_it_is_the_covariance_of_a_complete_series(n):
    model = WhiteNoise(1.0) + GaussMarkov(0.5, 20.0)
    m = 2.0 ** np.arange(n.bit_length() - 1)
    found = gappy_covariance(model.psd, Runs.complete(n), 1.0, m)
    expected = gmwm.haar_covariance(model.psd, n, 1.0)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.max(np.abs(found - expected) / scale) < 0.04


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.integers(1, 12))
def test_runs_count_what_a_loop_counts(present, width):
    values = np.where(present, 0.0, np.nan)
    runs = Runs.of(values)
    windows = [all(present[t : t + width]) for t in range(len(present) - width + 1)]
    assert runs.counts(np.array([width]))[0] == sum(windows)
    assert runs.present == sum(present)
    assert runs.is_complete == all(present)
    assert np.sum(runs.occupancy(width, 4)) == pytest.approx(sum(windows) / 4)


GAPPY = [
    WhiteNoise(1.0) + GaussMarkov(0.7, 40.0),
    WhiteNoise(1.0) + RandomWalk(0.03) + RateRamp(2e-3),
]


@pytest.mark.parametrize("truth", GAPPY, ids=repr)
def test_fits_of_gappy_series_are_as_good_as_their_intervals(truth):
    """Standardised errors of 30 fits; with a fifth of the record missing in 16 gaps."""
    n, runs = 8000, 30
    rng = np.random.default_rng(5)
    squares = []
    for _ in range(runs):
        starts = rng.choice(n - 100, 16, replace=False)
        x = with_gaps(truth.simulate(n, 1.0, rng), [(a, a + 100) for a in starts])
        fit = gmwm.fit(truth.opened(), x, dt=1.0)
        assert fit.valid, fit.message
        errors = [(fit.params[k] - truth.params[k]) / s for k, s in fit.stderr.items()]
        squares.append(np.square(errors))
    # Of normal errors; the 1e-3 tails of chi-square, with a tenth for their own standard errors.
    low, high = chi2.ppf([1e-3, 1.0 - 1e-3], runs) / runs
    means = np.mean(squares, axis=0)
    assert np.all(means > low - 0.1) and np.all(means < high + 0.1), means


def test_likelihood_and_moments_agree_on_a_gappy_series():
    truth = WhiteNoise(1.0) + GaussMarkov(0.7, 40.0)
    x = with_gaps(truth.simulate(10_000, 1.0, 3), [(500, 700), (4000, 5000)])
    moments = gmwm.fit(truth.opened(), x, dt=1.0)
    exact = gmwm.fit(truth.opened(), x, dt=1.0, method="mle")
    for key, error in exact.stderr.items():
        assert moments.params[key] == pytest.approx(exact.params[key], abs=1.5 * error)
        assert moments.stderr[key] == pytest.approx(error, rel=0.4)


def test_a_drift_that_no_block_shows_is_refused():
    x = WhiteNoise(1.0).simulate(100_000, 1.0, 1)
    x[::11] = x[1::11] = np.nan
    with pytest.raises(gmwm.InputError, match="take a model without RateRamp"):
        gmwm.fit(WhiteNoise() + RateRamp(), x, dt=1.0)


def test_a_gappy_wavelet_variance_goes_to_json_and_back():
    x = with_gaps(WhiteNoise(1.0).simulate(5000, 1.0, 1), [(0, 9), (100, 400)])
    wv = gmwm.wavelet_variance(x, dt=1.0)
    again = gmwm.WaveletVariance.from_dict(wv.to_dict())
    assert again.runs == wv.runs
    np.testing.assert_array_equal(again.covariance, wv.covariance)
    np.testing.assert_array_equal(again.blocks, wv.blocks)
    assert "309 of them missing" in str(wv)
    model = Model((WhiteNoise(),))
    assert gmwm.fit(model, again).params == gmwm.fit(model, wv).params
