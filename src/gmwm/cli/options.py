"""What commands share: arguments, and what the terminal shows in the words of the command line."""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm._core.files import toml_beside, writable_file, writable_folder
from gmwm.errors import InputError
from gmwm.readers import CLOCKS, NAMES as FORMATS

if TYPE_CHECKING:
    from gmwm._core.typing import Progress
    from gmwm.calibration import Calibration
    from gmwm.issues import Notice
    from gmwm.process import Model
    from gmwm.readers import Recording


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
        return str(error).replace("rate=HZ and time=False", hint)
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
        "time-column": "to choose another, give --time",
        "sd-assumed": f"give --{notice.where}-sd",
        "axis-up": "correct if the sensor is mounted upside down. If z points up give --channel "
        "gyro_z=-NAME --channel accel_z=-NAME, and also y if it points left; if accelerometers "
        "read gravity instead of the reaction to it, reverse accel_x, accel_y and accel_z only",
        "noise-scales": "for numbers at your working temperature give --temperature to gmwm bound, "
        "budget and export",
        "curve-lags": "add a lag, such as --covariate temperature=cubic,lag, or check the "
        "thermometer's clock",
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
    cause = "find the cause, such as the temperature or a failing thermometer"
    cause *= notice.code == "slow-period"
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


_SCREENING = ("events", "lines", "resonances", "outliers")

Decorator = Callable[[Any], Any]

PATH = click.Path(path_type=Path)
_TYPES = {"FILE": PATH, "YAML": PATH, "N": click.IntRange(min=1), "NUMBER": float, "S": float}
"""What is to be given -> its type; other values are texts."""

FILE_TO_WRITE = {"type": PATH, "callback": lambda _, __, path: path and writable_file(path)}
"""Settings of an option: a path that cannot be written is rejected before any work."""


def folder_to_write(default: str, names: Sequence[str] = ()) -> dict[str, Any]:
    """Settings of the option of a folder to fill with files of these names, checked likewise."""

    def checked(_: click.Context, __: click.Parameter, path: Path) -> Path:
        return writable_folder(path, names)

    return {"type": PATH, "default": Path(default), "callback": checked}


def options(declared: str, **settings: dict[str, Any]) -> Decorator:
    """The options of a command, declared as its help shows them.

    declared: On each line flags, what is to be given after them, if it is no switch, two blanks
        and the help, which may go on on further lines; or only the name of an option or a group of
        `_SHARED`, as a flag.
    settings: Of `click.option`, by the name of the last flag; ``name`` is that of the argument.
    """
    given = _group(declared, settings)

    def decorated(command: Any) -> Any:
        for each in reversed(given):
            command = each(command)
        return command

    return decorated


def _declared(declared: str, settings: dict[str, dict[str, Any]]) -> dict[str, list[Decorator]]:
    """The option or the group of each name."""
    found: dict[str, list[Decorator]] = {}
    for entry in re.split(r"\n +(?=-)", declared)[1:]:
        usage, _, text = entry.strip().partition("  ")
        flags = [word for word in usage.split() if word.startswith("-")]
        key = flags[-1].lstrip("-").replace("-", "_")
        if not text and key in _SHARED:
            found[key] = _SHARED[key]
            continue
        metavar, own = usage.removeprefix(" ".join(flags)).strip(), dict(settings.get(key, {}))
        # A default is added to the help, unless it is zero or settings hide it.
        usual: dict[str, Any] = {"show_default": bool(own.get("default"))}
        if metavar in _TYPES:
            usual["type"] = _TYPES[metavar]
        elif not metavar and "type" not in own:
            usual["is_flag"] = True
        names = [*flags, own.pop("name")] if "name" in own else flags
        usual |= {"metavar": metavar or None, "help": " ".join(text.split())}
        found[key] = [click.option(*names, **(usual | own))]
    if unknown := settings.keys() - found.keys():
        raise KeyError(f"settings of options that are not declared: {unknown}")
    return found


def _group(declared: str, settings: dict[str, dict[str, Any]]) -> list[Decorator]:
    return [each for group in _declared(declared, settings).values() for each in group]


