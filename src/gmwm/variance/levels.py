"""The levels of a series, their coefficients, and the spectrum that they imply."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Self

import numpy as np

from gmwm._core.distributions import student
from gmwm._core.typing import BoolArray, FloatArray, IntArray, inner
from gmwm.process import PSD, Panels, node_weights, wavelet as known_wavelet
from gmwm.variance import kernels, tuning
from gmwm.variance.covariance.haar import dyadic_levels
from gmwm.variance.gaps import (
    GapEffects,
    Runs,
    bridged,
    common_share,
    lags_to,
    pair_factor,
    spread_by_lags,
    unmasked,
    window_centres,
    window_count,
)
from gmwm.variance.periodogram import Periodogram


def pilot_psd(variance: FloatArray, averaging: FloatArray, dt: float) -> PSD:
    """Power-law pieces between the pass bands of the levels, fitted to the wavelet variances.

    variance: (J,), Haar wavelet variances, u^2, positive.
    averaging: (J,), averaging times in samples, rising.
    Returns: ``psd(f, dt)``.
    """
    x, weight = _points(tuple(averaging.tolist()))
    knots = np.log(tuning.HAAR_PEAK / averaging)[::-1]  # rising frequency
    level = np.log(2.0 * variance * averaging)
    largest = (tuning.PILOT_STEEPEST * np.diff(np.log(averaging))).tolist()
    for _ in range(tuning.PILOT_ITERATIONS):
        implied = weight @ np.exp(_interpolated(x, knots, level[::-1]))
        level = level + np.clip(tuning.PILOT_STEP * np.log(variance / implied), -1.0, 1.0)
        limited = level.tolist()  # within f^-2.5 .. f^2.5 from one level to the next
        for j, step in enumerate(largest, 1):
            limited[j] = min(max(limited[j], limited[j - 1] - step), limited[j - 1] + step)
        level = np.array(limited)

    def psd(f: FloatArray, sampling: float) -> FloatArray:
        return sampling * np.exp(_interpolated(np.log(f * sampling), knots, level[::-1]))

    return psd


@lru_cache(maxsize=32)  # gaps hide other levels in each channel; 0.1 MB each
def _points(averaging: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Logarithms of frequencies (cycles per sample), and weights of a spectrum there by level."""
    frequency, weight = node_weights(averaging)
    lowest = np.log(tuning.HAAR_PEAK / averaging[-1])
    octaves = Panels.of(np.log(frequency) - lowest, np.log(2.0))
    points = lowest + octaves.points.ravel()
    weights = octaves.gathered(weight).reshape(len(averaging), -1)
    points.flags.writeable = weights.flags.writeable = False
    return points, weights


def _interpolated(x: FloatArray, knots: FloatArray, level: FloatArray) -> FloatArray:
    """Between levels at the knots; below the lowest with the mean slope of the lowest three."""
    found = np.interp(x, knots, level)
    if reach := min(3, level.size - 1):
        slope = (level[reach] - level[0]) / (knots[reach] - knots[0])
        found += np.clip(slope, -2.0, 0.0) * np.minimum(x - knots[0], 0.0)
    return found


def haar_moments(integral: FloatArray, runs: IntArray, averaging: FloatArray) -> FloatArray:
    """Mean and mean square of the Haar MODWT coefficients that lie within runs, (L, 2).

    integral: (n + 1,), cumulative sum of the series about its mean, starting with 0.
    runs: (P, 2), first sample of each run, and the one after its last.
    averaging: (L,), averaging times in samples, each with a coefficient.
    """
    found = np.array([kernels.haar_sums(integral, runs, int(m)) for m in averaging])
    return found[:, 1:] / found[:, :1]


def haar_coefficients(integral: FloatArray, start: int, stop: int, m: int) -> FloatArray:
    """Haar MODWT coefficients of the samples from ``start`` to ``stop``, free of end effects.

    integral: (n + 1,), cumulative sum of the series, starting with 0.
    """
    own = integral[start : stop + 1]
    return (0.5 / m) * (own[2 * m :] - 2.0 * own[m:-m] + own[: -2 * m])


def wavelet_coefficients(
    values: FloatArray, wavelet: str, levels: int = 64
) -> Iterator[FloatArray]:
    """MODWT coefficients free of end effects, level by level, by the pyramid algorithm.

    Percival & Walden, *Wavelet Methods for Time Series Analysis*, 2000, ch. 5: level j filters the
    smooth of level j - 1 with the filters of level 1, their taps 2^(j-1) samples apart.

    values: (n,), finite numbers.
    levels: At most so many. A short series has fewer that have such a coefficient.
    Yields: (n - width(j) + 1,), of level j = 1, 2, ..., in the order of time; element i stems from
        samples i to i + width(j) - 1.
    """
    filters = known_wavelet(wavelet)
    for row in range(min(filters.levels(values.size), levels)):
        yield _filtered(values, filters.detail, 1 << row)
        values = _filtered(values, filters.scaling, 1 << row)


