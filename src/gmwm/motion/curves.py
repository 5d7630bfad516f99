"""Allan variances of one IMU from its differences to others, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from scipy.stats import t as student

from gmwm._core.typing import FloatArray
from gmwm.motion import tuning


@dataclass(frozen=True)
class Curves:
    """Allan variances of the three axes of a sensor.

    tau: (J,), s.
    variance, lower, upper: (3, J), u^2, with the ends of 95 % intervals; of two IMUs that of the
        difference. A variance can be negative by chance; its lower end is zero then.
    pairs: (P, 3, J), from each pair of others.
    differences: (K - 1, 3, J), of the difference to each other.
    agree: (3, J), p-value of the equality of the pairs; NaN where there is one.
    """

    tau: FloatArray
    variance: FloatArray
    lower: FloatArray
    upper: FloatArray
    pairs: FloatArray
    differences: FloatArray
    agree: FloatArray


def haar(values: FloatArray, m: int) -> FloatArray:
    """Difference of means over m samples and over the m before, at each sample: (n - 2m + 1, 3)."""
    total = np.cumsum(np.vstack([np.zeros((1, values.shape[1])), values]), axis=0)
    return np.asarray((total[2 * m :] - 2.0 * total[m:-m] + total[: -2 * m]) / m)


def curves_of(flights: Sequence[Sequence[FloatArray]], dt: float, longest: int) -> Curves:
    """Curves from the differences (n, 3) of the target and each other, by flight.

    longest: Samples of the longest flight, as all targets have them.

    The Allan variance at an octave is half the mean, over pairs of others and over time, of the
    product of Haar coefficients of two differences: only the target's own errors are in both.
    Means over blocks of four averaging times, or over flights where there are five or more, are
    the unit of the interval (Student's t on the logarithm): motion is not stationary.
    """
    octaves = int(np.log2(max(1, longest // tuning.WINDOWS)))
    rows = [
        _octave([each for each in flights if len(each[0]) >= tuning.WINDOWS * 2**k], 2**k, dt)
        for k in range(octaves + 1)
    ]
    columns = [np.stack(each, axis=-1) for each in zip(*rows, strict=True)]
    tau = np.asarray(dt * 2.0 ** np.arange(octaves + 1), dtype=float)
    return Curves(tau, *columns)


def _octave(flights: Sequence[Sequence[FloatArray]], m: int, dt: float) -> tuple[FloatArray, ...]:
    """The curves at one averaging time, in their order."""
    count = len(flights[0])
    pairs = list(combinations(range(count), 2)) or [(0, 0)]
    block = max(tuning.BLOCK_LEVELS * m, tuning.BLOCK_LEAST / dt)
    units, weights = [], []  # (pairs, 3) means over a block or a flight
    powers = np.zeros((count, 3))
    for flight in flights:
        coefficients = [haar(each, m) for each in flight]
        n = len(coefficients[0])
        powers += [np.sum(each**2, axis=0) for each in coefficients]
        by_flight = len(flights) >= tuning.FEWEST_FLIGHTS
        parts = 1 if by_flight else max(2, int(n / block))
        ends = np.linspace(0, n, min(parts, n) + 1).astype(int)
        products = [0.5 * coefficients[a] * coefficients[b] for a, b in pairs]
        units += [np.stack([p[s:e].mean(axis=0) for p in products]) for s, e in pairwise(ends)]
        weights += np.diff(ends).tolist()
    share = np.array(weights) / np.sum(weights)
    each = np.stack(units)
    by_pair = np.tensordot(share, each, 1)
    variance = by_pair.mean(axis=0)
    n = len(share)

    def error(values: FloatArray) -> FloatArray:
        away = values - np.tensordot(share, values, 1)
        return np.sqrt(np.tensordot(share**2, away**2, 1) * n / (n - 1))

    spread = error(each.mean(axis=1))
    reach = student.ppf(0.975, n - 1) * spread
    # On the logarithm where the variance is known to better than itself.
    known = reach < variance
    ratio = np.exp(np.divide(reach, variance, out=np.zeros(3), where=known))
    lower = np.where(known, variance / ratio, 0.0)
    upper = np.where(known, variance * ratio, np.maximum(variance + reach, 0.0))
    apart = list(combinations(range(len(pairs)), 2))
    agree = np.full(3, np.nan)
    for a, b in apart:
        unsure = error(each[:, a] - each[:, b])
        away = np.abs(by_pair[a] - by_pair[b]) / np.maximum(unsure, np.finfo(float).tiny)
        chance = 2.0 * student.sf(away, n - 1) * len(apart)
        agree = np.fmin(agree, np.minimum(chance, 1.0))
    return variance, lower, upper, by_pair, 0.5 * powers / np.sum(weights), agree
