"""Wavelets, robustness and weights as options of the wavelet variance and the fit."""

import json

import numpy as np
import pytest

import gmwm
from gmwm import ARIMA, GaussMarkov, QuantizationNoise, RandomWalk, RateRamp, WhiteNoise
from marks import slow

TRUTH = WhiteNoise(1.0) + GaussMarkov(0.7, 40.0)


def standardised(truth, n, runs, seed, *, omega="model", **options):
    """Mean square of the errors over their standard errors."""
    rng = np.random.default_rng(seed)
    squares = []
    for _ in range(runs):
        wv = gmwm.wavelet_variance(truth.simulate(n, 1.0, rng), dt=1.0, **options)
        fit = gmwm.fit(truth.opened(), wv, omega=omega)
        errors = [(fit.params[k] - v) / fit.stderr[k] for k, v in truth.params.items()]
        squares.append(np.square(errors))
    return np.mean(squares, axis=0)


@pytest.mark.parametrize(
    "options",
    [
        {"robust": True, "efficiency": 0.9},  # what both leave out is below, beside a ramp
        {"omega": "data", "data_covariance": "octave"},
        slow({"omega": "data", "data_covariance": "octave", "wavelet": "db2"}),
    ],
    ids=str,
)
def test_standard_errors_are_those_of_the_estimates(options):
    found = standardised(TRUTH, 10_000, 12, 7, **options)
    # The mean of 12 squares of normal variables is within 0.1 .. 3.3 in all but 1e-4 of cases.
    # Weights from the data are correlated with what they weight, which linearisation leaves out.
    high = 5.6 if options.get("omega") == "data" else 3.3
    assert np.all(found > 0.1) and np.all(found < high), found


@pytest.mark.parametrize("options", [{"wavelet": "db2"}, slow({"robust": True})], ids=str)
def test_a_ramp_beside_a_walk(options):
    truth = WhiteNoise(1.0) + RandomWalk(0.03) + RateRamp(3e-3)
    found = standardised(truth, 8192, 10, 3, **options)
    assert np.all(found > 0.09) and np.all(found < 3.6), found  # 1e-4 on either side


def test_outliers_move_the_robust_fit_less():
    rng = np.random.default_rng(4)
    x = TRUTH.simulate(100_000, 1.0, rng)
    hit = rng.random(x.size) < 0.01
    x[hit] += 10.0 * rng.standard_normal(int(np.sum(hit)))
    classical = gmwm.fit(TRUTH.opened(), gmwm.wavelet_variance(x, dt=1.0))
    robust = gmwm.fit(TRUTH.opened(), gmwm.wavelet_variance(x, dt=1.0, robust=True))
    assert abs(robust.params["N"] - 1.0) < 0.5 * abs(classical.params["N"] - 1.0)


def test_twice_integrated_noise_needs_two_vanishing_moments():
    truth = gmwm.Model((ARIMA(ar=[], ma=[], sigma2=1.0, d=2),))
    x = np.cumsum(np.cumsum(np.random.default_rng(5).standard_normal(10_000)))
    wv = gmwm.wavelet_variance(x, dt=1.0, wavelet="db3")
    fit = gmwm.fit(truth.opened(), wv)
    assert fit.params["sigma2"] == pytest.approx(1.0, abs=4.0 * fit.stderr["sigma2"])
    with pytest.raises(gmwm.InputError, match="d = 0 or 1"):
        truth.wavelet_variance(wv.tau, 1.0, "haar")


def test_a_ramp_is_nothing_to_a_wavelet_with_two_vanishing_moments():
    x = WhiteNoise(1.0).simulate(4096, 1.0, 1)
    ramp = 0.1 * np.arange(4096)
    plain = gmwm.wavelet_variance(x, dt=1.0, wavelet="db2")
    sloped = gmwm.wavelet_variance(x + ramp, dt=1.0, wavelet="db2")
    np.testing.assert_allclose(sloped.variance, plain.variance, rtol=1e-6)
    np.testing.assert_array_equal(sloped.drift_response, 0.0)
    np.testing.assert_array_equal(RateRamp(0.1).wavelet_variance(plain.tau, 1.0, "db2"), 0.0)


