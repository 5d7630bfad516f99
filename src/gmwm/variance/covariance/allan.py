"""Mean and variance of the Allan family's estimates under a spectrum.

Each is a mean of squares of filtered samples, a quadratic form. With M terms, transfer function H
and spectrum S its variance is 2/M int |H|^4 S^2 df. At long averaging times, where few terms and
the ends of the series matter, this is multiplied by a ratio of sums over means of blocks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from math import comb

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.variance import tuning
from gmwm.variance.covariance.lags import LagGrid, block_spectrum
from gmwm.variance.periodogram import Periodogram


@dataclass(frozen=True)
class AllanFilter:
    """The filter of a deviation of the family.

    differences: Of means over the averaging time, one after the other.
    modified: Whether the differences are averaged over as long again.
    reflected: Whether the series is continued by its reflection at both ends.
    """

    differences: int = 1
    modified: bool = False
    reflected: bool = False

    @property
    def reach(self) -> int:
        """Averaging times that the filter spans."""
        return 1 + self.differences + self.modified

    def gain(self, m: float, f: FloatArray, power: int = 1) -> FloatArray:
        """Squared gain to a power; beyond `tuning.LOBES` lobes their mean.

        f: (K,), cycles per sample.
        """
        means = 2 * (1 + self.modified)  # powers of the sine of means
        sines = power * (self.differences + 1 + self.modified)
        resolved = np.sin(np.pi * m * f) ** (2 * sines)
        lobes = np.where(m * f < tuning.LOBES, resolved, comb(2 * sines, sines) / 4.0**sines)
        scale = 4.0**self.differences / comb(2 * self.differences, self.differences)
        return np.asarray(scale**power * lobes / (m * np.sin(np.pi * f)) ** (means * power))

    def applied(self, series: FloatArray, m: int) -> FloatArray:
        """Its values along the first axis of a series or several, (M, ...)."""

        def means(values: FloatArray) -> FloatArray:
            total = np.cumsum(np.concatenate([np.zeros_like(values[:1]), values]), axis=0)
            return (total[m:] - total[:-m]) / m

        if self.reflected:
            series = np.concatenate([series[: m - 1][::-1], series, series[::-1][: m - 1]])
        found = means(series)
        for _ in range(self.differences):
            found = found[m:] - found[:-m]
        found = means(found) if self.modified else found
        return np.asarray(found / np.sqrt(comb(2 * self.differences, self.differences)))


def allan_dof(kind: AllanFilter, spectrum: Periodogram, n: int, m: int) -> tuple[float, float]:
    """Equivalent degrees of freedom 2 E^2 / Var of an estimate, and its relative bias.

    n, m: Samples of the series, and in an averaging time.
    Returns: the second is the mean over that of the filter without reflection.
    """
    f, weight = _nodes(m)
    mean = weight @ (kind.gain(m, f) * spectrum.psd(f, 1.0))
    square = weight @ (kind.gain(m, f, 2) * spectrum.root_square(f, 1.0) ** 2)
    part = min(n, tuning.FEW_AVERAGES * m)
    bias, share, added = _of_blocks(kind, spectrum, part, m)
    bias, share = (1.0 + (each - 1.0) * part / n for each in (bias, share))  # ends are 1/n of it
    half = square * share / (n - kind.reach * m + 1) + added * (part / n) ** 2
    return float((bias * mean) ** 2 / half), bias


@lru_cache(maxsize=64)
def _nodes(m: int) -> tuple[FloatArray, FloatArray]:
    """Frequencies and weights of a spectral integral, both signs; steps within a lobe are equal."""
    end, count = min(tuning.LOBES / m, 0.5), tuning.NODES_OF_FAMILY
    edges = np.append(np.linspace(0.0, end, count), np.geomspace(end, 0.5, count))
    return 0.5 * (edges[1:] + edges[:-1]), 2.0 * np.diff(edges)


def _of_blocks(
    kind: AllanFilter, spectrum: Periodogram, n: int, m: int
) -> tuple[float, float, float]:
    """What the ends of a series do to an estimate, from means of blocks.

    Returns: what reflection does to the mean, a factor; half the variance without reflection,
        relative to its spectral integral; what reflection adds to it, u^4.
    """
    block = max(m // tuning.BLOCKS_OF_FAMILY, 1)
    size, average = round(n / block), round(m / block)
    grid = LagGrid.holding(3 * size, block)
    density = block_spectrum(spectrum.psd, 1.0, grid)
    weight = np.full(density.size, 2.0 / grid.size)
    weight[[0, -1]] *= 0.5
    square = weight @ (kind.gain(average, grid.frequency) * density) ** 2
    lag = np.arange(size)
    # A level common to all samples does not matter; at zero frequency only its bend is left.
    bend = 0.5 * (2.0 * np.pi * grid.frequency[0] * lag) ** 2 * density[0] / grid.size
    density[0] = 0.0
    covariance = (grid.transform(density)[:size] - bend)[np.abs(np.subtract.outer(lag, lag))]

    def moments(kind: AllanFilter) -> tuple[float, float]:
        rows = kind.applied(np.eye(size), average)
        found = rows @ covariance @ rows.T
        return float(np.mean(np.diag(found))), float(np.mean(found**2))

    mean, half = moments(replace(kind, reflected=False))
    own = moments(kind) if kind.reflected else (mean, half)
    share = half * (size - kind.reach * average + 1) / square
    return own[0] / mean, float(share), own[1] - half
