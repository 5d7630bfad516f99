"""Daubechies-type wavelet filters and their gains.

Filters are those of PyWavelets in the normalisation of the maximal overlap transform (MODWT): the
scaling filter g sums to 1, the wavelet filter h to 0, and sum h^2 = sum g^2 = 1/2 (Percival &
Walden, *Wavelet Methods for Time Series Analysis*, 2000, ch. 5). Their squared gains are

    |G(f)|^2 = cos^2r(pi f) Q(f),    |H(f)|^2 = |G(1/2 - f)|^2,    |G|^2 + |H|^2 = 1,

with r vanishing moments and a polynomial Q >= 1 in y = sin^2(pi f) that the last equation
determines but for an odd polynomial R,

    Q = sum_{k<r} C(r-1+k, k) y^k + y^r R(1 - 2y)

(Daubechies, *Ten Lectures on Wavelets*, 1992, sec. 6.1). R = 0 for "db" and "sym"; for "coif" it
is found from the filter. The form keeps all digits near f = 0, where |H|^2 falls as f^2r.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import comb

import numpy as np
import numpy.typing as npt

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError

ComplexArray = npt.NDArray[np.complex128]

NAMES = (
    "haar",
    *(f"db{r}" for r in range(1, 11)),
    *(f"sym{r}" for r in range(2, 11)),
    *(f"coif{k}" for k in range(1, 6)),
)
"""The wavelets there are; "haar" and "db1" are the same."""


@dataclass(frozen=True, eq=False)
class Wavelet:
    """A wavelet: its filters and what follows from them.

    name: As in PyWavelets; "haar" for "db1".
    scaling, detail: (L,), MODWT scaling filter g and wavelet filter h.
    vanishing_moments: r: polynomials of degree below r give coefficients of zero.
    """

    name: str
    scaling: FloatArray
    detail: FloatArray
    vanishing_moments: int
    _binomials: FloatArray
    _odd: FloatArray

    def width(self, level: int) -> int:
        """Length of the equivalent filter of a level, (2^j - 1)(L - 1) + 1, in samples."""
        return (2**level - 1) * (self.scaling.size - 1) + 1

    def levels(self, n: int) -> int:
        """Number of levels that have a coefficient free of end effects in ``n`` samples."""
        if n < self.scaling.size:
            return 0
        return ((n - 1) // (self.scaling.size - 1) + 1).bit_length() - 1

    def remainder(self, f: FloatArray) -> FloatArray:
        """Q(f) = |G(f)|^2 / cos^2r(pi f), same shape as ``f`` (cycles per sample)."""
        y = np.sin(np.pi * f) ** 2
        result = np.polynomial.polynomial.polyval(y, self._binomials)
        if self._odd.size:
            odd = np.polynomial.chebyshev.chebval(1.0 - 2.0 * y, self._odd)
            result = result + y**self.vanishing_moments * odd
        return np.asarray(result)

    def scaling_gain(self, f: FloatArray) -> FloatArray:
        """|G(f)|^2 of the scaling filter of level 1."""
        return np.cos(np.pi * f) ** (2 * self.vanishing_moments) * self.remainder(f)

    def detail_gain(self, f: FloatArray) -> FloatArray:
        """|H(f)|^2 of the wavelet filter of level 1."""
        return np.sin(np.pi * f) ** (2 * self.vanishing_moments) * self.remainder(0.5 - f)

    def gain(self, level: int, f: FloatArray) -> FloatArray:
        """Squared gain of a level's equivalent filter, to full relative precision at small f.

        level: j = 1, 2, ...; the averaging time is 2^(j-1) samples.
        f: Frequencies in cycles per sample.
        Returns: |H_j(f)|^2 = |H(2^(j-1) f)|^2 prod_{l<j-1} |G(2^l f)|^2, same shape as ``f``.
        """
        return np.asarray(self.gains(level, f)[-1])

    def gains(self, levels: int, f: FloatArray) -> FloatArray:
        """`gain` of the levels 1 to ``levels``, shape (levels, *f.shape)."""
        f = np.asarray(f, dtype=float)
        result = np.empty((levels, *f.shape))
        finer = np.ones_like(f)
        for row in range(levels):
            scaled = _reduced(f, row)
            result[row] = finer * self.detail_gain(scaled)
            finer *= self.scaling_gain(scaled)
        return result

    def transfer(self, level: int, f: FloatArray) -> ComplexArray:
        """Transfer function H_j(f) = sum_l h_{j,l} exp(-2 pi i f l), complex, same shape."""
        f = np.asarray(f, dtype=float)
        result = _response(self.detail, _reduced(f, level - 1))
        for doubling in range(level - 1):
            result = result * _response(self.scaling, _reduced(f, doubling))
        return result


def _reduced(f: FloatArray, doublings: int) -> FloatArray:
    """2^doublings f, less the nearest whole number: both steps are exact in binary."""
    scaled = np.ldexp(f, doublings)
    return np.asarray(scaled - np.rint(scaled))


def _response(taps: FloatArray, f: FloatArray) -> ComplexArray:
    return np.asarray(np.polynomial.polynomial.polyval(np.exp(-2j * np.pi * f), taps))


def wavelet(name: str) -> Wavelet:
    """The wavelet of a name.

    name: As in PyWavelets: "haar" (or "db1"), "db2" to "db10", "sym2" to "sym10", "coif1" to
        "coif5". The number is that of vanishing moments, for "coif" half of it.
    Raises InputError for a name that is not known.
    """
    if not isinstance(name, str) or name not in NAMES:
        raise InputError(
            f"wavelet {name!r} is not known: choose haar, db2 to db10, sym2 to sym10 or coif1 to "
            "coif5"
        )
    return _made(name)


@lru_cache(maxsize=len(NAMES))
def _made(name: str) -> Wavelet:
    import pywt

    source = pywt.Wavelet(name)
    scaling = np.array(source.rec_lo) / np.sqrt(2.0)
    detail = np.array(source.rec_hi) / np.sqrt(2.0)
    order = int(source.vanishing_moments_psi)
    binomials = np.array([comb(order - 1 + k, k) for k in range(order)], dtype=float)
    odd = _odd_polynomial(scaling, binomials)
    for array in (scaling, detail, binomials, odd):
        array.flags.writeable = False
    return Wavelet("haar" if name == "db1" else name, scaling, detail, order, binomials, odd)


def _odd_polynomial(scaling: FloatArray, binomials: FloatArray) -> FloatArray:
    """Chebyshev coefficients of R from the gain of a filter longer than 2 r.

    |G|^2 - (1 - y)^r sum C(r-1+k, k) y^k = (y (1 - y))^r R(1 - 2y) is linear in R.
    """
    order = binomials.size
    degree = scaling.size - 1 - 2 * order
    if degree < 1:
        return np.zeros(0)
    f = (np.arange(4 * scaling.size) + 0.5) / (8 * scaling.size)
    y = np.sin(np.pi * f) ** 2
    shortest = (1.0 - y) ** order * np.polynomial.polynomial.polyval(y, binomials)
    excess = np.abs(_response(scaling, f)) ** 2 - shortest
    basis = np.polynomial.chebyshev.chebvander(1.0 - 2.0 * y, degree)[:, 1::2]
    basis *= ((y * (1.0 - y)) ** order)[:, None]
    result = np.zeros(degree + 1)
    result[1::2] = np.linalg.lstsq(basis, excess, rcond=None)[0]
    return result
