"""The series as each level sees it: which samples exist or are filled, and the coefficients."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gmwm._core.typing import FloatArray, IntArray
from gmwm.process import wavelet as known_wavelet
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
from gmwm.variance.pilot import pilot_psd

_ROW = 1 << FINE


def haar_moments(
    values: FloatArray, integral: FloatArray, runs: IntArray, averaging: FloatArray
) -> FloatArray:
    """Mean and mean square of the Haar MODWT coefficients that lie within a run, (L, 2).

    values: (n,), about their mean.
    integral: (n + 1,), their cumulative sum, starting with 0.
    runs: (P, 2), first sample of each run, and the one after its last.
    averaging: (L,), averaging times in samples: powers of two in a row, of each of which a window
        fits a run.
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

    number, total, square = np.sum(_in_threads(of_part, values.size), axis=0).T
    return np.stack([total, square], axis=1) / number[:, None]


def _in_threads(work: Callable[[int, int], FloatArray], n: int) -> list[FloatArray]:
    """What each part gives; a short series is one part."""
    parts = min(_processors(), n // tuning.SAMPLES_PER_THREAD)
    if parts < 2:
        return [work(0, 1)]
    with ThreadPoolExecutor(parts) as pool:
        return list(pool.map(work, range(parts), [parts] * parts))


def _processors() -> int:
    """Those that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True, eq=False)
class Levels:
    """The levels of a series, gaps included.

    values: (n,), about their mean; NaN where samples are missing.
    runs: The samples that exist.
    averaging: (J,), averaging times, in samples, of the levels with a coefficient.
    filling: How short gaps are filled; ``None`` where none are.
    change: (J,), of the expected variances by filling, relative.
    error: (J,), wavelet variances of the error of the filling, relative.
    filled: (J,) of bool, levels for which gaps are filled.
    parts: (P,), where the series begins anew with another level; its line has one level in each
        part.
    """

    values: FloatArray
    runs: Runs
    averaging: FloatArray
    wavelet: str
    filling: Filling | None
    change: FloatArray
    error: FloatArray
    filled: NDArray[np.bool_]
    parts: IntArray = field(default_factory=lambda: np.zeros(1, dtype=np.int64))

    @classmethod
    def of(cls, values: FloatArray, runs: Runs, wavelet: str, dt: float) -> Levels:
        """Those with a coefficient; of a Haar wavelet, with short gaps filled."""
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

    def _apart(self, gaps: Gaps, dt: float) -> NDArray[np.bool_]:
        """Gaps that the level changes in, judged by what the series is between them."""
        between = replace(self, parts=self.runs.edges[:, 0])
        variance = between._pilot_variance(0)
        known = self.averaging[: variance.size]
        psd = pilot_psd(variance, known, dt)
        return levels_apart(gaps, self.values, between.slope, psd, dt, float(known[-1]))

    def _pilot_variance(self, start: int) -> FloatArray:
        """Variances without the drift of the levels from ``start`` on that are well known.

        One at least of the finest.
        """
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

        The averaging time over the number of windows goes with the relative sampling variance.
        Where that of the fine levels, ``scarcity``, makes the change known worse than the level
        itself, as where hardly two samples follow each other, the level is not filled.
        """
        psd = pilot_psd(variance, self.averaging[: variance.size], dt)
        filling = Filling.under(psd, dt, gaps)
        found = replace(self, filling=filling)
        change, error = filling.change(self.averaging)
        own = self.averaging / np.maximum(found.counts, 1.0)
        filled = np.abs(change) <= tuning.LARGEST_CHANGE
        filled &= change**2 * scarcity <= (1.0 + change) ** 2 * own
        # Of the coarsest levels the pilot knows too little to decide anew.
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
        """Of the least-squares line through the samples that exist, per sample."""
        return slope(self.values, self.parts)

    # -- what exists -------------------------------------------------------------------------------

    def edges(self, level: int) -> IntArray:
        """Runs of samples that exist or are filled for a level, (P, 2)."""
        if self.filling is None or not self.filled[level]:
            return self.runs.edges
        return self.filling.gaps.joined(self.averaging[level])

    @property
    def width(self) -> FloatArray:
        """Number of samples that a coefficient is made of, (J,)."""
        if self.wavelet == "haar":
            return 2.0 * self.averaging
        kind = known_wavelet(self.wavelet)
        return np.array([kind.width(j + 1) for j in range(self.averaging.size)], dtype=float)

    @cached_property
    def counts(self) -> FloatArray:
        """Number of coefficients, (J,)."""
        pairs = enumerate(self.width)
        return np.array([window_count(self.edges(j), width) for j, width in pairs])

    def effects(self) -> GapEffects | None:
        """What the gaps do to the variances; ``None`` of a complete series."""
        n = self.runs.n
        if self.runs.is_complete:
            return None
        widths = self.width
        centres = [window_centres(self.edges(j), int(width)) for j, width in enumerate(widths)]
        if self.wavelet == "haar":
            averaging = self.averaging.astype(int).tolist()
            pairs = zip(centres, averaging, strict=True)
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

    # -- coefficients ------------------------------------------------------------------------------

    def _series(self) -> Iterator[tuple[NDArray[np.intp], FloatArray, FloatArray]]:
        """Levels, the series that they are made of, and its cumulative sum."""
        if self.filling is not None:
            yield from self.filling.series(self.values, self.averaging, self.slope)
            return
        yield np.arange(self.averaging.size), self.values, self._integral

    def moments(self) -> FloatArray:
        """Mean and mean square of each level's coefficients, (J, 2)."""
        if self.wavelet != "haar":
            return np.array([(np.mean(w), np.mean(w * w)) for w in self.coefficients()])
        found = [np.zeros((0, 2))]
        plain = None
        for levels, values, integral in self._series():
            plain = integral if plain is None else plain
            # Neighbours that are made of the same series, all together.
            for own in np.split(levels, np.flatnonzero(np.diff(self.filled[levels])) + 1):
                if own.size:
                    series = (values, integral) if self.filled[own[0]] else (self.values, plain)
                    edges = self.edges(int(own[0]))
                    found.append(haar_moments(*series, edges, self.averaging[own]))
        return np.concatenate(found)

    def coefficients(self, *, level: bool = False) -> Iterator[FloatArray]:
        """The coefficients of each level, over all runs; without the series' line if ``level``."""
        line = self.slope * np.arange(self.runs.n) if level else 0.0
        if self.wavelet != "haar":
            yield from self._other_coefficients(self.values - line)
            return
        plain = None
        for levels, values, integral in self._series():
            there = cumulative(values - line, 0.0) if level else integral
            plain = there if plain is None else plain
            for j in levels:
                m = int(self.averaging[j])
                own = there if self.filled[j] else plain
                yield np.concatenate([haar_coefficients(own, a, b, m) for a, b in self.edges(j)])

    def _other_coefficients(self, values: FloatArray) -> Iterator[FloatArray]:
        from gmwm.variance.modwt import coefficients

        number = self.averaging.size
        series = [coefficients(values[a:b], self.wavelet, number) for a, b in self.runs.edges]
        for _ in range(number):
            yield np.concatenate([next(part, np.zeros(0)) for part in series])

    # -- what is made of them ----------------------------------------------------------------------

    def driftless(self, moments: FloatArray) -> FloatArray:
        """Expected variances without the filling and without the least-squares line, (J,)."""
        step = 0.5 * self.slope * self.averaging
        return np.asarray(
            (moments[:, 1] - 2.0 * step * moments[:, 0] + step**2) / (1.0 + self.change)
        )

    def unfilled(self, moments: FloatArray) -> FloatArray:
        """Variances without what filling added; it took nothing from a drift, (J,)."""
        if not np.any(self.change):
            return moments[:, 1]
        return moments[:, 1] - self.change * self.driftless(moments)

    def block_means(self) -> tuple[FloatArray, int]:
        """Means of blocks, NaN where a gap is not filled for the coarsest level, and their size."""
        values, integral = self._coarsest()
        n = self.runs.n
        whole = self.runs.is_complete or not np.any(np.isnan(values))
        most = tuning.MOST_BLOCKS if whole else tuning.MOST_BLOCKS_WITH_GAPS
        block = -(-n // most)
        end = (n // block) * block
        means = np.diff(integral[: end + 1 : block]) / block
        if not whole:
            means[np.any(np.isnan(values[:end]).reshape(-1, block), axis=1)] = np.nan
        return means, block

    def _coarsest(self) -> tuple[FloatArray, FloatArray]:
        """The series that the coarsest level is made of, and its cumulative sum."""
        if self.filling is None or not self.filled[-1]:
            return self.values, self._integral
        *_, (_, values, integral) = self.filling.series(
            self.values, self.averaging[-1:], self.slope
        )
        return values, integral
