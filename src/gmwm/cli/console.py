"""What the terminal shows: results, tables, a bar of progress."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from gmwm._core.typing import Progress


def print_result(
    result: Any,
    *written: str | Path | None,
    text: str = "",
    as_json: bool = False,
    quiet: bool = False,
) -> None:
    """Print a result as text, with the files that were written, or as JSON."""
    if as_json:
        click.echo(json.dumps(result.to_dict(), allow_nan=False))
    elif not quiet:
        wrote = "\n".join(f"wrote {path}" for path in written if path is not None)
        click.echo("\n\n".join(filter(None, (text or str(result), wrote))))


def command_line() -> str:
    """What was typed, for reports."""
    return shlex.join(["gmwm", *sys.argv[1:]])


def new_console(width: int | None = None, *, to_errors: bool = False) -> Console:
    from rich.console import Console

    # Piped output is as wide as a terminal that people use, not as rich guesses. Names come from
    # files: brackets and colons in them are no markup.
    stream = sys.stderr if to_errors else sys.stdout
    width = width or (None if stream.isatty() else 80)
    return Console(width=width, markup=False, emoji=False, stderr=to_errors)


def print_whole(console: Console, table: Table) -> None:
    """Print a table at the width that it needs: a number that is cut off is a wrong number."""
    from rich.measure import Measurement

    needed = Measurement.get(console, console.options.update(width=10_000), table).maximum
    new_console(max(console.width, needed)).print(table)


def new_table(*columns: str) -> Table:
    """A plain table; ``>`` before a title puts the column to the right."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, collapse_padding=True)
    for title in columns:
        justify: Literal["left", "right"] = "right" if title.startswith(">") else "left"
        table.add_column(title.removeprefix(">"), justify=justify, no_wrap=True)
    return table


@contextmanager
def progress_bar(title: str, unit: str, *, quiet: bool = False) -> Iterator[Progress | None]:
    """A bar with the time that is left, on a terminal only."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress as Bar,
        TextColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield None
        return
    columns = (
        TextColumn(title),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(unit + " {task.description}", markup=False),
        TimeRemainingColumn(),
        TextColumn("left"),
    )
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda done, total, what: bar.update(
            task, completed=done, total=total, description=what
        )
