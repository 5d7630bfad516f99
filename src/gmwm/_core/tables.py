"""Tables that people read, and data frames."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
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
        side: Any = "right" if k and _is_number(k, rows) else "left"
        table.add_column(head, justify=side, vertical="bottom")
    for row in rows:
        table.add_row(*row)
    stream = StringIO()
    Console(file=stream, width=WIDTH, color_system=None, markup=False, highlight=False).print(table)
    return "\n".join(line.rstrip() for line in stream.getvalue().splitlines())


_GREEN, _RED = "#22863a", "#d73a49"  # readable on white and on black
_MARKS = {"valid": _GREEN, "chosen": _GREEN, "not valid": _RED, "bad": _RED}


def html_table(
    title: str,
    heads: Sequence[str],
    rows: Sequence[Sequence[str]],
    notes: Iterable[object] = (),
    mark: str = "",
) -> str:
    """A table of texts for notebooks: numbers to the right, verdicts and upper limits marked.

    mark: "valid" or "not valid", of the whole table, after its title.
    """

    def shown(text: str) -> str:
        if text in _MARKS:
            sign = "\u2717" if _MARKS[text] == _RED else "\u2713"
            return f'<b style="color:{_MARKS[text]}">{sign} {text}</b>'
        limit = f'<span title="95 % upper limit">\u2264 {escape(text[3:])}</span>'
        return limit if text.startswith("<= ") else escape(text).replace("\n", "<br/>")

    lines = [f"<p><b>{escape(title)}</b> {shown(mark)}</p><table>"]
    sides = ["right" if _is_number(k, rows) else "left" for k in range(len(heads))]
    for tag, row in [("th", heads), *(("td", row) for row in rows)]:
        styles = (f'style="text-align:{side};padding:1px 8px"' for side in sides)
        cells = zip(styles, map(shown, row), strict=True)
        line = "".join(f"<{tag} {style}>{text}</{tag}>" for style, text in cells)
        lines.append(f"<tr>{line}</tr>")
    listed = [f"<li>{escape(str(note))}</li>" for note in notes]
    return "\n".join([*lines, "</table>", *(["<ul>", *listed, "</ul>"] if listed else [])])


def _is_number(k: int, rows: Sequence[Sequence[str]]) -> bool:
    return all(row[k][:1] in "-+<\u2264.0123456789" for row in rows)
