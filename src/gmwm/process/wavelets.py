"""Daubechies-type wavelet filters and their gains.

Filters are those of PyWavelets in the normalisation of the maximal overlap transform (MODWT): the
scaling filter g sums to 1, the wavelet filter h to 0, and sum h^2 = sum g^2 = 1/2 (Percival &
Walden, *Wavelet Methods for Time Series Analysis*, 2000, ch. 5).

Integrals of the gains against smooth spectra are exact at every level: on panels graded by octaves
a spectrum is a polynomial, the lobes of a gain go into the weights of its nodes, and these follow
from level to level by the transfer operator of the scaling filter. docs/derivations.md has it.
"""

from collections.abc import Iterator
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


_NODES_PER_PANEL = 8
_PANELS_LOG2 = 5  # panels an octave: 32 hold a resonance of damping 0.01 to 1e-5
_PANELS_BELOW_LOG2 = 2
_OCTAVES_BELOW = 26  # below the coarsest pass band
_ORDER = 64


@dataclass(frozen=True, eq=False)
class GainWeights:
    """Nodes and weights for the levels 1 to J of a wavelet.

    frequency: (K,), nodes in cycles per sample, rising, within (0, 1/2).
    weight: (J, K), int_0^{1/2} |H_j|^2 S df = weight[j - 1] @ S(frequency), in cycles per sample.
    lowest, second: Nodes of the two lowest octaves.
    """

    frequency: FloatArray
    weight: FloatArray
    lowest: slice
    second: slice


@lru_cache(maxsize=8)
def unit_legendre(order: int) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre nodes and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(order)
    return 0.5 * (x + 1.0), 0.5 * w


def lagrange(nodes: FloatArray, at: FloatArray) -> FloatArray:
    """Lagrange polynomials of ``nodes`` (m,) at points (k,), shape (k, m)."""
    # The scale 4 is the inverse capacity of [0, 1]: products of many differences stay in range.
    apart = 4.0 * (nodes[:, None] - nodes[None, :])
    np.fill_diagonal(apart, 1.0)
    barycentric = 1.0 / np.prod(apart, axis=1)
    difference = at[:, None] - nodes[None, :]
    hit = difference == 0.0
    difference[hit] = 1.0
    terms = barycentric / difference
    result = terms / np.sum(terms, axis=1, keepdims=True)
    rows = np.any(hit, axis=1)
    result[rows] = hit[rows]
    return np.asarray(result)


def transfer_matrix(factor: FloatArray, other: FloatArray) -> FloatArray:
    """T phi at the nodes from phi at the nodes, for factors at u/2 and (u + 1)/2."""
    u, _ = unit_legendre(_ORDER)
    low, high = lagrange(u, 0.5 * u), lagrange(u, 0.5 * (u + 1.0))
    return 0.5 * (factor[:, None] * low + other[:, None] * high)


def _composite() -> tuple[FloatArray, FloatArray]:
    """Nodes and weights on [0, 1] that integrate products of gains and Lagrange polynomials."""
    u, w = unit_legendre(_ORDER)
    nodes = (np.arange(8)[:, None] + u) / 8
    return nodes.ravel(), np.tile(w / 8, 8)


@lru_cache(maxsize=8)
def gain_measures(name: str, count: int) -> FloatArray:
    """int_0^1 sin^2r(pi u) |H_j(u)|^2 l_n(u) du, j = 1 .. count, shape (count, _ORDER)."""
    filters = wavelet(name)
    power = 2 * filters.vanishing_moments
    u, _ = unit_legendre(_ORDER)
    step = transfer_matrix(filters.remainder(0.5 * u), filters.remainder(0.5 * (u + 1.0)))
    step *= 0.5**power
    fine, weight = _composite()
    first = weight * np.sin(np.pi * fine) ** power * filters.detail_gain(fine)
    result = np.empty((count, u.size))
    result[0] = first @ lagrange(u, fine)
    for row in range(1, count):
        result[row] = result[row - 1] @ step
    result.flags.writeable = False
    return result


def _octaves(levels: int) -> Iterator[tuple[int, FloatArray, FloatArray]]:
    """Panels of every octave, from the lowest on: s, fine frequencies and nodes; width 2^-s."""
    x, _ = unit_legendre(_NODES_PER_PANEL)
    u, _ = unit_legendre(_ORDER)
    for octave in range(levels + _OCTAVES_BELOW, -1, -1):
        split = _PANELS_LOG2 if octave <= levels + 1 else _PANELS_BELOW_LOG2
        doublings = octave + 2 + split
        start = 2.0**split + np.arange(2**split)[:, None]
        yield doublings, 0.5**doublings * (start + u), 0.5**doublings * (start + x)


def _rest(levels: int) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights from zero to the lowest octave."""
    x, w = unit_legendre(_NODES_PER_PANEL)
    low = 0.5 ** (levels + _OCTAVES_BELOW + 2)
    return low * x, low * w


def _unresolved_factor(filters: Wavelet, doublings: int, fine: FloatArray) -> FloatArray:
    """P_s(f) / sin^2r(pi u) at the fine points of an octave, (P, _ORDER)."""
    power = 2 * filters.vanishing_moments
    result = (2.0**doublings * np.sin(np.pi * fine)) ** -power
    for doubling in range(doublings):
        scaled = np.ldexp(fine, doubling)
        result *= filters.remainder(scaled - np.rint(scaled))
    return np.asarray(result)


@lru_cache(maxsize=8)
def gain_weights(name: str, levels: int) -> GainWeights:
    """Nodes and weights of the levels 1 to ``levels`` of a wavelet, found once."""
    filters = wavelet(name)
    u, w = unit_legendre(_ORDER)
    polynomials = lagrange(unit_legendre(_NODES_PER_PANEL)[0], u)
    measures = gain_measures(name, levels)
    low_nodes, low_weights = _rest(levels)
    # A spectrum may rise to infinity on [0, lowest], but its product with the gain is smooth.
    frequencies, weights = [low_nodes], [low_weights * filters.gains(levels, low_nodes)]
    for doublings, fine, nodes in _octaves(levels):
        width, direct = 0.5**doublings, min(levels, doublings)
        weight = np.empty((levels, *nodes.shape))
        weight[:direct] = width * (filters.gains(direct, fine) * w) @ polynomials
        if levels > direct:
            factor = _unresolved_factor(filters, doublings, fine)
            for row in range(direct, levels):
                weight[row] = width * (factor * measures[row - direct]) @ polynomials
        frequencies.append(nodes.ravel())
        weights.append(weight.reshape(levels, -1))
    frequency, weight = np.concatenate(frequencies), np.concatenate(weights, axis=1)
    for array in (frequency, weight):
        array.flags.writeable = False
    first, second, third = np.cumsum([each.size for each in frequencies[:3]])
    return GainWeights(frequency, weight, slice(first, second), slice(second, third))