class _ModelOption(click.Option):
    """An option whose help names the terms of a model, which take long to import."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        from gmwm.process import CATALOGUE

        terms = sorted((k.short_name for k in CATALOGUE), key=lambda name: (len(name), name))
        self.help = (self.help or "").replace("{terms}", ", ".join(terms))
        return super().get_help_record(ctx)


def numbers(flag: str, text: str, form: str, *counts: int, separator: str = ",") -> list[float]:
    """The numbers of an option.

    form: How they are to be written, for messages.
    counts: How many there may be; by default any number.
    """
    try:
        found = [float(part) for part in text.split(separator)]
    except ValueError:
        found = []
    if not found or (counts and len(found) not in counts):
        raise InputError(f"{flag} {text}: write {form}")
    return found


def seconds(flag: str, text: str) -> list[float]:
    """Times of an option, separated by commas."""
    return numbers(flag, text, "seconds, e.g. 1,10,60")


READING = ("rate", "gyro_unit", "accel_unit", "channel", "time", "format", "layout", "damaged")
"""Arguments of the options of a file."""

_SHARED: dict[str, list[Decorator]] = {}
_SHARED["reading"] = _group(
    f"""
    --rate NUMBER  Sampling rate in Hz; needed without a time column.
    --gyro-unit TEXT  Unit of the gyro columns: rad/s, deg/s, deg/h, ...
    --accel-unit TEXT  Unit of the accelerometer columns: m/s^2, g, mg, ...
    --channel NAME=COLUMN  Role of a column by its name or 0-based number, e.g. gyro_x=wx or
        accel_z=5; repeat. By default roles are guessed from the column names.
    --time COLUMN  Time column by name or number; 'none' to ignore it.
    --format NAME  File format, if content and name do not show it: {", ".join(FORMATS)}.
    --layout LAYOUT  Layout of a binary file without a header: IMAR, LN200, LN200IG, IXSEA,
        NAVCHIP_INT, NAVCHIP_FLT, KF-GINS, or TYPE,GYRO_SCALE,ACCEL_SCALE[,rates][,little|big].
    --damaged  Use the readable part of a text or a flight log that is cut off or damaged; by
        default it is rejected.
    """,
    {"channel": {"multiple": True}, "format": {"type": click.Choice(FORMATS)}},
)
_SHARED["part"] = _group(
    """
    --topic NAME  Topic of a bag or a flight log; needed if several have an IMU. Repeat it if gyros
        and accelerometers have separate topics.
    --clock  Time stamps to use: those in the message headers, or the times of recording.
    --channels NAME,...  Only these channels: gyro_x,accel_z, or gyro for all of them.
    --start S  Leave out samples before this time, in seconds.
    --stop S  Leave out samples after this time, in seconds.
    """,
    {
        "topic": {"multiple": True},
        "clock": {"type": click.Choice(CLOCKS), "default": CLOCKS[0]},
        "start": {"default": 0.0},
    },
)
_SHARED["estimating"] = _group(  # named as arguments of `gmwm.calibrate`
    """
    --model [NAME=]MODEL  Fit this model instead of selecting one: terms {terms}, e.g.
        'N + K + 2 GM'; or 'gyro=N + 2 GM' for a sensor or channel; repeat.
    --leave WHAT  Leave events, lines, resonances, outliers or all as they are; repeat. By default
        shocks and outliers are masked, and lines and resonances become terms if needed.
    --all  Treat everything as static; by default only the stretches at rest of a log that moves are
        used.
    """,
    {
        "model": {
            "cls": _ModelOption,
            "name": "models",
            "multiple": True,
            "callback": lambda _, __, texts: written_models(texts),
        },
        "leave": {
            "name": "screening",
            "multiple": True,
            "type": click.Choice([*_SCREENING, "all"]),
            "callback": lambda _, __, left: [
                each for each in _SCREENING if each not in left and "all" not in left
            ],
        },
        "all": {"name": "still", "callback": lambda _, __, everything: not everything},
    },
)
_SHARED |= _declared(
    """
    --jobs N  Number of processes; by default one for each core.
    --cluster ADDRESS  Dask scheduler that does the work, e.g. tcp://10.0.0.1:8786.
    --resume  Continue the interrupted run in the folder.
    --horizon S  Longest outage that the filter numbers cover, in seconds.
    --temperature NUMBER  Use the noise at this temperature, or at this value of another covariate;
        by default the average of the recording.
    --datasheet YAML  N, B and K by sensor or channel, each with its unit, to be drawn over the
        curves of the report: 'gyro: {N: 0.15 deg/sqrt(h), B: 7 deg/h}'.
    --memory GB  Memory for the samples, by default 1 GB. A longer file is kept on disk, in TMPDIR;
        memory then holds about three times one channel.
    --units  Units of the table; files and JSON are in SI.
    --json  Print the result as JSON, in SI units.
    -q --quiet  Print nothing but errors.
    """,
    {
        "jobs": {"default": lambda: os.cpu_count() or 1, "show_default": False},
        "horizon": {"default": 60.0},
        "memory": {"type": float},
        "units": {"type": click.Choice(["field", "si"]), "default": "field"},
        "json": {"name": "as_json"},
    },
)
"""Options and groups of options that several commands have."""


def read_recording(
    file: Path, *, start: float = 0.0, stop: float | None = None, **reading: Any
) -> Recording:
    """Read a recording as the options of its reading, and of its part where there are some, say.

    Raises InputError if an option or the file cannot be used.
    """
    from gmwm.readers import read

    return read(file, **arguments_of_read(**reading)).part(start, stop)


def arguments_of_read(
    *,
    gyro_unit: str | None,
    accel_unit: str | None,
    channel: Sequence[str],
    time: str | None,
    damaged: bool,
    channels: str | None = None,
    **others: Any,
) -> dict[str, Any]:
    """Arguments of `gmwm.read` for those of these options that are given.

    Raises InputError if an option cannot be used.
    """
    units = {"gyro": gyro_unit, "accel": accel_unit}
    found = {
        "units": {kind: unit for kind, unit in units.items() if unit is not None},
        "channels": _channels(channel, channels),
        "time": False if (time or "").lower() == "none" else time and _column(time),
        "damaged": damaged or None,
        **others,
    }
    return {name: each for name, each in found.items() if each not in (None, {}, ())}


def _channels(pairs: Sequence[str], only: str | None) -> dict[str, str | int] | list[str]:
    """Channel name -> column, of NAME=COLUMN; of some names only, or these names alone."""
    columns: dict[str, str | int] = {}
    for pair in pairs:
        name, _, column = pair.partition("=")
        if not (name and column):
            raise InputError(f"--channel {pair}: write NAME=COLUMN, e.g. gyro_x=wx or accel_z=5")
        if name in columns:
            raise InputError(f"--channel {name}=... is given twice: a channel has one column")
        columns[name] = _column(column)
    if only is None:
        return columns
    names = [name.strip() for name in only.split(",") if name.strip()]
    if not names:
        raise InputError("--channels names no channel: write names, e.g. gyro_x,accel_z")
    for name in names if columns else ():
        if name not in columns:
            raise InputError(f"--channels {only}: add --channel {name}=COLUMN, or leave {name} out")
    return {name: columns[name] for name in names} if columns else names


def _column(text: str) -> str | int:
    return int(text) if text.isascii() and text.isdigit() else text


# -- models ---------------------------------------------------------------------------------------


def written_models(texts: Sequence[str]) -> dict[str, Model]:
    """Models of ``--model MODEL`` and ``--model NAME=MODEL``, by name; empty for all channels."""
    from gmwm.process import as_model

    given: dict[str, Model] = {}
    for text in texts:
        name, _, model = map(str.strip, text.rpartition("="))
        if name in given:
            raise InputError(f"--model {text}: {name or 'all channels'} have a model: give one")
        try:
            given[name] = as_model(model)
        except InputError as error:
            raise InputError(f"--model {text}: {error}") from None
    return given
