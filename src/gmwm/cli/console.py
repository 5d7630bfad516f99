"""What the terminal shows: results, progress, and advice in the words of the command line."""

from __future__ import annotations

import json
import math
import re
import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm._core.files import toml_beside
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
    from rich import progress
    from rich.console import Console

    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield None
        return
    text = progress.TextColumn
    what = text(f"{unit} {{task.description}}", markup=False)
    columns = (text(title), progress.BarColumn(), progress.MofNCompleteColumn(), what)
    left = (progress.TimeRemainingColumn(), text("left"))
    with progress.Progress(*columns, *left, console=console, transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda done, total, what: bar.update(
            task, completed=done, total=total, description=what
        )


HINTS: dict[str, str] = toml_beside(__file__)


Span = tuple[float, float] | None

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
        hint = hint if "rate" in error.values else "the sampling rate, --rate, and --time none"
        return f"{error.problem}: {re.sub('give [^;]*time=False', f'give {hint}', error.hint)}"
    if error.hint:
        return f"{error.problem}: {'give e.g. ' if hint.startswith('-') else ''}{hint}"
    return f"{error} (on the command line: {hint})"


def in_options(calibration: Calibration) -> Calibration:
    """A calibration whose notices advise in options, for a report of the command line."""
    from gmwm.calibration import LONGEST_PART

    part = next((n.values for n in calibration.notices if n.code == "part"), {"start": 0.0})
    span = (part["start"], part["start"] + calibration.duration)
    notices = tuple(with_option(each, span) for each in calibration.notices)
    longest = next((n.hint for n in notices if n.code == LONGEST_PART), "")
    # Samples at which a step may be are left out where it is subtracted.
    steps = [[n.values for n in fit.notices if n.code == "step"] for fit in calibration.values()]
    lost = max(sum(v.get("time_upper", 0) - v.get("time_lower", 0) for v in own) for own in steps)
    fits = {
        name: replace(fit, notices=tuple(with_option(n, span, lost, longest) for n in fit.notices))
        for name, fit in calibration.items()
    }
    return replace(calibration, fits=fits, notices=notices)


def with_option(notice: Notice, span: Span = None, lost: float = 0.0, longest: str = "") -> Notice:
    """A notice with the options that do what it advises.

    span: Of the file, s, where times of a calibration count from its start.
    lost: s: of a channel, where departures are subtracted.
    longest: How to calibrate the longest part without any.
    """
    from gmwm.calibration import LONGEST_PART

    values = notice.values
    always = {
        "sd-assumed": f"give --{notice.where}-sd",
        "axis-up": "correct if the sensor is mounted upside down. If z points up give --channel "
        "gyro_z=-NAME --channel accel_z=-NAME, and also y if it points left; if accelerometers "
        "read gravity instead of the reaction to it, reverse accel_x, accel_y and accel_z only",
        "noise-scales": "for numbers at your working temperature give --temperature to gmwm bound, "
        "budget and export",
        "curve-lags": "add a lag, such as --covariate temperature=cubic,lag",
        "vibration": "leave it out with --start and --stop, or record again",
    }
    if unit := values.get("alike"):
        sensor = "gyro" if notice.code == "gyro-unit" else "accel"
        always[notice.code] = f"values look like {unit}: use --{sensor}-unit {unit}"
    if notice.code in always:
        return replace(notice, hint=always[notice.code])
    is_part = notice.code in ("not-static", "tilt") and "start" in values and not notice.source
    if is_part or notice.code == LONGEST_PART:
        return replace(notice, hint=f"rerun with {_cut(values['start'], values['stop'], span)}")
    length = span[1] - span[0] if span is not None and not notice.source else 0.0
    if notice.code == "unsteady" and length:
        first, last = values["start"], values["stop"]
        ends = (0.0, first) if first > length - last else (last, length)
        return replace(notice, hint=_rerun(_cut(ends[0], ends[1], span), ends[1] - ends[0], length))
    if notice.severity == "note" or not values.get("evident"):
        return notice
    hint = longest if values.get("together") else ""
    if values.get("removable"):
        hint = _rerun("--remove-departures", length - lost, length)
    elif length and not hint and notice.code != "slow-period":
        last = values["time_upper"] * (3.0 if notice.code == "transient" else 1.0)
        first = values["time_lower"] if notice.code == "step" else 0.0
        ends = (last, length) if length - last >= first else (0.0, first)
        if ends[1] - ends[0] > _LEAST_KEPT * length:
            hint = _rerun(_cut(ends[0], ends[1], span), ends[1] - ends[0], length)
    cause = "find the cause, such as the temperature" * (notice.code == "slow-period")
    return replace(notice, hint="; ".join(filter(None, [hint, cause])) or notice.hint)


def _rerun(options: str, kept: float, length: float) -> str:
    """The command, and how many seconds of a recording it keeps; of length 0: unknown."""
    from gmwm.report import duration_text

    shown, whole = map(duration_text, (kept, length))
    keeps = "the whole recording" if shown == whole else f"about {shown} of {whole}"
    return f"rerun with {options}" + f": keeps {keeps}" * (kept > 0.0)


def _cut(start: float, stop: float, span: Span) -> str:
    """The options that keep a part, which begins and ends at whole seconds if it is long."""
    zero, end = span or (0.0, math.inf)
    first, last = zero + start, zero + stop
    if stop - start > _LONG:
        first, last = float(math.ceil(first)), float(math.floor(last))
    options = [f"--start {first:.10g}"] if start > 0.0 else []
    return " ".join([*options, f"--stop {last:.10g}"] if zero + stop < end else options)
