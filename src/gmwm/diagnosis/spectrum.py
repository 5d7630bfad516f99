"""Periodogram and its smooth background."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from gmwm._core.typing import BoolArray, FloatArray, IntArray, inner
from gmwm.diagnosis import tuning

POWER_INFLATION = 1.0 + 2.0 * (4.0 / 9.0 + 1.0 / 36.0)
"""Variance of means of neighbouring Hann periodogram bins, over that of independent ones."""

_HALF_OCTAVE = tuning.BANDS_PER_OCTAVE // 2
_LOG_VARIANCE = np.pi**2 / 6.0  # of the logarithm of an exponential variate


@dataclass(frozen=True, eq=False)
class Bands:
    """Mean logarithm of the spectrum in J bands of equal width in log frequency."""

    edges: IntArray  # (J + 1,), bins of the spectrum
    frequency: FloatArray  # Hz
    level: FloatArray  # logarithm of the density
    variance: FloatArray  # of the level
    smooth: FloatArray  # running median of the level over an octave


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One-sided periodogram with a Hann window."""

    density: FloatArray  # (n // 2 + 1,), u^2/Hz
    resolution: float  # distance of the bins, Hz
    dt: float  # s

    @property
    def frequency(self) -> FloatArray:
        """Frequency of each bin, Hz."""
        return np.asarray(self.resolution * np.arange(self.density.size), dtype=float)


def spectrum(values: FloatArray, dt: float) -> Spectrum:
    """Periodogram of a series (n,) without its linear trend; straight lines bridge gaps (NaN).

    It has unit gain for density; a line of amplitude A has the area A^2/2.
    """
    n = values.size
    place = np.arange(n, dtype=float)
    known = ~np.isnan(values)
    filled = values if np.all(known) else np.interp(place, place[known], values[known])
    centred = place - np.mean(place)
    trend = inner(centred, filled) / inner(centred, centred)
    centred *= -trend
    tapered = filled - np.mean(filled)
    tapered += centred
    del filled, centred
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * (place + 0.5) / n)
    tapered *= window
    # What is missing has no power of its own.
    weight = float(np.sum(window[known] ** 2))
    del place, window
    power = np.abs(fft.rfft(tapered, overwrite_x=True)) ** 2
    return Spectrum(2.0 * dt / weight * power, 1.0 / (n * dt), dt)


def bands(spectrum: Spectrum, left_out: BoolArray | None = None) -> Bands:
    """Band levels and their running median, which lines and narrow bumps hardly move."""
    logs = np.log(np.maximum(spectrum.density, np.finfo(float).tiny)) + np.euler_gamma
    used = np.ones(logs.size)
    if left_out is not None:
        used[left_out] = 0.0
    edges = _edges(logs.size - 1)  # the last bin, at half the rate, is another distribution
    within = slice(edges[-1])
    sums, counts = (np.add.reduceat(x[within], edges[:-1]) for x in (logs * used, used))
    kept = counts >= 0.5 * np.diff(edges)
    # A band that is nearly all line takes the level of its neighbours.
    places = np.arange(kept.size)
    level = np.interp(places, places[kept], sums[kept] / counts[kept])
    counts = np.where(kept, counts, 0.5 * np.diff(edges))
    middle = np.sqrt(edges[:-1] * (edges[1:] - 1.0)) * spectrum.resolution
    variance = _LOG_VARIANCE * POWER_INFLATION / counts
    # Running median over an octave; beyond the ends the curve goes on turned by 180 degrees.
    reach = min(_HALF_OCTAVE, level.size - 1)
    before = 2.0 * np.median(level[:3]) - level[reach:0:-1]
    after = 2.0 * np.median(level[-3:]) - level[-2 : -reach - 2 : -1]
    longer = np.concatenate([before, level, after])
    windows = np.lib.stride_tricks.sliding_window_view(longer, 2 * reach + 1)
    return Bands(edges, middle, level, variance, np.asarray(np.median(windows, axis=1)))


def background(spectrum: Spectrum, found: Bands) -> FloatArray:
    """Density of the smooth background at every bin, u^2/Hz."""
    place = np.log(np.maximum(spectrum.frequency, 0.5 * spectrum.resolution))
    return np.exp(np.interp(place, np.log(found.frequency), found.smooth))


def _edges(last: int) -> IntArray:
    """Bins at which bands begin: a 24th of an octave, but eight bins at least."""
    edges = [4]
    while edges[-1] < last:
        width = round(edges[-1] * (2.0 ** (1.0 / tuning.BANDS_PER_OCTAVE) - 1.0))
        edges.append(edges[-1] + max(tuning.FEWEST_IN_BAND, width))
    if edges[-1] > last:
        edges.pop()
    return np.array(edges)
