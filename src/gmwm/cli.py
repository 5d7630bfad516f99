"""Command line: parse, call, print."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from gmwm import __version__
from gmwm.arguments import read_recording, reading_options
from gmwm.errors import InputError
from gmwm.health_command import health
from gmwm.navigate_command import navigate
from gmwm.study.command import reproduce

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from gmwm.calibration import Calibration, Progress
    from gmwm.process import Model
    from gmwm.recording import Recording

_EXIT_INPUT = 2


def _output_option(default: str) -> Callable[[Any], Any]:
    return click.option(
        "-o",
        "--output",
        type=click.Path(path_type=Path),
        default=Path(default),
        show_default=True,
        help="Folder for calibration.json, report.html, imu.yaml.",
    )


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="gmwm")
def cli() -> None:
    """Stochastic error models of inertial sensors from static recordings."""


@cli.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True,
                type=click.Path(path_type=Path))  # fmt: skip
@_output_option("gmwm-out")
@reading_options
@click.option("--leave", "left", multiple=True,
              type=click.Choice(["events", "lines", "resonances", "outliers", "all"]),
              metavar="WHAT",
              help="Leave events, lines, resonances, outliers or all as they are: samples of "
                   "knocks are masked otherwise, lines and resonances are terms that a model may "
                   "have, outliers all over it make the variances robust; repeat.")  # fmt: skip
@click.option("--jobs", type=click.IntRange(min=1), default=1, show_default=True, help="Threads.")
def calibrate(
    files: tuple[Path, ...],
    output: Path,
    rate: float | None,
    gyro_unit: str | None,
    accel_unit: str | None,
    channels: tuple[str, ...],
    time_column: str | None,
    left: tuple[str, ...],
    jobs: int,
) -> None:
    """Calibrate every channel of a static recording, or of several of one sensor.

    FILE is CSV (plain or .gz; any of the usual separators, with or without a header), NPY or NPZ.
    Empty fields, NaN and rows that the time column jumps over are missing samples.
    For each channel an error model is selected and estimated; the table shows it in the units of
    the field, the files hold everything in SI units. Several recordings of one sensor have one
    model, with a test whether they agree.

    \b
    Examples:
      gmwm calibrate static.csv --rate 100 --gyro-unit deg/s --accel-unit g -o out
      gmwm calibrate a.csv b.csv --rate 100 --gyro-unit deg/s --accel-unit g
    """
    from gmwm.calibration import calibrate as run
    from gmwm.files import folder_to_fill
    from gmwm.remedies import REMEDIES

    with folder_to_fill(output) as folder:
        recordings = [
            read_recording(file, rate, gyro_unit, accel_unit, channels, time_column)
            for file in files
        ]
        with _progress(recordings[0], "calibrating") as progress:
            chosen = () if "all" in left else [name for name in REMEDIES if name not in left]
            result = run(recordings, remedies=chosen, jobs=jobs, progress=progress)
        # The files first: who pipes the table into head must not lose them.
        written = _write(result, folder)
    _show(result)
    click.echo(written)


@cli.command()
@_output_option("gmwm-demo")
@click.option("--hours", type=click.FloatRange(0.01, 100.0), default=1.0, show_default=True,
              help="Length of the simulated recording in hours.")  # fmt: skip
@click.option("--seed", type=int, default=1, show_default=True)
def demo(output: Path, hours: float, seed: int) -> None:
    """Simulate a six-axis MEMS IMU at 100 Hz, calibrate it, compare with the truth.

    The error models are those of Table VI of Stebler et al., IEEE/ION PLANS 2012.

    \b
    Example:
      gmwm demo --hours 4 --seed 2
    """
    from gmwm.calibration import calibrate as run
    from gmwm.demo import simulated_imu
    from gmwm.files import folder_to_fill
    from gmwm.report.page import duration_text
    from gmwm.selection import describe

    with folder_to_fill(output) as folder:
        recording, truth = simulated_imu(3600.0 * hours, seed)
        forms = {name: model.opened() for name, model in truth.items()}
        with _progress(recording, "fitting") as progress:
            fitted = run(recording, forms, progress=progress)
        with _progress(recording, "selecting") as progress:
            selected = run(recording, progress=progress)
        written = _write(selected, folder)
    click.echo(f"{recording.source}: {duration_text(recording.duration)} at {recording.rate:g} Hz")
    click.echo("\nTruth and estimate, the form of each model known:\n")
    _show_truth(fitted, truth)
    click.echo("\nSelected where the form is not known, as gmwm calibrate does:\n")
    for name, fit in selected.fits.items():
        click.echo(f"  {name:8}  {describe(fit.model)}")
    click.echo(f"\n{written}")


@cli.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--times", default="1,10,60,600", show_default=True, metavar="T,T,...",
              help="Coasting times in seconds.")  # fmt: skip
@click.option("--unknown-start", is_flag=True,
              help="Nothing is known of the errors at the start; by default the initial values of "
                   "the slow ones are, as after aiding.")  # fmt: skip
def budget(file: Path, times: str, unknown_start: bool) -> None:
    """Predict the error growth of unaided navigation.

    FILE is a calibration.json. For each term of each channel's model: attitude (deg), velocity
    (m/s) and position (m) errors, 1 sigma, after coasting level and without manoeuvres. Valid up
    to 600 seconds or so.

    \b
    Example:
      gmwm budget out/calibration.json --times 1,10,60
    """
    from gmwm.calibration import load
    from gmwm.coasting import error_budget

    click.echo(error_budget(load(file), _seconds(times), calibrated=not unknown_start))


cli.add_command(health)
cli.add_command(navigate)
cli.add_command(reproduce)


def main() -> None:
    """Entry point: bad input is one sentence and exit code 2, never a traceback."""
    try:
        cli.main(standalone_mode=False)
    except InputError as error:
        click.echo(f"gmwm: {error}", err=True)
        sys.exit(_EXIT_INPUT)
    except click.exceptions.Exit as error:
        sys.exit(error.exit_code)
    except click.ClickException as error:
        click.echo(f"gmwm: {error.format_message()}", err=True)
        sys.exit(_EXIT_INPUT)
    except click.Abort:
        click.echo("gmwm: interrupted, no file is half-written", err=True)
        sys.exit(130)


# -- arguments ------------------------------------------------------------------------------------


def _seconds(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"--times {text}: write seconds, e.g. 1,10,60") from None


# -- what is printed ------------------------------------------------------------------------------


@contextmanager
def _progress(recording: Recording, what: str) -> Iterator[Progress]:
    """A bar over the channels, on a terminal only."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    bar = Progress(
        TextColumn(what),
        BarColumn(),
        TextColumn("{task.completed}/{task.total} channels {task.description}"),
        TimeElapsedColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    with bar:
        task = bar.add_task("", total=len(recording))

        def done(name: str) -> None:
            bar.update(task, advance=1, description=name)

        yield done


