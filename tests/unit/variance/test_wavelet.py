"""The wavelet variance of a series against allantools, real recordings, and bad input."""

import json

import allantools
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.stats import binom, chi2

import gmwm
from marks import slow
from places import SHARED


@settings(max_examples=40, deadline=None)
@given(st.integers(8, 3000), st.integers(0, 2**31), st.floats(-1e6, 1e6), st.floats(-2.0, 2.0))
def test_half_of_allantools_overlapping_allan_variance(n, seed, offset, drift):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=n) + np.cumsum(rng.normal(size=n)) + offset + drift * np.arange(n)
    wv = gmwm.wavelet_variance(x, dt=0.5)
    taus, deviation, _, _ = allantools.oadev(x, rate=2.0, data_type="freq", taus=wv.tau)
    # allantools drops levels with few coefficients; ours are all there.
    ours = wv.variance[: taus.size]
    np.testing.assert_allclose(ours, 0.5 * deviation**2, rtol=1e-9, atol=1e-20 * offset**2)
    assert wv.tau.size == int(np.log2(n))


@pytest.mark.parametrize("n", [8, 9, 15, 16, 17, 1023, 1024, 1025])
def test_all_levels_with_at_least_one_coefficient(n):
    x = np.random.default_rng(n).normal(size=n)
    wv = gmwm.wavelet_variance(x, dt=1.0)
    for m, variance, mean, count in zip(
        wv.averaging.astype(int), wv.variance, wv.mean, wv.counts, strict=True
    ):
        w = [
            0.5 * (x[t + m : t + 2 * m].mean() - x[t : t + m].mean()) for t in range(n - 2 * m + 1)
        ]
        assert len(w) == count >= 1
        assert variance == pytest.approx(np.mean(np.square(w)), rel=1e-10)
        assert mean == pytest.approx(np.mean(w), rel=1e-9, abs=1e-12)


def test_real_recording_against_an_independent_implementation():
    source = SHARED / "data" / "adis16405" / "adis16405_1.csv.gz"
    if not source.exists():
        pytest.skip("the real recordings are not on this machine")
    reference = json.loads((SHARED / "reference" / "adis16405_1_wavelet_variance.json").read_text())
    rec = gmwm.read(source, rate=100, units={"gyro": "deg/s", "accel": "g"})
    factor = {"deg/s": np.pi / 180.0, "g": 9.80665}
    for name, expected in reference["channels"].items():
        wv = gmwm.wavelet_variance(rec[name])
        found = wv.variance[:18] / factor[expected["unit"]] ** 2
        np.testing.assert_allclose(found, expected["haar_wavelet_variance"], rtol=1e-9)


def test_removing_a_drift_from_the_moments_is_removing_it_from_the_series():
    rng = np.random.default_rng(3)
    x, t = np.cumsum(rng.normal(size=700)), 0.1 * np.arange(700)
    before = gmwm.wavelet_variance(x + 0.7 * t, dt=0.1)
    np.testing.assert_allclose(
        before.detrended(0.7), gmwm.wavelet_variance(x, dt=0.1).variance, rtol=1e-9
    )


def test_ends_of_intervals_are_quantiles_of_chi_square():
    wv = gmwm.wavelet_variance(gmwm.WhiteNoise(1.0).simulate(1000, 1.0, 3), dt=1.0, confidence=0.9)
    for end, chance in ((wv.lower, 0.95), (wv.upper, 0.05)):
        np.testing.assert_allclose(chi2.cdf(wv.dof * wv.variance / end, wv.dof), chance)


@pytest.mark.parametrize(
    ("model", "n"),
    [
        slow(gmwm.WhiteNoise(1.0), 1000),
        (gmwm.RandomWalk(1.0), 1000),
        slow(gmwm.BiasInstability(1.0), 1000),
        slow(gmwm.QuantizationNoise(1.0) + gmwm.WhiteNoise(0.06), 4096),
        slow(gmwm.QuantizationNoise(1.0) + gmwm.RandomWalk(1e-3), 4096),
        (gmwm.WhiteNoise(1.0) + gmwm.Resonance(1.0, 0.155, 0.01), 4096),
        slow(gmwm.WhiteNoise(0.2) + gmwm.RandomWalk(0.02) + gmwm.RateRamp(0.03), 6000),
    ],
    ids=["N", "K", "B", "Q+N", "Q+K", "N and a narrow resonance", "N+K+R"],
)
def test_intervals_cover(model, n):
    runs = 80
    rng = np.random.default_rng(12)
    found = [gmwm.wavelet_variance(model.simulate(n, 1.0, rng), dt=1.0) for _ in range(runs)]
    truth = model.haar_variance(found[0].tau, 1.0)
    held = np.sum([(wv.lower < truth) & (truth < wv.upper) for wv in found], axis=0)
    # Rounding errors are uniform, so that those of quantization noise are wider than needed.
    low, high = binom.ppf([1e-4, 1 - 1e-4], runs, 0.95)
    assert np.all(held[:-2] >= low), held
    assert np.all(held >= 0.85 * runs), held
    assert "Quantization" in repr(model) or np.all(held[:-3] <= high), held


def test_the_spectrum_of_a_long_series_is_that_of_the_noise():
    n = 300_000
    model = gmwm.WhiteNoise(1.0) + gmwm.RandomWalk(1e-3)
    spectrum = gmwm.wavelet_variance(model.simulate(n, 1.0, 3), 1.0).spectrum
    f = np.geomspace(100.0 / n, 0.49, 300)
    ratio = np.log(spectrum.psd(f, 1.0) / sum(term.psd(f, 1.0) for term in model.terms))
    assert np.abs(np.mean(ratio)) < 0.1
    assert np.max(np.abs(ratio)) < 0.5


@pytest.mark.parametrize(
    ("data", "dt", "words"),
    [
        (np.arange(7.0), 1.0, "8 samples or more"),
        (np.ones(100), 1.0, "constant"),
        (np.arange(70.0) * np.tile([1.0] * 6 + [np.nan], 10), 1.0, "no 8 consecutive samples"),
        (np.array([1.0] * 50 + [np.inf] * 50), 1.0, "infinite"),
        (np.zeros((10, 10)), 1.0, "one series"),
        (["a"] * 100, 1.0, "not a number"),
        (np.arange(100.0), None, "sampling rate is missing"),
        (np.arange(100.0), 0.0, "positive sampling interval"),
        (np.arange(100.0), float("nan"), "positive sampling interval"),
    ],
)
def test_bad_input(data, dt, words):
    with pytest.raises(gmwm.InputError, match=words):
        gmwm.wavelet_variance(data, dt)


def test_confidence_out_of_range():
    with pytest.raises(gmwm.InputError, match="between 0 and 1"):
        gmwm.wavelet_variance(np.arange(100.0), 1.0, confidence=95)
