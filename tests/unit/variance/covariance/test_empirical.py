"""The covariance estimated from the coefficients, against its definition and the truth."""

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, WhiteNoise
from gmwm.variance.series import covariance_of_data

MODEL = WhiteNoise(1.0) + GaussMarkov(0.5, 20.0)


def levels(n, seed=1):
    rng = np.random.default_rng(seed)
    x = rng.standard_normal(n)
    return [np.convolve(x, np.r_[-np.ones(m), np.ones(m)] / (2 * m), "valid") for m in (1, 2, 4, 8)]


@pytest.mark.parametrize("n", [64, 65, 100])
def test_it_is_the_sum_over_all_lags_of_squared_covariances(n):
    """Eq. (5): lags of a series repeated after zeros, circular over the longest level's length."""
    coefficients = levels(n)
    size = coefficients[0].size
    padded = [np.pad(w, (0, size - w.size)) for w in coefficients]
    found = covariance_of_data(coefficients, max(c.size for c in coefficients))
    for j, a in enumerate(padded):
        for k, b in enumerate(padded):
            m_j, m_k = coefficients[j].size, coefficients[k].size
            lags = [np.dot(a, np.roll(b, h)) / np.sqrt(m_j * m_k) for h in range(size)]
            expected = np.sum(np.square(lags)) / max(m_j, m_k)
            # The transform's length has small factors, and its last frequency is left out.
            assert found[j, k] == pytest.approx(expected, rel=0.35)


@pytest.mark.parametrize("window", ["none", "octave"])
def test_its_mean_is_the_covariance_of_the_estimates(window):
    n, runs = 4096, 40
    rng = np.random.default_rng(2)
    series = [MODEL.simulate(n, 1.0, rng) for _ in range(runs)]
    found = np.array(
        [gmwm.wavelet_variance(x, dt=1.0, data_covariance=window).data_covariance for x in series]
    )
    truth = gmwm.haar_covariance(MODEL.psd, n, 1.0)
    scale = np.sqrt(np.outer(np.diag(truth), np.diag(truth)))
    error = (np.mean(found, axis=0) - truth) / scale
    spread = np.std(found, axis=0) / scale / np.sqrt(runs)
    # Beyond a quarter of the record there are hardly any coefficients to tell it from.
    part = np.s_[:-2, :-2]
    assert np.all(np.abs(error[part]) < 4.0 * spread[part] + 0.08)


@pytest.mark.parametrize("window", ["none", "octave"])
@pytest.mark.parametrize("n", [40, 1000, 1023])
def test_it_is_positive_semidefinite(window, n):
    found = covariance_of_data(levels(n), n, window)
    np.testing.assert_allclose(found, found.T)
    assert np.linalg.eigvalsh(found)[0] > -1e-12 * np.trace(found)


def test_an_unknown_window_is_refused():
    with pytest.raises(gmwm.InputError, match="choose from none, octave"):
        gmwm.wavelet_variance(np.arange(100.0) ** 2, dt=1.0, data_covariance="parzen")
