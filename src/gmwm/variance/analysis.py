"""From a series to its wavelet variance."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process import wavelet as known_wavelet
from gmwm.readers import Channel
from gmwm.variance.covariance.empirical import WINDOWS, data_covariance as covariance_of_data
from gmwm.variance.covariance.haar import dyadic_levels
from gmwm.variance.kernels import cumulative, haar_coefficients, haar_moments
from gmwm.variance.runs import Runs
from gmwm.variance.wavelet import WaveletVariance

_MAX_BLOCKS, _MAX_BLOCKS_WITH_GAPS = 2048, 512
_LEAST_PRESENT = 0.9  # of a block whose mean counts
_SMALLEST, _LARGEST = 1e-60, 1e60  # fourth powers of the data must not overflow
MIN_SAMPLES = 8
"""Fewest samples of which a wavelet variance is made."""


def wavelet_variance(
    data: Channel | FloatArray | Sequence[float],
    dt: float | None = None,
    *,
    wavelet: str = "haar",
    robust: bool = False,
    efficiency: float = 0.6,
    data_covariance: str | None = None,
    confidence: float = 0.95,
) -> WaveletVariance:
    """MODWT wavelet variance of a channel or an array.

    All levels with at least one coefficient free of end effects are given; the mean of the series
    does not matter. Coefficients that a missing sample (NaN) takes part in are left out.

    Parameters
    ----------
    data : Channel or (n,) array_like
        At least 8 samples without a gap between them.
    dt : float, optional
        Sampling interval, s; needed for an array.
    wavelet : str, optional
        A Daubechies filter, as PyWavelets names it: "haar", "db2" ... "db10", "sym4", "coif2".
    robust : bool, optional
        Whether to bound the influence of outliers, see `gmwm.variance.robust`.
    efficiency : float, optional
        Of the robust estimate where there are no outliers, between 0 and 1.
    data_covariance : {"none", "octave"}, optional
        Estimate the covariance of the variances from the coefficients too, over all lags or with
        a lag window (see `gmwm.variance.covariance.empirical`), for ``fit(weights="data")``.
    confidence : float, optional
        Level of the chi-square intervals.

    Returns
    -------
    WaveletVariance

    Raises
    ------
    InputError
        For data that is not one series of numbers, too short or constant, or an unknown wavelet.

    Notes
    -----
    Percival & Walden (2000), *Wavelet Methods for Time Series Analysis*, sec. 8.3; eq. (3) of
    Stebler et al. (2012). The Haar variance of averaging time tau is half the overlapping Allan
    variance.
    """
    channel = data if isinstance(data, Channel) else as_channel(data, dt)
    values, runs = checked_samples(channel)
    confidence = checks.share("confidence", confidence, 0.95)
    efficiency = checks.share("efficiency", efficiency, 0.6)
    robust = checks.truth("robust", robust)
    if data_covariance is not None:
        checks.choice("data_covariance", data_covariance, WINDOWS)
    wavelet = "haar" if wavelet == "db1" else wavelet
    averaging = _averaging(channel, runs, wavelet)
    mean = float(np.nanmean(values))
    integral = cumulative(values, mean)
    if wavelet == "haar" and not robust:
        moments = np.array([haar_moments(integral, runs.edges, int(m)) for m in averaging])
    else:
        parts = _coefficients(values - mean, integral, runs, wavelet, averaging)
        moments = _moments(parts, efficiency if robust else 1.0)
    driftless = None
    if robust:
        level = _without_line(values)
        parts = _coefficients(level, cumulative(level, 0.0), runs, wavelet, averaging)
        driftless = _moments(parts, efficiency)[:, 1]
    blocks, block = _block_means(values, integral, runs)
    found = None
    if data_covariance is not None:
        parts = _coefficients(values - mean, integral, runs, wavelet, averaging)
        found = covariance_of_data(parts, data_covariance)
    return WaveletVariance(
        tau=averaging * channel.dt,
        variance=moments[:, 1],
        mean=moments[:, 0],
        blocks=blocks,
        block=block,
        n=runs.n,
        dt=channel.dt,
        confidence=confidence,
        name=channel.name,
        quantity=channel.quantity,
        unit=channel.unit or "u",
        wavelet=wavelet,
        efficiency=efficiency if robust else 1.0,
        driftless=driftless,
        present=None if runs.is_complete else runs,
        data_covariance=found,
    )


def _where(channel: Channel) -> str:
    return f"channel {channel.name!r}" if channel.name else "the series"


def checked_samples(channel: Channel) -> tuple[FloatArray, Runs]:
    """The samples of a channel, and which of them exist.

    Raises
    ------
    InputError
        If they are no series of numbers, too few, infinite, constant or of no sensor's size, or
        the sampling interval is none.
    """
    where = _where(channel)
    checks.sampling_interval(channel.dt)
    values = np.ascontiguousarray(checks.real_numbers(channel.values, where))
    if values.ndim != 1 or values.size < MIN_SAMPLES:
        raise InputError(
            f"{where} has shape {values.shape}: give one series of {MIN_SAMPLES} samples or more"
        )
    bad = np.flatnonzero(np.isinf(values))
    if bad.size:
        raise InputError(
            f"{where} has {bad.size} infinite samples, the first at index {bad[0]}: remove or "
            "repair them, or set them to NaN for missing"
        )
    runs = Runs.of(values)
    if runs.longest < MIN_SAMPLES:
        raise InputError(
            f"{where} has no {MIN_SAMPLES} samples without a missing one between them: nothing "
            "can be told of its noise"
        )
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if low == high:
        raise InputError(f"{where} is constant ({low:g}): a dead channel has no noise model")
    if not _SMALLEST < high - low < _LARGEST:
        raise InputError(
            f"{where} varies by {high - low:.1g}: that is no sensor noise, check the unit"
        )
    return values, runs


def _averaging(channel: Channel, runs: Runs, wavelet: str) -> FloatArray:
    """Averaging times, in samples, of the levels with a coefficient."""
    if wavelet == "haar":
        return dyadic_levels(runs.longest)
    kind = known_wavelet(wavelet)
    if kind.width(1) > runs.longest:
        raise InputError(
            f"{_where(channel)} has no {kind.width(1)} samples in a row, which {wavelet} needs: "
            "take a shorter wavelet, e.g. haar"
        )
    m = dyadic_levels(runs.longest)
    return m[[kind.width(j + 1) <= runs.longest for j in range(m.size)]]


def _moments(parts: Iterable[FloatArray], efficiency: float) -> FloatArray:
    """Mean, and mean square or its robust stand-in, of each level's coefficients, (J, 2)."""
    if efficiency == 1.0:
        return np.array([(np.mean(w), np.mean(w * w)) for w in parts])
    from gmwm.variance.robust import robust_variance

    return np.array([(np.mean(w), robust_variance(w, efficiency)) for w in parts])


