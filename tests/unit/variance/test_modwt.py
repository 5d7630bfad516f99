"""The transform against PyWavelets, its definition, and itself backwards."""

import numpy as np
import pytest
import pywt
from hypothesis import given, settings, strategies as st

from gmwm import InputError
from gmwm.process.wavelets import NAMES, wavelet
from gmwm.variance.modwt import coefficients, imodwt, modwt

SOME = ("haar", "db2", "db5", "db10", "sym8", "coif2", "coif5")


def by_definition(x, name, level):
    """Circular coefficients of a level, its equivalent filter applied through the FFT."""
    n = x.size
    transfer = wavelet(name).transfer(level, np.fft.fftfreq(n))
    return np.fft.ifft(transfer * np.fft.fft(x)).real


@settings(max_examples=80, deadline=None)
@given(st.sampled_from(NAMES), st.integers(1, 700), st.integers(0, 2**32 - 1))
def test_reconstruction_is_exact_at_any_length(name, n, seed):
    x = np.random.default_rng(seed).standard_normal(n) + 5.0
    transform = modwt(x, name)
    # The published coefficients of the symlets are right to eleven digits.
    np.testing.assert_allclose(transform.inverse(), x, atol=1e-9 if "sym" in name else 1e-12)
    again = imodwt(transform.detail, transform.smooth, name)
    np.testing.assert_array_equal(again, transform.inverse())


@pytest.mark.parametrize("name", SOME)
def test_levels_are_the_equivalent_filters_applied_circularly(name):
    for n in (1, 2, 3, 10, 63, 256, 1001, 9001):
        x = np.random.default_rng(n).standard_normal(n)
        transform = modwt(x, name, levels=n.bit_length())
        assert transform.detail.shape == (n.bit_length(), n)
        for level, found in enumerate(transform.detail, 1):
            np.testing.assert_allclose(found, by_definition(x, name, level), atol=1e-12)


@pytest.mark.parametrize("name", ["haar", "db2", "db4", "sym5", "coif1", "coif3"])
def test_agrees_with_pywavelets(name):
    x = np.random.default_rng(3).standard_normal(256)
    # Its transform correlates where this one convolves: it is that of the reversed series, and
    # its coefficients are delayed by half of each filter.
    theirs = pywt.swt(x[::-1], name, level=4, norm=True, trim_approx=True)
    ours = modwt(x, name, levels=4)
    for expected, found in zip(theirs[:0:-1], ours.detail, strict=True):
        expected = expected[::-1]
        shifts = [np.max(np.abs(np.roll(expected, shift) - found)) for shift in range(256)]
        assert np.min(shifts) < 1e-12
    np.testing.assert_allclose(np.sort(theirs[0]), np.sort(ours.smooth), atol=1e-12)


@pytest.mark.parametrize("name", SOME)
def test_energy_is_kept(name):
    x = np.random.default_rng(4).standard_normal(777)
    transform = modwt(x, name)
    energy = np.sum(transform.detail**2) + np.sum(transform.smooth**2)
    assert energy == pytest.approx(np.sum(x**2), rel=1e-9)
    assert np.mean(transform.smooth) == pytest.approx(np.mean(x), rel=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(NAMES), st.integers(1, 10_000))
def test_coefficients_free_of_end_effects_are_those_that_do_not_wrap(name, n):
    x = np.random.default_rng(n).standard_normal(n)
    filters = wavelet(name)
    transform = modwt(x, name)
    levels = list(coefficients(x, name))
    assert len(levels) == filters.levels(n)
    for level, found in enumerate(levels, 1):
        width = filters.width(level)
        assert found.size == n - width + 1
        np.testing.assert_allclose(found, transform.detail[level - 1, width - 1 :], atol=1e-12)


@pytest.mark.parametrize("name", SOME)
def test_polynomials_below_the_vanishing_moments_leave_nothing(name):
    t = np.linspace(-1.0, 1.0, 3000)
    for found in coefficients(t ** (wavelet(name).vanishing_moments - 1) + 3.0, name):
        assert np.max(np.abs(found)) < 1e-9


def test_coefficients_come_one_level_at_a_time():
    x = np.random.default_rng(6).standard_normal(100)
    source = coefficients(x, "db2", levels=2)
    assert next(source).size == 97
    assert next(source).size == 91
    with pytest.raises(StopIteration):
        next(source)
    assert list(coefficients(x[:3], "db2")) == []
    assert len(list(coefficients(x[:10], "db2", levels=7))) == 2


def test_inputs_are_left_as_they_are():
    x = np.random.default_rng(7).standard_normal(50)
    x.flags.writeable = False
    before = x.copy()
    modwt(x, "db3").inverse()
    list(coefficients(x, "db3"))
    np.testing.assert_array_equal(x, before)
    assert modwt([1, 2, 3, 4]).detail.dtype == float
    np.testing.assert_allclose(modwt(x[::2], "db2").inverse(), x[::2], atol=1e-12)


@pytest.mark.parametrize(
    ("x", "wavelet_name", "levels", "message"),
    [
        ([], "haar", None, "shape"),
        (3.0, "haar", None, "shape"),
        (np.ones((4, 4)), "haar", None, "shape"),
        ([1.0, np.nan, 2.0], "haar", None, "index 1"),
        ([1.0, np.inf, 2.0], "haar", None, "index 1"),
        (["a", "b"], "haar", None, "not a number"),
        (np.arange(8.0), "db99", None, "not known"),
        (np.arange(8.0), "haar", 0, "levels = 0"),
        (np.arange(8.0), "haar", 5, "levels = 5"),
        (np.arange(8.0), "haar", 1.5, "levels = 1.5"),
        (np.arange(8.0), "haar", True, "levels = True"),
    ],
)
def test_bad_input_is_refused_by_name(x, wavelet_name, levels, message):
    with pytest.raises(InputError, match=message):
        modwt(x, wavelet_name, levels)
    if levels is None:
        with pytest.raises(InputError, match=message):
            coefficients(x, wavelet_name)


@pytest.mark.parametrize("shape", [(3,), (3, 7), (2, 3, 8)])
def test_shapes_that_do_not_belong_together_are_refused(shape):
    with pytest.raises(InputError, match="one row of 8"):
        imodwt(np.zeros(shape), np.zeros(8), "haar")
