"""What a page shows of the recording itself: its time series, thinned, and its spectrum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.diagnosis import spectrum
from gmwm.readers import Channel

_BINS = 400
"""Of the time series: as many as a figure has columns of pixels to show."""

_PER_OCTAVE = 12
_FIRST_BIN = 4  # of the spectrum: the window reaches over the bins below

Spans = Sequence[tuple[int, int]]


@dataclass(frozen=True, eq=False)
class Series:
    """A time series in bins.

    time: (b,), middle of each bin, s.
    mean, low, high: (b,), of the samples that are used, less the mean of all, u; NaN where there
        are none.
    left_out: First and last time of what was left out, s.
    offset: The mean, u.
    """

    time: FloatArray
    mean: FloatArray
    low: FloatArray
    high: FloatArray
    left_out: tuple[tuple[float, float], ...]
    offset: float


def used(channel: Channel, spans: Spans) -> FloatArray:
    """The samples of a channel, NaN where they were left out."""
    values = np.array(channel.values, dtype=float)
    for start, stop in spans:
        values[start:stop] = np.nan
    return values


def series(channel: Channel, spans: Spans) -> Series:
    """A channel in bins, with what was left out."""
    values = used(channel, spans)
    offset = float(np.nanmean(values))
    edges = np.unique(np.linspace(0, values.size, min(_BINS, values.size) + 1).astype(int))
    place, parts = [], []
    for start, stop in pairwise(edges.tolist()):
        part = values[start:stop]
        part = part[~np.isnan(part)] - offset
        place.append(0.5 * (start + stop) * channel.dt)
        parts.append((part.mean(), part.min(), part.max()) if part.size else (np.nan,) * 3)
    mean, low, high = np.array(parts).T
    width = 0.5 * channel.dt * values.size / _BINS  # what is narrower could not be seen
    gone: list[tuple[float, float]] = []
    for start, stop in spans:
        first, last = start * channel.dt - width, stop * channel.dt + width
        if gone and first <= gone[-1][1]:
            gone[-1] = (gone[-1][0], last)
        else:
            gone.append((first, last))
    return Series(np.array(place), mean, low, high, tuple(gone), offset)


def density(channel: Channel, spans: Spans) -> tuple[FloatArray, FloatArray]:
    """Frequency (Hz) and root of the two-sided density (u/sqrt(Hz)) of a channel.

    Means of the periodogram over a twelfth of an octave. White noise of N lies at N.
    """
    found = spectrum(used(channel, spans), channel.dt)
    bins = found.density.size
    octaves = np.log2(bins / _FIRST_BIN)
    edges = np.unique(
        np.rint(_FIRST_BIN * 2.0 ** np.linspace(0.0, octaves, int(_PER_OCTAVE * octaves) + 1))
    ).astype(int)
    mean = np.add.reduceat(found.density[: edges[-1]], edges[:-1]) / np.diff(edges)
    middle = 0.5 * (edges[:-1] + edges[1:] - 1) * found.resolution
    return middle, np.sqrt(0.5 * mean)
