"""Numbers as tables for people: in the units of the field, or in SI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gmwm._core import checks
from gmwm._core.text import WIDTH
from gmwm._core.units import field_units, si_parameter_unit

UNITS = ("field", "si")
"""Those of data sheets and IEEE Std 952 / 1554, or SI."""

_UNITS = {"N": "u/sqrt(Hz)", "K": "u/s/sqrt(Hz)", "sigma": "u", "tau": "s", "initial_sd": "u"}


def shown_unit(key: str, quantity: str, units: str) -> tuple[str, float]:
    """The unit in which a number is shown, and how many of it one SI unit is.

    Raises InputError if ``units`` is not one of `UNITS`.
    """
    unit = _UNITS[key if key in _UNITS else key.partition("_")[0]]
    known = field_units(unit, quantity) if checks.choice("units", units, UNITS) == "field" else ()
    return (known[0].unit, known[0].per_si) if known else (si_parameter_unit(unit, quantity), 1.0)


def stacked(
    title: str,
    rows: Mapping[str, tuple[Mapping[str, float], Mapping[str, float]]],
    quantity: str,
    units: str,
) -> list[str]:
    """A table of values with their units above one of predictions, by the name of each row.

    A column such as "N +-" is of the number that it begins with; predictions have no unit.
    """
    names = list(rows)
    width = max(map(len, [title, *names]))
    values, predictions = zip(*rows.values(), strict=True)
    # Errors are known of some axes only.
    columns = max((list(row) for row in values), key=len)
    scales = [shown_unit(column.partition(" ")[0], quantity, units) for column in columns]
    cells = [
        [_cell(row, key, scale) for key, (_, scale) in zip(columns, scales, strict=True)]
        for row in values
    ]
    heads = ["" if " " in key else unit for key, (unit, _) in zip(columns, scales, strict=True)]
    lines = _lines(width, [title, "", *names], [columns, heads, *cells])
    times = max((list(row) for row in predictions), key=len)
    cells = [[_cell(row, key, 1.0) for key in times] for row in predictions]
    return lines + (_lines(width, ["predicted", *names], [times, *cells]) if times else [])


def _cell(row: Mapping[str, float], key: str, scale: float) -> str:
    return f"{row[key] * scale:.4g}" if key in row else "-"


def _lines(width: int, names: Sequence[str], cells: Sequence[Sequence[str]]) -> list[str]:
    """The table, in equal parts beneath each other where it is wider than a page."""
    widths = [max(9, *map(len, column)) for column in zip(*cells, strict=True)]
    room = max(WIDTH - width, 1)  # a name may be as wide as the page
    count = -(-sum(each + 1 for each in widths) // room)
    size = -(-len(widths) // count)
    return [
        (f"{name:<{width}}" + "".join(f" {row[i]:>{widths[i]}}" for i in part)).rstrip()
        for part in (range(len(widths))[k : k + size] for k in range(0, len(widths), size))
        for name, row in zip(names, cells, strict=True)
    ]