def _filtered(values: FloatArray, taps: FloatArray, step: int) -> FloatArray:
    """sum_l taps[l] values[t - step l] where all of these exist."""
    reach = step * (taps.size - 1)
    out = np.zeros(values.size - reach)
    for i, tap in enumerate(taps.tolist()):
        out += tap * values[reach - step * i : values.size - step * i]
    return out


def level_changes(values: FloatArray, runs: Runs) -> BoolArray:
    """Gaps in which the level of a series changes by what its noise does not explain, (runs - 1,).

    A Student's t test of the difference of the means on both sides. Its variance is at most four
    times the largest of the Haar wavelet variances of about that averaging time, from the windows
    between gaps; beyond the longest known one it grows as that of a random walk. Noise has one such
    gap in a series with a probability of `tuning.APART`. A change of the level lasts, a narrow peak
    of the spectrum does not: it must show in means over wider stretches as well.

    values: (n,), NaN where samples are missing.
    """
    if len(runs.starts) < 2:
        return np.zeros(0, dtype=bool)
    m = dyadic_levels(runs.longest)
    counts = np.array([window_count(runs.edges, 2.0 * each) for each in m])
    m = m[: max(int(np.sum(np.cumprod(counts >= 2.0 * tuning.PILOT_WINDOWS * m))), 1)]
    sums = kernels.cumulative(values, 0.0)
    mean, square = haar_moments(sums, runs.edges, m).T
    drift = kernels.slope(values, runs.edges[:, 0])
    noise = np.pad(square - drift * m * mean + (0.5 * drift * m) ** 2, 1, mode="edge")
    noise = np.maximum(np.maximum(noise[:-2], noise[2:]), noise[1:-1])
    there = np.zeros(values.size + 1, dtype=np.int64)
    np.cumsum(~np.isnan(values), out=there[1:])
    first, last = runs.edges[:-1, 1], runs.edges[1:, 0]
    room = np.minimum(first - runs.starts[0], runs.stops[-1] - last)

    def is_large(width: IntArray) -> BoolArray:
        """Whether means of up to ``width`` samples differ by more than noise does."""
        width = np.minimum(width, room)
        left, right = (there[a + width] - there[a] for a in (first - width, last))
        before, after = (sums[a + width] - sums[a] for a in (first - width, last))
        apart = last - first + width
        known = np.minimum(np.log2(width).astype(int), m.size - 1)
        variance = 4.0 * noise[known] * width / np.minimum(left, right)
        variance *= np.maximum(apart / m[-1], 1.0)
        windows = np.maximum(runs.present / (2.0 * np.minimum(width, m[-1])), 1.0)
        limit = student.isf(0.5 * tuning.APART / first.size, windows)
        change = np.abs(after / right - before / left - drift * apart)
        return np.asarray(change > limit * np.sqrt(variance))

    width = tuning.STRETCH_OF_GAP * 2 ** np.ceil(np.log2(last - first)).astype(np.int64)
    width = np.maximum(width, tuning.LEAST_STRETCH)
    return is_large(width) & is_large(tuning.WIDER * width)


