"""Filling of short gaps, and how it changes the expected wavelet variance.

All samples of a gap get one value: a weighted mean of pairs of boxes of samples, at the same
distance before and after the gap. The weights sum to one and minimize the mean square difference to
the mean of the missing samples under a given spectrum (ordinary kriging). A known drift goes on
through the gap.

With x a series without gaps and e the error of the filling (zero outside gaps), a level whose Haar
filter has the autocorrelation r and the squared gain H gains, summed over all its windows,

    sum_t [(W_t(x + e))^2 - W_t(x)^2] = sum_{k,k'} (2 e_k x_k' + e_k e_k') r(k - k').

The error of one gap of L samples is e = E x, with rows of E that sum to zero. For x of frequency f
the response of the filling is a, the sum over the gap D, and r(k) = 1/(2 m) - 3 |k|/(4 m^2) for
all |k| <= m, so that the expectation is the integral over the spectrum of

    2 H (a D - L) + (D - a L)^2 / (2 m) - 3 (T - 2 a T_1 + a^2 T_0) / (4 m^2),

where T, T_1, T_0 are sums over k, k' in the gap, counted from its middle, of |k - k'| times
cos 2 pi f (k - k'), cos 2 pi f k, and 1. It is exact and finite for a random walk. Short gaps near
each other use the same samples: each pair of them adds the covariance of the errors of their sums,
times twice r at their distance. Gaps of 64 samples or more are treated in means of blocks of
samples, with independent errors.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gmwm._core.distributions import student
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.process import PSD, haar_gain, quadrature
from gmwm.variance import tuning
from gmwm.variance.covariance.lags import block_density
from gmwm.variance.gaps import Gaps, window_count
from gmwm.variance.kernels import accumulate, cumulative, fill, neighbours

_REACH = 256.0  # blocks: what the frequencies resolve
_LOWEST = 2.0**-26  # cycles per block
_MEAN_SIN4 = 3.0 / 8.0
_LOBES = 32.0  # of the gain that are resolved
_RIDGE = 1e-10


@dataclass(frozen=True, eq=False)
class _Shape:
    """Responses of gaps of one length in blocks, and of the boxes around them."""

    boxes: FloatArray  # (boxes, F)
    total: FloatArray
    tents: tuple[FloatArray, FloatArray, float]


@lru_cache(maxsize=1)
def _nodes() -> tuple[FloatArray, FloatArray]:
    """Frequencies in cycles per block, and weights for both signs together."""
    grid = quadrature((_REACH,))
    kept = grid.frequency > _LOWEST
    return grid.frequency[kept], 2.0 * grid.weight[kept]


@lru_cache(maxsize=1)
def _cosines() -> FloatArray:
    """Cosines for all lags of half a sample within the neighbourhood, (F, lags)."""
    f, _ = _nodes()
    return np.asarray(np.cos(np.outer(np.pi * f, np.arange(tuning.NEIGHBOURHOOD))))


@lru_cache(maxsize=96)
def _shape(length: int) -> _Shape:
    f, _ = _nodes()
    omega = 2.0 * np.pi * f
    inside = np.arange(length) - 0.5 * (length - 1)
    lags = np.arange(1, length)
    tent = 2.0 * (lags * (length - lags)) @ np.cos(np.outer(lags, omega))
    sums = np.sum(np.abs(np.subtract.outer(inside, inside)), axis=1)
    edge = 0.5 * (length - 1)
    number = int(np.log2(max(4 * length, tuning.FILLING_REACH))) + 1
    far = 2.0 ** np.arange(number)
    near = np.concatenate([[0.0], far[:-1]])
    # The mean over distances near + 1 ... far, by the sum of a geometric series.
    width = (far - near)[:, None]
    middle = (edge + 0.5 * (near + 1.0 + far))[:, None]
    boxes = np.cos(omega * middle) * _sum_response(width, f) / width
    return _Shape(
        boxes,
        _sum_response(np.array([[float(length)]]), f)[0],
        (np.asarray(tent), sums @ np.cos(np.outer(inside, omega)), float(np.sum(sums))),
    )


def _sum_response(width: FloatArray, f: FloatArray) -> FloatArray:
    """Response of the sum over ``width`` samples about its middle."""
    return np.asarray(np.sin(np.pi * width * f) / np.sin(np.pi * f))


@lru_cache(maxsize=128)
def _gain(m: float) -> FloatArray:
    """Squared gain at the nodes; lobes that they do not resolve are replaced by their mean."""
    f, _ = _nodes()
    octave = 2.0 ** np.floor(np.log2(f))
    panels = np.maximum(_REACH * octave / 8.0, 1.0)
    mean = _MEAN_SIN4 / (m * np.sin(np.pi * f)) ** 2
    return np.where(m * octave <= _LOBES * panels, haar_gain(m, f), mean)


def levels_apart(
    gaps: Gaps, values: FloatArray, slope: float, psd: PSD, dt: float, longest: float
) -> BoolArray:
    """Gaps in which the level of a series changes by what its noise does not explain, (G,).

    A Student's t test of the difference of the means on both sides, as far as a filling looks,
    against its standard deviation under the spectrum. Noise has one such gap in a series with a
    probability of `tuning.APART`. Beyond the averaging times that the spectrum is known for, the
    noise is treated as a drift. A change must show in means over wider stretches as well.

    values: (n,), NaN where samples are missing.
    slope: Drift of the series, per sample.
    psd: Spectrum of its noise between the gaps.
    longest: Averaging time up to which the spectrum is known, samples.
    """
    first, last = gaps.edges.T
    there = np.zeros(values.size + 1, dtype=np.int64)
    np.cumsum(~np.isnan(values), out=there[1:])
    sums = cumulative(values, 0.0)

    def ratio(width: IntArray, deviation: FloatArray) -> FloatArray:
        """Differences of means of ``width`` over the limit for noise, (G,)."""
        before, after = (
            (sums[b] - sums[a]) / np.maximum(there[b] - there[a], 1)
            for a, b in (
                (np.maximum(first - width, 0), first),
                (last, np.minimum(last + width, values.size)),
            )
        )
        windows = np.maximum(gaps.runs.present / (2.0 * np.clip(width, 1, longest)), 1.0)
        far = student.isf(0.5 * tuning.APART / max(first.size, 1), windows)
        slow = np.maximum((last - first + width) / longest, 1.0)
        return np.asarray(
            np.abs(after - before - slope * (last - first + width)) / (far * slow * deviation)
        )

    kinds, kind = gaps.kinds
    width, deviation = kinds[:, 0] * 2 ** np.maximum(kinds[:, 2] - 1, 0), np.zeros(kinds.shape[0])
    for row, (block, length, _) in enumerate(kinds.tolist()):
        deviation[row] = _deviation(psd, dt, block, length, width[row] // block)
    near = ratio(width[kind], deviation[kind])
    apart = (near > 1.0) & (gaps.boxes > 0)
    if not np.any(apart):
        return apart
    # A change of the level lasts, a narrow peak of the spectrum does not.
    room = np.minimum(first - gaps.runs.edges[0, 0], gaps.runs.edges[-1, 1] - last)
    wide = np.minimum(tuning.WIDER * width[kind], room)
    deviations = np.ones(wide.size)
    for own in np.flatnonzero(apart).tolist():
        block = int(gaps.block[own]) * tuning.WIDER
        length = max(int(last[own] - first[own]) // block, 1)
        deviations[own] = _deviation(psd, dt, block, length, max(int(wide[own]) // block, 1))
    return np.asarray(apart & (ratio(wide, deviations) > 1.0))


def _deviation(psd: PSD, dt: float, block: int, length: int, width: int) -> float:
    """Standard deviation of the difference of means of blocks before and after a gap."""
    f, quadrature_weight = _nodes()
    power = quadrature_weight * block_density(psd, dt, f, block)
    total = _sum_response(np.array(width), f) / width
    return float(2.0 * np.sqrt((np.sin(np.pi * f * (length + width)) * total) ** 2 @ power))


@dataclass(frozen=True, eq=False)
class Filling:
    """How the gaps of a series are filled under a spectrum.

    weights: (K, most boxes), weights of the pairs of boxes, for each kind of gap.
    """

    gaps: Gaps
    weights: FloatArray
    psd: PSD
    dt: float

    @classmethod
    def under(cls, psd: PSD, dt: float, gaps: Gaps) -> Filling:
        """The best filling for noise of spectrum ``psd``."""
        kinds, _ = gaps.kinds
        weights = np.zeros((kinds.shape[0], max(int(np.max(kinds[:, 2])), 1)))
        f, quadrature_weight = _nodes()
        for block in np.unique(kinds[:, 0]):
            power = quadrature_weight * block_density(psd, dt, f, int(block))
            for row in np.flatnonzero((kinds[:, 0] == block) & (kinds[:, 2] > 0)):
                _, length, boxes = kinds[row].tolist()
                weights[row, :boxes] = _kriged(_shape(length), boxes, length, power)
        return cls(gaps, weights, psd, dt)

    def series(
        self, values: FloatArray, integral: FloatArray, averaging: FloatArray, slope: float
    ) -> Iterator[tuple[IntArray, FloatArray, FloatArray]]:
        """The series as the levels need it, from the finest on.

        values: (n,), NaN where samples are missing.
        integral: (n + 1,), its cumulative sum, starting with 0.
        averaging: (J,), ascending, in samples.
        slope: Drift that goes on through the gaps, per sample.
        Yields: levels, the series with the gaps filled for them, and its cumulative sum. The first
            levels, perhaps none, have nothing filled. The series changes when the next is asked
            for.
        """
        gaps, done = self.gaps, np.zeros(self.gaps.octave.size, dtype=bool)
        levels: list[int] = []
        for j, m in enumerate(averaging):
            new = gaps.filled(m) & ~done
            if np.any(new):
                yield np.array(levels, dtype=int), values, integral
                levels = []
                if not np.any(done):
                    values, integral = values.copy(), integral.copy()
                # By rising length: a gap looks across those that are much shorter.
                for octave in np.unique(gaps.octave[new]):
                    own = new & (gaps.octave == octave)
                    weights = self.weights[gaps.kinds[1][own]]
                    places = gaps.edges[own], gaps.block[own], gaps.boxes[own]
                    fill(values, integral, *places, weights, slope)
                    accumulate(values, 0.0, integral)
                done |= new
            levels.append(j)
        yield np.array(levels, dtype=int), values, integral

    def change(self, averaging: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Relative change of the expected wavelet variances, and that by the error alone, (J,).

        The latter is the wavelet variance of the error, without its covariance with the series.
        """
        f, quadrature_weight = _nodes()
        gaps = self.gaps
        kinds, kind = gaps.kinds
        covered = np.zeros((averaging.size, kinds.shape[0]))
        for j, m in enumerate(averaging):
            filled = gaps.filled(m)
            covered[j] = np.bincount(kind[filled], gaps.covered(int(m)), kinds.shape[0])
            covered[j] /= max(window_count(gaps.joined(m), 2.0 * m), 1.0)
        crossed, squared = np.zeros(averaging.size), np.zeros(averaging.size)
        for block in np.unique(kinds[:, 0]):
            rows = np.flatnonzero((kinds[:, 0] == block) & np.any(covered > 0.0, axis=0))
            levels = np.flatnonzero(np.any(covered[:, rows] > 0.0, axis=1))
            if not rows.size:
                continue
            power = quadrature_weight * block_density(self.psd, self.dt, f, int(block))
            m = averaging[levels] / block
            gains = np.array([_gain(each) for each in m])
            kernels = np.array([self._kernels(row)[:3] for row in rows])
            products, squares, tents = kernels.swapaxes(0, 1)
            share = block * covered[np.ix_(levels, rows)]
            crossed[levels] += np.sum(share * (2.0 * (gains * power) @ products.T), axis=1)
            added = np.outer(0.5 / m, squares @ power) - np.outer(0.75 / m**2, tents @ power)
            squared[levels] += np.sum(share * added, axis=1)
        power = quadrature_weight * block_density(self.psd, self.dt, f, 1)
        squared += self._of_pairs(averaging, covered, power)
        variance = np.array([_gain(m) @ power for m in averaging])
        return (crossed + squared) / variance, squared / variance

    def _of_pairs(
        self, averaging: FloatArray, covered: FloatArray, power: FloatArray
    ) -> FloatArray:
        """Contribution of the correlated errors of neighbouring short gaps, (J,)."""
        total = np.zeros(averaging.size)
        kinds, kind = self.gaps.kinds
        number = np.bincount(kind, minlength=kinds.shape[0])
        short = (kinds[:, 0] == 1) & (kinds[:, 2] > 0)
        usual = np.argsort(-number * short)[: tuning.PAIRED_KINDS]
        usual = np.sort(usual[short[usual]])
        if not usual.size:
            return total
        place = np.full(number.size, -1)
        place[usual] = np.arange(usual.size)
        centre = np.sum(self.gaps.edges, axis=1)
        pairs = neighbours(centre, place[kind], usual.size, tuning.NEIGHBOURHOOD)
        pairs = pairs + pairs.swapaxes(0, 1)
        first, second = np.nonzero(np.triu(np.any(pairs > 0, axis=2)))
        if not first.size:
            return total
        sums = np.array([self._kernels(row)[3] for row in usual])
        lag = 0.5 * np.arange(tuning.NEIGHBOURHOOD)
        common = (sums[first] * sums[second] * power) @ _cosines()
        common *= pairs[first, second] * np.where(first == second, 1.0, 2.0)[:, None]
        for j, m in enumerate(averaging):
            share = covered[j, usual] / number[usual]
            autocorrelation = np.where(lag <= m, 2.0 * m - 3.0 * lag, np.minimum(lag - 2.0 * m, 0))
            added = np.sqrt(share[first] * share[second]) * (common @ autocorrelation)
            total[j] = np.sum(added) / (4.0 * m**2)
        return total

    def _kernels(self, row: np.intp) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Factors of 2 H, 1/(2 m) and -3/(4 m^2), and the error of the gap's sum, (F,) each."""
        _, length, boxes = self.gaps.kinds[0][row].tolist()
        shape = _shape(length)
        response = self.weights[row, :boxes] @ shape.boxes[:boxes]
        both, first, none = shape.tents
        error = response * length - shape.total
        return (
            response * shape.total - length,
            error**2,
            both - 2.0 * response * first + response**2 * none,
            error,
        )


def _kriged(shape: _Shape, boxes: int, length: int, power: FloatArray) -> FloatArray:
    """Weights of the boxes, which sum to one."""
    base = shape.boxes[0]
    rest = shape.boxes[1:boxes] - base
    target = shape.total / length - base
    gram = (rest * power) @ rest.T
    gram[np.diag_indices_from(gram)] *= 1.0 + _RIDGE
    found = np.linalg.lstsq(gram, (rest * power) @ target, rcond=None)[0]
    return np.concatenate([[1.0 - np.sum(found)], found])
