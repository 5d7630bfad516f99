"""Allan variances of one IMU from its differences to others, and models that cover them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.optimize import linprog
from scipy.stats import t as student

from gmwm._core.typing import FloatArray, IntArray
from gmwm.motion import tuning
from gmwm.process import Model, Process, QuantizationNoise, RandomWalk, WhiteNoise


@dataclass(frozen=True)
class Curves:
    """Those of `MotionCurve` for the three axes of a sensor.

    variance, lower, upper, agree: (3, J). The lower end of a negative variance is zero.
    pairs, differences: (P, 3, J) and (K - 1, 3, J).
    exponent, exponent_error: (J,), of the axes together.
    """

    tau: FloatArray
    variance: FloatArray
    lower: FloatArray
    upper: FloatArray
    pairs: FloatArray
    differences: FloatArray
    agree: FloatArray
    exponent: FloatArray
    exponent_error: FloatArray


@dataclass(frozen=True)
class Flight:
    """Differences (n, 3) of a target to each other IMU, and its vibration (n,), m/s^2 rms.

    vibration: NaN where it is not known.
    absorbed: (K - 1, J, 3), share of the variance that the fit of each mapping takes, by octave;
        None where nothing is fitted.
    """

    differences: Sequence[FloatArray]
    vibration: FloatArray
    absorbed: FloatArray | None = None

    def within(self, low: float, high: float) -> Flight:
        """With a vibration of zero where it is not within limits: such instants do not count."""
        is_in = (self.vibration >= low) & (self.vibration < high)
        return replace(self, vibration=np.where(is_in, self.vibration, 0.0))


@dataclass(frozen=True)
class _Blocks:
    """Mean products of Haar coefficients over blocks of time.

    products: (B, P, 3).
    weights: (B,), share of the coefficients.
    flight: (B,), whose block it is.
    vibration: (B,), m/s^2 rms.
    powers: (K - 1, 3), mean squares of the coefficients of each difference.
    length: Of a block, in averaging times.
    """

    products: FloatArray
    weights: FloatArray
    flight: IntArray
    vibration: FloatArray
    powers: FloatArray
    length: float

    @classmethod
    def of(cls, flights: Sequence[Flight], octave: int, dt: float) -> _Blocks:
        """In blocks of four averaging times. What fits took is given back."""
        m, count = 2**octave, len(flights[0].differences)
        pairs = list(combinations(range(count), 2)) or [(0, 0)]
        block = max(tuning.BLOCK_LEVELS * m, tuning.BLOCK_LEAST / dt)
        parts: list[tuple[FloatArray, ...]] = []
        powers = np.zeros((count, 3))
        for number, flight in enumerate(flights):
            coefficients = [haar(each, m) for each in flight.differences]
            if flight.absorbed is not None:
                left = np.sqrt(1.0 - flight.absorbed[:, octave])
                coefficients = [c / share for c, share in zip(coefficients, left, strict=True)]
            level = flight.vibration[m : m + len(coefficients[0])]
            used = (level != 0.0)[:, None]
            powers += [np.sum(used * each**2, axis=0) for each in coefficients]
            products = np.stack(
                [0.5 * used * coefficients[a] * coefficients[b] for a, b in pairs], axis=1
            )
            n = len(level)
            starts = np.linspace(0, n, min(max(2, int(n / block)), n) + 1).astype(int)[:-1]
            counts = np.add.reduceat(used[:, 0].astype(float), starts)
            each = np.maximum(counts, 1.0)
            means = np.add.reduceat(products, starts) / each[:, None, None]
            rms = np.sqrt(np.add.reduceat(level**2, starts) / each)
            parts.append((means, counts, np.full(counts.size, number), rms))
        columns = [np.concatenate(each) for each in zip(*parts, strict=True)]
        kept = columns[1] > 0.0
        products, counts, own, rms = (each[kept] for each in columns)
        total = max(counts.sum(), 1.0)
        weights = counts / total
        return cls(products, weights, own.astype(int), rms, 0.5 * powers / total, block / m)

    @cached_property
    def units(self) -> tuple[FloatArray, FloatArray]:
        """(n, P, 3) and (n,) means and weights of flights where there are many, else of blocks."""
        flights = np.unique(self.flight)
        if flights.size < tuning.FEWEST_FLIGHTS:
            return self.products, self.weights
        is_of = (self.flight == flights[:, None]) * self.weights
        weights = is_of.sum(axis=1)
        return np.tensordot(is_of / weights[:, None], self.products, 1), weights

    def error(self, values: FloatArray) -> FloatArray:
        """Standard error of the mean of values of units, the first axis.

        Coefficients reach over the ends of blocks: of white noise, the sum of the variances of
        blocks of L averaging times is 1 - 1/(2 L) of that of the whole.
        """
        share, n = self.units[1], len(self.units[1])
        away = values - np.tensordot(share, values, 1)
        apart = 1.0 if n < len(self.weights) else 1.0 - 0.5 / self.length
        variance = np.tensordot(share**2, away**2, 1) * n / (max(n - 1, 1) * apart)
        return np.asarray(np.sqrt(variance))

    def exponent(self, variance: FloatArray) -> tuple[float, float]:
        """Exponent of the vibration in the deviation, and half of its 95 % interval.

        Least squares in logarithms, by flights where there are many: blocks of one share a level.
        """
        relative = self.products.mean(axis=1) / np.where(variance > 0.0, variance, np.nan)
        power = np.nanmean(relative, axis=1) if np.any(variance > 0.0) else np.zeros(0)
        used = (power > 0.0) & (self.vibration > 0.0) if power.size else np.zeros(0, dtype=bool)
        if np.count_nonzero(used) < tuning.FEWEST_BLOCKS:
            return np.nan, np.nan
        y, x = 0.5 * np.log(power[used]), np.log(self.vibration[used])
        x = x - x.mean()
        slope = float(x @ y / (x @ x))
        score = x * (y - y.mean() - slope * x)
        groups, by_group = np.unique(self.flight[used], return_inverse=True)
        if groups.size >= tuning.FEWEST_FLIGHTS:
            score = np.bincount(by_group, score)
        reach = student.ppf(0.975, score.size - 2) * np.sqrt(score.size / (score.size - 2))
        return slope, float(reach * np.sqrt(score @ score) / (x @ x))


def haar(values: FloatArray, m: int) -> FloatArray:
    """Difference of means over m samples and over the m before, at each sample: (n - 2m + 1, 3)."""
    total = np.cumsum(np.vstack([np.zeros((1, values.shape[1])), values]), axis=0)
    return np.asarray((total[2 * m :] - 2.0 * total[m:-m] + total[: -2 * m]) / m)


def curves_of(flights: Sequence[Flight], dt: float, longest: int) -> Curves:
    """Curves of a target.

    longest: Samples of the longest flight, as all targets have them.

    The Allan variance at an octave is half the mean, over pairs of others and over time, of the
    product of Haar coefficients of two differences: only the target's own errors are in both.
    Means over blocks of four averaging times, or over flights where there are five or more, are
    the unit of the interval (Student's t on the logarithm): motion is not stationary.
    """
    octaves = int(np.log2(max(1, longest // tuning.WINDOWS)))
    rows = []
    for k in range(octaves + 1):
        long = [each for each in flights if len(each.vibration) >= tuning.WINDOWS * 2**k]
        rows.append(_octave(_Blocks.of(long, k, dt)))
    columns = [np.stack(each, axis=-1) for each in zip(*rows, strict=True)]
    tau = np.asarray(dt * 2.0 ** np.arange(octaves + 1), dtype=float)
    return Curves(tau, *columns)


def _octave(blocks: _Blocks) -> tuple[FloatArray, ...]:
    """The curves at one averaging time, in their order."""
    each, share = blocks.units
    n = len(share)
    by_pair = np.tensordot(share, each, 1)
    variance = by_pair.mean(axis=0)
    reach = student.ppf(0.975, max(n - 1, 1)) * blocks.error(each.mean(axis=1))
    # On the logarithm where the variance is known to better than itself.
    known = reach < variance
    ratio = np.exp(np.divide(reach, variance, out=np.zeros(3), where=known))
    lower = np.where(known, variance / ratio, 0.0)
    upper = np.where(known, variance * ratio, np.maximum(variance + reach, 0.0))
    apart = list(combinations(range(each.shape[1]), 2))
    agree = np.full(3, np.nan)
    for a, b in apart:
        unsure = blocks.error(each[:, a] - each[:, b])
        away = np.abs(by_pair[a] - by_pair[b]) / np.maximum(unsure, np.finfo(float).tiny)
        chance = 2.0 * student.sf(away, max(n - 1, 1)) * len(apart)
        agree = np.fmin(agree, np.minimum(chance, 1.0))
    exponent = (np.asarray(end) for end in blocks.exponent(variance))
    return variance, lower, upper, by_pair, blocks.powers, agree, *exponent


# -- models that are nowhere below a curve ---------------------------------------------------------

BOUNDED = (QuantizationNoise, WhiteNoise, RandomWalk)
"""Bounded angle (differenced white noise of the rate), angle and rate random walk."""

FILTER = (WhiteNoise, RandomWalk)


def dominating(
    tau: FloatArray, variance: FloatArray, kinds: Sequence[Callable[[float], Process]], dt: float
) -> Model:
    """The smallest sum of processes of one parameter whose Allan variance is nowhere below a curve.

    The mean ratio to the curve is least (a linear programme in the squares). A walk has 1 % of the
    last variance or more, and white noise of a filter, which divides by both, of the first.
    """
    units = [kind(1.0) for kind in kinds]
    shares = np.column_stack([2.0 * each.haar_variance(tau, dt) for each in units])
    shares /= variance[:, None]
    walks = np.array([each.is_walk for each in units])
    # In parts of what each needs alone: squares of SI units are beyond the solver's tolerances.
    scale = 1.0 / shares.min(axis=0)
    white = np.zeros(len(units)) if kinds is BOUNDED else 1.0 / (shares[0] * scale)
    least = np.where(walks, 1.0 / (shares[-1] * scale), white)
    found = linprog(
        shares.mean(axis=0) * scale,
        A_ub=-shares * scale,
        b_ub=-np.ones(tau.size),
        bounds=[(low, None) for low in tuning.LEAST_WALK * least],
    )
    squares = zip(kinds, found.x * scale, strict=True)
    return Model(tuple(kind(float(np.sqrt(x))) for kind, x in squares if x > 0.0))


def between(tau: FloatArray, variance: FloatArray, times: FloatArray) -> FloatArray:
    """Allan variances at times, on lines between those of a curve in logarithms."""
    return np.asarray(np.exp(np.interp(np.log(times), np.log(tau), np.log(variance))))
