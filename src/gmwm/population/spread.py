"""How a parameter of an axis differs from unit to unit, and limits for most units."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.stats import binom, chi2, nct, ncx2, norm, shapiro

from gmwm._core.frozen import freeze
from gmwm._core.typing import BoolArray, FloatArray
from gmwm._core.units import customary_unit, si_parameter_unit
from gmwm.population import tuning
from gmwm.population.tuning import CONFIDENCE, CONTENT
from gmwm.population.unit import DERIVED, Row

_NODES = 80  # of the quadrature over the error of the mean: seven digits
_MOST_TESTED = 5000  # values that the Shapiro-Wilk test is made for
_SIGNED = ("R",)
_NUMBER_OF_TERM = re.compile(r"_\d+$")
_SD_PER_MAD = 1.0 / norm.ppf(0.75)


@dataclass(frozen=True)
class Outlier:
    """A unit that stands apart.

    value: SI.
    distance: From the median, in robust standard deviations of the logarithms, or of signed values.
    """

    device: str
    value: float
    distance: float


@dataclass(frozen=True, eq=False)
class Spread:
    """One parameter of one axis over the units that have it in a valid fit.

    of: Number of parameters of this letter in the models; models with equally many are compared.
    unit: SI.
    values: (n,), SI.
    stderr: (n,), NaN where unknown.
    found: (n,) of bool; where false, the value is an upper limit.
    without: Number of units with a valid model of the axis that lacks the parameter.
    """

    channel: str
    quantity: str
    parameter: str
    of: int
    unit: str
    devices: tuple[str, ...]
    values: FloatArray
    stderr: FloatArray
    found: BoolArray
    without: int

    def __post_init__(self) -> None:
        freeze(self, "values", "stderr", "found")

    @property
    def n(self) -> int:
        return len(self.devices)

    @property
    def field_unit(self) -> tuple[str, float]:
        """The data-sheet unit, and its number in one SI unit."""
        for plain in ("u/sqrt(Hz)", "u", "u s", "u/s/sqrt(Hz)", "u/s"):
            if si_parameter_unit(plain, self.quantity) == self.unit:
                return customary_unit(plain, self.quantity, "u")
        return self.unit, 1.0

    @property
    def is_logarithmic(self) -> bool:
        """Whether logarithms are compared: values are positive, and no signed rate ramp."""
        return self.parameter not in _SIGNED and bool(np.all(self.values > 0.0))

    @cached_property
    def _scaled(self) -> FloatArray:
        return np.log(self.values) if self.is_logarithmic else self.values

    @property
    def median(self) -> float:
        return float(np.median(self.values))

    @property
    def sd(self) -> float:
        """Standard deviation of logarithms, or of signed values; NaN for a single unit."""
        return float(np.std(self._scaled, ddof=1)) if self.n > 1 else float("nan")

    @property
    def of_estimation(self) -> float:
        """Fraction of the variance that is estimation error; NaN if unknown."""
        error = self.stderr / self.values if self.is_logarithmic else self.stderr
        known = error[np.isfinite(error)]
        if not (known.size and self.sd > 0.0):
            return float("nan")
        return float(np.mean(known**2) / self.sd**2)

    def _normal(self, sds: float) -> float:
        """Mean plus some standard deviations, in the scale of the values."""
        value = float(np.mean(self._scaled)) + sds * self.sd
        return float(np.exp(value)) if self.is_logarithmic else value

    @property
    def normal_limit(self) -> float:
        """95 % of units are below this (95 % confidence, log-normal); NaN for a single unit."""
        return self._normal(one_sided_factor(self.n)) if self.n > 1 else float("nan")

    @property
    def normal_limits(self) -> tuple[float, float]:
        """95 % of units are within these (95 % confidence, log-normal); NaN for a single unit."""
        if self.n < 2:
            return float("nan"), float("nan")
        half = two_sided_factor(self.n)
        return self._normal(-half), self._normal(half)

    @property
    def free_limit(self) -> float | None:
        """The upper limit for any distribution; ``None`` for fewer than 59 units."""
        rank = rank_of_limit(self.n)
        return None if rank is None else float(np.sort(self.values)[-rank])

    @property
    def free_limits(self) -> tuple[float, float] | None:
        """The interval for any distribution; ``None`` for fewer than 93 units."""
        rank, ordered = rank_of_limits(self.n), np.sort(self.values)
        return None if rank is None else (float(ordered[rank - 1]), float(ordered[-rank]))

    @cached_property
    def normality(self) -> float:
        """p-value of the Shapiro-Wilk test, on the scale of `sd`; NaN if it cannot be tested."""
        if self.n < 3 or not np.ptp(self._scaled) > 0.0:
            return float("nan")
        return float(shapiro(self._scaled[:_MOST_TESTED]).pvalue)

    @property
    def is_normal(self) -> bool:
        """Whether nothing contradicts normal theory."""
        return not self.normality < tuning.CONTRADICTED

    @cached_property
    def outliers(self) -> tuple[Outlier, ...]:
        """Units farther from the median than the farthest of as many normal ones would be.

        By the median and the median absolute deviation (Hampel's identifier; Davies and Gather, J.
        Am. Stat. Assoc. 88, 1993), at a level of 1 % for the axis and parameter as a whole.
        """
        if self.n < tuning.LEAST_FOR_OUTLIERS:
            return ()
        away = self._scaled - np.median(self._scaled)
        robust_sd = _SD_PER_MAD * float(np.median(np.abs(away)))
        if robust_sd == 0.0:
            return ()
        distance = away / robust_sd
        return tuple(
            Outlier(self.devices[i], float(self.values[i]), float(distance[i]))
            for i in np.argsort(-np.abs(distance))
            if abs(distance[i]) > outlier_distance(self.n)
        )


@lru_cache
def outlier_distance(n: int) -> float:
    """Robust standard deviations that contain the farthest of ``n`` normal values in 99 %."""
    draws = min(tuning.SIMULATED, tuning.MOST_SIMULATED // n)
    away = np.random.default_rng(n).standard_normal((max(draws, 100), n))
    away = np.abs(away - np.median(away, axis=1, keepdims=True))
    ratio = np.max(away, axis=1) / (_SD_PER_MAD * np.median(away, axis=1))
    return float(np.quantile(ratio, 1.0 - tuning.OUTLIER_LEVEL))


def spreads_of(rows: Sequence[Row]) -> tuple[Spread, ...]:
    """Every parameter of every axis in the rows of a fleet, those of `DERIVED` first."""

    def letter(row: Row) -> str:
        name: str = row["parameter"]
        return name if name in DERIVED else _NUMBER_OF_TERM.sub("", name)

    valid = [row for row in rows if row["valid"] and row["parameter"]]
    counts = Counter((row["device"], row["channel"], letter(row)) for row in valid)
    groups: dict[tuple[str, str, int], list[Row]] = {}
    for row in valid:
        of = counts[row["device"], row["channel"], letter(row)]
        # Of the derived numbers an upper limit counts too.
        if row["kind"] in ("estimated", "derived", *["bound"] * (row["parameter"] in DERIVED)):
            groups.setdefault((row["channel"], row["parameter"], of), []).append(row)
    units = Counter(channel for channel, _ in {(row["channel"], row["device"]) for row in valid})
    made = [_spread(*key, own, units[key[0]]) for key, own in groups.items()]
    order, channels = list(DERIVED), list(dict.fromkeys(row["channel"] for row in valid))

    def place(each: Spread) -> tuple[int, str, int, int]:
        rank = order.index(each.parameter) if each.parameter in order else len(order)
        return rank, each.parameter, each.of, channels.index(each.channel)

    return tuple(sorted(made, key=place))


def _spread(channel: str, parameter: str, of: int, known: Sequence[Row], units: int) -> Spread:
    found = [row["kind"] != "bound" for row in known]
    values = [
        row["value" if is_found else "upper"] for row, is_found in zip(known, found, strict=True)
    ]
    return Spread(
        channel=channel,
        quantity=known[0]["quantity"],
        parameter=parameter,
        of=of,
        unit=known[0]["unit"],
        devices=tuple(row["device"] for row in known),
        values=np.array(values, dtype=float),
        stderr=np.array([row["stderr"] for row in known], dtype=float),  # None becomes NaN
        found=np.array([row["kind"] != "bound" for row in known]),
        without=units - len(known),
    )


@dataclass(frozen=True)
class Structures:
    """Which models were selected for an axis.

    counts: Title -> number of units with a valid model of that structure, the commonest first.
    invalid: Units whose model of this axis is not valid.
    missing: Units without a model of this axis.
    """

    channel: str
    counts: dict[str, int]
    invalid: tuple[str, ...]
    missing: tuple[str, ...]

    @property
    def different(self) -> int:
        """Number of units with another structure than the commonest one."""
        return sum(self.counts.values()) - max(self.counts.values(), default=0)


def structures_of(rows: Sequence[Row]) -> tuple[Structures, ...]:
    """Structures of every axis in the rows of a fleet."""
    models: dict[str, dict[str, tuple[str, bool]]] = {}
    for row in rows:
        if row["channel"] and row["model"]:
            models.setdefault(row["channel"], {})[row["device"]] = row["model"], row["valid"]
    devices = dict.fromkeys(row["device"] for row in rows if row["model"])
    return tuple(
        Structures(
            channel=channel,
            counts=dict(Counter(title for title, valid in own.values() if valid).most_common()),
            invalid=tuple(device for device, (_, valid) in own.items() if not valid),
            missing=tuple(device for device in devices if device not in own),
        )
        for channel, own in models.items()
    )


# -- tolerance limits: what holds for most units when only some were measured ----------------------


@lru_cache
def one_sided_factor(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> float:
    """Factor k of the upper limit ``mean + k * sd`` of normal units.

    n: Units measured, 2 or more.
    content, confidence: With this confidence, this fraction of all units is below the limit.

    Exact, by the noncentral t distribution (ISO 16269-6:2014; Krishnamoorthy and Mathew,
    *Statistical Tolerance Regions*, 2009, (2.2.3)).
    """
    shift = np.sqrt(n) * norm.ppf(content)
    return float(nct.ppf(confidence, n - 1, shift) / np.sqrt(n))


@lru_cache
def two_sided_factor(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> float:
    """Factor k of the interval ``mean - k * sd`` to ``mean + k * sd``; see `one_sided_factor`.

    Exact: the probability that the sample's standard deviation is large enough, averaged over the
    error of its mean (Krishnamoorthy and Mathew, (2.3.4)). The search starts at the approximation
    of Howe, J. Am. Stat. Assoc. 64, 1969.
    """
    dof = n - 1
    howe = norm.ppf(0.5 + 0.5 * content) * np.sqrt(
        dof * (1 + 1 / n) / chi2.ppf(1 - confidence, dof)
    )
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    error = 4.0 * (1.0 + nodes) / np.sqrt(n)  # of the mean, from zero to eight standard errors
    weights = 8.0 * weights * norm.pdf(error * np.sqrt(n))
    needed = ncx2.ppf(content, 1, error**2)

    def shortfall(factor: float) -> float:
        return float(weights @ chi2.sf(dof * needed / factor**2, dof)) - confidence

    return float(brentq(shortfall, 0.8 * howe, 1.2 * howe, xtol=1e-6 * howe))


def rank_of_limit(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> int | None:
    """Rank, from the largest as 1, of the value that is an upper limit for any distribution.

    ``None`` if there are too few units: 95 % with 95 % confidence takes 59. The r-th largest value
    is above the quantile ``content`` unless more than ``n - r`` are below it (Wilks, Ann. Math.
    Stat. 12, 1941).
    """
    return _rank(n, 1, content, confidence)


def rank_of_limits(n: int, content: float = CONTENT, confidence: float = CONFIDENCE) -> int | None:
    """Rank r of the interval from the r-th smallest to the r-th largest: it takes 93 units."""
    return _rank(n, 2, content, confidence)


def _rank(n: int, sides: int, content: float, confidence: float) -> int | None:
    ranks = np.arange(1, n // sides + 1)
    good = ranks[binom.cdf(n - sides * ranks, n, content) >= confidence]
    return int(good[-1]) if good.size else None


def content_of_largest(n: int, confidence: float = CONFIDENCE) -> float:
    """Fraction of all units that the largest of ``n`` values is a limit for."""
    return float((1.0 - confidence) ** (1.0 / n))


def needed_units(content: float = CONTENT, confidence: float = CONFIDENCE) -> int:
    """Number of units whose largest value is a limit for any distribution."""
    return int(np.ceil(np.log(1.0 - confidence) / np.log(content)))
