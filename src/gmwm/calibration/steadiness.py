"""Find slow noise that changes its size during a record.

A model is an average over the record: it fits even where a random walk begins halfway, but
describes no part of it. `gmwm.health` checks the fast noise by prediction errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import eigh, toeplitz

from gmwm._core.distributions import chi2
from gmwm._core.text import brief
from gmwm._core.typing import FloatArray, IntArray
from gmwm.calibration import tuning
from gmwm.estimate import Fit
from gmwm.estimate.problem import Scales, difference_covariance
from gmwm.issues import Notice, Severity, notice
from gmwm.process import PSD, Model
from gmwm.variance import WaveletVariance

if TYPE_CHECKING:
    from gmwm.calibration.departures import Departure


@dataclass(frozen=True, eq=False)
class Means:
    """Means of blocks."""

    blocks: FloatArray  # (B,), NaN where samples are missing, u
    samples: int  # in a block
    dt: float  # s

    @classmethod
    def of(cls, wv: WaveletVariance, most: int) -> Means:
        """Block means of a series, at most so many."""
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
        """Length of all blocks, s."""
        return self.blocks.size * self.step

    @cached_property
    def first(self) -> IntArray:
        """Blocks that exist, but for the last."""
        return np.flatnonzero(~np.isnan(self.blocks))[:-1]

    @property
    def time(self) -> FloatArray:
        """Middles of the blocks, s, (B,)."""
        return np.asarray(self.step * (np.arange(self.blocks.size) + 0.5), dtype=float)

    def without(self, curves: Sequence[FloatArray]) -> Means:
        """Less curves, each (B,), by least squares."""
        there = ~np.isnan(self.blocks)
        rows = np.vstack([np.ones(self.blocks.size), *curves])
        sizes = np.linalg.lstsq(rows[:, there].T, self.blocks[there], rcond=None)[0]
        return replace(self, blocks=self.blocks - sizes @ rows)

    def parts(self, count: int) -> list[Means]:
        """Split into parts of equal length."""
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
        """Differences of each block that exists and the next that does, (..., B) to (..., D)."""
        there = ~np.isnan(self.blocks)
        return np.asarray(np.diff(curves[..., there], axis=-1))

    def covariance(self, spectrum: PSD) -> FloatArray:
        """Covariance of these differences under a spectrum, (D, D), u^2."""
        column = difference_covariance(spectrum, self.dt, self.samples, self.blocks.size)
        last = int(np.flatnonzero(~np.isnan(self.blocks))[-1])
        whole = toeplitz(column[:last])
        # One across missing blocks is the sum of those of neighbours.
        return np.asarray(np.add.reduceat(np.add.reduceat(whole, self.first), self.first, axis=1))


def steadiness_notice(
    fitted: Fit, wv: WaveletVariance | None = None, known: Sequence[Departure] = ()
) -> Notice | None:
    """Say that the slow noise is larger in some parts of a record than in others, if so.

    The record is divided into 8, 4 and 2 parts. Of the differences between block means of each, the
    weighted mean square is taken whose weights are best for small changes of what is above the
    flat floor of the spectrum, and one of what is far above it, where changes are large. If the
    noise is Gaussian and stationary, these are about chi-square distributed with degrees of freedom
    that follow from the weights, and alike, which Bartlett's test decides (1937, *Proc. R. Soc. A*
    160, 268-282), for all divisions and weights together. The model gives the weights only: that
    it misses the size of the noise does no harm.

    wv: The recording, where the fit is one of several.
    known: What was found beside the noise, which is subtracted.
    """
    data = wv or fitted.wv
    noise = tuple(term for term in fitted.model.terms if not term.is_drift)
    if not noise:
        return None
    psd = Scales.of(data).spectrum(Model(noise))
    lines = [frequency for frequency, _ in Model(noise).lines()]
    tests: list[_Test] = []
    for count in tuning.DIVISIONS:
        means = Means.of(data, count * tuning.MEANS_OF_PART)
        tests += _tests(_rest(means, lines, known), psd, count)
    if not tests:
        return None
    clearest = min(tests, key=lambda test: test.p_value)
    if clearest.p_value * len(tests) > tuning.FALSE_ALARM or clearest.excess < tuning.UNSTEADY:
        return None
    return _notice(clearest)


def _rest(means: Means, lines: Sequence[float], known: Sequence[Departure]) -> Means:
    """Without sines of such frequencies (Hz) and without departures, whose places are missing."""
    blocks, time = means.blocks.copy(), means.time
    for each in known:
        if each.kind == "step":
            place = (each.time[1] - 0.5 * means.step, each.time[2] + 0.5 * means.step)
            blocks[(time > place[0]) & (time < place[1])] = np.nan
    phases = 2.0 * np.pi * np.outer(lines, time)
    curves = [*np.sin(phases), *np.cos(phases), *(each.curve(time) for each in known)]
    return replace(means, blocks=blocks).without(curves)


@dataclass(frozen=True, eq=False)
class _Test:
    """Sizes of the slow noise in P parts of a record."""

    sizes: FloatArray  # (P,), mean squares over that of all; NaN where most is missing
    freedom: FloatArray  # (P,), degrees of freedom
    length: float  # of a part, s

    @cached_property
    def p_value(self) -> float:
        """Chance that stationary noise has sizes as different (Bartlett)."""
        known = ~np.isnan(self.sizes)
        sizes, freedom = self.sizes[known], self.freedom[known]
        total, more = np.sum(freedom), sizes.size - 1
        statistic = total * np.log(freedom @ sizes / total) - freedom @ np.log(sizes)
        correction = 1.0 + (np.sum(1.0 / freedom) - 1.0 / total) / (3.0 * more)
        return float(chi2.sf(statistic / correction, more))

    @cached_property
    def deviations(self) -> FloatArray:
        """Over that of all, without what chance spreads them, (P,)."""
        total = float(np.nanvar(self.sizes, ddof=1))
        added = max(total - float(np.nanmean(2.0 / self.freedom)), 0.0)
        shrunk = 1.0 + np.sqrt(added / total) * (self.sizes - 1.0)
        return np.asarray(np.sqrt(np.maximum(shrunk, np.nanmin(self.sizes))))

    @property
    def excess(self) -> float:
        """By how much the deviation of all is above that of the quiet quarter of the parts."""
        return float(1.0 / np.nanquantile(self.deviations, 0.25)) - 1.0


def _tests(means: Means, psd: PSD, count: int) -> list[_Test]:
    """Tests of a division into parts, with all weights that leave enough degrees of freedom."""
    floor = means.floor(psd)
    parts = means.parts(count)
    if floor == 0.0 or parts[0].blocks.size < tuning.FEWEST_DIFFERENCES:
        return []
    gains: dict[bytes, tuple[FloatArray, FloatArray]] = {}
    found = np.full((2, len(tuning.POWERS), count), np.nan)
    for i, part in enumerate(parts):
        there = ~np.isnan(part.blocks)
        if np.count_nonzero(there) < tuning.LEAST_OF_PART * there.size:
            continue
        if (pattern := there.tobytes()) not in gains:
            gains[pattern] = _gains(part, psd, floor)
        gain, directions = gains[pattern]
        square = (part.differences(part.blocks) @ directions) ** 2
        for k, power in enumerate(tuning.POWERS):
            weight = gain**power
            total = float(np.sum(weight))
            if total > 0.0:
                found[:, k, i] = weight @ square / total, total**2 / float(weight @ weight)
    sizes, freedom = found
    known = ~np.isnan(sizes)
    used = (np.sum(known, axis=1) > 1) & np.all((freedom >= tuning.FEWEST_FREEDOM) | ~known, axis=1)
    length = parts[0].length
    return [
        _Test(each / (np.nansum(each * nu) / np.nansum(nu)), nu, length)
        for each, nu in zip(sizes[used], freedom[used], strict=True)
        if np.nanmin(each) > 0.0
    ]


def _gains(part: Means, psd: PSD, floor: float) -> tuple[FloatArray, FloatArray]:
    """Share of the variance above the floor in independent directions, and these directions.

    Returns: (D,) and (D, D); the differences have a variance of one in each direction.
    """
    whole = part.covariance(psd)
    slow = whole - floor * part.covariance(lambda f, _: np.ones_like(f))
    whole += tuning.NO_INFORMATION * float(np.mean(np.diag(whole))) * np.eye(len(whole))
    gain, directions = eigh(slow, whole)
    gain = np.where(gain > tuning.NO_SLOW_PART, gain, 0.0)
    return np.asarray(gain), np.asarray(directions)


def _notice(test: _Test) -> Notice:
    low, high = int(np.nanargmin(test.deviations)), int(np.nanargmax(test.deviations))
    quiet, loud = (float(test.deviations[i]) for i in (low, high))
    quiet_part, loud_part = (
        f"from {i * test.length:.4g} s to {(i + 1) * test.length:.4g} s" for i in (low, high)
    )
    values = {"excess": test.excess, "p_value": test.p_value, "quiet": quiet, "loud": loud}
    values |= {"start": high * test.length, "stop": (high + 1) * test.length}
    severity: Severity = "bad" if loud > tuning.HARMFUL_UNSTEADY * quiet else "warning"
    words = {"quiet_part": quiet_part, "loud_part": loud_part}
    words |= {"less": brief(quiet), "more": brief(loud)}
    return notice("unsteady", "", values, severity=severity, **words)
