"""Does a filter know how good it is? NEES, coverage, innovations, and a proper score.

After Bar-Shalom, Li & Kirubarajan (2001), *Estimation with Applications to Tracking and
Navigation*, sec. 5.4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv

from gmwm._core.distributions import chi2, norm, student as t
from gmwm._core.typing import BoolArray, FloatArray, IntArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.simulation.filter_errors import GROUPS, FilterErrors

LEVELS = (0.5, 0.68, 0.95, 0.997)  # at which coverage is counted
_UPPER = 0.5 + 0.5 * tuning.CONFIDENCE
_UNKNOWN = (float("nan"),) * 3


@dataclass(frozen=True)
class Ratio:
    """A statistic that is 1 for a consistent filter.

    lower, upper: Band of 95 % in which it lies if the filter is consistent.
    p_value: Two-sided probability of a value as far from 1, if it is.
    """

    value: float
    lower: float
    upper: float
    p_value: float

    @property
    def within(self) -> bool:
        """Whether it lies in its band."""
        return bool(self.lower <= self.value <= self.upper)


@dataclass(frozen=True)
class Coverage:
    """Fraction of the errors within the predicted interval of a level.

    lower, upper: Interval of 95 % of the fraction: binomial at one epoch (Clopper & Pearson 1934,
        *Biometrika* 26, 404-413), and over a time with as many draws as the scatter between the
        runs is worth (Korn & Graubard 1998, *Survey Methodology* 24, 193-201).
    """

    level: float
    fraction: float
    lower: float
    upper: float

    @property
    def within(self) -> bool:
        """Whether the interval holds the level."""
        return bool(self.lower <= self.level <= self.upper)


@dataclass(frozen=True)
class Consistency:
    """How a filter's own covariance agrees with its true errors.

    Attributes
    ----------
    nees : dict
        Group of `GROUPS`, or "sensors", -> NEES per degree of freedom.
    coverage : dict
        Group -> `Coverage` at each of `LEVELS`, of its components' errors.
    rms : dict
        Group -> root mean square of the errors in their predicted standard deviations.
    score : dict
        Group -> mean of the negative logarithm of the predicted density at the truth; less is
        better, and to predict too much or too little costs alike (Gneiting & Raftery 2007, *JASA*
        102, 359-378).
    """

    nees: dict[str, Ratio]
    coverage: dict[str, tuple[Coverage, ...]]
    rms: dict[str, float]
    score: dict[str, float]

    @property
    def consistent(self) -> bool:
        """Whether no group's NEES contradicts the filter."""
        level = tuning.CONTRADICTED / len(self.nees)
        return all(ratio.p_value > level for ratio in self.nees.values())


def at_epoch(runs: FilterErrors, index: int) -> Consistency:
    """Consistency at one epoch (`FilterErrors.index`) over independent runs: chi-square bands."""
    alive = np.isfinite(runs.error[:, index, 0])
    return _consistency(runs, alive, np.array([index]), single=True)


def over_time(runs: FilterErrors, start: float = 0.0, end: float = np.inf) -> Consistency:
    """Consistency over a time, s, averaged run by run: bands from the scatter between the runs.

    The errors of one run are correlated, so that a run counts as one draw; Student's t.

    Raises InputError if no errors were kept in that time.
    """
    epochs = np.flatnonzero((runs.time >= start) & (runs.time <= end) & ~runs.before)
    if not epochs.size:
        raise InputError(
            f"no errors were kept from {start:g} s to {end:g} s: give a longer time, within "
            f"{runs.time[0]:g} s to {runs.time[-1]:g} s"
        )
    alive = np.all(np.isfinite(runs.error[:, epochs, 0]), axis=1)
    return _consistency(runs, alive, epochs, single=False)


def _consistency(
    runs: FilterErrors, alive: BoolArray, epochs: IntArray, *, single: bool
) -> Consistency:
    """Consistency of some runs at one epoch, or over several."""
    result = Consistency({}, {}, {}, {})

    def judge(name: str, squares: FloatArray, standard: FloatArray, size: int) -> None:
        if single:
            result.nees[name] = chi_square_ratio(squares, size)
        else:
            result.nees[name] = mean_ratio(np.mean(squares, axis=1) / size)
        result.coverage[name] = coverage_of(standard, single)
        result.rms[name] = float(np.sqrt(np.mean(standard**2))) if standard.size else float("nan")

    for i, (name, part) in enumerate(GROUPS.items()):
        size = part.stop - part.start
        squares = runs.nees[alive][:, epochs, i]
        error, sd = runs.error[alive][:, epochs, part], runs.sd[alive][:, epochs, part]
        judge(name, squares, error / sd, size)
        densities = squares + runs.log_det[alive][:, epochs, i] + size * np.log(2.0 * np.pi)
        result.score[name] = float(0.5 * np.mean(densities)) if squares.size else float("nan")
    settled = epochs[np.all(np.isfinite(runs.sensor_nees[alive][:, epochs]), axis=0)]
    if np.any(alive) and settled.size:
        # Only sensors that have states.
        error, sd = runs.sensor_error[alive][:, settled], runs.sensor_sd[alive][:, settled]
        known = np.all(sd > 0.0, axis=(0, 1))
        standard = np.asarray(error[..., known] / sd[..., known])
        judge("sensors", runs.sensor_nees[alive][:, settled], standard, int(np.sum(known)))
    return result


