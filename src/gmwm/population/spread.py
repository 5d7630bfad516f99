"""How a sensor number of an axis differs from unit to unit, and limits for most units."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
from scipy.stats import binom, nct, norm

from gmwm._core.frozen import freeze
from gmwm._core.typing import BoolArray, FloatArray
from gmwm._core.units import customary_unit
from gmwm.population import tuning
from gmwm.population.tuning import CONFIDENCE, CONTENT
from gmwm.population.unit import LETTERS, Structure

_SD_PER_MAD = 1.0 / norm.ppf(0.75)
_ONE_SIDED = 1.645  # standard errors from an estimate of zero to its 95 % upper limit


@dataclass(frozen=True)
class Outlier:
    """A unit that stands apart.

    value: SI; an upper limit if not ``found``.
    distance: From the median, in standard deviations of the logarithm.
    """

    device: str
    value: float
    found: bool
    distance: float


@dataclass(frozen=True, eq=False)
class Spread:
    """N, B or K of one axis over the units with a valid model of it.

    values: (n,), SI.
    errors: (n,), standard errors of their logarithms; NaN of upper limits.
    found: (n,) of bool; where false, the value is an upper limit.
    level: Probability that one of as many equal units is an outlier.
    """

    channel: str
    quantity: str
    parameter: str
    devices: tuple[str, ...]
    values: FloatArray
    errors: FloatArray
    found: BoolArray
    level: float

    def __post_init__(self) -> None:
        freeze(self, "values", "errors", "found")

    @property
    def n(self) -> int:
        return len(self.devices)

    @property
    def field_unit(self) -> tuple[str, float]:
        """The data-sheet unit, and its number in one SI unit."""
        return customary_unit(LETTERS[self.parameter], self.quantity, "u")

    @cached_property
    def _logarithms(self) -> FloatArray:
        return np.log(self.values)

    @property
    def median(self) -> float:
        return float(np.median(self.values))

    @property
    def is_limit(self) -> bool:
        """Whether the median is an upper limit: of most units nothing more is known."""
        return 2 * int(np.count_nonzero(self.found)) <= self.n

    @property
    def sd(self) -> float:
        """Standard deviation of logarithms; NaN for a single unit."""
        return float(np.std(self._logarithms, ddof=1)) if self.n > 1 else float("nan")

    @property
    def of_estimation(self) -> float:
        """Fraction of the variance that is estimation error; NaN if unknown."""
        known = self.errors[self.found]
        if not (known.size and self.sd > 0.0):
            return float("nan")
        return float(np.mean(known**2) / self.sd**2)

    @property
    def normal_limit(self) -> float:
        """95 % of units are below this (95 % confidence, log-normal); NaN for a single unit."""
        if self.n < 2:
            return float("nan")
        return float(np.exp(np.mean(self._logarithms) + one_sided_factor(self.n) * self.sd))

    @property
    def free_limit(self) -> float | None:
        """The upper limit for any distribution; ``None`` for fewer than 59 units."""
        rank = rank_of_limit(self.n)
        return None if rank is None else float(np.sort(self.values)[-rank])

    @cached_property
    def outliers(self) -> tuple[Outlier, ...]:
        """Units farther from the median than the farthest of as many normal ones would be.

        The standard deviation is 1.48 times the median absolute deviation (Hampel's identifier;
        Davies and Gather, J. Am. Stat. Assoc. 88, 1993), at least the usual estimation error, and
        larger for a unit whose own error is larger. An upper limit of K counts below the median of
        estimates; that of B is of the fitted curve only.
        """
        if self.n < tuning.LEAST_FOR_OUTLIERS:
            return ()
        away = self._logarithms - np.median(self._logarithms)
        usual = float(np.median(self.errors[self.found])) if np.any(self.found) else 0.0
        spread = max(_SD_PER_MAD * float(np.median(np.abs(away))), usual)
        # Zero plus 1.645 errors is the square of the limit at most.
        of_limit = np.abs(away) / (_ONE_SIDED * np.exp(2.0 * np.abs(away)))
        more = np.where(self.found, np.maximum(self.errors**2 - usual**2, 0.0), of_limit**2)
        scale = np.sqrt(spread**2 + more)
        if not np.all(scale > 0.0):
            return ()
        distance = away / scale
        counts = self.found | ((distance < 0.0) & (self.parameter == "K") & (not self.is_limit))
        is_apart = counts & (np.abs(distance) > outlier_distance(self.n, self.level))
        return tuple(
            Outlier(self.devices[i], float(self.values[i]), bool(self.found[i]), float(distance[i]))
            for i in np.argsort(-np.abs(distance))
            if is_apart[i]
        )


@lru_cache
def outlier_distance(n: int, level: float) -> float:
    """Robust standard deviations within which all of ``n`` normal values are, but for ``level``."""
    draws = max(min(tuning.SIMULATED, tuning.MOST_SIMULATED // n), int(20.0 / level))
    away = np.random.default_rng(n).standard_normal((draws, n))
    away = np.abs(away - np.median(away, axis=1, keepdims=True))
    ratio = np.max(away, axis=1) / (_SD_PER_MAD * np.median(away, axis=1))
    return float(np.quantile(ratio, 1.0 - level))


def spreads_of(structures: Sequence[Structure]) -> tuple[Spread, ...]:
    """N, B and K of every axis over the units with a valid model, in this order."""
    found = []
    sensors = dict.fromkeys(each.quantity for each in structures)
    for sensor, letter in product(sensors, LETTERS):
        for each in (own for own in structures if own.quantity == sensor):
            valid = {name: own[letter] for name, own in each.usable.items()}
            ends = {k: x.upper if x.value is None else x.value for k, x in valid.items()}
            known = {k: end for k, end in ends.items() if 0.0 < end < np.inf}
            if known:
                errors = np.array([valid[k].error for k in known])
                arrays = np.array(list(known.values())), errors, np.isfinite(errors)
                found.append((each.channel, each.quantity, letter, tuple(known), *arrays))
    level = tuning.FALSE_ALARMS / max(len(found), 1)
    return tuple(Spread(*each, level) for each in found)


@lru_cache
def one_sided_factor(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> float:
    """Factor k of the upper limit ``mean + k * sd`` of normal units.

    content, confidence: With this confidence, this fraction of all units is below the limit.

    Exact, by the noncentral t distribution (ISO 16269-6:2014; Krishnamoorthy and Mathew,
    *Statistical Tolerance Regions*, 2009, (2.2.3)).
    """
    shift = np.sqrt(n) * norm.ppf(content)
    return float(nct.ppf(confidence, n - 1, shift) / np.sqrt(n))


def rank_of_limit(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> int | None:
    """Rank, from the largest as 1, of the value that is an upper limit for any distribution.

    ``None`` if there are too few units: 95 % with 95 % confidence takes 59. The r-th largest value
    is above the quantile ``content`` unless more than ``n - r`` are below it (Wilks, Ann. Math.
    Stat. 12, 1941).
    """
    ranks = np.arange(1, n + 1)
    good = ranks[binom.cdf(n - ranks, n, content) >= confidence]
    return int(good[-1]) if good.size else None


def needed_units(content: float = CONTENT, confidence: float = CONFIDENCE) -> int:
    """Number of units whose largest value is a limit for any distribution."""
    return int(np.ceil(np.log(1.0 - confidence) / np.log(content)))
