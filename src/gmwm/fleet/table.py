"""The table of a fleet: a row per unit, channel and parameter."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import isfinite
from typing import Any

import pyarrow as pa

from gmwm._core.notices import Notice
from gmwm._core.units import si_parameter_unit
from gmwm.calibration import Calibration
from gmwm.errors import printable
from gmwm.estimate import Fit
from gmwm.fleet.unit import DERIVED, Unit

_TEXT, _NUMBER, _TEXTS = pa.string(), pa.float64(), pa.list_(pa.string())

SCHEMA = pa.schema([
    ("device", _TEXT), ("path", _TEXT), ("channel", _TEXT), ("quantity", _TEXT), ("model", _TEXT),
    ("parameter", _TEXT), ("kind", _TEXT), ("value", _NUMBER), ("stderr", _NUMBER),
    ("lower", _NUMBER), ("upper", _NUMBER), ("unit", _TEXT), ("valid", pa.bool_()),
    ("reasons", _TEXTS), ("notices", _TEXTS),
])  # fmt: skip
"""Columns; what does not apply is null. ``kind`` is that of `gmwm.Estimate`, or "derived" for
`gmwm.fleet.DERIVED`; of one that is an upper bound only ("bound"), ``value`` is null. ``reasons``
say why a fit, a channel or a unit is not valid."""

Row = dict[str, Any]


def rows_of(units: Iterable[Unit]) -> Iterator[Row]:
    """Rows of units, in their order; of one without a calibration, or a channel without a fit, a
    row with the reason.
    """
    empty = dict.fromkeys(SCHEMA.names)
    for unit in units:
        own = {**empty, "device": unit.name, "path": printable(unit.path), "valid": False}
        if isinstance(unit.result, Notice):
            yield {**own, "reasons": [unit.result.code], "notices": [unit.result.code]}
            continue
        for name, fit in unit.result.items():
            yield from _of_channel(own, unit, name, fit)
        for name, why in unit.result.skipped.items():
            yield {**own, "channel": name, "reasons": [why.code], "notices": [why.code]}


def _of_channel(own: Row, unit: Unit, name: str, fit: Fit) -> Iterator[Row]:
    calibration = unit.result
    assert isinstance(calibration, Calibration)
    quantity = fit.wv.quantity or ""
    found = [*fit.notices, *(n for n in calibration.notices if n.where in ("", name))]
    own = {
        **own, "channel": name, "quantity": quantity, "model": fit.model.title(),
        "valid": fit.valid,
        "reasons": [reason for reason, is_met in fit.reasons.items() if not is_met],
        "notices": list(dict.fromkeys(each.code for each in found if each.severity != "good")),
    }  # fmt: skip
    for each in fit.estimates:
        known = {
            key: getattr(each, key) for key in ("kind", "value", "stderr", "lower", "upper", "unit")
        }
        if each.kind == "bound":
            known |= {"value": None, "stderr": None}
        yield _finite({**own, "parameter": each.key, **known})
    for key, number in unit.numbers.get(name, {}).items():
        known = {"kind": "derived", "value": number.value, "stderr": number.stderr}
        if not number.found:
            known = {"kind": "bound", "upper": number.value}
        unit_text = si_parameter_unit(DERIVED[key], quantity)
        yield _finite({**own, "parameter": key, **known, "unit": unit_text})


def _finite(row: Row) -> Row:
    """With null for numbers that are none."""
    return {k: None if isinstance(v, float) and not isfinite(v) else v for k, v in row.items()}


def arrow(rows: Iterable[Row]) -> pa.Table:
    """Rows as a table of Arrow."""
    return pa.Table.from_pylist(list(rows), schema=SCHEMA)
