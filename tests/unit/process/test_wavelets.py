"""Filters and gains of the wavelets against PyWavelets, textbooks and the filters' own sums."""

import mpmath
import numpy as np
import pytest
import pywt
from hypothesis import given, settings, strategies as st

from gmwm import InputError
from gmwm.process.wavelets import NAMES, wavelet


def equivalent_filter(name, level):
    """The level's filter in full, by convolution of upsampled filters."""
    filters = wavelet(name)
    result = np.ones(1)
    for j in range(level):
        taps = filters.detail if j == level - 1 else filters.scaling
        spread = np.zeros((taps.size - 1) * 2**j + 1)
        spread[:: 2**j] = taps
        result = np.convolve(result, spread)
    return result


@pytest.mark.parametrize("name", NAMES)
def test_filters_are_those_of_pywavelets_in_the_normalisation_of_the_modwt(name):
    filters, source = wavelet(name), pywt.Wavelet(name)
    np.testing.assert_allclose(filters.scaling * np.sqrt(2.0), source.rec_lo, rtol=1e-15)
    np.testing.assert_allclose(filters.detail * np.sqrt(2.0), source.rec_hi, rtol=1e-15)
    assert filters.vanishing_moments == source.vanishing_moments_psi
    assert np.sum(filters.scaling) == pytest.approx(1.0, abs=1e-10)
    assert np.sum(filters.detail) == pytest.approx(0.0, abs=1e-10)
    assert np.sum(filters.detail**2) == pytest.approx(0.5, abs=1e-10)
    # Polynomials below the vanishing moments leave nothing, that of this degree does.
    t = np.linspace(-1.0, 1.0, filters.detail.size)
    for degree in range(filters.vanishing_moments):
        assert abs(filters.detail @ t**degree) < 1e-9
    assert abs(filters.detail @ t**filters.vanishing_moments) > 1e-8


def test_db2_is_d4_as_daubechies_gives_it():
    root = np.sqrt(3.0)
    d4 = np.array([1 + root, 3 + root, 3 - root, 1 - root]) / 8.0
    np.testing.assert_allclose(wavelet("db2").scaling, d4, rtol=1e-14)
    np.testing.assert_allclose(wavelet("db2").detail, d4[::-1] * [1, -1, 1, -1], rtol=1e-14)


@pytest.mark.parametrize("name", NAMES)
def test_gain_is_the_squared_transfer_function_of_the_equivalent_filter(name):
    f = np.linspace(0.0, 0.5, 257)
    for level in (1, 2, 3, 6):
        taps = equivalent_filter(name, level)
        assert taps.size == wavelet(name).width(level)
        response = np.exp(-2j * np.pi * np.outer(f, np.arange(taps.size))) @ taps
        found = wavelet(name).gain(level, f)
        np.testing.assert_allclose(found, np.abs(response) ** 2, atol=1e-9)
        np.testing.assert_allclose(wavelet(name).transfer(level, f), response, atol=1e-11)
        np.testing.assert_allclose(wavelet(name).gain(level, -f), found, rtol=1e-12, atol=1e-300)
    filters = wavelet(name)
    smooth = np.prod([filters.scaling_gain(2.0**j * f) for j in range(7)], axis=0)
    np.testing.assert_allclose(np.sum(filters.gains(7, f), axis=0) + smooth, 1.0, atol=1e-9)


def exact_filter_gain(r, f):
    """|H(f)|^2 of "db" with r moments: int_0^{2 pi f} sin^(2r-1) over that to pi, a beta function.

    Meyer's form, Daubechies 1992, sec. 6.1.
    """
    return mpmath.betainc(r, r, 0, mpmath.sin(mpmath.pi * f) ** 2, regularized=True)


@pytest.mark.parametrize("name", ["db1", "db2", "db5", "db10", "sym2", "sym5", "sym10"])
def test_gain_keeps_all_digits_however_small(name):
    r = wavelet(name).vanishing_moments
    for f in (1e-12, 1e-6, 1e-3, 0.1, 0.25, 0.49):
        with mpmath.workdps(40):
            expected = exact_filter_gain(r, mpmath.mpf(f))
            assert abs(wavelet(name).gain(1, np.array([f]))[0] / expected - 1) < 2e-13


@pytest.mark.parametrize("name", [name for name in NAMES if name.startswith("coif")])
def test_gain_of_coiflets_near_zero_is_what_their_first_moment_makes_it(name):
    filters = wavelet(name)
    r, taps = filters.vanishing_moments, filters.detail
    t = np.arange(taps.size) - 0.5 * (taps.size - 1)
    pairs = zip(taps, t, strict=True)
    # H(f) = (-2 pi i f)^r sum h t^r / r! + ...
    moment = float(mpmath.fsum(mpmath.mpf(h) * mpmath.mpf(x) ** r for h, x in pairs))
    f = 1e-9
    expected = ((2 * np.pi * f) ** r * moment / float(mpmath.factorial(r))) ** 2
    assert filters.gain(1, np.array([f]))[0] == pytest.approx(expected, rel=1e-6)


@settings(max_examples=100, deadline=None)
@given(st.sampled_from(NAMES), st.integers(1, 5000))
def test_levels_are_those_whose_filter_fits(name, n):
    filters = wavelet(name)
    levels = filters.levels(n)
    assert levels == 0 or filters.width(levels) <= n
    assert filters.width(levels + 1) > n


def test_gain_at_very_coarse_levels_is_finite_and_bounded():
    f = np.array([0.0, 2.0**-80, 2.0**-40, 2.0**-39, 0.1, 1.0 / 3.0, 0.5])
    for name in ("haar", "db10", "coif5"):
        gains = wavelet(name).gains(62, f)
        assert np.all((gains >= 0.0) & (gains <= 1.0 + 1e-9))


def test_haar_and_db1_are_one():
    assert wavelet("db1").name == "haar"
    np.testing.assert_array_equal(wavelet("db1").detail, wavelet("haar").detail)
    assert wavelet("haar") is wavelet("haar")


def test_unknown_names_are_refused_with_those_there_are():
    for name in ("", "db0", "db11", "DB2", "sym1", "coif6", "bior2.2", "daubechies"):
        with pytest.raises(InputError, match="db10"):
            wavelet(name)


def test_filters_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        wavelet("db2").scaling[0] = 0.0
