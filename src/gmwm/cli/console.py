"""What the terminal shows: results, progress, and advice in the words of the command line."""

from __future__ import annotations

import json
import math
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm._core.typing import Progress
    from gmwm.calibration import Calibration
    from gmwm.issues import Notice


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


HINTS = {
    "accel-unit-missing": "--accel-unit {unit}",
    "channel-unknown": "--channel gyro_x=COLUMN for each channel",
    "channels-swapped": "--channel accel_x=COLUMN for each channel",
    "clock": "--rate 100 --time none",
    "damaged": "get a whole copy, or read the rest with --damaged",
    "earlier-runs": "--resume, or -o FOLDER",
    "gyro-unit-missing": "--gyro-unit deg/s",
    "heading-unknown": "--heading DEG, or heading: in the file",
    "layout": "--layout LAYOUT, one of those in the help of gmwm calibrate",
    "memory": "--channel gyro_x=COLUMN for each of some channels, or, if there is more, "
    "--memory GB with gmwm calibrate and health, and GMWM_MEMORY=GB before the others",
    "missing-key": "--trajectory, --truth and --filter, or --imu, --gnss and --sensors",
    "model-missing": "--model '{channel}=N + K', or leave it out by --channels",
    "no-rest": "--all to take everything as static",
    "no-stamps": "--clock log",
    "other-runs": "-o FOLDER",
    "output": "{first}choose another place with -o",
    "rate": "--rate 100",
    "rate-contradicted": "leave out the rate to use the stamps, or add --time none",
    "runs-in-use": "-o FOLDER",
    "sensor-absent": "record them too, or calibrate the rest alone, --channels {sensor}",
    "time-unit": "--rate {rate:.6g}, or name the column {column}",
    "topic": "--topic NAME",
    "topics-apart": "--topic NAME or --clock log",
    "unit-missing": "name the channel gyro_... or accel_... and give --gyro-unit or --accel-unit",
}


_LEAST_KEPT = 0.2  # share of a recording that is worth calibrating alone
_LONG = 100.0  # s: longer parts begin and end at whole seconds


def with_hint(error: InputError) -> str:
    """The message of an error, its hint in the words of the command line."""
    hint = " ".join(HINTS[code] for code in error.code.split() if code in HINTS)
    usual = {"rate": 100.0, "column": "by its unit", "unit": "g"}
    hint = hint.format(**(usual | error.values))
    if not hint:
        return str(error)
    if error.code == "clock":  # to ignore the stamps is right only if nothing else is
        return str(error).replace("give rate= and time=False", f"give e.g. {hint}")
    if error.hint:
        return f"{error.problem}: {'give e.g. ' if hint.startswith('-') else ''}{hint}"
    return f"{error} (on the command line: {hint})"


def in_options(calibration: Calibration) -> Calibration:
    """A calibration whose notices advise in options, for a report of the command line."""
    part = next((n.values for n in calibration.notices if n.code == "part"), {"start": 0.0})
    span = (part["start"], part["start"] + calibration.duration)
    fits = {
        name: replace(fit, notices=tuple(with_option(each, span) for each in fit.notices))
        for name, fit in calibration.items()
    }
    notices = tuple(with_option(each, span) for each in calibration.notices)
    return replace(calibration, fits=fits, notices=notices)


def with_option(notice: Notice, span: tuple[float, float] | None = None) -> Notice:
    """A notice with the options that do what it advises.

    span: Of the file, s, where times of a calibration count from its start.
    """
    from gmwm.calibration import LONGEST_PART

    values = notice.values
    if notice.code == "sd-assumed":
        return replace(notice, hint=f"give --{notice.where}-sd")
    if notice.code == "axis-up":
        hint = (
            "correct if the sensor is mounted upside down; otherwise give --channel gyro_z=-NAME "
            "--channel accel_z=-NAME, and also y if it points left"
        )
        return replace(notice, hint=hint)
    if notice.code == "vibration":
        return replace(notice, hint="leave it out with --start and --stop, or record again")
    if notice.code in ("not-static", "tilt") and "start" in values and not notice.source:
        return replace(notice, hint=_again(_cut(values["start"], values["stop"], span)))
    options = ["--remove-departures" * bool(values.get("removable"))]
    if notice.code == LONGEST_PART:
        return replace(notice, hint=_again(*options, _cut(values["start"], values["stop"], span)))
    if notice.code == "unsteady" and span is not None and not notice.source:
        first, last, length = values["start"], values["stop"], span[1] - span[0]
        start, stop = (0.0, first) if first > length - last else (last, length)
        return replace(notice, hint=f"{_again(_cut(start, stop, span))} or record again")
    if notice.severity == "note" or not values.get("evident") or values.get("together"):
        return notice
    if span is not None and not notice.source:
        length, last = span[1] - span[0], values["time_upper"]
        last *= 3.0 if notice.code == "transient" else 1.0
        first = values["time_lower"] if notice.code == "step" else 0.0
        start, stop = (last, length) if length - last >= first else (0.0, first)
        if notice.code != "slow-period" and stop - start > _LEAST_KEPT * length:
            options.append(_cut(start, stop, span))
    cause = "find what varies so, such as the temperature" * (notice.code == "slow-period")
    return replace(notice, hint="; ".join(filter(None, [_again(*options), cause])) or notice.hint)


def _cut(start: float, stop: float, span: tuple[float, float] | None) -> str:
    """The options that keep a part, which begins and ends at whole seconds if it is long."""
    zero, end = span or (0.0, math.inf)
    first, last = zero + start, zero + stop
    if stop - start > _LONG:
        first, last = float(math.ceil(first)), float(math.floor(last))
    options = [f"--start {first:.10g}"] if start > 0.0 else []
    return " ".join([*options, f"--stop {last:.10g}"] if zero + stop < end else options)


def _again(*options: str) -> str:
    given = " or ".join(filter(None, options))
    return f"run again with {given}" if given else ""
