"""Hot loops of the wavelet variance."""

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray

ANY_ORDER = {"reassoc", "contract", "nsz"}
"""Sums in any order, so that they run on vector registers."""


@compiled(fastmath=ANY_ORDER)
def summed_with_moments(
    out: FloatArray, first: FloatArray, second: FloatArray
) -> tuple[float, float]:
    """Add two series; returns the sum of their differences, and of the squares of these."""
    total, square = 0.0, 0.0
    for i in range(out.size):
        out[i] = first[i] + second[i]
        difference = second[i] - first[i]
        total += difference
        square += difference * difference
    return total, square


@compiled()
def summed(out: FloatArray, first: FloatArray, second: FloatArray) -> None:
    """Add two series."""
    for i in range(out.size):
        out[i] = first[i] + second[i]


@compiled(fastmath=ANY_ORDER)
def haar_sums(integral: FloatArray, runs: IntArray, m: int) -> tuple[int, float, float]:
    """Number of the Haar MODWT coefficients within runs, their sum, and that of their squares.

    integral: (n + 1,), cumulative sum of the series, starting with 0.
    runs: (P, 2), first sample of each run, and the one after its last.
    m: Averaging time in samples.
    """
    count, total, square = 0, 0.0, 0.0
    for run in range(runs.shape[0]):
        first = integral[runs[run, 0] : runs[run, 1] + 1]
        middle, last = first[m:], first[2 * m :]
        count += last.size
        for i in range(last.size):
            w = first[i] - 2.0 * middle[i] + last[i]
            total += w
            square += w * w
    return count, total * (0.5 / m), square * (0.5 / m) ** 2


@compiled()
def masked_coefficients(
    integral: FloatArray, there: IntArray, runs: IntArray, m: int, result: FloatArray
) -> float:
    """Half the differences of neighbouring means of the samples that exist, within runs.

    integral, there: (n + 1,), cumulative sum and number of the samples that exist, from 0 on.
    m: Averaging time in samples, longer than any gap within a run.
    result: To which the coefficients are written, run by run.
    Returns: the sum of a quarter of 1/C - 1/m over all halves of windows, with C of m samples.
    """
    scarcity, place = 0.0, 0
    for run in range(runs.shape[0]):
        for t in range(runs[run, 0], runs[run, 1] - 2 * m + 1):
            before = 1.0 / (there[t + m] - there[t])
            after = 1.0 / (there[t + 2 * m] - there[t + m])
            first = (integral[t + m] - integral[t]) * before
            result[place] = 0.5 * ((integral[t + 2 * m] - integral[t + m]) * after - first)
            scarcity += before + after - 2.0 / m
            place += 1
    return 0.25 * scarcity


def cumulative(values: FloatArray, mean: float) -> FloatArray:
    """Cumulative sum of ``values - mean``, starting with 0; missing samples (NaN) add nothing."""
    result = np.empty(values.size + 1)  # numpy asks for large pages, compiled code does not
    accumulate(values, mean, result)
    return result


@compiled()
def accumulate(values: FloatArray, mean: float, result: FloatArray) -> None:
    """Cumulative sum with what earlier additions lost (Kahan 1965)."""
    total, lost = 0.0, 0.0
    result[0] = total
    for i in range(values.size):
        y = values[i] - mean
        y = (0.0 if np.isnan(y) else y) - lost
        following = total + y
        lost = (following - total) - y
        total = following
        result[i + 1] = total


@compiled(fastmath=ANY_ORDER)
def slope(values: FloatArray, parts: IntArray) -> float:
    """Slope of the least-squares lines, one level a part, through the samples, per sample.

    values: (n,), NaN where missing.
    parts: (P,), first sample of each part.
    """
    product, square = 0.0, 0.0
    for part in range(parts.size):
        start = parts[part]
        own = values[start : parts[part + 1] if part + 1 < parts.size else values.size]
        count, total = 0, 0.0
        for i in range(own.size):
            there = own[i] == own[i]  # NaN is not
            count += there
            total += i if there else 0.0
        centre = total / max(count, 1)
        for i in range(own.size):
            there = own[i] == own[i]
            place = i - centre if there else 0.0
            product += place * (own[i] if there else 0.0)
            square += place * place
    return product / square if square > 0.0 else 0.0


@compiled(fastmath=ANY_ORDER)
def difference_powers(values: FloatArray) -> tuple[int, float, float]:
    """Number, and sums of the second and fourth powers, of first differences that exist."""
    count, square, fourth = 0, 0.0, 0.0
    for i in range(values.size - 1):
        difference = values[i + 1] - values[i]
        there = difference == difference  # NaN is not
        power = difference * difference if there else 0.0
        count += there
        square += power
        fourth += power * power
    return count, square, fourth


@compiled(fastmath=ANY_ORDER)
def lagged_squares(values: FloatArray, parts: IntArray, lags: IntArray, slope: float) -> FloatArray:
    """Mean squares of differences of existing samples of a part, without the line, (K,).

    values: (n,), NaN where missing.
    parts: (P, 2), first sample of each part, and the one after its last.
    lags: (K,), in samples.
    slope: Of the line, per sample.
    """
    found = np.zeros(lags.size)
    for i in range(lags.size):
        count, square, step = 0, 0.0, slope * lags[i]
        for part in range(parts.shape[0]):
            first = values[parts[part, 0] : parts[part, 1]]
            second = first[lags[i] :]
            for t in range(second.size):
                difference = second[t] - first[t] - step
                there = difference == difference  # NaN is not
                count += there
                square += difference * difference if there else 0.0
        found[i] = square / max(count, 1)
    return found


@compiled(fastmath=ANY_ORDER)
def survey(values: FloatArray) -> tuple[int, float, float, float]:
    """Number of missing samples; sum, smallest and largest of the others."""
    missing, total = 0, 0.0
    low, high = np.inf, -np.inf
    for i in range(values.size):
        value = values[i]
        there = value == value  # NaN is not
        missing += not there
        total += value if there else 0.0
        low = value if value < low else low
        high = value if value > high else high
    return missing, total, low, high


@compiled(fastmath=ANY_ORDER)
def biweight_means(coefficients: FloatArray, factor: float) -> tuple[float, float]:
    """Means of u t^4 and of its derivative by log u, with u = (factor W)^2 and t = max(1 - u, 0).

    coefficients: (M,), W.
    factor: One over the distance beyond which a coefficient has no weight.
    """
    value = 0.0
    slope = 0.0
    for i in range(coefficients.size):
        v = coefficients[i] * factor
        u = min(v * v, 1.0)
        t = 1.0 - u
        t3 = t * t * t
        value += u * t3 * t
        slope += u * t3 * (1.0 - 5.0 * u)
    return value / coefficients.size, slope / coefficients.size


@compiled()
def pairs_at_lag(first: IntArray, second: IntArray, lag: int) -> int:
    """Number of places t within the first intervals such that t + lag is within the second.

    first, second: (P, 2), (Q, 2), ascending intervals, their ends excluded.
    lag: Zero or more.
    """
    total = 0
    j = 0
    for i in range(first.shape[0]):
        low, high = first[i, 0] + lag, first[i, 1] + lag
        while j > 0 and second[j - 1, 1] > low:
            j -= 1
        while j < second.shape[0] and second[j, 0] < high:
            total += max(min(high, second[j, 1]) - max(low, second[j, 0]), 0)
            j += 1
        j = min(j, second.shape[0] - 1)
    return total
