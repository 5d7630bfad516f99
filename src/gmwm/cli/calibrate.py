"""``gmwm calibrate`` and ``gmwm health``: an error model for every channel, and what spoils it."""

from __future__ import annotations

import hashlib
import json
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm._core.files import folder_to_fill, moved_together, opened, replaceable, run_of, write_text
from gmwm.cli.options import (
    FILE_TO_WRITE,
    PATH,
    command_line,
    folder_to_write,
    in_options,
    options,
    print_result,
    progress_bar,
    read_recording,
)
from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm.calibration import Calibration
    from gmwm.estimate import Fit
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
        and calibrate the rest. Not with covariates.
    --temperature  Estimate the curve of each channel against the temperature channel, together
        with its noise.
    --temperature-file FILE  The temperature by time, in seconds from the first sample, if it is not
        in the recording.
    --degree N  Degree of that curve, 1 to 6; by default the best of 1 to 3.
    --covariate NAME=WORDS  The same for another channel, 'time' or 'settling' at switch-on, such as
        'temperature=cubic,lag' or 'settling=300 s'; repeat.
    --export NAME  Also write the file of this program into the folder; see gmwm export --list.
    --datasheet
    --jobs N  Largest number of processes; short recordings take one.
    -v --verbose  Print the error model of each axis and all notices too.
    --memory
    --json
    --quiet
    """,
    output=folder_of_results("gmwm-out"),
    export={"name": "target"},
    covariate={"name": "covariates", "multiple": True},
    jobs={"default": 2},
)
def calibrate(
    files: Sequence[Path],
    output: Path,
    models: dict[str, Any],
    temperature: bool,
    temperature_file: Path | None,
    degree: int | None,
    covariates: Sequence[str],
    target: str | None,
    datasheet: Path | None,
    verbose: bool,
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
    For each channel an error model is selected and estimated. The printed page has N, B and K of
    each axis as in a data sheet, N and K for a filter in SI units, and what to do; the files hold
    everything. Several recordings of one sensor get one model, with a test whether they agree; so
    do the stretches at rest of a log that moves.

    Exit status: 0 if a channel has a valid model, 1 if none has (the files are written all the
    same), 2 if the input cannot be used.

    \b
    Examples:
      gmwm calibrate static.csv --rate 100 --gyro-unit deg/s --accel-unit g -o out
      gmwm calibrate a.csv b.csv --rate 100 --gyro-unit deg/s --accel-unit g
      gmwm calibrate static.bag --export kalibr -o out
      gmwm calibrate chamber.csv --temperature -o out
    """
    _start_workers(files, given["jobs"], memory)
    from gmwm._core.memory import limited
    from gmwm.calibration import calibrate as run
    from gmwm.datasheet import read_datasheet

    work = {name: given.pop(name) for name in ("screening", "still", "remove_departures", "jobs")}
    work["covariates"] = _covariates(
        temperature or temperature_file is not None, degree, covariates
    )
    if target is not None:
        from gmwm._core import checks
        from gmwm.export import TARGETS

        checks.choice("--export", target, tuple(TARGETS))
        replaceable(output / TARGETS[target].file_name)
    with folder_to_fill(output) as folder:
        with limited(memory):
            recordings = _recordings(files, temperature_file, given)
        quantities = {c.name: c.quantity or "" for each in recordings for c in each.inertial}
        for name in models:
            if not any(name in (each, each.partition("_")[0], "") for each in quantities):
                channels = ", ".join(quantities)
                raise InputError(f"--model {name}=...: choose a channel from {channels}")
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
        show(result, written, verbose=verbose)
    exit_unless(any(fit.valid for fit in result.values()), "channel")


def _recordings(
    files: Sequence[Path], temperature: Path | None, reading: dict[str, Any]
) -> list[Recording]:
    """Recordings, with the temperatures of another file where one is given."""
    if temperature is None:
        return [read_recording(file, **reading) for file in files]
    from gmwm.readers import Wanted, open_tables, with_thermometer

    table = open_tables(temperature, Wanted())[0]
    span = {name: reading.pop(name) for name in ("start", "stop")}  # the file's times are not cut
    whole = [with_thermometer(read_recording(file, **reading), table) for file in files]
    return [each.part(**span) for each in whole]


def _covariates(
    temperature: bool, degree: int | None, others: Sequence[str]
) -> dict[str, str] | None:
    """Covariates as `gmwm.calibrate` takes them; None without any."""
    found = {}
    for text in others:
        name, _, words = text.partition("=")
        found[name.strip()] = words or "auto"
    if temperature or degree is not None:
        found.setdefault("temperature", "auto" if degree is None else f"{degree}")
    return found or None


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

        others = worker_pool(extra_workers(jobs, _CHANNELS), "gmwm.calibration")
        click.get_current_context().with_resource(others)


def show(result: Calibration, files: Iterable[str] = (), *, verbose: bool = False) -> None:
    """Print the page, and with ``verbose`` the error models and all notices too."""
    from gmwm._core.text import bullets
    from gmwm.report import summary_text

    advised = in_options(result)
    parts = [summary_text(advised, files)]
    if verbose:
        models = [line for name, fit in result.items() for line in _model_lines(name, fit)]
        parts += ["\n".join(["Error model (+-: 95 % interval)", *models])]
        parts += ["\n".join(["All notices", *bullets(_all_notices(advised))])]
    # `click.echo` takes a terminal of ASCII for one of UTF-8.
    print("\n\n".join(parts))


