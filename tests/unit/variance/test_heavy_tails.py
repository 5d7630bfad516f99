"""The sampling variance of wavelet variances of white noise that is not Gaussian."""

import numpy as np
import pytest

import gmwm
from gmwm import RandomWalk, WhiteNoise
from gmwm.variance.series import fourth_cumulant

N, DT = 4000, 0.01


def laplace(seed, n=N):
    return np.random.default_rng(seed).laplace(size=n)


@pytest.mark.parametrize(("law", "cumulant"), [("laplace", 12.0), ("t8", 10.67)])
def test_the_cumulant_is_that_of_the_law(law, cumulant):
    # Excess kurtosis times the square of the variance: 3 2^2, and 6/(8 - 4) (2 8/6)^2.
    rng = np.random.default_rng(1)
    x = rng.laplace(size=1_000_000) if law == "laplace" else rng.standard_t(8, 1_000_000) * 2**0.5
    assert fourth_cumulant(x) == pytest.approx(cumulant, rel=0.1)
    # A random walk beside it is none of it.
    assert fourth_cumulant(x + np.cumsum(rng.normal(size=x.size)) * 0.01) == pytest.approx(
        cumulant, rel=0.1
    )


@pytest.mark.parametrize("seed", range(5))
def test_gaussian_noise_has_none(seed):
    assert fourth_cumulant(np.random.default_rng(seed).normal(size=N)) == 0.0


@pytest.mark.slow
def test_the_stated_covariance_is_the_observed_one():
    runs = 300
    found = [gmwm.wavelet_variance(laplace(seed), dt=DT) for seed in range(runs)]
    observed = np.cov(np.array([wv.variance[:5] for wv in found]).T)
    psd = WhiteNoise(np.sqrt(2.0 * DT)).psd
    stated = np.mean([wv.covariance_under(psd)[:5, :5] for wv in found], axis=0)
    # A variance of 300 is known to 8 %, of this law to 10 %.
    np.testing.assert_allclose(np.diag(stated), np.diag(observed), rtol=0.4)
    assert stated[0, 0] == pytest.approx(observed[0, 0], rel=0.3)
    assert stated[0, 1] == pytest.approx(observed[0, 1], rel=0.35)


def test_intervals_of_the_white_noise_hold_it_and_the_others_stay():
    runs, held, errors = 25, 0, []
    model = WhiteNoise() + RandomWalk()
    for seed in range(runs):
        x = 1e-3 * laplace(seed) / np.sqrt(2.0) + RandomWalk(1e-4).simulate(N, DT, seed)
        wv = gmwm.wavelet_variance(x, dt=DT)
        fit = gmwm.fit(model, wv)
        low, high = fit.interval()["N"]
        held += low < 1e-4 < high
        errors.append(fit.stderr["N"])
    # 95 % of 25 are 24, with a standard deviation of 1.1; without the cumulant 19.
    assert held >= 21
    # The variance of a mean square is (2 + 3)/2 times that of Gaussian noise.
    assert np.median(errors) / 1e-4 == pytest.approx(0.5 * np.sqrt(5.0 / N), rel=0.25)


def test_round_trip_and_robust():
    wv = gmwm.wavelet_variance(laplace(7), dt=DT)
    assert wv.fourth_cumulant > 0.0
    assert type(wv).from_dict(wv.to_dict()).fourth_cumulant == wv.fourth_cumulant
    assert gmwm.wavelet_variance(laplace(7), dt=DT, robust=True).fourth_cumulant == 0.0
