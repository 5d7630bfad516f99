"""The levels of a series: which samples exist or are filled for each, and the coefficients."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.process import PSD, Panels, node_weights, wavelet as known_wavelet
from gmwm.variance import tuning
from gmwm.variance.covariance.haar import dyadic_levels
from gmwm.variance.filling import Filling, levels_apart
from gmwm.variance.gaps import (
    GapEffects,
    Gaps,
    Runs,
    common_share,
    pair_factor,
    window_centres,
    window_count,
)
from gmwm.variance.kernels import (
    FINE,
    coarse_moments,
    cumulative,
    fine_moments,
    haar_coefficients,
    slope,
)
from gmwm.variance.modwt import coefficients


def pilot_psd(variance: FloatArray, averaging: FloatArray, dt: float) -> PSD:
    """Power-law pieces between the pass bands of the levels, fitted to the wavelet variances.

    variance: (J,), Haar wavelet variances, u^2, positive.
    averaging: (J,), averaging times in samples, dyadic.
    dt: Sampling interval, s.
    Returns: ``psd(f, dt)``.
    """
    x, weight = _points(tuple(averaging.tolist()))
    knots = np.log(tuning.HAAR_PEAK / averaging)[::-1]  # rising frequency
    places = _Places(x, knots)
    level = np.log(2.0 * variance * averaging)
    for _ in range(tuning.PILOT_ITERATIONS):
        implied = weight @ np.exp(places.interpolated(level[::-1]))
        level = level + np.clip(tuning.PILOT_STEP * np.log(variance / implied), -1.0, 1.0)
        level = _limit_slopes(level)

    def psd(f: FloatArray, sampling: float) -> FloatArray:
        return sampling * np.exp(_Places(np.log(f * sampling), knots).interpolated(level[::-1]))

    return psd


@lru_cache(maxsize=32)  # gaps hide other levels in each channel; 0.1 MB each
def _points(averaging: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Logarithms of frequencies (cycles per sample), and weights of a spectrum there by level.

    A power law on an octave is a polynomial of its points to rounding.
    """
    frequency, weight = node_weights(averaging)
    lowest = np.log(tuning.HAAR_PEAK / averaging[-1])
    octaves = Panels.of(np.log(frequency) - lowest, np.log(2.0))
    points = lowest + octaves.points.ravel()
    weights = octaves.gathered(weight).reshape(len(averaging), -1)
    points.flags.writeable = weights.flags.writeable = False
    return points, weights


class _Places:
    """Places of values between knots, for repeated piecewise linear interpolation.

    It is quick where many values in a row lie in one piece.

    x: (n,).
    knots: (K,), rising.
    """

    def __init__(self, x: FloatArray, knots: FloatArray) -> None:
        self._knots = knots
        self._below = np.minimum(x - knots[0], 0.0)
        piece = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, max(knots.size - 2, 0))
        self._beyond = np.clip(x, knots[0], knots[-1]) - knots[piece]
        start = np.flatnonzero(np.diff(piece, prepend=-1))
        self._piece, self._repeats = piece[start], np.diff(start, append=piece.size)

    def interpolated(self, level: FloatArray) -> FloatArray:
        """Between levels at the knots; below the lowest with the mean slope of the lowest three."""
        reach = min(3, level.size - 1)
        if reach == 0:
            return np.full(self._below.shape, level[0])
        slopes = np.diff(level) / np.diff(self._knots)
        inside = np.repeat(slopes[self._piece], self._repeats) * self._beyond
        inside += np.repeat(level[self._piece], self._repeats)
        slope = (level[reach] - level[0]) / (self._knots[reach] - self._knots[0])
        return np.asarray(inside + np.clip(slope, -2.0, 0.0) * self._below)


def _limit_slopes(level: FloatArray) -> FloatArray:
    """Keep the density within f^-2.5 .. f^2.5 from one level (an octave) to the next."""
    largest = tuning.PILOT_STEEPEST * float(np.log(2.0))
    limited = level.tolist()
    for j in range(1, level.size):
        limited[j] = min(max(limited[j], limited[j - 1] - largest), limited[j - 1] + largest)
    return np.array(limited)


