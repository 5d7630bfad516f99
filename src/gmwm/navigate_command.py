"""``gmwm navigate``: parse, run, print, write."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from gmwm.errors import InputError


@click.command()
@click.argument("file", required=False, type=click.Path(path_type=Path), metavar="[STUDY.yaml]")
@click.option("--trajectory", metavar="NAME",
              help="helicopter, car, loiter, or a CSV of time, latitude, longitude, height, roll, "
                   "pitch, yaw.")  # fmt: skip
@click.option("--duration", type=float, help="s, of the trajectory.")
@click.option("--truth", metavar="FILE", help="calibration.json that sensor errors are drawn from.")
@click.option("--filter", "filters", multiple=True, metavar="NAME=FILE",
              help="A filter and the calibration.json that it believes; 'truth' for the true "
                   "models; repeat. The others are compared with the first.")  # fmt: skip
@click.option("--outage", "outages", multiple=True, metavar="START:LENGTH",
              help="Seconds without GNSS; repeat.")  # fmt: skip
@click.option("--runs", type=click.IntRange(min=1), help="Number of runs.  [default: 100]")
@click.option("--seed", type=click.IntRange(min=0), help="[default: 0]")
@click.option("--jobs", type=click.IntRange(min=1), help="Processes; one a core by default.")
@click.option("-o", "--output", type=click.Path(path_type=Path), default=Path("gmwm-navigate"),
              show_default=True, help="Folder for the report, the table and the runs.")  # fmt: skip
@click.option("--resume", is_flag=True, help="Go on with the runs that the folder holds.")
def navigate(
    file: Path | None,
    trajectory: str | None,
    duration: float | None,
    truth: str | None,
    filters: tuple[str, ...],
    outages: tuple[str, ...],
    runs: int | None,
    seed: int | None,
    jobs: int | None,
    output: Path,
    resume: bool,
) -> None:
    """Prove sensor models by navigating: INS/GNSS filters, outages, Monte Carlo.

    Errors of the sensors, drawn from the true models or taken from real static recordings, are
    added to the error-free signals of a trajectory; every filter navigates on the same errors.
    Printed are the errors at the end of the outages and whether each filter knows how good it is.
    A YAML file can say more than the options, which go before it; see docs/navigation.md.

    \b
    Examples:
      gmwm navigate study.yaml -o out
      gmwm navigate --trajectory car --truth cal.json --filter GMWM=cal.json \\
        --filter AV=av.json --outage 600:60 --outage 900:40
    """
    from gmwm.files import folder_to_fill, written
    from gmwm.ins.experiment import Experiment, read_experiment
    from gmwm.ins.validation import Validation
    from gmwm.report.validation_page import write_validation_report

    content: dict[str, Any] = {} if file is None else dict(read_experiment(file))
    content |= _given(trajectory, duration, truth, filters, outages, runs, seed)
    experiment = Experiment.of(content, Path() if file is None else file.parent)
    with folder_to_fill(output) as folder:
        store = folder / "runs"
        if not resume:
            _cleared(store)
        with _progress(experiment.runs) as progress:
            validation = Validation.of(
                experiment, jobs=jobs or os.cpu_count() or 1, folder=store, progress=progress
            )
        text = str(validation)
        table = folder / "validation.txt"
        with written(table) as stream:
            stream.write(text + "\n")
        report = write_validation_report(validation, folder / "validation.html")
    click.echo(text)
    click.echo(f"\nwrote {table}\nwrote {report}")


def _given(
    trajectory: str | None,
    duration: float | None,
    truth: str | None,
    filters: tuple[str, ...],
    outages: tuple[str, ...],
    runs: int | None,
    seed: int | None,
) -> dict[str, Any]:
    """The options as the file would have them; paths are relative to where one is."""
    found: dict[str, Any] = {
        "trajectory": trajectory,
        "duration": duration,
        "truth": None if truth is None else _absolute(truth),
        "runs": runs,
        "seed": seed,
    }
    if filters:
        found["filters"] = dict(_pair(text) for text in filters)
    if outages:
        found["outages"] = [_span(text) for text in outages]
    return {name: each for name, each in found.items() if each is not None}


def _pair(text: str) -> tuple[str, str]:
    name, separator, path = text.partition("=")
    if not (name and separator and path):
        raise InputError(f"--filter {text}: write NAME=FILE, e.g. GMWM=out/calibration.json")
    return name, path if path == "truth" else _absolute(path)


def _absolute(path: str) -> str:
    return str(Path(path).absolute())


def _span(text: str) -> list[float]:
    try:
        start, length = (float(part) for part in text.split(":"))
    except ValueError:
        raise InputError(f"--outage {text}: write START:LENGTH in seconds, e.g. 600:60") from None
    return [start, length]


def _cleared(store: Path) -> None:
    """Forget the runs of an earlier study."""
    for path in [*store.glob("runs-*.npz"), store / "study.json"]:
        path.unlink(missing_ok=True)


@contextmanager
def _progress(total: int) -> Iterator[Callable[[int], None]]:
    """A bar with the time that is left, on a terminal only."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("navigating"), BarColumn(), MofNCompleteColumn(), TextColumn("runs,"),
               TimeRemainingColumn(), TextColumn("left"))  # fmt: skip
    with Bar(*columns, console=Console(file=sys.stderr), transient=True) as bar:
        task = bar.add_task("", total=total)
        yield lambda done: bar.update(task, completed=done)
