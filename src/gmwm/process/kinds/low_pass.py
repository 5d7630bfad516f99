"""White noise that a sensor has filtered: the bandwidth of its low-pass, its moving average.

At averaging times well above the memory of the filter it is white noise of density N^2. No filter
or estimator that integrates the sensor can do better than to take it for that, so that its
state-space form is that white noise, without a state.
"""

import math
from functools import lru_cache
from typing import ClassVar

import numpy as np
from scipy import fft

from gmwm._core.compiled import compiled
from gmwm._core.frozen import frozen
from gmwm._core.typing import FloatArray
from gmwm.process.base import Process, Shape
from gmwm.process.kinds.arma import haar_sum
from gmwm.process.parameter import parameter
from gmwm.process.spectral import PANEL, POLE_OF_PANEL, log_tangent, log_tangent_weights
from gmwm.process.state_space import StateSpace

_GRID_PER_DECADE = 6
_LOWEST, _HIGHEST = 0.004, 0.45  # of the grid of bandwidths, in cycles per sample
_LARGEST_LOG = 600.0
_LAGS = 1 << 17
_PANELS = (4.0 * PANEL, PANEL)  # widths that are tried

BUTTERWORTH = float(np.sqrt(0.5))
"""Damping ratio at which the pass band is as flat as it can be."""


class _Filtered(Process):
    """White noise behind any low-pass of gain 1 at zero frequency."""

    is_band_limited: ClassVar[bool] = True
    has_finite_state_space: ClassVar[bool] = False

    N: float

    def state_space(self, dt: float) -> StateSpace:
        """White noise of density N^2, which it acts as beyond the memory of the filter."""
        return StateSpace.white(self.N**2 / dt)