def _model_lines(name: str, fit: Fit) -> list[str]:
    """The terms of an axis."""
    from gmwm._core.text import brief, with_error, wrapped
    from gmwm.report import error_model

    names = {each.key: each.parameter.name for each in fit.model.parameters}
    rows: dict[str, list[str]] = {}
    for label, one in error_model(fit):
        usual = one.usual
        text = with_error(usual.value, usual.lower, usual.upper)
        if one.kind != "estimated":
            text = f"<= {brief(usual.upper, 3)}" if one.kind == "bound" else f"{usual.value:.4g}"
        key, more = names.get(one.key, "N"), one.meaning.partition(": ")[2]
        rows.setdefault(label, []).append(f"{key} {text} {usual.unit}".rstrip(" -"))
        rows[label] += [] if one.key in names else [more]
    lines = [name if fit.valid else f"{name}, not valid"]
    for label, shown in rows.items():
        lines += wrapped(", ".join(shown), first=f"  {label:<19}", indent=21)
    return lines


def _all_notices(result: Calibration) -> list[str]:
    """Each once, after the channels that it concerns."""
    from gmwm.diagnosis import gathered
    from gmwm.estimate import JointFit
    from gmwm.issues import worst_first

    found = [each for each in gathered(result.notices) if each.severity != "good"]
    for name, fit in result.items():
        own = [each for each in fit.notices if not each.issue.spoils]
        found += [replace(n, where=" ".join(dict.fromkeys((name, n.where))).strip()) for n in own]
    places: dict[str, list[str]] = {}
    for each in worst_first(found):
        places.setdefault(str(replace(each, where="")), []).append(each.where)
    others = [(f"no model, {why.text}", name) for name, why in result.skipped.items()]
    others += [(fit.agreement, name) for name, fit in result.items() if isinstance(fit, JointFit)]
    for text, name in others:
        places.setdefault(text, []).append(name)
    listed = {text: ", ".join(dict.fromkeys(filter(None, each))) for text, each in places.items()}
    return [f"{where}: {text}" if where else text for text, where in listed.items()]


def _hashes(files: Iterable[Path]) -> dict[str, str]:
    """Hash of each file, also of those in a folder, such as a bag."""
    found = {}
    for file in files:
        for one in sorted(file.rglob("*")) if file.is_dir() else [file]:
            if one.is_file():
                with opened(one) as stream:
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
) -> list[str]:
    """Write the files, all or none, then that of another program; returns the last lines."""
    from gmwm._core.text import wrapped
    from gmwm.export import TARGETS, curve_files, export

    document, page, kalibr = (folder / name for name in _FILES)
    written, lines = [f"{page.name} (open this)", document.name], []
    shown = in_options(result)
    with moved_together(folder) as new:
        mark = run_of(result.save(new / document.name))
        source = {**(origin or {}), "run": mark}
        shown.report(new / page.name, recording, datasheet=datasheet, provenance=source)
        if {"gyro", "accel"} <= {fit.wv.quantity for fit in result.values()}:
            try:
                text = export(shown, "kalibr")
                write_text(new / kalibr.name, f"{text}# run: {mark}")
                written.insert(1, f"{kalibr.name} (Kalibr)")
            except InputError as error:  # the other files are no worse for it
                lines = wrapped(f"no {kalibr.name}: {error}")
        if target is not None:  # after a kill, none of another run is left
            (folder / TARGETS[target].file_name).unlink(missing_ok=True)
    has_imu = len(written) > 2
    if not has_imu and kalibr.exists():
        lines.append(f"left {kalibr} of an earlier run: Kalibr needs gyro and accelerometer")
    if target is not None and not (target == "kalibr" and has_imu):
        path = folder / TARGETS[target].file_name
        export(result, target, path=path)
        written.append(f"{path.name} ({target})")
    given = shlex.quote(str(document))
    after = f"gmwm export {given} --to openvins" if has_imu else f"gmwm bound {given}"
    if curves := curve_files(result):
        lines.append(f"curves: gmwm export {given} --to {curves[0]}")
        lines += wrapped(f"  or --to {', '.join(curves[1:])}", indent=2)
    after = after if all(fit.valid for fit in result.values()) else f"1. above, then {after}"
    wrote = wrapped(f"wrote {', '.join(written)} in {folder}", indent=2)
    return [*wrote, *lines, f"next: {after}"]


@click.command()
@click.argument("file", type=PATH)
@options(
    """
    -o --output FILE  Write all findings with their numbers, in SI units, to this file.
    --reading
    --part
    --memory
    --json
    --quiet
    """,
    output=FILE_TO_WRITE,
)
def health(
    file: Path,
    output: Path | None,
    memory: float | None,
    as_json: bool,
    quiet: bool,
    **reading: Any,
) -> None:
    """Find defects of a recording before it is calibrated.

    Motion, gaps, dead and stuck channels, saturation, spikes and shocks, rounding, periodic lines,
    resonances, drift, changes of the noise, dependence between channels; worst first, with what
    to do about it. The exit code is 0 whatever is found. FILE is as for gmwm calibrate.

    \b
    Example:
      gmwm health static.csv --rate 100 --gyro-unit deg/s --accel-unit g
    """
    from gmwm._core.memory import limited
    from gmwm.cli.options import with_option
    from gmwm.diagnosis import health as examine

    with limited(memory):
        recording = read_recording(file, **reading)
    found = examine(recording)
    if output is not None:  # first: who pipes the table into head must not lose it
        found.save(output)
    span = (reading["start"], reading["start"] + recording.duration)
    shown = replace(found, notices=tuple(with_option(each, span) for each in found.notices))
    print_result(found, output, text=str(shown), as_json=as_json, quiet=quiet)
