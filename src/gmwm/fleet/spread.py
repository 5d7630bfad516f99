"""How a parameter of an axis differs from unit to unit, and what holds for most units."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.stats import norm, shapiro

from gmwm._core.frozen import freeze
from gmwm._core.typing import BoolArray, FloatArray
from gmwm._core.units import factor, field_units
from gmwm.errors import InputError
from gmwm.fleet import tuning
from gmwm.fleet.table import Row
from gmwm.fleet.tolerance import one_sided_factor, rank_of_limit, rank_of_limits, two_sided_factor
from gmwm.fleet.unit import DERIVED

_MOST_TESTED = 5000  # values that the test of Shapiro and Wilk is made for
_SIGNED = ("R",)
_NUMBER = re.compile(r"_\d+$")
_MAD = 1.0 / norm.ppf(0.75)


@dataclass(frozen=True)
class Outlier:
    """A unit that stands apart.

    value: SI.
    distance: From the median, in robust standard deviations, of logarithms where values are
        positive.
    """

    device: str
    value: float
    distance: float


@dataclass(frozen=True, eq=False)
class Spread:
    """One parameter of one axis, over the units whose fit is valid and has it.

    of: How many parameters of this letter the models have: those of models with equally many are
        compared.
    unit: SI.
    values: (n,), SI.
    stderr: (n,), NaN where it is not known.
    found: (n,) of bool, where not, the value is an upper bound.
    without: Units with a valid model of the axis that does not have it.
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
        """The unit in which the field quotes it, and how many of it one SI unit is."""
        for plain in ("u/sqrt(Hz)", "u", "u s", "u/s/sqrt(Hz)", "u/s"):
            for usual in field_units(plain, self.quantity)[:1]:
                try:
                    return usual.unit, 1.0 / factor(usual.unit, self.unit.replace(" s", "*s"))
                except InputError:
                    continue
        return self.unit, 1.0

    @property
    def is_logarithmic(self) -> bool:
        """Whether it is positive and so taken by its logarithm; a rate ramp is signed."""
        return self.parameter not in _SIGNED and bool(np.all(self.values > 0.0))

    @cached_property
    def _scaled(self) -> FloatArray:
        return np.log(self.values) if self.is_logarithmic else self.values

    def _back(self, value: float) -> float:
        return float(np.exp(value)) if self.is_logarithmic else float(value)

    @property
    def median(self) -> float:
        return float(np.median(self.values))

    @property
    def sd(self) -> float:
        """Standard deviation of logarithms, or of signed values; NaN of a single unit."""
        return float(np.std(self._scaled, ddof=1)) if self.n > 1 else float("nan")

    @property
    def of_estimation(self) -> float:
        """Which fraction of the variance the errors of the estimates explain; NaN if unknown."""
        error = self.stderr / self.values if self.is_logarithmic else self.stderr
        known = error[np.isfinite(error)]
        if not (known.size and self.sd > 0.0):
            return float("nan")
        return float(np.mean(known**2) / self.sd**2)

    # -- what could be promised ---------------------------------------------------------------

    @property
    def normal_limit(self) -> float:
        """Upper limit of 95 % of the units with 95 % confidence, if (logarithms) are normal."""
        if not self.sd >= 0.0:
            return float("nan")
        return self._back(float(np.mean(self._scaled)) + one_sided_factor(self.n) * self.sd)

    @property
    def normal_limits(self) -> tuple[float, float]:
        """Interval that holds 95 % of the units with 95 % confidence, likewise."""
        if not self.sd >= 0.0:
            return float("nan"), float("nan")
        mean, half = float(np.mean(self._scaled)), two_sided_factor(self.n) * self.sd
        return self._back(mean - half), self._back(mean + half)

    @property
    def free_limit(self) -> float | None:
        """The upper limit whatever the distribution; ``None`` of fewer than 59 units."""
        rank = rank_of_limit(self.n)
        return None if rank is None else float(np.sort(self.values)[-rank])

    @property
    def free_limits(self) -> tuple[float, float] | None:
        """The interval whatever the distribution; ``None`` of fewer than 93 units."""
        rank = rank_of_limits(self.n)
        ordered = np.sort(self.values)
        return None if rank is None else (float(ordered[rank - 1]), float(ordered[-rank]))

    @cached_property
    def normality(self) -> float:
        """p-value of Shapiro and Wilk, on the scale of `sd`; NaN where there is nothing to test."""
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

        The median and the median absolute deviation (Hampel's identifier; Davies and Gather, J.
        Am. Stat. Assoc. 88, 1993), at a level of 1 % for the whole axis and parameter.
        """
        if self.n < tuning.LEAST_FOR_OUTLIERS:
            return ()
        away = self._scaled - np.median(self._scaled)
        robust = _MAD * float(np.median(np.abs(away)))
        if robust == 0.0:
            return ()
        distance = away / robust
        order = np.argsort(-np.abs(distance))
        return tuple(
            Outlier(self.devices[i], float(self.values[i]), float(distance[i]))
            for i in order
            if abs(distance[i]) > outlier_distance(self.n)
        )


@lru_cache
def outlier_distance(n: int) -> float:
    """Robust standard deviations that the farthest of ``n`` normal values is within in 99 %."""
    draws = min(tuning.SIMULATED, tuning.MOST_SIMULATED // n)
    away = np.random.default_rng(n).standard_normal((max(draws, 100), n))
    away = np.abs(away - np.median(away, axis=1, keepdims=True))
    ratio = np.max(away, axis=1) / (_MAD * np.median(away, axis=1))
    return float(np.quantile(ratio, 1.0 - tuning.OUTLIER_LEVEL))


def spreads_of(rows: Sequence[Row]) -> tuple[Spread, ...]:
    """Every parameter of every axis, derived ones first."""
    valid = [row for row in rows if row["valid"] and row["parameter"]]
    counts = Counter((row["device"], row["channel"], _letter(row)) for row in valid)
    groups: dict[tuple[str, str, int], list[Row]] = {}
    for row in valid:
        of = counts[row["device"], row["channel"], _letter(row)]
        groups.setdefault((row["channel"], row["parameter"], of), []).append(row)
    having = Counter(channel for channel, _ in {(row["channel"], row["device"]) for row in valid})
    made = (_spread(key, of_group, having[key[0]]) for key, of_group in groups.items())
    order, channels = list(DERIVED), list(dict.fromkeys(row["channel"] for row in valid))
    return tuple(sorted(
        (each for each in made if each.n),
        key=lambda s: (
            order.index(s.parameter) if s.parameter in order else len(order),
            s.parameter, s.of, channels.index(s.channel),
        ),
    ))  # fmt: skip


def _letter(row: Row) -> str:
    """Of a parameter: that of ``sigma_2`` is sigma, derived ones are their own."""
    name: str = row["parameter"]
    return name if name in DERIVED else _NUMBER.sub("", name)


def _spread(key: tuple[str, str, int], rows: Iterable[Row], having: int) -> Spread:
    channel, parameter, of = key
    known = [
        row for row in rows
        if row["kind"] in ("estimated", "derived")
        or (row["kind"] == "bound" and parameter in DERIVED)
    ]  # fmt: skip
    first = known[0] if known else {"quantity": "", "unit": ""}
    found = [row["kind"] != "bound" for row in known]
    values = [
        row["value"] if is_found else row["upper"]
        for row, is_found in zip(known, found, strict=True)
    ]
    errors = [row["stderr"] for row in known]
    return Spread(
        channel=channel,
        quantity=first["quantity"],
        parameter=parameter,
        of=of,
        unit=first["unit"],
        devices=tuple(row["device"] for row in known),
        values=np.array(values, dtype=float),
        stderr=np.array([float("nan") if e is None else e for e in errors], dtype=float),
        found=np.array(found, dtype=bool),
        without=having - len(known),
    )


@dataclass(frozen=True)
class Structures:
    """Which models were selected for an axis.

    counts: Title -> units with a valid model of that structure, the commonest first.
    invalid: Units whose model of this axis is not valid.
    missing: Units without a model of this axis.
    """

    channel: str
    counts: dict[str, int]
    invalid: tuple[str, ...]
    missing: tuple[str, ...]

    @property
    def different(self) -> int:
        """Units that have another structure than the commonest one."""
        return sum(self.counts.values()) - max(self.counts.values(), default=0)


def structures_of(rows: Sequence[Row]) -> tuple[Structures, ...]:
    """Of every axis that a unit has."""
    models = {
        (row["channel"], row["device"]): (row["model"], row["valid"])
        for row in rows if row["channel"] and row["model"]
    }  # fmt: skip
    devices = dict.fromkeys(row["device"] for row in rows if row["model"])
    found = []
    for channel in dict.fromkeys(channel for channel, _ in models):
        own = {device: each for (axis, device), each in models.items() if axis == channel}
        titles = Counter(title for title, is_valid in own.values() if is_valid)
        found.append(
            Structures(
                channel=channel,
                counts=dict(titles.most_common()),
                invalid=tuple(d for d, (_, is_valid) in own.items() if not is_valid),
                missing=tuple(device for device in devices if device not in own),
            )
        )
    return tuple(found)