def _show(result: Calibration) -> None:
    from gmwm.estimate.joint import JointFit
    from gmwm.report.page import duration_text

    console = _console()
    console.print(
        f"{result.source}: {duration_text(result.duration)} at {result.rate:g} Hz, "
        f"{result.n:,} samples a channel",
        highlight=False,
    )
    _print_whole(console, _table(result))
    for note in (*result.notes, *result.warnings):
        console.print(f"- {note}", highlight=False)
    for name, why in result.skipped.items():
        console.print(f"- {name} skipped: {why}", highlight=False)
    for name, fit in result.fits.items():
        if isinstance(fit, JointFit):
            console.print(f"- {name}: {fit.agreement}", highlight=False)
        for remark in fit.remarks:
            console.print(f"- {name}: {remark}", highlight=False)


def _console(width: int | None = None) -> Console:
    from rich.console import Console

    # Piped output is as wide as a terminal that people use, not as rich guesses.
    return Console(width=width or (None if sys.stdout.isatty() else 80))


def _print_whole(console: Console, table: Table) -> None:
    """Print a table at the width that it needs: a number that is cut off is a wrong number."""
    from rich.measure import Measurement

    needed = Measurement.get(console, console.options.update(width=10_000), table).maximum
    _console(max(console.width, needed)).print(table)


