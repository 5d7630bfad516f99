"""The Haar wavelet variance of a series."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import chi2

from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.recording import Channel
from gmwm.variance.covariance import dyadic_levels, haar_counts, haar_covariance
from gmwm.variance.kernels import cumulative, haar_moments
from gmwm.variance.pilot import pilot_psd

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MAX_BLOCKS = 2048
_LEAST_DOF, _LEAST_QUANTILE = 0.01, 1e-9  # keep intervals that say nothing in numbers
_SMALLEST, _LARGEST = 1e-60, 1e60  # fourth powers of the data must not overflow
MIN_SAMPLES = 8
"""Fewest samples of which a wavelet variance is made."""


@dataclass(frozen=True, eq=False)
class WaveletVariance:
    """Haar MODWT wavelet variance of a series, level by level, with what a fit needs to know.

    Attributes
    ----------
    tau : (J,) ndarray
        Averaging times 2^(j-1) dt, s.
    variance : (J,) ndarray
        Unbiased estimates from the coefficients free of end effects, u^2.
    mean : (J,) ndarray
        Mean of these coefficients, u; R tau/2 under a drift of R.
    blocks : (B,) ndarray
        Means of blocks of samples about the mean of the series, u: what a drift is estimated from.
    block : int
        Samples per block.
    n : int
        Number of samples.
    dt : float
        Sampling interval, s.
    confidence : float
        Level of ``lower`` and ``upper``.
    name, quantity, unit : str
        Of the channel, where there is one.
    """

    tau: FloatArray
    variance: FloatArray
    mean: FloatArray
    blocks: FloatArray
    block: int
    n: int
    dt: float
    confidence: float = 0.95
    name: str = ""
    quantity: str | None = None
    unit: str = "u"

    @property
    def averaging(self) -> FloatArray:
        """Averaging times in samples, (J,)."""
        return dyadic_levels(self.n)

    @property
    def counts(self) -> FloatArray:
        """Number of coefficients of each level, (J,)."""
        return haar_counts(self.n, self.averaging)

    @property
    def allan_variance(self) -> FloatArray:
        """Overlapping Allan variance, twice the wavelet variance, u^2, (J,)."""
        return 2.0 * self.variance

    @property
    def allan_deviation(self) -> FloatArray:
        """Overlapping Allan deviation, u, (J,)."""
        return np.sqrt(self.allan_variance)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of ``variance``, u^4, (J, J).

        That of a Gaussian series with the smooth spectrum that the wavelet variances themselves
        imply; no model is assumed.
        """
        psd = pilot_psd(self._positive, self.averaging, self.dt)
        return haar_covariance(psd, self.n, self.dt)

    @property
    def _positive(self) -> FloatArray:
        return np.maximum(self.variance, 1e-12 * np.max(self.variance))

    @cached_property
    def dof(self) -> FloatArray:
        """Equivalent degrees of freedom 2 nu^4 / var(nu^2) of each level, (J,)."""
        square = 2.0 * self._positive**2
        # At most one a coefficient; a level without any variance would divide zero by zero.
        least = np.maximum(square / self.counts, np.finfo(float).tiny)
        return np.maximum(square / np.maximum(np.diag(self.covariance), least), _LEAST_DOF)

    @property
    def lower(self) -> FloatArray:
        """Lower end of the chi-square interval at ``confidence``, u^2, (J,)."""
        return self._end(0.5 + 0.5 * self.confidence)

    @property
    def upper(self) -> FloatArray:
        """Upper end of the chi-square interval at ``confidence``, u^2, (J,)."""
        return self._end(0.5 - 0.5 * self.confidence)

    def _end(self, probability: float) -> FloatArray:
        quantile = np.maximum(chi2.ppf(probability, self.dof), _LEAST_QUANTILE)
        return np.asarray(self.dof * self.variance / quantile)

    def detrended(self, slope: float) -> FloatArray:
        """Wavelet variances of the series less a drift of ``slope`` (u/s), exactly, u^2, (J,)."""
        step = 0.5 * slope * self.tau
        return self.variance - 2.0 * step * self.mean + step**2

    def __str__(self) -> str:
        head = f"{self.name or 'series'}: {self.n:,} samples at {1.0 / self.dt:g} Hz"
        unit = self.unit or "u"
        lines = [head, f"{'tau [s]':>12} {f'Allan dev. [{unit}]':>22} {'95 % interval':>27}  dof"]
        lines[1] = lines[1].replace("95 %", f"{100 * self.confidence:g} %")
        low, high = np.sqrt(2.0 * self.lower), np.sqrt(2.0 * self.upper)
        for row in zip(self.tau, self.allan_deviation, low, high, self.dof, strict=True):
            tau, dev, a, b, dof = row
            lines.append(f"{tau:12.6g} {dev:22.5g} {f'{a:.5g} .. {b:.5g}':>27} {dof:4.3g}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """All that is needed to make the object again, in JSON types; see `from_dict`."""
        return {
            "n": self.n,
            "dt": self.dt,
            "name": self.name,
            "quantity": self.quantity,
            "unit": self.unit,
            "confidence": self.confidence,
            "tau": self.tau.tolist(),
            "variance": self.variance.tolist(),
            "mean": self.mean.tolist(),
            "block": self.block,
            "blocks": self.blocks.tolist(),
        }

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> WaveletVariance:
        """Inverse of `to_dict`."""
        arrays = {
            k: np.array(content[k], dtype=float) for k in ("tau", "variance", "mean", "blocks")
        }
        numbers = {"n": int(content["n"]), "dt": float(content["dt"])}
        return cls(**{**content, **arrays, **numbers})

    def plot(self, ax: Axes | None = None) -> Axes:
        """Allan deviation with error bars against averaging time; returns the axes."""
        from gmwm import plot

        low, high = np.sqrt(2.0 * self.lower), np.sqrt(2.0 * self.upper)
        return plot.deviation(
            self.tau, self.allan_deviation, low, high, unit=self.unit, title=self.name, ax=ax
        )


def wavelet_variance(
    data: Channel | FloatArray, dt: float | None = None, *, confidence: float = 0.95
) -> WaveletVariance:
    """Haar MODWT wavelet variance of a channel or an array.

    All levels with at least one coefficient free of end effects are given; the mean of the series
    does not matter.

    Parameters
    ----------
    data : Channel or (n,) array_like
        At least 8 samples.
    dt : float, optional
        Sampling interval, s; needed for an array.
    confidence : float, optional
        Level of the chi-square intervals.

    Returns
    -------
    WaveletVariance

    Raises
    ------
    InputError
        For data that is not one series of finite numbers, too short or constant.

    Notes
    -----
    Percival & Walden (2000), *Wavelet Methods for Time Series Analysis*, sec. 8.3; eq. (3) of
    Stebler et al. (2012). The variance of averaging time tau is half the overlapping Allan
    variance.
    """
    channel = data if isinstance(data, Channel) else as_channel(data, dt)
    values = np.ascontiguousarray(channel.values, dtype=float)
    where = f"channel {channel.name!r}" if channel.name else "the series"
    if values.ndim != 1 or values.size < MIN_SAMPLES:
        raise InputError(
            f"{where} has shape {values.shape}: give one series of {MIN_SAMPLES} samples or more"
        )
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise InputError(
            f"{where} has {bad.size} NaN or infinite samples, the first at index {bad[0]}: "
            "remove or repair them"
        )
    if not 0.0 < confidence < 1.0:
        raise InputError(f"confidence = {confidence!r}: give a number between 0 and 1, e.g. 0.95")
    if channel.is_constant:
        raise InputError(f"{where} is constant ({values[0]:g}): a dead channel has no noise model")
    size = float(np.max(np.abs(values - values[0])))
    if not _SMALLEST < size < _LARGEST:
        raise InputError(f"{where} varies by {size:.1g}: that is no sensor noise, check the unit")
    mean = float(np.mean(values))
    integral = cumulative(values, mean)
    averaging = dyadic_levels(values.size)
    moments = np.array([haar_moments(integral, int(m)) for m in averaging])
    block = -(-values.size // _MAX_BLOCKS)
    edges = integral[: (values.size // block) * block + 1 : block]
    return WaveletVariance(
        tau=averaging * channel.dt,
        variance=moments[:, 1],
        mean=moments[:, 0],
        blocks=np.diff(edges) / block,
        block=block,
        n=values.size,
        dt=channel.dt,
        confidence=confidence,
        name=channel.name,
        quantity=channel.quantity,
        unit=channel.unit or "u",
    )


def as_wavelet_variance(
    data: WaveletVariance | Channel | FloatArray, dt: float | None
) -> WaveletVariance:
    """A wavelet variance as it is, or that of a series.

    Raises
    ------
    InputError
        If a sampling interval is given for a wavelet variance, which has its own.
    """
    if not isinstance(data, WaveletVariance):
        return wavelet_variance(data, dt)
    if dt is not None:
        raise InputError("a wavelet variance has its own sampling interval: leave dt out")
    return data


def as_channel(data: FloatArray, dt: float | None) -> Channel:
    """A channel without a name from an array and its sampling interval (s).

    Raises
    ------
    InputError
        If either is not usable.
    """
    if dt is None:
        raise InputError("give the sampling interval of the array: wavelet_variance(x, dt=0.01)")
    if not (isinstance(dt, Real) and np.isfinite(dt) and dt > 0.0):
        raise InputError(f"dt = {dt!r}: give a positive sampling interval in seconds")
    try:
        values = np.asarray(data, dtype=float)
    except (TypeError, ValueError):
        raise InputError("the series holds something that is not a number") from None
    return Channel("", values, float(dt))