def test_db1_is_haar():
    x = WhiteNoise(1.0).simulate(1000, 1.0, 1)
    np.testing.assert_array_equal(
        gmwm.wavelet_variance(x, dt=1.0, wavelet="db1").variance,
        gmwm.wavelet_variance(x, dt=1.0).variance,
    )


@pytest.mark.parametrize("options", [{"wavelet": "db4"}, {"robust": True}], ids=str)
def test_gaps_go_with_everything(options):
    x = TRUTH.simulate(20_000, 1.0, 2)
    x[3000:3100] = x[15_000:15_700] = np.nan
    fit = gmwm.fit(TRUTH.opened(), gmwm.wavelet_variance(x, dt=1.0, **options))
    assert fit.valid, fit.message
    for key, value in TRUTH.params.items():
        assert fit.params[key] == pytest.approx(value, abs=4.0 * fit.stderr[key])


@pytest.mark.parametrize(
    "options", [{"wavelet": "db2"}, {"robust": True}, {"data_covariance": "none"}], ids=str
)
def test_json_and_back(options):
    x = (TRUTH + QuantizationNoise(0.1)).simulate(3000, 1.0, 2)
    wv = gmwm.wavelet_variance(x, dt=1.0, **options)
    again = gmwm.WaveletVariance.from_dict(json.loads(json.dumps(wv.to_dict())))
    np.testing.assert_array_equal(again.covariance, wv.covariance)
    np.testing.assert_array_equal(again.detrended(0.01), wv.detrended(0.01))
    assert str(again) == str(wv)
    assert max(map(len, str(wv).splitlines())) <= 80


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"wavelet": "db99"}, "db99"),
        ({"wavelet": "coif5"}, "take a shorter wavelet"),
        ({"robust": True, "efficiency": 1.0}, "between 0 and 1"),
        ({"robust": True, "efficiency": 0.0}, "between 0 and 1"),
    ],
)
def test_bad_options(options, words):
    with pytest.raises(gmwm.InputError, match=words):
        gmwm.wavelet_variance(WhiteNoise(1.0).simulate(20, 1.0, 1), dt=1.0, **options)


def test_data_weights_need_the_covariance():
    wv = gmwm.wavelet_variance(WhiteNoise(1.0).simulate(100, 1.0, 1), dt=1.0)
    with pytest.raises(gmwm.InputError, match="data_covariance"):
        gmwm.fit(WhiteNoise(), wv, omega="data")
    with pytest.raises(gmwm.InputError, match="choose from model, data, diagonal, identity"):
        gmwm.fit(WhiteNoise(), wv, omega="best")


def test_a_series_that_changes_within_its_gaps_only_has_no_noise():
    x = np.repeat([1.0, -2.0, 0.5], 300)
    x[295:305] = x[595:605] = np.nan

    with pytest.raises(gmwm.InputError, match="changes only where samples are missing"):
        gmwm.wavelet_variance(x, dt=0.01)


@pytest.mark.parametrize("entrance", [gmwm.wavelet_variance, lambda x: gmwm.fit(TRUTH.opened(), x)])
def test_an_array_needs_a_sampling_interval_wherever_it_goes_in(entrance):
    with pytest.raises(
        gmwm.InputError, match=r"^the sampling rate is missing: give it in Hz, as in rate=100"
    ):
        entrance(np.ones(100))


@pytest.mark.parametrize("share", [0.05, 0.3])
def test_covariance_from_data_with_gaps_is_that_of_the_variances(share):
    ratios = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        x = rng.normal(size=8000)
        x[rng.random(x.size) < share] = np.nan
        wv = gmwm.wavelet_variance(x, 1.0, data_covariance="octave")
        ratios.append(np.diag(wv.data_covariance)[:6] / np.diag(wv.covariance)[:6])
    # Of windows of 64 samples each is known to 13 % in one series.
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1.0, atol=0.15)