def _coefficients(
    values: FloatArray, integral: FloatArray, runs: Runs, wavelet: str, averaging: FloatArray
) -> Iterator[FloatArray]:
    """For each level, the coefficients that exist, over all runs."""
    if wavelet == "haar":
        for m in averaging:
            parts = [haar_coefficients(integral, a, b, int(m)) for a, b in runs.edges]
            yield np.concatenate(parts)
        return
    from gmwm.variance.modwt import coefficients

    series = [coefficients(values[a:b], wavelet, averaging.size) for a, b in runs.edges]
    for _ in averaging:
        yield np.concatenate([next(part, np.zeros(0)) for part in series])


def _without_line(values: FloatArray) -> FloatArray:
    """The series less its least-squares line."""
    k = np.arange(values.size) - 0.5 * (values.size - 1)
    there = ~np.isnan(values)
    line = np.polynomial.polynomial.polyfit(k[there], values[there], 1)
    return np.asarray(values - np.polynomial.polynomial.polyval(k, line))


def _block_means(values: FloatArray, integral: FloatArray, runs: Runs) -> tuple[FloatArray, int]:
    """Means of blocks, NaN where too much is missing, and the samples per block."""
    most = _MAX_BLOCKS if runs.is_complete else _MAX_BLOCKS_WITH_GAPS
    block = -(-runs.n // most)
    whole = (runs.n // block) * block
    sums = np.diff(integral[: whole + 1 : block])
    if runs.is_complete:
        return sums / block, block
    present = np.sum(~np.isnan(values[:whole]).reshape(-1, block), axis=1)
    enough = present >= _LEAST_PRESENT * block
    return np.where(enough, sums / np.maximum(present, 1), np.nan), block


def as_wavelet_variance(
    data: WaveletVariance | Channel | FloatArray | Sequence[float],
    dt: float | None,
    *,
    data_covariance: str | None = None,
) -> WaveletVariance:
    """A wavelet variance as it is, or that of a series.

    Raises
    ------
    InputError
        If a sampling interval is given for a wavelet variance, which has its own.
    """
    if not isinstance(data, WaveletVariance):
        return wavelet_variance(data, dt, data_covariance=data_covariance)
    if dt is not None:
        raise InputError("a wavelet variance has its own sampling interval: leave dt out")
    return data


def as_channel(data: FloatArray | Sequence[float], dt: float | None) -> Channel:
    """A channel without a name from an array and its sampling interval (s).

    Raises
    ------
    InputError
        If either is not usable.
    """
    if dt is None:
        raise InputError("give the sampling interval of the array: wavelet_variance(x, dt=0.01)")
    interval = checks.sampling_interval(dt)
    return Channel("", checks.real_numbers(data, "the series"), interval)
