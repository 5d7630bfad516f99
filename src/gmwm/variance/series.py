"""From a series to its wavelet variance."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy import fft

from gmwm._core import checks
from gmwm._core.spool import release, scaled
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process import wavelet as known_wavelet
from gmwm.readers import Channel
from gmwm.variance import tuning
from gmwm.variance.gaps import Runs
from gmwm.variance.kernels import difference_powers, survey
from gmwm.variance.levels import Levels
from gmwm.variance.wavelet import WaveletVariance

MIN_SAMPLES = 8  # fewest for a wavelet variance


def wavelet_variance(
    data: Channel | FloatArray | Sequence[float],
    dt: float | None = None,
    *,
    wavelet: str = "haar",
    robust: bool = False,
    efficiency: float = 0.6,
    data_covariance: str | None = None,
    confidence: float = 0.95,
    rate: float | None = None,
) -> WaveletVariance:
    """MODWT wavelet variance of a channel or an array.

    All levels with at least one coefficient free of end effects are given; the mean of the series
    does not matter. Missing samples are NaN: a Haar coefficient is the difference of means of the
    samples that exist, and what missing ones add to its variance is subtracted
    (`gmwm.variance.gaps`). Coefficients with a gap of a quarter of the averaging time or more, or
    with any gap for other wavelets, are left out.

    Parameters
    ----------
    data : Channel or (n,) array_like
        At least 8 samples without a gap between them.
    dt, rate : float, optional
        Sampling interval, s, or rate, Hz; one is needed for an array.
    wavelet : str, optional
        A Daubechies filter, as PyWavelets names it: "haar", "db2" ... "db10", "sym4", "coif2".
    robust : bool, optional
        Whether to bound the influence of outliers, see `gmwm.variance.robust`.
    efficiency : float, optional
        Efficiency of the robust estimate where there are no outliers, between 0 and 1.
    data_covariance : {"none", "octave"}, optional
        Estimate the covariance of the variances from the coefficients too, over all lags or with
        a lag window (see `gmwm.variance.series`), for ``fit(weights="data")``.
    confidence : float, optional
        Level of the chi-square intervals.

    Raises
    ------
    InputError
        For data that is not one series of numbers, too short or constant, also between gaps, or an
        unknown wavelet.

    Notes
    -----
    Percival & Walden (2000), *Wavelet Methods for Time Series Analysis*, sec. 8.3; eq. (3) of
    Stebler et al. (2012). The Haar variance of averaging time tau is half the overlapping Allan
    variance.
    """
    channel = as_channel(data, dt, rate)
    values, runs, mean = checked_samples(channel)
    confidence = checks.share("confidence", confidence, 0.95)
    efficiency = checks.share("efficiency", efficiency, 0.6)
    efficiency = efficiency if checks.truth("robust", robust) else 1.0
    if data_covariance is not None:
        checks.choice("data_covariance", data_covariance, WINDOWS)
    wavelet = "haar" if wavelet == "db1" else wavelet
    _check_width(channel, runs, wavelet)
    values = scaled(values, 1.0, -mean)
    levels = Levels.of(values, runs, wavelet)
    moments, scarcity = levels.moments()
    level = None
    if robust:
        moments = _robust_moments(levels.coefficients(), efficiency)
        level = _robust_moments(levels.coefficients(level=True), efficiency)[:, 1]
    added, change = levels.added(moments, scarcity, level)
    variance = np.maximum(moments[:, 1] - added, moments[:, 1] / (1.0 + tuning.LARGEST_CHANGE))
    blocks, block = levels.block_means()
    release(channel.values)
    found = None
    if data_covariance is not None:
        longest = int(np.max(levels.counts))
        found = covariance_of_data(levels.coefficients(), longest, data_covariance)
    if not np.any(variance > 0.0):
        raise InputError(
            f"{where_of(channel)} changes only where samples are missing, so the channel is dead: "
            "leave it out"
        )
    return WaveletVariance(
        tau=levels.averaging * channel.dt,
        variance=variance,
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
        efficiency=efficiency,
        driftless=None if level is None else level - added,
        gaps=levels.effects(change),
        fourth_cumulant=0.0 if robust else fourth_cumulant(values),
        data_covariance=found,
        spectrum=None if robust else levels.spectrum(),
    )


def _check_width(channel: Channel, runs: Runs, wavelet: str) -> None:
    width = known_wavelet(wavelet).width(1)
    if width > runs.longest:
        raise InputError(
            f"{where_of(channel)} has no {width} samples in a row, which {wavelet} needs: "
            "take a shorter wavelet, e.g. haar"
        )


def _robust_moments(parts: Iterable[FloatArray], efficiency: float) -> FloatArray:
    """Mean and robust mean square of each level's coefficients, (J, 2)."""
    from gmwm.variance.robust import robust_variance

    return np.array([(np.mean(w), robust_variance(w, efficiency)) for w in parts])


def fourth_cumulant(values: FloatArray) -> float:
    """Fourth cumulant of the independent part of a series, NaN where samples are missing, u^4."""
    count, square, fourth = difference_powers(values)
    return cumulant_of_powers(square / count, fourth / count, count)


def cumulant_of_powers(square: float, fourth: float, count: float) -> float:
    """Fourth cumulant of the independent part of a series, u^4; 0 if it may be chance.

    Cumulants of independent samples add up: first differences have twice that of the samples.

    square, fourth: Mean second and fourth power of the first differences, u^2 and u^4.
    """
    excess = fourth / square / square - 3.0 if square > 0.0 else 0.0  # the square may underflow
    chance = tuning.LARGEST_KURTOSIS * np.sqrt(tuning.KURTOSIS_VARIANCE / count)
    return 0.5 * square**2 * excess if excess > chance else 0.0


