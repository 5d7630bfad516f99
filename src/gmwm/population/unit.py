"""A unit of a fleet, and its rows in the table of the fleet."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

import pyarrow as pa

from gmwm._core.documents import NotNegative
from gmwm._core.frozen import freeze
from gmwm._core.units import si_parameter_unit
from gmwm.calibration import Calibration
from gmwm.errors import printable
from gmwm.estimate import Fit
from gmwm.issues import Notice

DERIVED = {"filter_N": "u/sqrt(Hz)", "filter_K": "u/s/sqrt(Hz)", "floor_B": "u"}
"""Numbers that units of any model structure have, and their units: the N and K of a filter for the
horizon (`gmwm.bound`), and the bias instability B."""

_TYPES = dict.fromkeys(("value", "stderr", "lower", "upper"), pa.float64())
_TYPES |= {"valid": pa.bool_()} | dict.fromkeys(("reasons", "notices"), pa.list_(pa.string()))
_NAMES = (
    "device path channel quantity model parameter kind value stderr lower upper unit valid reasons "
    "notices"
)
SCHEMA = pa.schema([(name, _TYPES.get(name, pa.string())) for name in _NAMES.split()])
"""Columns of the table; null where one does not apply. ``kind`` is that of `gmwm.Estimate`, or
"derived" for the numbers of `DERIVED`; of an upper limit ("bound") ``value`` is null. ``reasons``
are the codes of why a fit, a channel or a unit is not valid."""

Row = dict[str, Any]


@dataclass(frozen=True)
class Number:
    """A number derived from a fit, SI; an upper limit if not ``found``."""

    value: NotNegative
    stderr: NotNegative | None
    found: bool


@dataclass(frozen=True)
class Unit:
    """A unit of a fleet.

    path: Path of its recording.
    name: Short name, unique in the fleet.
    result: The calibration, or why there is none.
    numbers: Channel -> name in `DERIVED` -> `Number`.
    digest: SHA-256 of the recording; empty where it cannot be read.
    """

    path: str
    name: str
    result: Calibration | Notice
    numbers: Mapping[str, Mapping[str, Number]] = field(default_factory=dict)
    digest: str = ""

    def __post_init__(self) -> None:
        freeze(self, "numbers")

    @property
    def valid(self) -> bool:
        """Whether a channel has a valid model."""
        return isinstance(self.result, Calibration) and any(
            fit.valid for fit in self.result.values()
        )


def rows_of(units: Iterable[Unit]) -> Iterator[Row]:
    """Rows of the table: one per unit, channel and parameter.

    A unit without a calibration, and a channel without a fit, has one row with the reason.
    """
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
            for each in _parameters(unit.result, name, fit, unit.numbers.get(name, {})):
                row = own | each
                yield {
                    key: None if isinstance(value, float) and not isfinite(value) else value
                    for key, value in row.items()
                }
        for name, why in unit.result.skipped.items():
            yield {**own, "channel": name, "reasons": [why.code], "notices": [why.code]}


def _parameters(
    calibration: Calibration, name: str, fit: Fit, numbers: Mapping[str, Number]
) -> Iterator[Row]:
    """Rows of a channel, without the columns of the unit."""
    quantity = fit.wv.quantity or ""
    notices = [*fit.notices, *(n for n in calibration.notices if n.where in ("", name))]
    own = {
        "channel": name,
        "quantity": quantity,
        "model": fit.model.title(),
        "valid": fit.valid,
        "reasons": [reason for reason, is_met in fit.reasons.items() if not is_met],
        "notices": list(dict.fromkeys(n.code for n in notices if n.severity != "good")),
    }
    for each in fit.estimates:
        known = {key: getattr(each, key) for key in ("kind", "lower", "upper", "unit")}
        if each.kind != "bound":
            known |= {"value": each.value, "stderr": each.stderr}
        yield {**own, "parameter": each.key, **known}
    for key, number in numbers.items():
        known = {"kind": "bound", "upper": number.value}
        if number.found:
            known = {"kind": "derived", "value": number.value, "stderr": number.stderr}
        yield {**own, "parameter": key, **known, "unit": si_parameter_unit(DERIVED[key], quantity)}