@dataclass(frozen=True)
class InnovationTest:
    """What a filter can be asked where no truth is known.

    nis: Normalised innovation squared per degree of freedom.
    whiteness: p-value of no correlation from one fix to the next.
    """

    nis: Ratio
    whiteness: float

    def __str__(self) -> str:
        mark = " " if self.nis.within else "*"
        band = f"(band {self.nis.lower:.4f} .. {self.nis.upper:.4f})"
        return f"{self.nis.value:>8.5g}{mark} {band}, p = {self.whiteness:.2g}"


def innovation_test(runs: FilterErrors) -> InnovationTest:
    """Innovations of all runs: their size and their whiteness."""
    total, count = np.nansum(runs.nis, axis=0)
    scores = runs.whiteness[np.isfinite(runs.whiteness)]
    p_value = float("nan")
    if scores.size:
        p_value = float(2.0 * norm.sf(abs(np.sum(scores)) / np.sqrt(scores.size)))
    return InnovationTest(_ratio(total, count), p_value)


def chi_square_ratio(squares: FloatArray, size: int) -> Ratio:
    """Mean of independent normalised errors squared of ``size`` degrees of freedom each."""
    return _ratio(float(np.sum(squares)), float(size * squares.size))


def _ratio(total: float, dof: float) -> Ratio:
    if not dof > 0.0 or not np.isfinite(total):
        return Ratio(float("nan"), *_UNKNOWN)
    lower, upper = chi2.ppf([1.0 - _UPPER, _UPPER], dof) / dof
    p_value = 2.0 * min(chi2.sf(total, dof), chi2.cdf(total, dof))
    return Ratio(float(total / dof), float(lower), float(upper), float(min(p_value, 1.0)))


def mean_ratio(values: FloatArray) -> Ratio:
    """Mean of independent values whose expectation is 1, of a distribution that is not known."""
    runs = values.size
    mean = float(np.mean(values)) if runs else float("nan")
    if runs < 2:
        return Ratio(mean, *_UNKNOWN)
    error = float(np.std(values, ddof=1) / np.sqrt(runs))
    width = float(t.ppf(_UPPER, runs - 1)) * error
    p_value = float(2.0 * t.sf(abs(mean - 1.0) / error, runs - 1)) if error > 0.0 else float("nan")
    return Ratio(mean, max(1.0 - width, 0.0), 1.0 + width, p_value)


def serial_ratio(standard: FloatArray) -> Ratio:
    """Mean square of uncorrelated errors of one run in their standard deviations, (K, d).

    Squares of Gaussian errors are correlated in time as the squares of the errors' correlations
    are, which leave so many degrees of freedom. They are taken about zero, so that an error that
    stays counts once, relative to its size, so that a wrong size is seen, and up to the first lag
    without any (Geyer 1992, *Stat. Sci.* 7, 473-483).
    """
    count, size = standard.shape
    power = np.abs(np.fft.rfft(standard, 2 * count, axis=0)) ** 2
    correlation = np.fft.irfft(power, axis=0)[:count]
    correlation /= np.maximum(correlation[0], np.finfo(float).tiny)
    until = np.logical_and.accumulate(correlation > 0.0, axis=0)
    share = 1.0 - np.arange(count) / count
    times = 2.0 * np.sum((until * correlation**2).T / share, axis=1) - 1.0
    dof = size**2 * count / float(np.sum(times))
    return _ratio(dof * float(np.mean(standard**2)), dof)


def coverage_of(standard: FloatArray, single: bool) -> tuple[Coverage, ...]:
    """Coverage of standardised errors (R, K, d).

    single: Whether K is 1: each run is a draw, since components are correlated; else the error is
        the scatter between runs.
    """
    runs, result = len(standard), []
    for level in LEVELS:
        each = np.mean(np.abs(standard) < norm.ppf(0.5 + 0.5 * level), axis=(1, 2))
        mean, draws = float(np.mean(each)) if runs else float("nan"), float(runs)
        error = float(np.var(each, ddof=1)) / runs if runs > 1 and not single else 0.0
        if error > 0.0:
            few, many = t.ppf(_UPPER, [max(runs - 1, 1), standard.size - 1])
            draws = min(mean * (1.0 - mean) / error, float(standard.size)) * (many / few) ** 2
        lower = upper = float("nan")
        if draws > 0.0:
            hits, tail = mean * draws, 1.0 - _UPPER
            lower = float(betaincinv(hits, draws - hits + 1.0, tail)) if hits > 0.0 else 0.0
            upper = float(betaincinv(hits + 1.0, draws - hits, 1.0 - tail)) if hits < draws else 1.0
        result.append(Coverage(level, mean, lower, upper))
    return tuple(result)
