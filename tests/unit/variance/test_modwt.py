"""Wavelet coefficients against PyWavelets and their definition."""

import numpy as np
import pytest
import pywt
from hypothesis import given, settings, strategies as st

from gmwm.process.wavelets import NAMES, wavelet
from gmwm.variance.levels import wavelet_coefficients

SOME = ("haar", "db2", "db5", "db10", "sym8", "coif2", "coif5")


def by_definition(x, name, level):
    """Circular coefficients of a level, its equivalent filter applied through the FFT."""
    n = x.size
    transfer = wavelet(name).transfer(level, np.fft.fftfreq(n))
    return np.fft.ifft(transfer * np.fft.fft(x)).real


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(NAMES), st.integers(1, 10_000))
def test_coefficients_free_of_end_effects_are_those_that_do_not_wrap(name, n):
    x = np.random.default_rng(n).standard_normal(n)
    filters = wavelet(name)
    levels = list(wavelet_coefficients(x, name))
    assert len(levels) == filters.levels(n)
    for level, found in enumerate(levels, 1):
        width = filters.width(level)
        assert found.size == n - width + 1
        np.testing.assert_allclose(found, by_definition(x, name, level)[width - 1 :], atol=1e-12)


@pytest.mark.parametrize("name", ["haar", "db2", "db4", "sym5", "coif1", "coif3"])
def test_agrees_with_pywavelets(name):
    x = np.random.default_rng(3).standard_normal(256)
    # Its transform correlates where this one convolves: it is that of the reversed series, and
    # its coefficients are delayed by half of each filter.
    theirs = pywt.swt(x[::-1], name, level=4, norm=True, trim_approx=True)
    for expected, found in zip(theirs[:0:-1], wavelet_coefficients(x, name, 4), strict=True):
        assert (
            np.min(
                np.abs(
                    np.lib.stride_tricks.sliding_window_view(np.tile(expected[::-1], 2), found.size)
                    - found
                ).max(axis=1)
            )
            < 1e-12
        )


@pytest.mark.parametrize("name", SOME)
def test_polynomials_below_the_vanishing_moments_leave_nothing(name):
    t = np.linspace(-1.0, 1.0, 3000)
    for found in wavelet_coefficients(t ** (wavelet(name).vanishing_moments - 1) + 3.0, name):
        assert np.max(np.abs(found)) < 1e-9


def test_coefficients_come_one_level_at_a_time():
    x = np.random.default_rng(6).standard_normal(100)
    source = wavelet_coefficients(x, "db2", levels=2)
    assert next(source).size == 97
    assert next(source).size == 91
    with pytest.raises(StopIteration):
        next(source)
    assert list(wavelet_coefficients(x[:3], "db2")) == []
    assert len(list(wavelet_coefficients(x[:10], "db2", levels=7))) == 2
