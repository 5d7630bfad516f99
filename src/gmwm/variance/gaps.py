"""Missing samples: the runs between them, the gaps that are filled, and what gaps cost.

A coefficient of averaging time m is made of 2 m samples, so a few missing ones would take all long
averaging times from a record. Gaps of up to m/4 samples are therefore filled before the
coefficients of that level are computed, see `gmwm.variance.filling`. Longer gaps split the record,
and so do gaps in which the level changes by more than the noise explains: coefficients that contain
them are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gmwm._core.documents import Array, check_covariance
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.variance import tuning
from gmwm.variance.kernels import pairs_at_lag


@dataclass(frozen=True)
class Runs:
    """Runs of samples without a missing one.

    starts, stops: First sample of each run, and the one after its last, ascending.
    n: Length of the series, missing samples included.
    """

    starts: tuple[int, ...]
    stops: tuple[int, ...]
    n: int

    @classmethod
    def of(cls, values: FloatArray) -> Runs:
        """The runs of a series (n,) in which NaN stands for missing samples."""
        present = np.concatenate([[False], ~np.isnan(values), [False]])
        edges = np.flatnonzero(present[1:] != present[:-1])
        return cls(tuple(edges[::2].tolist()), tuple(edges[1::2].tolist()), int(values.size))

    @property
    def is_complete(self) -> bool:
        """Whether no sample is missing."""
        return self.starts == (0,) and self.stops == (self.n,)

    @cached_property
    def edges(self) -> IntArray:
        """Starts and stops, (runs, 2)."""
        return np.stack([self.starts, self.stops], axis=1).astype(np.int64)

    @property
    def present(self) -> int:
        """Number of samples that exist."""
        return int(np.sum(self.edges[:, 1] - self.edges[:, 0]))

    @property
    def longest(self) -> int:
        """Length of the longest run."""
        return int(np.max(self.edges[:, 1] - self.edges[:, 0], initial=0))


@dataclass(frozen=True, eq=False)
class Gaps:
    """Gaps within a series, with the samples around each that predict what it held.

    runs: The samples that exist.
    edges: (G, 2), first sample of each gap that has samples on both sides, and the one after its
        last. Runs that are very short beside the gaps around them belong to the gap.
    octave: (G,), lengths rounded up to a power of two, as its exponent.
    apart: (G,) of bool, gaps with another level on either side, which are never filled.
    """

    runs: Runs
    edges: IntArray
    octave: IntArray
    apart: BoolArray

    @classmethod
    def of(cls, runs: Runs) -> Gaps:
        """The gaps between the first and the last sample that exist."""
        edges = _merge_over_islands(np.stack([runs.edges[:-1, 1], runs.edges[1:, 0]], axis=1))
        octave = np.ceil(np.log2(edges[:, 1] - edges[:, 0])).astype(np.int64)
        return cls(runs, edges, octave, np.zeros(octave.size, dtype=bool))

    @property
    def span(self) -> int:
        """Samples from the first to the last that exist."""
        return int(self.runs.edges[-1, 1] - self.runs.edges[0, 0])

    @cached_property
    def block(self) -> IntArray:
        """Samples of the unit in which each gap is less than 64 long, (G,)."""
        length = self.edges[:, 1] - self.edges[:, 0]
        octave = np.floor(np.log2(np.maximum(2 * length / tuning.GAP_BLOCKS, 1.0)))
        return 2 ** octave.astype(np.int64)

    @cached_property
    def length(self) -> IntArray:
        """Length of each gap in blocks, (G,)."""
        return np.rint((self.edges[:, 1] - self.edges[:, 0]) / self.block).astype(np.int64)

    @cached_property
    def boxes(self) -> IntArray:
        """Number of boxes on either side that a filling is made of, (G,).

        They end 1, 2, 4, 8, ... blocks from the gap, and before the next gap that is not much
        shorter; much shorter ones are filled already. None where the record ends too near.
        """
        free = np.empty(self.octave.size, dtype=np.int64)
        ends = self.runs.edges[0, 0], self.runs.edges[-1, 1]
        for octave in np.unique(self.octave):
            own = self.octave == octave
            others = (self.octave > octave - tuning.PASSED_OCTAVES) | self.apart
            edges = self.edges[others]
            before = np.concatenate([[ends[0]], edges[:-1, 1]])
            after = np.concatenate([edges[1:, 0], [ends[1]]])
            room = np.minimum(edges[:, 0] - before, after - edges[:, 1])
            free[own] = room[own[others]]
        reach = np.minimum(free // self.block, np.maximum(4 * self.length, tuning.FILLING_REACH))
        return np.floor(np.log2(np.maximum(reach, 0.5))).astype(np.int64) + 1

    @cached_property
    def kinds(self) -> tuple[IntArray, IntArray]:
        """Block, length and boxes of the kinds of gaps there are, (K, 3), and each gap's, (G,)."""
        base = 2 * tuning.GAP_BLOCKS  # more than any length or number of boxes
        code = (self.block * base + self.length) * base + self.boxes
        found, kind = np.unique(code, return_inverse=True)
        return np.stack([found // base**2, found // base % base, found % base], axis=1), kind

    def filled(self, m: float) -> BoolArray:
        """Which gaps are filled for averaging times of ``m`` samples, (G,)."""
        short = self.octave <= np.log2(m / tuning.AVERAGES_OF_GAP)
        return np.asarray(short & (self.boxes > 0) & ~self.apart)

    def joined(self, m: float) -> IntArray:
        """Runs of samples that exist or are filled for averaging times of ``m`` samples, (P, 2)."""
        filled = self.filled(m)
        largest = int(np.max(self.octave, initial=-1, where=filled))
        if largest not in self._joined:
            starts, stops = self.runs.edges.T
            first, last = self.edges[filled].T
            beside = np.searchsorted(first, starts, "left") - 1
            kept = starts[(beside < 0) | (starts > last[beside])]
            beside = np.searchsorted(first, stops, "right") - 1
            ends = stops[(beside < 0) | (stops >= last[beside])]
            self._joined[largest] = np.stack([kept, ends], axis=1)
        return self._joined[largest]

    @cached_property
    def _joined(self) -> dict[int, IntArray]:
        """Runs by the octave of the longest gaps that are filled."""
        return {-1: self.runs.edges}

    def covered(self, m: int) -> FloatArray:
        """Number of kept windows of 2 m samples that cover each gap filled for it, over 2 m."""
        runs = self.joined(m)
        edges = self.edges[self.filled(m)]
        centre = np.sum(edges, axis=1) // 2
        own = np.searchsorted(runs[:, 0], edges[:, 0], "right") - 1
        first = np.maximum(runs[own, 0], centre - 2 * m + 1)
        last = np.minimum(runs[own, 1] - 2 * m, centre)
        return np.asarray(np.maximum(last - first + 1, 0) / (2.0 * m))


def _merge_over_islands(edges: IntArray) -> IntArray:
    """Merge gaps that are separated by very short runs."""
    while edges.shape[0] > 1:
        length = edges[:, 1] - edges[:, 0]
        apart = edges[1:, 0] - edges[:-1, 1]
        one = tuning.ISLAND * apart < np.maximum(length[1:], length[:-1])
        if not np.any(one):
            break
        starts = edges[np.concatenate([[True], ~one]), 0]
        edges = np.stack([starts, edges[np.concatenate([~one, [True]]), 1]], axis=1)
    return edges


@dataclass(frozen=True, eq=False)
class GapEffects:
    """What gaps do to the wavelet variances of the levels.

    missing: Number of missing samples.
    counts: (J,), number of coefficients.
    change: (J,), relative change of the expected variance by filling short gaps; it has been
        subtracted. Zero where no gap was filled.
    inflation: (J, J), growth of the covariance over that of a complete record.
    """

    missing: int
    counts: Array
    change: Array
    inflation: Array

    def check(self, n: int, levels: int) -> None:
        """Raise ValueError if these are not the gaps of so many samples and levels."""
        if not (0 <= self.missing < n and self.counts.shape == self.change.shape == (levels,)):
            raise ValueError("gaps are those of another series")
        if not (np.all(self.counts > 0.0) and np.all(self.change > -1.0)):
            raise ValueError("gaps leave no coefficients, or less than no variance")
        check_covariance(self.inflation.tolist(), levels, "inflation")


def window_count(runs: IntArray, width: float) -> float:
    """Number of windows of ``width`` samples that lie within a run."""
    return float(np.sum(np.maximum(runs[:, 1] - runs[:, 0] - width + 1.0, 0.0)))


def window_centres(runs: IntArray, width: int) -> IntArray:
    """Intervals of the centres of windows of ``width`` samples that lie within a run, (P, 2)."""
    centres = np.stack([runs[:, 0], runs[:, 1] - width + 1], axis=1) + width // 2
    return centres[centres[:, 1] > centres[:, 0]]


def pair_factor(centres: IntArray, m: int, n: int) -> float:
    """Sampling variance of a Haar level by windows at these centres, over that of n samples.

    From the pairs of coefficients at the lags at which those of white noise are correlated.
    """
    return _mean_variance(centres, m) / _mean_variance(window_centres(np.array([[0, n]]), 2 * m), m)


def _mean_variance(centres: IntArray, m: int) -> float:
    """Variance of the mean of squares at these centres, over that of one of them."""
    # Some lags of an average, or of the most windows in a row where these are fewer.
    widest = min(m, int(np.max(centres[:, 1] - centres[:, 0])))
    step = max(widest // tuning.LAGS_PER_AVERAGE, 1)
    lags = np.arange(0, min(2 * m, int(centres[-1, 1] - centres[0, 0])), step)
    correlation = np.where(lags <= m, 1.0 - 1.5 * lags / m, 0.5 * lags / m - 1.0)
    weight = correlation**2 * np.where(lags == 0, 1.0, 2.0)
    found = np.array([pairs_at_lag(centres, centres, int(lag)) for lag in lags], dtype=float)
    return float(step * (weight @ found) / found[0] ** 2)


def common_share(centres: Sequence[IntArray], width: FloatArray, n: int) -> FloatArray:
    """How far the levels whose windows have these centres share them, (J, J).

    For two levels the number of common centres over the geometric mean of both numbers, counted
    where a record of n samples without gaps has centres of both: 1 there, positive semi-definite.
    """
    size = len(centres)
    common = np.eye(size)
    for k, second in enumerate(centres):
        whole = window_centres(np.array([[0, n]]), int(width[k]))
        number = pairs_at_lag(second, second, 0)
        for j in range(k):
            there = pairs_at_lag(centres[j], whole, 0)
            both = pairs_at_lag(centres[j], second, 0)
            common[j, k] = common[k, j] = both / np.sqrt(max(there * number, 1))
    values, vectors = np.linalg.eigh(common)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    root /= np.sqrt(np.sum(root**2, axis=1))[:, None]
    return np.asarray(root @ root.T)
