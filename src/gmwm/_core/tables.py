"""Tables of declared rows: a field of a dataclass says its unit, digits and heading once.

A row is a dataclass whose fields carry `column`. From the declaration follow the table that people
read (`text_table`), in data-sheet units or SI, and the data frame (`frame`), always in SI.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from io import StringIO
from typing import TYPE_CHECKING, Any

from gmwm._core.text import WIDTH
from gmwm._core.units import customary_unit, si_parameter_unit
from gmwm.errors import InputError

if TYPE_CHECKING:
    import pandas

_KEY = "gmwm.column"


@dataclass(frozen=True)
class Column:
    """Declaration of a column.

    name: Of the field; the column of a data frame.
    heading: What people read; empty: the name.
    unit: SI, with the placeholder ``u`` for the channel's own unit (``"u/sqrt(Hz)"``); empty for
        texts and plain numbers.
    digits: Significant digits in the text table.
    is_shown: Whether the text table has it.
    """

    name: str
    heading: str = ""
    unit: str = ""
    digits: int = 4
    is_shown: bool = True


def column(
    heading: str = "", unit: str = "", digits: int = 4, *, is_shown: bool = True
) -> dict[str, Any]:
    """Metadata of a field, ``field(metadata=column("N", "u/sqrt(Hz)"))``; see `Column`."""
    return {_KEY: (heading, unit, digits, is_shown)}


def columns_of(kind: type) -> tuple[Column, ...]:
    """Columns of a row class, in the order of its fields; fields without `column` are none."""
    return tuple(
        Column(each.name, *each.metadata[_KEY]) for each in fields(kind) if _KEY in each.metadata
    )


def row_of(row: Any) -> dict[str, Any]:
    """Column -> value, SI."""
    return {each.name: getattr(row, each.name) for each in columns_of(type(row))}


def frame(rows: Iterable[Any], columns: type | Sequence[str], **same: Any) -> pandas.DataFrame:
    """A data frame, in SI units.

    rows: Declared rows, or mappings of column -> value; other keys are left out.
    columns: The class of the rows or the names; an empty table has them too.
    same: Columns before the others with one value.
    Raises InputError if pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise InputError(
            "tables need pandas, which is not installed: pip install 'gmwm[pandas]'"
        ) from None
    if isinstance(columns, type):
        columns = [each.name for each in columns_of(columns)]
    mappings = [dict(row) if isinstance(row, Mapping) else row_of(row) for row in rows]
    return pandas.DataFrame([same | row for row in mappings], columns=[*same, *columns])


def text_table(
    rows: Sequence[Any], quantity: str | None = None, unit: str = "", units: str = "field"
) -> str:
    """Rows of a declared class as lines of at most 80 columns, units below the headings.

    quantity, unit: Of the channel: {"gyro", "accel", None} and its SI unit.
    units: {"field", "si"}, data-sheet units or SI.
    """
    shown = [each for each in columns_of(type(rows[0])) if each.is_shown] if rows else []
    heads: list[str] = []
    cells: list[list[str]] = [[] for _ in rows]
    for each in shown:
        name, scale = _unit(each.unit, quantity, unit, units)
        heads.append("\n".join(filter(None, (each.heading or each.name, name))))
        for row, line in zip(rows, cells, strict=True):
            line.append(cell(getattr(row, each.name), each.digits, scale))
    return plain_table(heads, cells)


def cell(value: Any, digits: int = 4, scale: float = 1.0) -> str:
    """A value as tables show it: ``-`` for one that is unknown."""
    if value is None or value != value:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return f"{value * scale:.{digits}g}"
    return str(value)


def plain_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Lines of a table of texts; columns of numbers are aligned to the right."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="")
    for k, head in enumerate(heads):
        is_number = all(row[k][:1] in "-+<≤.0123456789" for row in rows)
        table.add_column(head, justify="right" if is_number and k else "left", vertical="bottom")
    for row in rows:
        table.add_row(*row)
    stream = StringIO()
    Console(file=stream, width=WIDTH, color_system=None, markup=False, highlight=False).print(table)
    return "\n".join(line.rstrip() for line in stream.getvalue().splitlines())


def _unit(parameter_unit: str, quantity: str | None, unit: str, units: str) -> tuple[str, float]:
    if not parameter_unit.startswith("u") or units == "field":
        return customary_unit(parameter_unit, quantity, unit) if parameter_unit else ("", 1.0)
    if quantity is None:
        return parameter_unit.replace("u", unit or "u", 1), 1.0
    return si_parameter_unit(parameter_unit, quantity), 1.0
