"""White noise behind a sensor's filter: the filters that it is, and what stands for it."""

import numpy as np
import pytest
from scipy import signal

import gmwm
from gmwm import AveragedNoise, LowPassNoise, WhiteNoise
from gmwm.process import BUTTERWORTH, spectral

F = np.linspace(0.001, 0.499, 200)


def power(b, a=1.0):
    return np.abs(signal.freqz(b, a, 2.0 * np.pi * F)[1]) ** 2


@pytest.mark.parametrize("order", [1, 2, 3, 4])
@pytest.mark.parametrize("cutoff", [0.02, 0.2, 0.4])
def test_every_butterworth_filter_is_one(order, cutoff):
    dt = 0.01
    found = LowPassNoise(0.3, cutoff / dt, order, BUTTERWORTH).psd(F / dt, dt)
    expected = 0.09 * power(*signal.butter(order, 2.0 * cutoff))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-15)


def test_filters_of_second_order_have_a_damping():
    found = LowPassNoise(1.0, 0.1, 2.0, np.sqrt(0.75)).psd(F, 1.0)  # Bessel: Q = 1/sqrt(3)
    expected = power(*signal.bessel(2, 0.2, norm="mag"))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-15)


@pytest.mark.parametrize("window", [1.0, 4.0, 22.0])
def test_a_moving_average_is_one(window):
    found = AveragedNoise(1.0, window).psd(F, 1.0)
    np.testing.assert_allclose(found, power(np.ones(int(window)) / window), atol=1e-12)
    part = AveragedNoise(1.0, window + 0.4).psd(F, 1.0)
    weights = np.append(np.ones(int(window)), 0.4) / (window + 0.4)
    np.testing.assert_allclose(part, power(weights), atol=1e-12)


@pytest.mark.parametrize("process", [LowPassNoise(0.2, 5.0, 2.0, 0.7), AveragedNoise(0.2, 0.09)])
def test_it_averages_out_like_white_noise_without_a_state(process):
    form, dt = process.state_space(0.01), 0.01
    assert form.n_states == 0
    assert form.measurement_noise == pytest.approx(0.04 / dt)
    slow = np.array([1024, 4096]) * dt
    expected = WhiteNoise(0.2).haar_variance(slow, dt)
    np.testing.assert_allclose(process.haar_variance(slow, dt), expected, rtol=0.02)


def test_a_band_at_or_above_half_the_rate_is_white():
    tau = 2.0 ** np.arange(6)
    white = WhiteNoise(2.0).haar_variance(tau, 1.0)
    for process in (LowPassNoise(2.0, 0.6, 2.0, 0.7), AveragedNoise(2.0, 0.5)):
        np.testing.assert_allclose(process.haar_variance(tau, 1.0), white, rtol=1e-12)


def test_the_exact_likelihood_refuses_it():
    x = np.random.default_rng(0).normal(size=500)
    with pytest.raises(gmwm.InputError, match='use method="gmwm" or "whittle"'):
        gmwm.fit(LowPassNoise(order=2.0, damping=0.7), x, dt=1.0, method="mle")


@pytest.mark.parametrize("order", [0.91, 2.0, 6.0, 15.9])
@pytest.mark.parametrize("damping", [0.21, BUTTERWORTH, 1.99])
def test_the_wavelet_variance_is_the_integral_of_the_spectrum_however_sharp(order, damping):
    process = LowPassNoise(1.0, 0.05, order, damping)
    tau = 2.0 ** np.arange(19)
    integral = spectral.haar_variance(process.psd, tau, 1.0)
    np.testing.assert_allclose(process.haar_variance(tau, 1.0), integral, rtol=1e-9)


def test_a_moving_average_has_the_density_of_its_noise_at_frequency_zero():
    process = AveragedNoise(N=0.3, window=0.057)
    np.testing.assert_allclose(process.psd(np.array([0.0, 1e-9]), 0.01), 0.09, rtol=1e-12)