@dataclass(frozen=True, eq=False)
class Levels:
    """The levels of a series with at least one coefficient, gaps included.

    values: (n,), about their mean; NaN where samples are missing.
    runs: The samples that exist.
    averaging: (J,), averaging times, in samples.
    apart: (runs - 1,), gaps in which the level changes, which no coefficient contains.
    """

    values: FloatArray
    runs: Runs
    averaging: FloatArray
    wavelet: str
    apart: BoolArray

    @classmethod
    def of(
        cls, values: FloatArray, runs: Runs, wavelet: str, apart: BoolArray | None = None
    ) -> Self:
        """The levels of a series about its mean; gaps apart are found unless they are given."""
        if wavelet != "haar":
            number = known_wavelet(wavelet).levels(runs.longest)
            together = np.zeros(len(runs.starts) - 1, dtype=bool)
            return cls(values, runs, dyadic_levels(2**number), wavelet, together)
        if apart is None:
            apart = level_changes(values, runs)
        found = cls(values, runs, dyadic_levels(runs.n), wavelet, apart)
        exist = int(np.sum(np.cumprod(found.counts > 0.0)))
        return cls(values, runs, found.averaging[:exist], wavelet, apart)

    @cached_property
    def slope(self) -> float:
        """Slope of the least-squares line through the samples that exist, per sample.

        The line jumps in gaps in which the level does.
        """
        return kernels.slope(self.values, self.runs.edges[np.append(True, self.apart), 0])

    @property
    def _step(self) -> FloatArray:
        """Coefficients of the line, (J,)."""
        return 0.5 * self.slope * self.averaging

    @cached_property
    def edges(self) -> list[IntArray]:
        """Runs within which the coefficients of each level lie, (P, 2)."""
        limits = self._longest_gap * self.averaging
        return [bridged(self.runs.edges, self.apart, limit) for limit in limits]

    @property
    def _longest_gap(self) -> float:
        """Gaps in a coefficient are shorter than this share of the averaging time."""
        return tuning.LONGEST_GAP if self.wavelet == "haar" else 0.0

    @property
    def width(self) -> FloatArray:
        """Number of samples in a coefficient, (J,)."""
        kind = known_wavelet(self.wavelet)
        return np.array([kind.width(j + 1) for j in range(self.averaging.size)], dtype=float)

    @cached_property
    def counts(self) -> FloatArray:
        """Number of coefficients, (J,)."""
        return np.array([window_count(self.edges[j], width) for j, width in enumerate(self.width)])

    @cached_property
    def plain(self) -> int:
        """Number of levels, the finest, whose coefficients contain no missing sample."""
        gaps = self.runs.edges[1:, 0] - self.runs.edges[:-1, 1]
        shortest = np.min(gaps, initial=self.runs.n, where=~self.apart)
        return int(np.sum(self._longest_gap * self.averaging <= shortest))

    @cached_property
    def _integral(self) -> FloatArray:
        """Cumulative sum of the series; where coefficients contain gaps, without its line."""
        if self.plain == self.averaging.size:
            return kernels.cumulative(self.values, 0.0)
        return kernels.cumulative(self.values - self.slope * np.arange(self.runs.n), 0.0)

    @cached_property
    def _there(self) -> IntArray:
        """Cumulative number of samples that exist, (n + 1,)."""
        there = np.zeros(self.runs.n + 1, dtype=np.int64)
        np.cumsum(~np.isnan(self.values), out=there[1:])
        return there

    def _masked(self, level: int) -> tuple[FloatArray, float]:
        """Coefficients of a level without the line, and their mean scarcity."""
        found, m = np.empty(int(self.counts[level])), int(self.averaging[level])
        data = (self._integral, self._there, self.edges[level])
        scarcity = kernels.masked_coefficients(*data, m, found)
        return found, scarcity / found.size

    def moments(self) -> tuple[FloatArray, FloatArray]:
        """Mean and mean square of each level's coefficients, (J, 2), and mean scarcity, (J,).

        The scarcity is a quarter of 1/C - 1/m of both halves of a window, with C of m samples.
        """
        scarcity = np.zeros(self.averaging.size)
        if self.wavelet != "haar":
            return np.array([(np.mean(w), np.mean(w * w)) for w in self.coefficients()]), scarcity
        moments = np.empty((self.averaging.size, 2))
        whole = self.plain == self.averaging.size
        integral = self._integral if whole else kernels.cumulative(self.values, 0.0)
        plain = self.averaging[: self.plain]
        moments[: plain.size] = haar_moments(integral, self.runs.edges, plain)
        for j in range(self.plain, self.averaging.size):
            w, scarcity[j] = self._masked(j)
            step = self._step[j]
            mean = float(np.mean(w))
            moments[j] = mean + step, inner(w, w) / w.size + 2.0 * step * mean + step**2
        return moments, scarcity

    def coefficients(self, *, level: bool = False) -> Iterator[FloatArray]:
        """The coefficients of each level, over all runs; without the series' line if ``level``."""
        line = self.slope * np.arange(self.runs.n) if level else 0.0
        if self.wavelet != "haar":
            number = self.averaging.size
            parts = [
                wavelet_coefficients((self.values - line)[a:b], self.wavelet, number)
                for a, b in self.runs.edges
            ]
            for _ in range(number):
                yield np.concatenate([next(part, np.zeros(0)) for part in parts])
            return
        own = kernels.cumulative(self.values - line, 0.0)
        for j, m in enumerate(self.averaging.astype(int).tolist()):
            if j < self.plain:
                yield np.concatenate([haar_coefficients(own, a, b, m) for a, b in self.edges[j]])
            else:
                yield self._masked(j)[0] + (0.0 if level else self._step[j])

    def added(
        self, moments: FloatArray, scarcity: FloatArray, level: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """What missing samples add to the variances, and that relative to them, (J,) each.

        level: (J,), variances without the series' line; by default from the moments.
        """
        if self.plain == self.averaging.size:
            return np.zeros(scarcity.size), np.zeros(scarcity.size)
        step = self._step
        square = moments[:, 1] - 2.0 * step * moments[:, 0] + step**2 if level is None else level
        there = self.runs.edges
        gaps = (there[1:, 0] - there[:-1, 1])[~self.apart]
        longest = self._longest_gap * self.averaging
        lags = lags_to(int(np.max(gaps, initial=1, where=gaps < longest[-1])))
        parts = bridged(there, self.apart, np.inf)
        squares = kernels.lagged_squares(self.values, parts, lags, self.slope)
        squares *= 4.0 * square[0] / max(squares[1], np.finfo(float).tiny)  # robust ones are others

        def spread(finer: FloatArray) -> float:
            j = finer.size
            runs = self.edges[j]
            used = runs[:, 1] - runs[:, 0] >= self.width[j]
            own = there[used[np.searchsorted(runs[:, 0], there[:, 0], side="right") - 1]]
            k = int(np.searchsorted(lags, longest[j]))
            return spread_by_lags(finer, own, runs[used], lags[:k], squares[:k])

        variance, change = unmasked(square, scarcity, spread)
        return square - variance, change

    def effects(self, change: FloatArray) -> GapEffects | None:
        """What the gaps do to the variances; ``None`` for a complete series."""
        n = self.runs.n
        if self.runs.is_complete:
            return None
        widths = self.width
        centres = [window_centres(self.edges[j], int(width)) for j, width in enumerate(widths)]
        if self.wavelet == "haar":
            pairs = zip(centres, self.averaging.astype(int).tolist(), strict=True)
            growth = np.array([pair_factor(own, m, n) for own, m in pairs])
        else:
            growth = (n - widths + 1.0) / self.counts
        deviation = np.sqrt(growth) * (1.0 + change)
        inflation = np.outer(deviation, deviation) * common_share(centres, widths, n)
        return GapEffects(n - self.runs.present, self.counts, change, inflation)

    def spectrum(self) -> Periodogram | None:
        """That of the longest run, if it holds most of the samples."""
        longest = np.argmax(self.runs.edges[:, 1] - self.runs.edges[:, 0])
        start, stop = self.runs.edges[longest].tolist()
        if stop - start < tuning.SHARE_OF_RUN * self.runs.present:
            return None
        return Periodogram.of(self.values[start:stop], self._integral[start : stop + 1])

    def block_means(self) -> tuple[FloatArray, int]:
        """Means of blocks of what exists, and their size.

        Those in gaps that the coarsest level contains are interpolated if less than half is there,
        between means over as long a time beside the gap; those with samples of longer gaps are NaN.
        """
        n = self.runs.n
        edges = np.concatenate([[0], self.edges[self.averaging.size - 1].ravel(), [n]])
        longer = [(start, stop) for start, stop in edges.reshape(-1, 2).tolist() if stop > start]
        block = -(-n // (tuning.MOST_BLOCKS_WITH_GAPS if longer else tuning.MOST_BLOCKS))
        ends = slice(0, (n // block) * block + 1, block)
        sums = np.diff(self._integral[ends])
        if self.runs.is_complete:
            return sums / block, block
        place, there = np.arange(sums.size), np.diff(self._there[ends])
        line = self.slope * (block * (place + 0.5) - 0.5)
        if self.plain == self.averaging.size:
            sums -= line * there
        known = there >= max(tuning.LEAST_OF_BLOCK * block, 1)
        if not np.any(known):
            return np.full(sums.size, np.nan), block
        means = _bridged(sums / np.maximum(there, 1), known) + line
        for start, stop in longer:
            means[start // block : (stop - 1) // block + 1] = np.nan
        return means, block


def _bridged(means: FloatArray, known: BoolArray) -> FloatArray:
    """Means with lines across those that are unknown, which add no noise of their own."""
    means, place = means.copy(), np.arange(means.size)
    edges = np.flatnonzero(np.diff(known, prepend=True, append=True))
    for start, stop in edges.reshape(-1, 2).tolist():
        reach = slice(max(2 * start - stop, 0), 2 * stop - start)
        left, right = (known[reach] & side[reach] for side in (place < start, place >= stop))
        ends = [
            (place[reach][side].mean(), means[reach][side].mean())
            for side in (left, right)
            if side.any()
        ]
        if ends:
            times, values = np.array(ends).T
            means[start:stop] = np.interp(place[start:stop], times, values)
    return means
