"""What people read of results: lines of 80 columns, sizes in usual units, tables."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from io import StringIO
from math import floor, log10
from typing import TYPE_CHECKING, Any

from gmwm._core.units import factor
from gmwm.errors import InputError

if TYPE_CHECKING:
    import pandas

WIDTH = 80

_UNITS = {"rad/s": ("deg/s",), "m/s^2": ("mg", "g")}
_LARGE, _HUGE, _SMALL = 1000.0, 1e6, 1e-2
_WIDE = 0.3  # of the value: wider intervals are not symmetric


class Printed:
    """A result that a notebook shows as `print` does."""

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def readable(value: float, unit: str, *, sign: bool = False, digits: int = 3) -> str:
    """A number in deg/s, mg or g; in its own unit where that is another.

    unit: Of the channel, SI.
    """
    for name in _UNITS.get(unit, (unit,)):
        shown = value if name == unit else value / factor(name, unit)
        if abs(shown) < _LARGE:
            break
    plus = "+" if sign else ""
    return f"{shown:{plus}.{digits}g} {name}".rstrip()


def brief(value: float, digits: int = 2) -> str:
    """Some significant digits, without an exponent where a person writes none: ``1,230``."""
    text = f"{value:.{digits}g}"
    is_whole = "e+" in text or abs(value) >= _LARGE
    return f"{float(text):,.0f}" if is_whole and abs(value) < _HUGE else text


def per_cent(share: float, digits: int = 2) -> str:
    """A share with its sign: ``118 %``."""
    return f"{brief(100.0 * share, digits)} %"


def with_error(value: float, lower: float, upper: float) -> str:
    """A value with its interval: ``2.66 +-0.01``; ``150 (40 to 290)`` where it is wide.

    The error has one digit, or two if the first is a 1.
    """
    error = 0.5 * (upper - lower)
    if not (0.0 < error < float("inf")):
        return brief(value, 4)
    if error > _WIDE * abs(value):
        return f"{brief(value)} ({brief(lower)} to {brief(upper)})"
    first = floor(log10(error))
    place = first - 1 if error < 2.0 * 10.0**first else first
    if abs(value) < _SMALL:
        power = floor(log10(abs(value)))
        digits = max(0, power - place)
        return f"{value:.{digits}e} +-{error:.{max(0, first - place)}e}"
    digits = max(0, -place)
    return f"{round(value, -place):,.{digits}f} +-{round(error, -place):,.{digits}f}"


def bullets(items: Iterable[object]) -> list[str]:
    """Lines of texts or notices, each after a hyphen."""
    return [line for each in items for line in wrapped(str(each), first="- ", indent=2)]


def wrapped(text: str, first: str = "", indent: int = 0) -> list[str]:
    """Lines of a text after ``first``, the second and later ones indented."""
    return textwrap.wrap(
        text, WIDTH, initial_indent=first, subsequent_indent=" " * indent,
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip


def frame(rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> pandas.DataFrame:
    """A data frame of rows by column, in SI units; an empty one has the columns, too."""
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