class LowPassNoise(_Filtered):
    """White noise behind a low-pass, as digital filters are made: sensor bandwidth.

    Parameters
    ----------
    N : float, optional
        Root power spectral density at low frequencies, u/sqrt(Hz).
    bandwidth : float, optional
        Frequency at which half of the power is left (-3 dB), Hz.
    order : float, optional
        Of the filter, from 0.9 to 16: beyond its bandwidth the power falls by 6 dB per octave and
        order. It need not be whole.
    damping : float, optional
        Damping ratio of a filter of second order, from 0.2 to 2; 0.7071 is a Butterworth filter of
        any order.

    Notes
    -----
    S(f) = N^2 / (1 + c q + q^2), c = 4 damping^2 - 2, with q = q3 (tan(pi f dt) / tan(pi f3
    dt))^order and 1 + c q3 + q3^2 = 2. These are the Butterworth filters of all orders and the
    filters of second order of any damping (Bessel, Chebyshev), by the bilinear transform
    (Oppenheim & Schafer, *Discrete-Time Signal Processing*, sec. 7.2). A bandwidth at or above
    half the sampling rate leaves the noise white.
    """

    N: float = parameter("u/sqrt(Hz)", "scale", meaning="density of the filtered white noise")
    bandwidth: float = parameter("Hz", meaning="sensor bandwidth, -3 dB")
    order: float = parameter("-", lower=0.9, upper=16.0, meaning="order of the sensor's low-pass")
    damping: float = parameter("-", lower=0.2, upper=2.0, meaning="damping ratio of that low-pass")
    label: ClassVar[str] = "low-pass noise"
    prefix: ClassVar[str] = "lowpass_"
    _examples = ((0.3, 0.1, 2.0, BUTTERWORTH), (1.0, 0.31, 1.0, 0.6), (2e-3, 0.02, 3.3, 1.0))

    def __init__(
        self,
        N: float | None = None,
        bandwidth: float | None = None,
        order: float | None = None,
        damping: float | None = None,
    ) -> None:
        super().__init__(N, bandwidth, order, damping)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        x = log_tangent(f, dt)
        found = _gain(self.bandwidth, self.order, self.damping, x.ravel(), dt)
        return self.N**2 * found.reshape(x.shape)

    def unit_haar_variance(self, shape: Shape, tau: FloatArray, dt: float) -> FloatArray:
        return _unit_curve(shape, tuple((tau / dt).tolist()), dt)

    def autocovariance(self, lag: FloatArray, dt: float) -> FloatArray:
        lag = np.asarray(lag, dtype=int)
        size = 2 * max(_LAGS, 2 * int(np.max(lag, initial=0)))
        frequency = np.arange(size // 2 + 1) / size
        return np.asarray(fft.irfft(self.psd(frequency / dt, dt) / dt, size)[lag])

    def shape_grid(self, dt: float, n: int) -> list[Shape]:
        low, high = np.log10(_LOWEST / dt), np.log10(_HIGHEST / dt)
        points = int(np.ceil((high - low) * _GRID_PER_DECADE))
        return [
            (float(bandwidth), order, damping)
            for bandwidth in np.logspace(low, high, points)
            for order in (1.0, 2.0, 4.0)
            for damping in (0.5, BUTTERWORTH, 1.0)
        ]


class AveragedNoise(_Filtered):
    """White noise averaged over a window: a moving average.

    Parameters
    ----------
    N : float, optional
        Root power spectral density at low frequencies, u/sqrt(Hz).
    window : float, optional
        Length of the window, s. Where it is not a whole number of samples, the last one counts in
        part; at or below the sampling interval the noise is white.
    """

    N: float = parameter("u/sqrt(Hz)", "scale", meaning="density of the averaged white noise")
    window: float = parameter("s", meaning="window of the sensor's moving average")
    label: ClassVar[str] = "averaged noise"
    prefix: ClassVar[str] = "averaged_"
    _examples = ((0.3, 4.0), (2.0, 21.6))

    def __init__(self, N: float | None = None, window: float | None = None) -> None:
        super().__init__(N, window)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        length = max(self.window / dt, 1.0)
        whole, rest = np.floor(length), length - np.floor(length)
        x = np.asarray(f) * dt
        kernel = np.where(
            x == 0.0, whole, np.sin(np.pi * whole * x) / np.sin(np.pi * np.where(x, x, 0.5))
        )
        # Its centre is (whole + 1)/2 samples from that of the last sample, which counts in part.
        square = kernel**2 + 2.0 * rest * kernel * np.cos(np.pi * (whole + 1.0) * x) + rest**2
        return np.asarray(self.N**2 * square / length**2)

    def autocovariance(self, lag: FloatArray, dt: float) -> FloatArray:
        covariance = _window_covariance(self.window / dt)
        lag = np.asarray(lag, dtype=int)
        inside = lag < covariance.size
        return self.N**2 / dt * np.where(inside, covariance[np.where(inside, lag, 0)], 0.0)

    def unit_haar_variance(self, shape: Shape, tau: FloatArray, dt: float) -> FloatArray:
        return _window_curve(shape[0] / dt, tuple((tau / dt).tolist())) / dt

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        weights = _window(self.window / dt)
        noise = self.N / np.sqrt(dt) * rng.standard_normal(n + weights.size - 1)
        return np.convolve(noise, weights, "valid")

    def shape_grid(self, dt: float, n: int) -> list[Shape]:
        longest = int(min(0.5 / _LOWEST, max(n / 8, 2)))
        return [(float(m) * dt,) for m in np.unique(np.geomspace(2, max(longest, 2), 40).round())]


@compiled()
def _gain(
    bandwidth: float, order: float, damping: float, log_tangent: FloatArray, dt: float
) -> FloatArray:
    """|H|^2 of the low-pass at frequencies (K,), given as log tan(pi f dt)."""
    result = np.ones(log_tangent.size)
    if bandwidth * dt >= 0.5:
        return result
    bend = 4.0 * damping**2 - 2.0
    half_power = 2.0 / (bend + math.sqrt(bend**2 + 4.0))
    start = math.log(half_power) - order * math.log(math.tan(math.pi * bandwidth * dt))
    for k in range(result.size):
        q = math.exp(min(start + order * log_tangent[k], 0.5 * _LARGEST_LOG))
        result[k] = 1.0 / (1.0 + q * (bend + q))
    return result


@lru_cache(maxsize=1024)
def _unit_curve(shape: Shape, averaging: tuple[float, ...], dt: float) -> FloatArray:
    """Wavelet variance at unit N; kept, as a fit asks for its grid and given shapes often."""
    _, order, damping = shape
    # Distance of the next pole of the spectrum from the real axis of log tan(pi f dt).
    pole = math.acos(max(1.0 - 2.0 * damping**2, -1.0)) / order
    wide_enough = (each for each in _PANELS if pole > 0.5 * each * POLE_OF_PANEL)
    x, weight = log_tangent_weights(averaging, next(wide_enough, 0.0))
    curve: FloatArray = frozen(weight @ _gain(*shape, x, dt) / dt)
    return curve


def _window(length: float) -> FloatArray:
    """Weights of a window of ``length`` samples."""
    length = max(length, 1.0)
    whole = int(length + 1e-9)
    weights = np.ones(whole + 1)
    weights[-1] = max(length - whole, 0.0)
    return weights / np.sum(weights)


def _window_covariance(length: float) -> FloatArray:
    """Autocovariance of white noise of unit variance behind a window."""
    weights = _window(length)
    return np.asarray(np.correlate(weights, weights, "full")[weights.size - 1 :])


@lru_cache(maxsize=1024)
def _window_curve(length: float, averaging: tuple[float, ...]) -> FloatArray:
    """Wavelet variance of white noise of unit variance behind a window."""
    covariance = _window_covariance(length)
    return np.array([haar_sum(covariance, m) for m in averaging])
