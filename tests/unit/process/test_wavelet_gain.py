"""Wavelet variances from the spectrum against filter energies, closed forms and brute force."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gmwm
from gmwm.process.spectral import Panels, wavelet_variance
from gmwm.process.wavelets import (
    NAMES,
    gain_weights,
    lagrange,
    unit_legendre,
    wavelet,
)
from marks import EXAMPLES, FIRST

SOME = ("haar", "db2", "db4", "db10", "sym6", "coif1", "coif5")
LEVELS = 9


def equivalent_filters(name, levels):
    """The filters of all levels in full."""
    filters = wavelet(name)
    result, smooth = [], np.ones(1)
    for j in range(levels):
        spread = np.zeros((2, (filters.scaling.size - 1) * 2**j + 1))
        spread[:, :: 2**j] = filters.detail, filters.scaling
        result.append(np.convolve(smooth, spread[0]))
        smooth = np.convolve(smooth, spread[1])
    return result


def of(process, name, levels=LEVELS, dt=1.0):
    return process.wavelet_variance(2.0 ** np.arange(levels) * dt, dt, name)


@pytest.mark.parametrize("name", NAMES)
def test_noises_are_the_energies_of_the_filter_differenced_and_summed(name):
    filters = equivalent_filters(name, LEVELS)
    white = [np.sum(taps**2) for taps in filters]
    quantization = [np.sum(np.diff(taps, prepend=0.0, append=0.0) ** 2) for taps in filters]
    walk = [np.sum(np.cumsum(taps) ** 2) for taps in filters]
    # The published coefficients of the symlets are right to eleven digits.
    rtol = 1e-9 if "sym" in name else 1e-12
    white_noise = wavelet_variance(
        gmwm.WhiteNoise(1.0).psd, (), 2.0 ** np.arange(LEVELS), 1.0, name
    )
    np.testing.assert_allclose(white_noise, white, rtol=rtol)
    for process, expected in (
        (gmwm.QuantizationNoise(1.0), quantization),
        (gmwm.RandomWalk(1.0), walk),
    ):
        found = wavelet_variance(process.psd, (), 2.0 ** np.arange(LEVELS), 1.0, name)
        np.testing.assert_allclose(found, expected, rtol=rtol)


@pytest.mark.parametrize("process", EXAMPLES, ids=repr)
def test_haar_by_weights_equals_the_closed_forms(process):
    if isinstance(process, gmwm.RateRamp):
        pytest.skip("a ramp is deterministic: it has no spectrum")
    for dt in (1.0, 0.01):
        tau = 2.0 ** np.arange(20) * dt
        found = wavelet_variance(process.psd, process.lines(), tau, dt, "haar")
        # The many lobes of a window are narrower than the steps of the quadrature.
        rtol = 2e-3 if isinstance(process, gmwm.AveragedNoise) else 1e-8
        np.testing.assert_allclose(found, process.haar_variance(tau, dt), rtol=rtol)


@pytest.mark.parametrize("process", FIRST)
def test_stationary_processes_give_the_filter_against_their_autocovariance(process):
    try:
        covariance = process.autocovariance(np.arange(2**9 * 12), 1.0)
    except gmwm.InputError:
        pytest.skip("not stationary")
    for name in ("db2", "sym4", "coif2"):
        found = of(process, name, levels=8)
        for value, taps in zip(found, equivalent_filters(name, 8), strict=True):
            # The correlation of the filter sums to zero: the variance drops out.
            lags = np.correlate(taps, taps, "full")[taps.size - 1 :]
            against = covariance[: taps.size] - covariance[0]
            expected = 2.0 * lags[1:] @ against[1:]
            rounding = 1e-13 * covariance[0] * np.sum(np.abs(lags))
            assert value == pytest.approx(expected, rel=1e-8, abs=rounding), name


@settings(max_examples=10, deadline=None)
@given(st.sampled_from(SOME), st.floats(-3.0, -0.35), st.floats(-2.0, -0.05))
def test_resonances_of_any_frequency_down_to_damping_of_one_per_cent(name, log_f, log_damping):
    process = gmwm.Resonance(1.0, 10.0**log_f, 10.0**log_damping)
    levels = 8
    x, w = np.polynomial.legendre.leggauss(16)
    # Panels resolve the lobes everywhere and the resonance around its frequency.
    peak = process.frequency * (1.0 + process.damping * np.linspace(-60.0, 60.0, 241))
    edges = np.union1d(np.linspace(0.0, 0.5, 2**10 + 1), peak[(peak > 0.0) & (peak < 0.5)])
    half = 0.5 * np.diff(edges)[:, None]
    f = 0.5 * (edges[1:] + edges[:-1])[:, None] + half * x
    gains = wavelet(name).gains(levels, f)
    brute = 2.0 * np.sum(gains * half * w * process.psd(f, 1.0), axis=(1, 2))
    found = wavelet_variance(process.psd, (), 2.0 ** np.arange(levels), 1.0, name)
    np.testing.assert_allclose(found, brute, rtol=1e-4)


def test_coarsest_levels_follow_the_power_laws_of_white_noise_and_random_walk():
    for name in SOME[:2]:
        white = of(gmwm.WhiteNoise(1.0), name, levels=30)
        np.testing.assert_allclose(white, 0.5 / 2.0 ** np.arange(30), rtol=1e-12)
        walk = of(gmwm.RandomWalk(1.0), name, levels=30)
        np.testing.assert_allclose(walk[21:] / walk[20:-1], 2.0, rtol=1e-9)


def test_quantization_noise_at_coarse_levels_holds_every_octave_of_the_band():
    """db2 leaves as much of it in each octave above its pass band: nothing may be cut off."""
    found = of(gmwm.QuantizationNoise(1.0), "db2", levels=11)
    expected = [np.sum(np.diff(taps, prepend=0.0, append=0.0) ** 2)
                for taps in equivalent_filters("db2", 11)]  # fmt: skip
    np.testing.assert_allclose(found, expected, rtol=1e-11)


def test_a_ramp_is_seen_by_db1_as_by_haar_which_it_is():
    ramp = gmwm.RateRamp(0.3)
    np.testing.assert_array_equal(of(ramp, "db1"), of(ramp, "haar"))


def test_ramp_leaves_nothing_with_two_vanishing_moments():
    np.testing.assert_array_equal(of(gmwm.RateRamp(0.3), "db2"), 0.0)


def test_line_is_half_its_square_at_its_alias():
    filters = wavelet("db3")
    for frequency in (0.05, 0.95, 1.05, 7.05):
        found = of(gmwm.Sinusoid(2.0, frequency), "db3", levels=6)
        np.testing.assert_allclose(found, 2.0 * filters.gains(6, 0.05), rtol=1e-9)


def test_twice_integrated_noise_needs_two_vanishing_moments():
    process = gmwm.ARIMA([], 2, [], 1.0)
    expected = [np.sum(np.cumsum(np.cumsum(taps)) ** 2) for taps in equivalent_filters("db2", 9)]
    np.testing.assert_allclose(of(process, "db2", 9), expected, rtol=1e-8)
    assert np.all(np.isfinite(of(process, "coif1", 20)))
    with pytest.raises(gmwm.InputError, match=r"f\^-4 .* 1 vanishing moment of .*'db2'"):
        of(process, "db1")
    with pytest.raises(gmwm.InputError, match=r"'db2'"):  # however small its unit makes it
        of(gmwm.ARIMA([], 2, [], 1e-18), "db1")


@pytest.mark.parametrize(
    ("slope", "enough"), [(3.0, "db2"), (4.9, "db3"), (5.0, "db3"), (6.0, "db3"), (19.9, "db10")]
)
def test_spectra_too_steep_are_told_which_wavelet_would_do(slope, enough):
    def psd(f, dt):
        return f**-slope

    tau = 2.0 ** np.arange(5)
    too_few = "haar" if slope < 4.5 else "db2"
    with pytest.raises(gmwm.InputError, match=f"'{enough}'"):
        wavelet_variance(psd, (), tau, 1.0, too_few)
    assert np.all(np.isfinite(wavelet_variance(psd, (), tau, 1.0, enough)))


@pytest.mark.parametrize("slope", [0.0, 0.7, 1.3, 2.0, 2.5, 3.0, 4.0])
def test_power_laws_scale_as_they_must(slope):
    """At coarse levels the variance of f^-a grows as tau^(a - 1)."""
    found = wavelet_variance(lambda f, dt: f**-slope, (), 2.0 ** np.arange(16), 1.0, "db4")
    np.testing.assert_allclose(found[11:] / found[10:-1], 2.0 ** (slope - 1.0), rtol=1e-5)


def test_averaging_times_must_be_dyadic():
    for tau in ([3.0], [1.0, 0.5], [-1.0], [0.0], [np.nan], [np.inf], [2.0**70]):
        with pytest.raises(gmwm.InputError, match="powers of two"):
            gmwm.WhiteNoise(1.0).wavelet_variance(tau, 1.0, "db2")


def test_averaging_times_in_any_order_and_shape():
    process = gmwm.GaussMarkov(1.0, 20.0)
    all_levels = of(process, "db2", 6, dt=0.01)
    tau = 0.01 * np.array([[32.0, 1.0], [4.0, 4.0]])
    np.testing.assert_allclose(
        process.wavelet_variance(tau, 0.01, "db2"), all_levels[[[5, 0], [2, 2]]], rtol=1e-9
    )
    assert process.wavelet_variance(np.float64(0.04), 0.01, "db2").shape == ()
    assert process.wavelet_variance([], 0.01, "db2").shape == (0,)


def test_a_spectrum_that_is_none_is_refused():
    for bad in (lambda f, dt: -f, lambda f, dt: f * np.nan, lambda f, dt: 1.0):
        with pytest.raises(gmwm.InputError, match="psd gives"):
            wavelet_variance(bad, (), np.array([1.0, 2.0]), 1.0, "db2")


def test_weights_hold_the_energy_of_every_level_at_thirty_levels():
    grid = gain_weights("db10", 30)
    np.testing.assert_allclose(np.sum(grid.weight, axis=1), 0.5 ** np.arange(2, 32), rtol=1e-10)
    assert np.all(np.diff(grid.frequency) > 0.0)
    assert 0.0 < grid.frequency[0] < grid.frequency[-1] < 0.5
    with pytest.raises(ValueError, match="read-only"):
        grid.weight[0, 0] = 0.0


def test_lagrange_polynomials_reproduce_polynomials_and_their_nodes():
    nodes, _ = unit_legendre(8)
    at = np.concatenate([np.linspace(0.0, 1.0, 33), nodes])
    found = lagrange(nodes, at)
    for degree in range(8):
        np.testing.assert_allclose(found @ nodes**degree, at**degree, atol=1e-12)
    np.testing.assert_array_equal(found[33:], np.eye(8))


def test_a_panel_is_smooth_if_a_polynomial_of_low_degree_goes_through_its_points():
    points = np.cos(np.pi * (np.arange(12) + 0.5) / 12)
    values = np.polynomial.chebyshev.chebval(points, np.eye(12)) + 0.1
    np.testing.assert_array_equal(Panels.are_smooth(values), np.arange(12) < 9)
