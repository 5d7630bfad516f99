"""A unit of a fleet, its sensor numbers, and its rows in the table of the fleet."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from gmwm._core.documents import NotNegative, OrInfinity
from gmwm._core.units import si_parameter_unit
from gmwm.calibration import Calibration, axis_numbers
from gmwm.errors import printable
from gmwm.estimate import Fit
from gmwm.issues import Notice

if TYPE_CHECKING:
    from gmwm.population.structure import Structure

LETTERS = {"N": "u/sqrt(Hz)", "B": "u", "K": "u/s/sqrt(Hz)"}
"""Sensor numbers (see `gmwm.Calibration.numbers`) and their units."""

_TYPES = dict.fromkeys(("value", "stderr", "lower", "upper"), pa.float64())
_TYPES |= {"valid": pa.bool_()} | dict.fromkeys(("reasons", "notices"), pa.list_(pa.string()))
_NAMES = (
    "device path channel quantity model number kind value stderr lower upper unit valid "
    "reasons notices"
)
SCHEMA = pa.schema([(name, _TYPES.get(name, pa.string())) for name in _NAMES.split()])
"""Columns of the table; null where one does not apply. ``number`` is N, B or K; of an upper limit
(``kind`` "bound") ``value`` is null. ``model`` is the one that it comes from. ``reasons`` are the
codes of why a fit, a channel or a unit is not valid."""

Row = dict[str, Any]


@dataclass(frozen=True)
class Number:
    """A sensor number with its 95 % interval, SI; no ``value`` where only ``upper`` is known."""

    value: NotNegative | None
    stderr: NotNegative | None
    lower: NotNegative
    upper: OrInfinity

    @property
    def error(self) -> float:
        """Standard error of the logarithm; NaN for an upper limit."""
        if not self.value:
            return float("nan")
        if self.lower > 0.0 and isfinite(self.upper):
            return float(np.log(self.upper / self.lower)) / 3.92
        return (self.stderr or 0.0) / self.value


def numbers_of(fit: Fit) -> dict[str, Number]:
    """N, B and K of a fit."""
    return {
        each.key: Number(
            None if each.kind == "bound" else each.value, each.stderr, each.lower, each.upper
        )
        for each in axis_numbers(fit)
    }


@dataclass(frozen=True)
class Unit:
    """A unit of a fleet.

    path: Path of its recording.
    name: Short name, unique in the fleet.
    result: The calibration, or why there is none.
    digest: SHA-256 of the recording; empty where it cannot be read.
    """

    path: str
    name: str
    result: Calibration | Notice
    digest: str = ""

    @property
    def valid(self) -> bool:
        """Whether a channel has a valid model."""
        return isinstance(self.result, Calibration) and any(
            fit.valid for fit in self.result.values()
        )


def rows_of(units: Iterable[Unit], structures: Sequence[Structure]) -> Iterator[Row]:
    """Rows of the table: N, B and K of every channel of every unit.

    A unit without a calibration, and a channel without a fit, has one row with the reason.
    """
    by_channel = {each.channel: each for each in structures}
    for unit in units:
        own = dict.fromkeys(SCHEMA.names) | {
            "device": unit.name,
            "path": printable(unit.path),
            "valid": False,
        }
        if isinstance(unit.result, Notice):
            yield {**own, "reasons": [unit.result.code], "notices": [unit.result.code]}
            continue
        for name, fit in unit.result.items():
            for each in _of_channel(unit, name, fit, by_channel[name]):
                row = own | each
                yield {
                    key: None if isinstance(value, float) and not isfinite(value) else value
                    for key, value in row.items()
                }
        for name, why in unit.result.skipped.items():
            yield {**own, "channel": name, "reasons": [why.code], "notices": [why.code]}


def _of_channel(unit: Unit, name: str, fit: Fit, structure: Structure) -> Iterator[Row]:
    """Rows of a channel, without the columns of the unit."""
    assert isinstance(unit.result, Calibration)
    notices = [*fit.notices, *(n for n in unit.result.notices if n.where in ("", name))]
    is_valid = unit.name in structure.usable
    is_common = is_valid and unit.name not in structure.own
    reasons = [] if is_valid else list(fit.reasons)
    own = {
        "channel": name,
        "quantity": fit.wv.quantity,
        "model": structure.model if is_common else fit.model.title(),
        "valid": is_valid,
        "reasons": reasons,
        "notices": list(dict.fromkeys(n.code for n in notices if n.severity != "good")),
    }
    for key, number in structure.numbers[unit.name].items():
        known = {each: getattr(number, each) for each in ("value", "stderr", "lower", "upper")}
        known |= {"kind": "bound" if number.value is None else "estimated", "number": key}
        yield {**own, **known, "unit": si_parameter_unit(LETTERS[key], fit.wv.quantity)}
