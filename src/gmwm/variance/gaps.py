"""Missing samples: the runs between them, what they add to wavelet variances, and what they cost.

A coefficient of averaging time m is half the difference of two neighbouring means of m samples.
Where some are missing, each is the mean of those that exist. Gaps of m/4 and more split the record,
and so do gaps in which the level changes by more than the noise explains: coefficients that contain
them are left out. What the others have too much variance by is known without a model, and is
subtracted level by level; see docs/derivations.md.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from gmwm._core.documents import Array, check_covariance
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.variance import tuning
from gmwm.variance.kernels import pairs_at_lag


@dataclass(frozen=True)
class Runs:
    """Runs of samples without a missing one.

    starts, stops: First sample of each run, and the one after its last, ascending.
    """

    starts: tuple[int, ...]
    stops: tuple[int, ...]
    n: int

    @classmethod
    def of(cls, values: FloatArray) -> Self:
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
class GapEffects:
    """What gaps do to the wavelet variances of the levels.

    missing: Number of missing samples.
    counts: (J,), number of coefficients.
    change: (J,), what missing samples added to the expected variance, relative to it; it has been
        subtracted.
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


def bridged(runs: IntArray, apart: BoolArray, limit: float) -> IntArray:
    """Runs to which gaps of fewer than ``limit`` samples belong, (P, 2), unless they are apart."""
    split = apart | (runs[1:, 0] - runs[:-1, 1] >= limit)
    return np.stack([runs[np.append(True, split), 0], runs[np.append(split, True), 1]], axis=1)


def unmasked(
    square: FloatArray, scarcity: FloatArray, spread: Callable[[FloatArray], float]
) -> tuple[FloatArray, FloatArray]:
    """Variances without what missing samples add, and that relative to them, (J,) each.

    square: (J,), mean squares of the coefficients.
    scarcity: (J,), mean over windows of a quarter of 1/C - 1/m, for both halves together.
    spread: S of a level from the variances of the finer ones.
    """
    variance, change, usual = np.zeros(square.size), np.zeros(square.size), 0.0
    for j in range(square.size):
        added = scarcity[j] * spread(variance[:j]) if scarcity[j] > 0.0 else 0.0
        variance[j] = max(square[j] - added, square[j] / (1.0 + tuning.LARGEST_CHANGE))
        # Relative to what is expected: few windows that came out small by chance would weigh least.
        # Levels fall by 4 from one to the next (quantization) or less, the last ones by 2 or less.
        usual = max(variance[j], usual * (0.5 if j >= square.size - tuning.FEW_WINDOWS else 0.25))
        change[j] = added / usual if usual > 0.0 else 0.0
    return variance, change


def lags_to(longest: int) -> IntArray:
    """Lags from 0 to that of the longest gap, the longer ones some an octave."""
    lags = [0, 1]
    while lags[-1] < longest:
        lags.append(lags[-1] + max(lags[-1] // tuning.LAGS_PER_OCTAVE, 1))
    return np.array(lags)


def spread_by_lags(
    finer: FloatArray, there: IntArray, runs: IntArray, lags: IntArray, squares: FloatArray
) -> float:
    """S of the level after the finer ones, of windows within some runs.

    finer: (j,), variances of the finer levels.
    there: (Q, 2), intervals of samples that exist within the runs.
    runs: (P, 2), intervals with windows.
    lags: (K,), from 0 on; shorter than an averaging time.
    squares: (K,), mean squares of differences at these lags.
    """
    m = 2.0**finer.size
    share = np.array([pairs_at_lag(there, there, k) / pairs_at_lag(runs, runs, k) for k in lags])
    weight = share - share[0] ** 2
    own = weight[0]
    weight *= np.diff(lags, prepend=0) + np.diff(lags, append=lags[-1] + 1)
    # Within m samples there are m - k pairs; k more lie on both sides of the centre of a window.
    spread = weight * (1.0 - 1.5 * lags / m) @ (np.sum(finer) - 0.5 * squares)
    return float(spread / (own - weight @ (1.0 - lags / m) / m))


def spread_by_lengths(finer: FloatArray, gaps: IntArray, missing: float, longest: float) -> float:
    """S from lengths of gaps: L m/(m - L) V(L, m), where a share ``missing`` of samples is.

    With a share p missing at random, gaps have the mean 1/(1 - p) but the effect of single ones.

    gaps: (G, 2), number of gaps of about the same length, and samples they have.
    longest: Longest gap within half a window, as a share of it.
    """
    m = 2.0**finer.size
    length = np.maximum(gaps[:, 1] / gaps[:, 0] * (1.0 - missing), 1.0)
    within = length <= longest * m
    own, samples = length[within], gaps[within, 1]
    octave = np.log2(own).astype(int)
    beyond = np.cumsum(finer[::-1])[::-1] - finer
    means = (2.0 ** (octave + 1) / own - 1.0) * finer[octave] + beyond[octave]  # as of white noise
    return float(own * means * m / (m - own) @ samples / max(np.sum(samples), 1))


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
    common = np.eye(len(centres))
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
