"""Spectral integrals against wavelet filters, for any power spectral density.

The Haar MODWT filter of averaging time ``tau = m dt`` has the squared gain

    |H_m(f)|^2 = sin^4(pi m f dt) / (m^2 sin^2(pi f dt)),

(Percival & Walden, *Wavelet Methods for Time Series Analysis*, 2000, ch. 5 and 8), so that the
wavelet variance is ``2 int_0^{1/(2 dt)} |H_m(f)|^2 S(f) df``. One fixed set of nodes serves all
levels: a spectrum is evaluated once, and all variances are one matrix product. Other wavelets have
weights of their own (`gmwm.process.wavelets`); docs/derivations.md has both.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, wraps
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy import fft
from scipy.special import expit

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process.wavelets import GainWeights, Wavelet, gain_weights, wavelet

PSD = Callable[[FloatArray, float], FloatArray]
"""``psd(f, dt)``: two-sided density in u^2/Hz at frequencies f in Hz."""

MEAN_SIN4 = 3.0 / 8.0

_NODES_PER_PANEL = 8
_MIN_PANELS, _MAX_PANELS = 16, 512  # an octave
_RESOLVED_LOBES = 256
_OCTAVES_BELOW = 26  # below the lowest lobe: a 1/f^2 spectrum leaves 2^-26 of its variance there
_MAX_LEVEL = 62
_MARGIN = 0.25  # a spectrum f^-a needs a < 2 r + 1 - _MARGIN: the lowest octaves then add up


@dataclass(frozen=True, eq=False)
class Quadrature:
    """Nodes and gains for a set of averaging times.

    frequency: (K,), nodes in cycles per sample, within (0, 1/2).
    weight: (K,), quadrature weights, in cycles per sample; their sum is 1/2.
    gain: (J, K), |H_m|^2 at the nodes, with unresolved lobes replaced by their mean.
    """

    frequency: FloatArray
    weight: FloatArray
    gain: FloatArray

    def haar_variance(self, psd: PSD, dt: float) -> FloatArray:
        """Wavelet variance of every averaging time, in u^2, shape (J,)."""
        density = evaluated(psd, self.frequency / dt, dt) / dt
        return 2.0 * (self.gain @ (self.weight * density))


def evaluated(psd: PSD, f: FloatArray, dt: float) -> FloatArray:
    """``psd(f, dt)``, checked: a user's own may be anything."""
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
    sine = np.sin(np.pi * m * frequency) ** 2  # a fourth power takes ten times as long
    return sine**2 / (m * np.sin(np.pi * frequency)) ** 2


def _kept(function: PSD) -> PSD:
    """Keep results for arrays that nobody can write to: the spectra of a search share them."""
    known: deque[tuple[FloatArray, float, FloatArray]] = deque(maxlen=16)

    @wraps(function)
    def found(f: FloatArray, dt: float) -> FloatArray:
        if not isinstance(f, np.ndarray) or f.base is not None or f.flags.writeable:
            return function(f, dt)
        for array, interval, values in tuple(known):
            if array is f and interval == dt:
                return values
        values = function(f, dt)
        values.flags.writeable = False
        known.append((f, dt, values))
        return values

    return found


@_kept
def in_hertz(f: FloatArray, dt: float) -> FloatArray:
    """Frequencies in Hz from those in cycles per sample."""
    return f / dt


@_kept
def squared_sine(f: FloatArray, dt: float) -> FloatArray:
    """sin^2(pi f dt) at frequencies f in Hz."""
    return np.asarray(np.sin(np.pi * f * dt) ** 2)


@_kept
def log_tangent(f: FloatArray, dt: float) -> FloatArray:
    """Log tan(pi |f| dt) at frequencies f in Hz, up to half the sampling rate."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.tan(np.pi * np.minimum(np.abs(f) * dt, 0.5))))


@lru_cache(maxsize=8)
def legendre(order: int) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre nodes and weights on [-1, 1]."""
    x, w = np.polynomial.legendre.leggauss(order)
    return x, w


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


def resolved_share(m: float, frequency: FloatArray) -> FloatArray:
    """Share of a gain that is resolved (1) rather than averaged over lobes (0), at nodes (K,)."""
    octave_low = np.ldexp(0.5, np.frexp(frequency)[1])
    lobes = m * octave_low
    last, end = np.searchsorted(lobes, (0.5 * _RESOLVED_LOBES, _RESOLVED_LOBES), side="right")
    share = np.zeros(frequency.size)
    share[:end] = 1.0
    if end < frequency.size:  # the last octave fades out, unless nothing follows
        u = np.clip(frequency[last:end] / octave_low[last:end] - 1.0, 1e-9, 1.0 - 1e-9)
        share[last:end] = expit(1.0 / u - 1.0 / (1.0 - u))  # infinitely smooth
    return share


