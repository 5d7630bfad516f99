"""Spectral integrals against the Haar wavelet filter, for any power spectral density.

The Haar MODWT filter of averaging time ``tau = m dt`` has the squared gain

    |H_m(f)|^2 = sin^4(pi m f dt) / (m^2 sin^2(pi f dt)),

(Percival & Walden, *Wavelet Methods for Time Series Analysis*, 2000, ch. 5 and 8), so that the
wavelet variance is ``2 int_0^{1/(2 dt)} |H_m(f)|^2 S(f) df``. At coarse levels the gain has up to
millions of lobes. The quadrature here is one fixed set of Gauss-Legendre nodes, octave by octave
towards zero frequency, shared by all levels: lobes are resolved over the octaves that hold the
first ``_RESOLVED_LOBES`` of a level, and replaced by their mean 3/8 above, with a smooth transition
over one octave (an infinitely smooth cut-off makes the error of the replacement fall faster
than any power of the number of lobes). With that, a spectrum is evaluated once, and the variances
of all levels are one matrix product.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import expit

from gmwm._typing import FloatArray
from gmwm.errors import InputError

PSD = Callable[[FloatArray, float], FloatArray]
"""``psd(f, dt)``: two-sided density in u^2/Hz at frequencies f in Hz."""

_NODES_PER_PANEL = 8
_MAX_PANELS = 512
_MIN_PANELS = 16
_RESOLVED_LOBES = 256
_OCTAVES_BELOW = 26  # below the lowest lobe: a 1/f^2 spectrum leaves 2^-26 of its variance there

MEAN_SIN4 = 3.0 / 8.0


@dataclass(frozen=True)
class Quadrature:
    """Nodes and gains for a set of averaging times.

    Attributes
    ----------
    frequency : (K,) ndarray
        Nodes in cycles per sample, within (0, 1/2).
    weight : (K,) ndarray
        Quadrature weights, in cycles per sample; their sum is 1/2.
    gain : (J, K) ndarray
        |H_m|^2 at the nodes, with unresolved lobes replaced by their mean.
    resolved : (J, K) ndarray
        Share of each gain that is resolved (1) rather than averaged over lobes (0).
    """

    frequency: FloatArray
    weight: FloatArray
    gain: FloatArray
    resolved: FloatArray

    def sampled(self, psd: PSD, dt: float) -> FloatArray:
        """``psd`` at the nodes per unit of normalised frequency, in u^2, shape (K,)."""
        return evaluated(psd, self.frequency / dt, dt) / dt

    def haar_variance(self, psd: PSD, dt: float) -> FloatArray:
        """Wavelet variance of every averaging time, in u^2, shape (J,)."""
        return 2.0 * (self.gain @ (self.weight * self.sampled(psd, dt)))


def evaluated(psd: PSD, f: FloatArray, dt: float) -> FloatArray:
    """``psd(f, dt)``, checked: a user's own may be anything.

    Raises
    ------
    InputError
        If it is not one finite, non-negative number a frequency.
    """
    density = np.asarray(psd(f, dt), dtype=float)
    if density.shape != f.shape:
        raise InputError(
            f"psd gives shape {density.shape} for frequencies of shape {f.shape}: return one value "
            "for each frequency"
        )
    if not (np.all(np.isfinite(density)) and np.all(density >= 0.0)):
        raise InputError(
            "psd gives negative, NaN or infinite values: check it over 0 < f <= 1/(2 dt)"
        )
    return density


def haar_gain(m: float, frequency: FloatArray) -> FloatArray:
    """Squared gain of the Haar filter of averaging time ``m`` samples (cycles per sample)."""
    return np.sin(np.pi * m * frequency) ** 4 / (m * np.sin(np.pi * frequency)) ** 2


@lru_cache(maxsize=8)
def legendre(order: int) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre nodes and weights on [-1, 1]."""
    x, w = np.polynomial.legendre.leggauss(order)
    return x, w


def _smooth_cut(u: FloatArray) -> FloatArray:
    """1 at u <= 0, 0 at u >= 1, infinitely differentiable."""
    u = np.clip(u, 1e-9, 1.0 - 1e-9)
    return np.asarray(expit(1.0 / u - 1.0 / (1.0 - u)))


def _nodes(m_max: float) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre nodes and weights on [0, 1/2], panels graded by octave."""
    x, w = legendre(_NODES_PER_PANEL)
    n_octaves = int(np.ceil(np.log2(max(m_max, 1.0)))) + _OCTAVES_BELOW
    edges = [np.array([0.0])]
    for octave in range(n_octaves, -1, -1):
        low = 2.0 ** -(octave + 2)
        lobes = m_max * low
        panels = int(np.clip(2.0 ** np.ceil(np.log2(2.0 * lobes)), _MIN_PANELS, _MAX_PANELS))
        edges.append(low * (1.0 + np.arange(panels) / panels))
    edge = np.concatenate([*edges, np.array([0.5])])
    half = 0.5 * np.diff(edge)[:, None]
    middle = 0.5 * (edge[1:] + edge[:-1])[:, None]
    return (middle + half * x).ravel(), (half * w).ravel()


@lru_cache(maxsize=32)
def quadrature(averaging: tuple[float, ...]) -> Quadrature:
    """The quadrature for averaging times of ``averaging`` samples each."""
    frequency, weight = _nodes(max(averaging))
    gain = np.empty((len(averaging), frequency.size))
    resolved = np.empty_like(gain)
    for row, m in enumerate(averaging):
        octave_low = 2.0 ** np.floor(np.log2(frequency))
        lobes = m * octave_low
        share = np.where(lobes <= _RESOLVED_LOBES, 1.0, 0.0)
        # The last resolved octave fades out, unless it is the top one: there nothing follows.
        last = (lobes <= _RESOLVED_LOBES) & (2.0 * lobes > _RESOLVED_LOBES) & (octave_low < 0.25)
        share[last] = _smooth_cut(frequency[last] / octave_low[last] - 1.0)
        mean = MEAN_SIN4 / (m * np.sin(np.pi * frequency)) ** 2
        exact = share > 0.0
        gain[row] = (1.0 - share) * mean
        gain[row, exact] += share[exact] * haar_gain(m, frequency[exact])
        resolved[row] = share
    for array in (frequency, weight, gain, resolved):
        array.flags.writeable = False
    return Quadrature(frequency, weight, gain, resolved)


def haar_variance(psd: PSD, tau: FloatArray, dt: float) -> FloatArray:
    """Haar wavelet variance of a process from its spectrum alone.

    Parameters
    ----------
    psd : callable
        ``psd(f, dt)``, two-sided, u^2/Hz.
    tau : array_like
        Averaging times in seconds.
    dt : float
        Sampling interval in seconds.

    Returns
    -------
    ndarray
        Same shape as ``tau``, in u^2.
    """
    tau = np.asarray(tau, dtype=float)
    m = tau.ravel() / dt
    rounded = np.where(np.abs(m - np.rint(m)) < 1e-9 * m, np.rint(m), m)
    result = quadrature(tuple(rounded.tolist())).haar_variance(psd, dt)
    return np.asarray(result.reshape(tau.shape))