_ROW = 1 << FINE


def haar_moments(
    values: FloatArray, integral: FloatArray, runs: IntArray, averaging: FloatArray
) -> FloatArray:
    """Mean and mean square of the Haar MODWT coefficients that lie within runs, (L, 2).

    values: (n,), about their mean.
    integral: (n + 1,), their cumulative sum, starting with 0.
    runs: (P, 2), first sample of each run, and the one after its last.
    averaging: (L,), averaging times in samples: powers of two in a row, each with a coefficient.
    """
    m = averaging.astype(np.int64)
    first = int(m[0]).bit_length() - 1
    fine = m[m < _ROW]
    coarse = m[m >= _ROW]
    long = runs[runs[:, 1] - runs[:, 0] >= 2 * m[0]]
    levels = first + fine.size

    def of_part(part: int, parts: int) -> FloatArray:
        found = np.zeros((first + m.size, 3))
        for start, stop in long.tolist():
            edges = [start + (stop - start) * i // parts for i in (part, part + 1)]
            if fine.size:
                fine_moments(values, edges[0], edges[1], stop, levels, found[:levels])
            if coarse.size and stop - start >= 2 * coarse[0]:
                columns = (_ROW * part // parts, _ROW * (part + 1) // parts)
                coarse_moments(integral, start, stop, columns, coarse, found[first + fine.size :])
        return found[first:]

    has_affinity = hasattr(os, "sched_getaffinity")  # not on Windows
    processors = len(os.sched_getaffinity(0)) if has_affinity else os.cpu_count() or 1
    parts = min(processors, values.size // tuning.SAMPLES_PER_THREAD)
    if parts < 2:
        found = of_part(0, 1)
    else:
        with ThreadPoolExecutor(parts) as pool:
            found = np.sum(list(pool.map(of_part, range(parts), [parts] * parts)), axis=0)
    return found[:, 1:] / found[:, :1]


@dataclass(frozen=True, eq=False)
class Levels:
    """The levels of a series, gaps included.

    values: (n,), about their mean; NaN where samples are missing.
    runs: The samples that exist.
    averaging: (J,), averaging times, in samples, of the levels with a coefficient.
    filling: How short gaps are filled; ``None`` where none are.
    change: (J,), relative change of the expected variances by filling.
    error: (J,), relative wavelet variances of the error of the filling.
    filled: (J,) of bool, levels for which gaps are filled.
    parts: (P,), first samples of parts with levels of their own, between which its line jumps.
    """

    values: FloatArray
    runs: Runs
    averaging: FloatArray
    wavelet: str
    filling: Filling | None
    change: FloatArray
    error: FloatArray
    filled: BoolArray
    parts: IntArray = field(default_factory=lambda: np.zeros(1, dtype=np.int64))

    @classmethod
    def of(cls, values: FloatArray, runs: Runs, wavelet: str, dt: float) -> Levels:
        """The levels with a coefficient; for the Haar wavelet, with short gaps filled."""
        m = dyadic_levels(runs.longest)
        if wavelet != "haar":
            kind = known_wavelet(wavelet)
            m = m[[kind.width(j + 1) <= runs.longest for j in range(m.size)]]
        none = np.zeros(m.size)
        plain = cls(values, runs, m, wavelet, None, none, none, none > 0.0)
        if runs.is_complete or wavelet != "haar":
            return plain
        gaps = Gaps.of(runs)
        m = dyadic_levels(gaps.span)
        if not np.any(gaps.filled(m[-1])):
            return plain
        gaps = replace(gaps, apart=plain._apart(gaps, dt))
        if np.any(gaps.apart):
            parts = np.concatenate([[0], gaps.edges[gaps.apart, 1]])
            plain = replace(plain, parts=parts)
            if not np.any(gaps.filled(m[-1])):
                return plain
        none = np.zeros(m.size)
        whole = replace(plain, averaging=m, change=none, error=none, filled=none == 0.0)
        variance = plain._pilot_variance(0)
        fine = [not np.any(gaps.filled(each)) for each in plain.averaging]
        scarcity = float(np.min((plain.averaging / plain.counts)[fine]))
        first = whole._filled_under(variance, scarcity, gaps, dt)
        variance = np.append(variance, first._pilot_variance(variance.size))
        return whole._filled_under(variance, scarcity, gaps, dt)

    def _apart(self, gaps: Gaps, dt: float) -> BoolArray:
        """Gaps in which the level changes, judged by the series between them, (G,)."""
        between = replace(self, parts=self.runs.edges[:, 0])
        variance = between._pilot_variance(0)
        known = self.averaging[: variance.size]
        psd = pilot_psd(variance, known, dt)
        return levels_apart(gaps, self.values, between.slope, psd, dt, float(known[-1]))

    def _pilot_variance(self, start: int) -> FloatArray:
        """Driftless variances of the well-known levels from ``start`` on; the finest always is."""
        windows = self.counts / (2.0 * self.averaging)
        known = max(int(np.sum(np.cumprod(windows >= tuning.PILOT_WINDOWS))), 1)
        part = replace(
            self,
            averaging=self.averaging[start:known],
            change=self.change[start:known],
            error=self.error[start:known],
            filled=self.filled[start:known],
        )
        return np.maximum(part.driftless(part.moments()), np.finfo(float).tiny)

    def _filled_under(self, variance: FloatArray, scarcity: float, gaps: Gaps, dt: float) -> Levels:
        """With the gaps filled under the spectrum that these variances of fine levels imply.

        The averaging time over the number of windows is proportional to the relative sampling
        variance. Where that of the fine levels, ``scarcity``, leaves the change less certain than
        the level itself, the level is not filled: hardly two samples follow each other there.
        """
        psd = pilot_psd(variance, self.averaging[: variance.size], dt)
        filling = Filling.under(psd, dt, gaps)
        found = replace(self, filling=filling)
        change, error = filling.change(self.averaging)
        own = self.averaging / np.maximum(found.counts, 1.0)
        filled = np.abs(change) <= tuning.LARGEST_CHANGE
        filled &= change**2 * scarcity <= (1.0 + change) ** 2 * own
        # The pilot knows too little of the coarsest levels to decide anew.
        decided = max(
            int(np.sum(found.counts >= tuning.DECIDING_WINDOWS * 2.0 * self.averaging)), 1
        )
        filled[decided:] = filled[decided - 1]
        change = np.minimum(change, tuning.LARGEST_CHANGE)
        change, error = np.where(filled, (change, error), 0.0)
        found = replace(found, change=change, error=error, filled=filled)
        exist = int(np.sum(np.cumprod(found.counts > 0.0)))
        return replace(
            found,
            averaging=self.averaging[:exist],
            change=change[:exist],
            error=error[:exist],
            filled=filled[:exist],
        )

    @cached_property
    def slope(self) -> float:
        """Slope of the least-squares line through the samples that exist, per sample."""
        return slope(self.values, self.parts)

    def edges(self, level: int) -> IntArray:
        """Runs of samples that exist or are filled for a level, (P, 2)."""
        if self.filling is None or not self.filled[level]:
            return self.runs.edges
        return self.filling.gaps.joined(self.averaging[level])

    @property
    def width(self) -> FloatArray:
        """Number of samples in a coefficient, (J,)."""
        if self.wavelet == "haar":
            return 2.0 * self.averaging
        kind = known_wavelet(self.wavelet)
        return np.array([kind.width(j + 1) for j in range(self.averaging.size)], dtype=float)

    @cached_property
    def counts(self) -> FloatArray:
        """Number of coefficients, (J,)."""
        return np.array([window_count(self.edges(j), width) for j, width in enumerate(self.width)])

    def effects(self) -> GapEffects | None:
        """What the gaps do to the variances; ``None`` for a complete series."""
        n = self.runs.n
        if self.runs.is_complete:
            return None
        widths = self.width
        centres = [window_centres(self.edges(j), int(width)) for j, width in enumerate(widths)]
        if self.wavelet == "haar":
            pairs = zip(centres, self.averaging.astype(int).tolist(), strict=True)
            growth = np.array([pair_factor(own, m, n) for own, m in pairs])
        else:
            growth = (n - widths + 1.0) / self.counts
        deviation = np.sqrt(growth) * (1.0 + self.error)
        inflation = np.outer(deviation, deviation) * common_share(centres, widths, n)
        return GapEffects(n - self.runs.present, self.counts, self.change, inflation)

    @cached_property
    def _integral(self) -> FloatArray:
        """Cumulative sum of the series without filled gaps."""
        return cumulative(self.values, 0.0)

    def _series(self) -> Iterator[tuple[IntArray, FloatArray, FloatArray]]:
        """Levels in groups, the series that they are made of, and its cumulative sum."""
        if self.filling is None:
            yield np.arange(self.averaging.size), self.values, self._integral
            return
        series = self.filling.series(self.values, self._integral, self.averaging, self.slope)
        for levels, values, integral in series:
            for own in np.split(levels, np.flatnonzero(np.diff(self.filled[levels])) + 1):
                if own.size and self.filled[own[0]]:
                    yield own, values, integral
                elif own.size:
                    yield own, self.values, self._integral

    def moments(self) -> FloatArray:
        """Mean and mean square of each level's coefficients, (J, 2)."""
        if self.wavelet != "haar":
            return np.array([(np.mean(w), np.mean(w * w)) for w in self.coefficients()])
        found = [
            haar_moments(values, integral, self.edges(int(levels[0])), self.averaging[levels])
            for levels, values, integral in self._series()
        ]
        return np.concatenate([np.zeros((0, 2)), *found])

    def coefficients(self, *, level: bool = False) -> Iterator[FloatArray]:
        """The coefficients of each level, over all runs; without the series' line if ``level``."""
        line = self.slope * np.arange(self.runs.n) if level else 0.0
        if self.wavelet != "haar":
            number = self.averaging.size
            parts = [
                coefficients((self.values - line)[a:b], self.wavelet, number)
                for a, b in self.runs.edges
            ]
            for _ in range(number):
                yield np.concatenate([next(part, np.zeros(0)) for part in parts])
            return
        for levels, values, integral in self._series():
            own = cumulative(values - line, 0.0) if level else integral
            for j in levels:
                m = int(self.averaging[j])
                yield np.concatenate([haar_coefficients(own, a, b, m) for a, b in self.edges(j)])

    def driftless(self, moments: FloatArray) -> FloatArray:
        """Expected variances without the filling and without the least-squares line, (J,)."""
        step = 0.5 * self.slope * self.averaging
        return np.asarray(
            (moments[:, 1] - 2.0 * step * moments[:, 0] + step**2) / (1.0 + self.change)
        )

    def unfilled(self, moments: FloatArray) -> FloatArray:
        """Variances without what filling added, (J,); it took nothing from a drift."""
        if not np.any(self.change):
            return moments[:, 1]
        return moments[:, 1] - self.change * self.driftless(moments)

    def block_means(self) -> tuple[FloatArray, int]:
        """Means of blocks, NaN where a gap is not filled for the coarsest level, and their size."""
        values, integral = self.values, self._integral
        if self.filling is not None and self.filled[-1]:
            coarsest = self.averaging[-1:]
            *_, (_, values, integral) = self.filling.series(values, integral, coarsest, self.slope)
        n = self.runs.n
        whole = self.runs.is_complete or not np.any(np.isnan(values))
        most = tuning.MOST_BLOCKS if whole else tuning.MOST_BLOCKS_WITH_GAPS
        block = -(-n // most)
        end = (n // block) * block
        means = np.diff(integral[: end + 1 : block]) / block
        if not whole:
            means[np.any(np.isnan(values[:end]).reshape(-1, block), axis=1)] = np.nan
        return means, block