def _gains(averaging: Sequence[float], frequency: FloatArray) -> FloatArray:
    """`Quadrature.gain`."""
    gain = np.empty((len(averaging), frequency.size))
    square = np.sin(np.pi * frequency) ** 2
    for row, m in enumerate(averaging):
        gain[row] = MEAN_SIN4 / (m * m * square)
        share = resolved_share(m, frequency)
        end = int(np.count_nonzero(share))  # the nodes rise, and the shares fall
        share, part = share[:end], frequency[:end]
        gain[row, :end] = (1.0 - share) * gain[row, :end] + share * haar_gain(m, part)
    return gain


def node_weights(averaging: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Nodes (K,) in cycles per sample, and the weights (J, K) of a spectrum there."""
    frequency, weight = _nodes(max(averaging))
    return frequency, 2.0 * weight * _gains(averaging, frequency)


@lru_cache(maxsize=8)  # 7 MB each
def quadrature(averaging: tuple[float, ...]) -> Quadrature:
    """The quadrature for averaging times of ``averaging`` samples each."""
    frequency, weight = _nodes(max(averaging))
    gain = _gains(averaging, frequency)
    for array in (frequency, weight, gain):
        array.flags.writeable = False
    return Quadrature(frequency, weight, gain)


PANEL, _POINTS = 0.125, 12
"""Width of a panel in the logarithm of tan(pi f dt), and Chebyshev points on it. A polynomial
through them is as near as rho^-12, rho that of the Bernstein ellipse through the next pole of the
spectrum (Trefethen 2013, *Approximation Theory and Approximation Practice*, ch. 8)."""

POLE_OF_PANEL = 2.21
"""Distance of that pole, in half panels, from which the polynomial is good to 1e-8."""

_ANGLES = np.pi * (np.arange(_POINTS) + 0.5) / _POINTS
_TAIL = 2.0 / _POINTS * np.cos(np.outer(_ANGLES, np.arange(_POINTS - 3, _POINTS)))
"""Last three Chebyshev coefficients from the values at the points."""


@dataclass(frozen=True, eq=False)
class Panels:
    """The nodes of a quadrature in panels, on which a smooth spectrum is a polynomial.

    points: (P, 12), Chebyshev points of each panel, in the coordinate of the nodes.
    starts: (P,), first node of each panel.
    share: (K, 12), lagrange's polynomials of the points of its panel at each node.
    """

    points: FloatArray
    starts: npt.NDArray[np.intp]
    share: FloatArray

    @classmethod
    def of(cls, nodes: FloatArray, width: float = PANEL) -> Self:
        """Those of nodes (K,), panel by panel: log tan(pi f) of each, f in cycles per sample."""
        panel = np.floor(nodes / width)
        starts = np.flatnonzero(np.diff(panel, prepend=-np.inf))
        points = np.cos(_ANGLES)
        within = 2.0 * (nodes / width - panel) - 1.0
        # By the barycentric formula, whose limit at a point is one.
        distance = within[:, None] - points
        distance[distance == 0.0] = np.finfo(float).tiny
        share = (-1.0) ** np.arange(_POINTS) * np.sin(_ANGLES) / distance
        share /= np.sum(share, axis=1, keepdims=True)
        return cls(width * (panel[starts, None] + 0.5 * (points + 1.0)), starts, share)

    def gathered(self, weight: FloatArray) -> FloatArray:
        """Weights of the points from weights of the nodes, (..., K) to (..., P, 12)."""
        ends = np.append(self.starts[1:], self.share.shape[0])
        result = np.empty((*weight.shape[:-1], *self.points.shape))
        for p, (start, end) in enumerate(zip(self.starts, ends, strict=True)):
            result[..., p, :] = weight[..., start:end] @ self.share[start:end]
        return result

    @staticmethod
    def are_smooth(values: FloatArray) -> npt.NDArray[np.bool_]:
        """Panels on which values at the points, (P, 12), are a polynomial to 1e-10, (P,)."""
        tail = np.max(np.abs(values @ _TAIL), axis=1)
        return np.asarray(tail <= 1e-10 * np.max(np.abs(values), axis=1))


@lru_cache(maxsize=16)
def log_tangent_weights(
    averaging: tuple[float, ...], panel: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Log tan(pi f) at all nodes of the quadrature, and the weights of each averaging time.

    panel: Width of panels on which a spectrum is smooth: their points are far fewer.
    """
    frequency, weight = node_weights(rounded(averaging))
    nodes = np.log(np.tan(np.pi * frequency))
    if panel == 0.0:
        return nodes, weight
    panels = Panels.of(nodes, panel)
    return panels.points.ravel(), panels.gathered(weight).reshape(len(averaging), -1)


def haar_variance(psd: PSD, tau: FloatArray, dt: float) -> FloatArray:
    """Haar wavelet variance of a process from its spectrum alone.

    Returns: same shape as ``tau``, in u^2.
    """
    tau = np.asarray(tau, dtype=float)
    result = quadrature(rounded(tuple((tau.ravel() / dt).tolist()))).haar_variance(psd, dt)
    return np.asarray(result.reshape(tau.shape))


@lru_cache(maxsize=8)
def rounded(averaging: tuple[float, ...]) -> tuple[float, ...]:
    """Averaging times in samples, those that are whole but for rounding errors as whole numbers."""
    return tuple(float(np.rint(m)) if abs(m - np.rint(m)) < 1e-9 * m else m for m in averaging)


def wavelet_variance(
    psd: PSD, lines: Sequence[tuple[float, float]], tau: FloatArray, dt: float, name: str
) -> FloatArray:
    """Wavelet variance by any Daubechies filter, from the spectrum, same shape as ``tau``, u^2.

    psd: ``psd(f, dt)``, two-sided, u^2/Hz.
    lines: Spectral lines beside it: frequency (Hz), amplitude (u).
    tau: Averaging times 2^(j-1) dt in seconds.
    name: Wavelet, see `gmwm.process.wavelets.wavelet`.
    Raises InputError for averaging times that are not dyadic, an unknown wavelet, or a spectrum
        that rises so fast towards zero frequency that the coefficients are not stationary.
    """
    filters = wavelet(name)
    tau = np.asarray(tau, dtype=float)
    level = _levels(tau.ravel() / dt)
    if level.size == 0:
        return np.zeros(tau.shape)
    weights = gain_weights(filters.name, int(np.max(level)))
    density = evaluated(psd, weights.frequency / dt, dt) / dt
    _check_stationary(filters, weights, density)
    result = 2.0 * (weights.weight @ density)[level - 1]
    for frequency, amplitude in lines:
        alias = np.asarray(frequency * dt - np.rint(frequency * dt))
        result += 0.5 * amplitude**2 * filters.gains(int(np.max(level)), alias)[level - 1]
    return np.asarray(result.reshape(tau.shape))


def _levels(m: FloatArray) -> npt.NDArray[np.intp]:
    """Levels j of averaging times of m = 2^(j-1) samples."""
    with np.errstate(invalid="ignore", divide="ignore"):
        exponent = np.log2(m)
        level = np.where(np.isfinite(exponent), np.rint(exponent) + 1.0, 0.0)
    wrong = ~((level >= 1.0) & (level <= _MAX_LEVEL) & (np.abs(exponent - level + 1.0) < 1e-9))
    if np.any(wrong):
        raise InputError(
            f"an averaging time is {m[wrong][0]:g} samples: wavelets other than Haar need powers "
            f"of two from 1 to 2^{_MAX_LEVEL - 1}"
        )
    return level.astype(int)


def _check_stationary(filters: Wavelet, weights: GainWeights, density: FloatArray) -> None:
    """Refuse a spectrum under which the lowest octaves do not add up to a finite variance."""
    octaves = (weights.lowest, weights.second)
    low, above = (float(weights.weight[0, part] @ density[part]) for part in octaves)
    if low <= 0.0 or low < 0.5**_MARGIN * above:
        return
    moments = filters.vanishing_moments
    slope = 2.0 * moments + 1.0 + np.log2(low / above)
    enough = int(np.floor(0.5 * (slope - 1.0 + _MARGIN))) + 1
    hint = f"use 'db{enough}'" if enough <= 10 else "it is too steep for any wavelet"
    raise InputError(
        f"the spectrum rises like f^-{slope:.3g} towards zero frequency, too fast for the "
        f"{moments} vanishing moment{'s'[: moments != 1]} of wavelet {filters.name!r}: {hint}"
    )


def circulant(spectrum: FloatArray, n: int, rng: np.random.Generator) -> FloatArray:
    """First ``n`` samples of a periodic Gaussian series (Davies & Harte 1987, *Biometrika* 74, 95).

    spectrum: (N/2 + 1,), non-negative eigenvalues of its circulant covariance matrix at frequencies
        0, 1/N, ..., 1/2 cycles per sample.
    """
    size = 2 * (spectrum.size - 1)
    transformed = fft.rfft(rng.standard_normal(size)) * np.sqrt(spectrum)
    return np.asarray(fft.irfft(transformed, size)[:n])


def from_psd(psd: PSD, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
    """A Gaussian series from its power spectral density.

    The spectrum is sampled at multiples of 1/(4 n dt), so the autocovariance is right up to what
    is left of it beyond lag 3 n. A spectrum that grows without bound towards zero frequency is
    simulated through its first differences and starts at zero.
    """
    size = fft.next_fast_len(4 * n, real=True)
    size += size % 2
    frequency = np.arange(size // 2 + 1) / size
    frequency[0] = 1e-4 / size
    spectrum = evaluated(psd, frequency / dt, dt) / dt
    if spectrum[0] <= 2.0 * spectrum[1]:
        return circulant(spectrum, n, rng)
    difference = spectrum * 4.0 * np.sin(np.pi * frequency) ** 2
    path = np.cumsum(circulant(difference, n, rng))
    return np.asarray(path - path[0])
