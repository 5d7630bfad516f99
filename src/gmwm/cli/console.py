"""What the terminal shows: results, and a bar of progress."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
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