def where_of(channel: Channel) -> str:
    """Name of a channel in messages."""
    return f"channel {channel.name!r}" if channel.name else "the series"


def checked_samples(channel: Channel) -> tuple[FloatArray, Runs, float]:
    """The samples of a channel, which of them exist, and their mean."""
    where = where_of(channel)
    checks.sampling_interval(channel.dt)
    values = np.ascontiguousarray(checks.real_numbers(channel.values, where))
    if values.ndim != 1 or values.size < MIN_SAMPLES:
        raise InputError(
            f"{where} has shape {values.shape}: give one series of {MIN_SAMPLES} samples or more"
        )
    missing, total, low, high = survey(values)
    bad = np.flatnonzero(np.isinf(values)) if not np.isfinite(total) else np.zeros(0)
    if bad.size:
        raise InputError(
            f"{where} has {bad.size} infinite samples, the first at index {bad[0]}: remove or "
            "repair them, or set them to NaN for missing"
        )
    runs = Runs.of(values) if missing else Runs((0,), (values.size,), values.size)
    if runs.longest < MIN_SAMPLES:
        raise InputError(
            f"{where} has no {MIN_SAMPLES} consecutive samples, so its noise cannot be estimated: "
            "record without gaps"
        )
    check_varies(replace(channel, values=np.array([low, high])))
    return values, runs, total / runs.present


def check_varies(channel: Channel) -> None:
    """Raise InputError if a channel is constant or varies by an amount that no sensor does."""
    where = where_of(channel)
    if channel.is_constant:
        raise InputError(
            f"{where} is constant ({np.nanmin(channel.values):g}), so the channel is dead: leave "
            "it out"
        )
    if not channel.is_of_a_sensor:
        raise InputError(
            f"{where} varies by {channel.spread:.1g}: that is not sensor noise, check the unit"
        )


def as_wavelet_variance(
    data: WaveletVariance | Channel | FloatArray | Sequence[float],
    dt: float | None,
    *,
    data_covariance: str | None = None,
) -> WaveletVariance:
    """A wavelet variance as it is, or that of a series."""
    if not isinstance(data, WaveletVariance):
        return wavelet_variance(data, dt, data_covariance=data_covariance)
    if dt is not None:
        raise InputError("a wavelet variance has its own rate: leave dt and rate out")
    return data


def as_channel(
    data: Channel | FloatArray | Sequence[float], dt: float | None, rate: float | None = None
) -> Channel:
    """A channel as it is, or one without a name from an array and its interval (s) or rate (Hz)."""
    if isinstance(data, Channel):
        return data
    if isinstance(data, WaveletVariance):
        raise InputError(f"{data!r} has no samples, which this needs: give the series")
    if isinstance(data, str | Mapping):
        source = f"gmwm.read({data!r})" if isinstance(data, str) else "recording"
        raise InputError(
            f"{checks.shown(data)} is not one series: give {source}['gyro_x'], or calibrate all "
            f"channels by gmwm.calibrate({source})"
        )
    return Channel("", checks.real_numbers(data, "the series"), checks.sampling_interval(dt, rate))


WINDOWS = ("none", "octave")


def covariance_of_data(
    coefficients: Iterable[FloatArray], longest: int, window: str = "none"
) -> FloatArray:
    """Covariance of the mean squares of several levels' coefficients.

    Eq. (4-5) of Stebler et al. (2012), after Serroukh, Walden & Percival (2000), *JASA* 95,
    184-196: sums over all lags of squared sample cross-covariances of two levels' coefficients. By
    Parseval's theorem these are sums over frequencies of products of periodograms, so that all
    pairs of levels are one Gram matrix, positive semi-definite whatever the data.

    coefficients: iterable of (M_j,), one array a level.
    longest: The largest M_j; not that of the finest level where only coarser ones bridge gaps.
    window: {"none", "octave"}, "none" takes all lags, as eq. (5) does: unbiased, but as noisy as a
        periodogram. "octave" averages the cross-spectra over an eighth of an octave first, a lag
        window whose length is proportional to the period: for long records.
    Returns: (J, J), u^4, positive semi-definite.
    """
    size = fft.next_fast_len(longest, real=True)
    # The mean is not removed, frequency zero not left out: at coarse levels that would take most of
    # the power, and a level of no variance would have all the weight.
    levels = list(coefficients)
    counts = np.array([level.size for level in levels], dtype=float)
    transforms = [fft.rfft(each, size)[: size // 2] / np.sqrt(each.size) for each in levels]
    bins = np.arange(size // 2)
    if window == "octave":
        number = int(np.ceil(np.log2(size // 2) * tuning.BINS_PER_OCTAVE)) + 1
        bins = np.unique(np.floor(np.geomspace(1.0, size // 2, number)).astype(int)) - 1
        bins = bins[bins < size // 2]
    width = np.diff(np.append(bins, size // 2)).astype(float)
    # A mean of b cross-periodograms has the expected square S^2 (1 + 1/b).
    weight = 2.0 * width / (1.0 + 1.0 / width) / (0.5 * size)
    weight[0] *= 0.5  # frequency zero has no negative counterpart
    if window == "none":
        power = np.abs(np.stack(transforms)) ** 2
        gram = (power * weight) @ power.T
    else:
        gram = np.zeros((counts.size, counts.size))
        for j, first in enumerate(transforms):
            for k in range(j, counts.size):
                cross = np.add.reduceat(first * np.conj(transforms[k]), bins) / width
                gram[j, k] = gram[k, j] = weight @ np.abs(cross) ** 2
    return np.asarray(gram / np.maximum.outer(counts, counts))
