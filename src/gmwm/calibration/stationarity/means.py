"""Means of blocks of samples, whose differences are stationary whatever the noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import toeplitz

from gmwm._core.typing import FloatArray, IntArray
from gmwm.calibration import tuning
from gmwm.estimate.problem import difference_covariance
from gmwm.process import PSD
from gmwm.variance import WaveletVariance


@dataclass(frozen=True, eq=False)
class Means:
    """Means of blocks.

    blocks: (B,), NaN where samples are missing, u.
    samples: In a block.
    dt: s.
    """

    blocks: FloatArray
    samples: int
    dt: float

    @classmethod
    def of(cls, wv: WaveletVariance, most: int) -> Means:
        """Of a series, as few as asked for."""
        merged = -(-wv.blocks.size // most)
        whole = wv.blocks.size // merged * merged
        means = wv.blocks[:whole].reshape(-1, merged).mean(axis=1)
        return cls(means, wv.block * merged, wv.dt)

    @property
    def step(self) -> float:
        """Length of a block, s."""
        return self.samples * self.dt

    @property
    def length(self) -> float:
        """Of all blocks, s."""
        return self.blocks.size * self.step

    @cached_property
    def first(self) -> IntArray:
        """Blocks that exist, but for the last."""
        return np.flatnonzero(~np.isnan(self.blocks))[:-1]

    @property
    def time(self) -> FloatArray:
        """Of the middles of the blocks, s, (B,)."""
        return np.asarray(self.step * (np.arange(self.blocks.size) + 0.5), dtype=float)

    def without(self, curves: Sequence[FloatArray]) -> Means:
        """Less curves, each (B,), by least squares."""
        there = ~np.isnan(self.blocks)
        rows = np.vstack([np.ones(self.blocks.size), *curves])
        sizes = np.linalg.lstsq(rows[:, there].T, self.blocks[there], rcond=None)[0]
        return replace(self, blocks=self.blocks - sizes @ rows)

    def parts(self, count: int) -> list[Means]:
        """Of so many parts of equal length, one after the other."""
        size = self.blocks.size // count
        rows = self.blocks[: size * count].reshape(count, size)
        return [Means(row, self.samples, self.dt) for row in rows]

    def floor(self, spectrum: PSD) -> float:
        """Smallest density of a spectrum between one period of all blocks and two blocks, u^2/Hz.

        Not below what rounding errors leave of the largest; 0 if there is no noise.
        """
        frequency = np.geomspace(1.0 / self.length, 0.5 / self.step, tuning.FREQUENCIES)
        density = spectrum(frequency, self.dt)
        return float(max(np.min(density), tuning.NO_INFORMATION * np.max(density)))

    def differences(self, curves: FloatArray) -> FloatArray:
        """Of each block that exists and the next that does, (..., B) to (..., D)."""
        there = ~np.isnan(self.blocks)
        return np.asarray(np.diff(curves[..., there], axis=-1))

    def covariance(self, spectrum: PSD) -> FloatArray:
        """Of these differences under a spectrum, (D, D), u^2."""
        column = difference_covariance(spectrum, self.dt, self.samples, self.blocks.size)
        last = int(np.flatnonzero(~np.isnan(self.blocks))[-1])
        whole = toeplitz(column[:last])
        # One across missing blocks is the sum of those of neighbours.
        return np.asarray(np.add.reduceat(np.add.reduceat(whole, self.first), self.first, axis=1))
