"""``gmwm calibrate``: a recording in, an error model for every channel out."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm._core.files import folder_to_fill, moved_together, replaceable
from gmwm._core.text import wrapped
from gmwm.cli.console import command_line, new_console, new_table, print_whole, progress_bar
from gmwm.cli.hints import in_options, with_option
from gmwm.cli.options import PATH, folder_to_write, options, read_recording
from gmwm.errors import InputError

if TYPE_CHECKING:
    from rich.table import Table

    from gmwm.calibration import Calibration, Stopwatch
    from gmwm.estimate.result import Estimate
    from gmwm.issues import Notice
    from gmwm.readers import Recording

NONE_VALID = 1
"""Exit status."""

_LARGE, _CHANNELS = 4 << 20, 6
"""Bytes of a file, plain or packed, that has enough samples for two processes; their channels."""

_ARRAYS = 2.0
"""Memory of a file's columns and of the arrays made of them, in its size; a file whose samples are
kept on disk is calibrated by one process."""

_FILES = ("calibration.json", "report.html", "imu.yaml")


def folder_of_results(default: str) -> dict[str, Any]:
    """Settings of the option of a folder for what `write_files` writes."""
    return folder_to_write(default, _FILES)


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=PATH)
@options(
    """
    -o --output  Folder for calibration.json, report.html, imu.yaml.
    --reading
    --part
    --estimating
    --remove-departures  Subtract steps, transients at the start and slow periods that are found,
        and calibrate what is left.
    --export NAME  Also write the file of this program into the folder; see gmwm export --list.
    --datasheet
    --jobs N  Processes at most; short recordings take one.
    --timings  Print where the time went, stage by stage.
    --memory
    --json
    --quiet
    """,
    output=folder_of_results("gmwm-out"),
    export={"name": "target"},
    jobs={"default": 2},
)
def calibrate(
    files: Sequence[Path],
    output: Path,
    models: dict[str, Any],
    target: str | None,
    datasheet: Path | None,
    timings: bool,
    memory: float | None,
    as_json: bool,
    quiet: bool,
    **given: Any,
) -> None:
    """Find an error model for every channel of a recording at rest.

    FILE is CSV (plain or .gz; any of the usual separators, with or without a header), NPY, NPZ,
    MAT, HDF5, Parquet or Feather; a bag of ROS 1 (.bag) or ROS 2 (folder, .mcap, .db3), or a log of
    PX4 (.ulg) or ArduPilot (.bin). Empty fields, NaN and rows that the time column jumps over are
    missing samples.
    For each channel an error model is selected and estimated; the table shows it in the units of
    the field, the files hold everything in SI units. Several recordings of one sensor have one
    model, with a test whether they agree; so have the stretches at rest of a log that moves.

    Exit status: 0 if a channel has a valid model, 1 if none has (the files are written all the
    same), 2 if the input cannot be used.

    \b
    Examples:
      gmwm calibrate static.csv --rate 100 --gyro-unit deg/s --accel-unit g -o out
      gmwm calibrate a.csv b.csv --rate 100 --gyro-unit deg/s --accel-unit g
      gmwm calibrate static.bag --export kalibr -o out
    """
    _start_workers(files, given["jobs"], memory)
    from gmwm._core.memory import limited
    from gmwm.calibration import Stopwatch, calibrate as run, stage
    from gmwm.report import read_datasheet

    work = {name: given.pop(name) for name in ("screening", "still", "remove_departures", "jobs")}
    if target is not None:
        from gmwm._core import checks
        from gmwm.export import TARGETS

        checks.choice("--export", target, tuple(TARGETS))
        replaceable(output / TARGETS[target].file_name)
    with folder_to_fill(output) as folder, Stopwatch().running() as watch:
        with stage("read"), limited(memory):
            recordings = [read_recording(file, **given) for file in files]
        quantities = {c.name: c.quantity or "" for each in recordings for c in each.inertial}
        for name in models:
            if not any(name in (each, each.partition("_")[0], "") for each in quantities):
                channels = ", ".join(quantities)
                raise InputError(f"--model {name}=...: the channels are {channels}")
        if datasheet is not None:  # rejected before the work
            read_datasheet(datasheet, quantities)
        with progress_bar("calibrating", "channels", quiet=quiet) as bar:
            if bar is not None:
                bar(0, len(quantities), "being examined")
            result = run(recordings, models or None, progress=bar, **work)
        # The files first: who pipes the table into head must not lose them.
        origin = {"command": command_line()} | _hashes(files)
        own = recordings[0] if len(recordings) == 1 else None
        written = write_files(result, folder, own, datasheet, origin, target)
    if as_json:
        click.echo(json.dumps(result.to_dict(), allow_nan=False))
    elif not quiet:
        show(result)
        click.echo(written)
    if timings:
        _show_timings(watch, work["jobs"])
    exit_unless(any(fit.valid for fit in result.values()), "channel")


def exit_unless(valid: bool, what: str) -> None:
    """End with the status for no valid model."""
    if not valid:
        click.echo(f"gmwm: no {what} has a valid model, see the report", err=True)
        click.get_current_context().exit(NONE_VALID)


def _start_workers(files: Sequence[Path], jobs: int, memory: float | None) -> None:
    """Start another process for a large file, so that it has done its imports when needed."""
    from gmwm._core.memory import held, limited

    with limited(memory):
        on_disk = held() * (1 << 30) / _ARRAYS
    if any(file.is_file() and _LARGE < file.stat().st_size < on_disk for file in files):
        from gmwm._core.jobs import extra_workers, worker_pool

        others = worker_pool(extra_workers(jobs, _CHANNELS), "gmwm.estimate:compile_search")
        click.get_current_context().with_resource(others)


def _show_timings(watch: Stopwatch, jobs: int) -> None:
    """On the stream of errors: the output of --json stays JSON."""
    table = new_table("stage", ">seconds", ">of the processor")
    rows = [*watch.elapsed.items(), ("all stages", sum(watch.elapsed.values()))]
    worked = {**watch.worked, "all stages": sum(watch.worked.values())}
    for name, elapsed in rows:
        table.add_row(name, f"{elapsed:.2f}", f"{worked[name]:.2f}")
    console = new_console(to_errors=True)
    console.print(table)
    if jobs > 1:
        console.print("stages of channels run side by side: their seconds are added up")


def show(result: Calibration) -> None:
    from gmwm.calibration import LONGEST_PART
    from gmwm.diagnosis import gathered
    from gmwm.estimate.result import JointFit
    from gmwm.issues import worst_first
    from gmwm.report import duration_text

    size = f"{duration_text(result.duration)} at {result.rate:g} Hz, {result.n:,} samples a channel"
    # `click.echo` takes a terminal of ASCII for one of UTF-8.
    print("\n".join(wrapped(f"{result.source}: {size}", indent=2)))
    print_whole(new_console(), _table(result))
    reasons = [
        (name, notice)
        for name, fit in result.fits.items()
        for notice in fit.notices
        if notice.severity == "bad"
    ]
    said = {(name, notice.code) for name, notice in reasons}
    shown = [each for each in result.notices if (each.where, each.code) not in said]
    found = [each for each in worst_first(gathered(shown)) if _is_shown(each)]
    counted = {each.where for each in found if each.code == "event"}  # with their samples
    found = [e for e in found if e.code != "events-left-out" or e.where not in counted]
    found = [*(each for each in shown if each.code == LONGEST_PART), *found]
    remarks = [str(with_option(each)) for each in found]
    remarks += [f"{name} skipped: {why.text}" for name, why in result.skipped.items()]
    for name, fit in result.fits.items():
        if isinstance(fit, JointFit):
            remarks.append(f"{name}: {fit.agreement}")
        of_fit = [each for each in fit.notices if not each.issue.spoils]
        remarks += [f"{name}: {with_option(n)}" for n in of_fit if n.severity != "bad"]
    invalid = [f"{name} is not valid: {with_option(notice)}" for name, notice in reasons]
    for remark in (*invalid, *remarks):
        print("\n".join(wrapped(remark, first="- ", indent=2)))


def _is_shown(notice: Notice) -> bool:
    """How the file was read, and what may spoil the estimates; the report has the rest."""
    if notice.issue.topic in ("reading", "clock") or notice.code == "events-left-out":
        return True
    if notice.code == "length":
        return notice.severity != "good"
    return notice.severity in ("warning", "bad") and notice.issue.repeats != "reader"


def _table(result: Calibration) -> Table:
    from gmwm.calibration import left_open

    walks = left_open(result)
    table = new_table("channel", "parameter", ">estimate", "95 % interval", "unit")
    for name, fit in result.fits.items():
        rows = [_cells(row) for row in fit.estimates]
        if name in walks:  # which the model lacks, and the filter's numbers have
            value, unit = walks[name]
            rows.append(("K", "0", f"below {value:.4g}", unit))
        if not fit.valid and len(rows) == 1:
            rows.append(("", "", "", ""))
        firsts = {0: name, 1: "" if fit.valid else "not valid"}
        for i, row in enumerate(rows):
            table.add_row(firsts.get(i, ""), *row, end_section=i == len(rows) - 1)
    return table


def _cells(row: Estimate) -> tuple[str, str, str, str]:
    usual = row.usual
    interval: str = row.kind
    if row.kind == "bound":
        interval = f"below {usual.upper:.4g}"
    elif row.kind == "estimated":
        interval = f"{usual.lower:.4g} .. {usual.upper:.4g}"
    return row.key, f"{usual.value:.4g}", interval, usual.unit


def _hashes(files: Iterable[Path]) -> dict[str, str]:
    """Of each file, and of those in a folder, as a bag is one."""
    found = {}
    for file in files:
        for one in sorted(file.rglob("*")) if file.is_dir() else [file]:
            if one.is_file():
                with one.open("rb") as stream:
                    digest = hashlib.file_digest(stream, "sha256").hexdigest()
                found[f"sha256 of {one.relative_to(file.parent)}"] = digest
    return found


def write_files(
    result: Calibration,
    folder: Path,
    recording: Recording | None = None,
    datasheet: Path | None = None,
    origin: Mapping[str, str] | None = None,
    target: str | None = None,
) -> str:
    """Write the files, all or none, then that of another program; returns what to say of them."""
    from gmwm.calibration import stage
    from gmwm.export import TARGETS, export

    names = [*_FILES[:2]]
    quantities = {fit.wv.quantity for fit in result.fits.values()}
    lines = []
    with moved_together(folder) as new:
        with stage("report"):
            shown = in_options(result)
            shown.report(new / names[1], recording, datasheet=datasheet, provenance=origin)
        with stage("exports"):
            result.save(new / names[0])
        if {"gyro", "accel"} <= quantities:
            try:
                with stage("exports"):
                    export(shown, "kalibr", path=new / "imu.yaml")
                names.append("imu.yaml")
                horizon = f"{TARGETS['kalibr'].horizon:g} s"
                lines = [f"imu.yaml: N and K for outages up to {horizon}; others: gmwm export"]
            except InputError as error:
                lines = [f"no imu.yaml: {error}"]  # the other files are no worse for it
    kalibr = folder / "imu.yaml"
    if "imu.yaml" not in names and kalibr.exists():
        lines.append(f"left {kalibr} of an earlier run: Kalibr needs gyro and accelerometer")
    if target is not None and not (target == "kalibr" and "imu.yaml" in names):
        path = folder / TARGETS[target].file_name
        with stage("exports"):
            export(result, target, path=path)
        lines.append(f"wrote {path} for {target}")
    return "\n".join([f"wrote {folder / name}" for name in names] + lines)
