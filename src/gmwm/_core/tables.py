"""Tables that people read, and data frames."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from io import StringIO
from typing import TYPE_CHECKING, Any

from gmwm._core.text import WIDTH
from gmwm.errors import InputError

if TYPE_CHECKING:
    import pandas


def frame(rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> pandas.DataFrame:
    """A data frame of rows by column, in SI units; an empty one has the columns, too.

    Raises InputError if pandas is not installed.
    """
    try:
        import pandas
    except ImportError:
        raise InputError(
            "tables need pandas, which is not installed: pip install 'gmwm[pandas]'"
        ) from None
    return pandas.DataFrame([dict(row) for row in rows], columns=list(columns))


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