def _table(result: Calibration) -> Table:
    table = _new_table("channel", "parameter", ">estimate", "95 % interval", "unit")
    for name, fit in result.fits.items():
        rows = fit.rows()
        for i, row in enumerate(rows):
            si = (row["value"], row["lower"], row["upper"], row["unit"])
            value, low, high, unit = row["field"][0] if row["field"] else si
            cells = [name if i == 0 else "", row["key"]]
            if row["kind"] == "bound":
                cells += [f"{value:.3g}", f"below {high:.3g}", unit]
            elif row["kind"] == "estimated":
                cells += [f"{value:.4g}", f"{low:.4g} .. {high:.4g}", unit]
            else:
                cells += [f"{value:.4g}", row["kind"], unit]
            if i == 1 and not fit.valid:
                cells[0] = "not valid"
            last = i == len(rows) - 1
            table.add_row(*cells, end_section=last and (fit.valid or i > 0))
        if len(rows) == 1 and not fit.valid:
            table.add_row("not valid", "", "", "", "", end_section=True)
    return table


def _show_truth(fitted: Calibration, truth: dict[str, Model]) -> None:
    """One table of truth beside estimate."""
    from gmwm.demo import compare

    table = _new_table("channel", "param.", ">truth", ">estimate", "95 % interval", "unit")
    determined = covered = total = 0
    for name, fit in fitted.fits.items():
        rows = compare(fit, truth[name])
        for i, row in enumerate(rows):
            total += 1
            determined += row.determined
            covered += row.determined and row.covered
            cells = [f"{row.estimate:.4g}", f"{row.lower:.4g} .. {row.upper:.4g}"]
            if not row.determined:
                cells = ["-", "too short to tell"]
            elif row.lower == 0.0:
                cells = [f"{row.estimate:.3g}", f"below {row.upper:.4g}"]
            if not row.covered:
                cells[1] += " *"
            first = name if i == 0 else ""
            table.add_row(first, row.what, f"{row.truth:.4g}", *cells, row.unit,
                          end_section=i == len(rows) - 1)  # fmt: skip
    console = _console()
    _print_whole(console, table)
    console.print(
        f"{determined} of {total} parameters are determined by this record; {covered} of these "
        f"{determined} intervals hold the truth (* does not).",
        highlight=False,
    )


def _new_table(*columns: str) -> Table:
    """A plain table; ``>`` before a title puts the column to the right."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for title in columns:
        justify: Literal["left", "right"] = "right" if title.startswith(">") else "left"
        table.add_column(title.removeprefix(">"), justify=justify, no_wrap=True)
    return table


def _write(result: Calibration, folder: Path) -> str:
    """Write the files; returns what to say of them."""
    from gmwm.export import write_kalibr
    from gmwm.files import replaceable

    paths = [replaceable(folder / name) for name in ("calibration.json", "report.html")]
    kalibr = replaceable(folder / "imu.yaml")
    quantities = {fit.wv.quantity for fit in result.fits.values()}
    lines = []
    if {"gyro", "accel"} <= quantities:
        try:
            paths.append(write_kalibr(result, kalibr))
        except InputError as error:
            lines = [f"no imu.yaml: {error}"]  # the other files are no worse for it
    elif kalibr.exists():
        lines = [f"left {kalibr} of an earlier run: Kalibr needs gyro and accelerometer"]
    result.report(paths[1])
    result.save(paths[0])
    return "\n".join([f"wrote {path}" for path in paths] + lines)


if __name__ == "__main__":
    main()
