"""Arguments of the command line: how a recording is to be read, and models as they are written."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm.errors import InputError
from gmwm.readers import CLOCKS, NAMES as FORMATS

if TYPE_CHECKING:
    from gmwm.process import Model, Process
    from gmwm.readers import Recording

_TERM = re.compile(r"\s*(?:([1-9])\s*\*?\s*)?([A-Za-z]+)\s*")


PATH = click.Path(path_type=Path)


def option(usage: str, text: str, *, name: str = "", **settings: Any) -> Callable[[Any], Any]:
    """An option of a command.

    usage: Its flags, and what is to be given after them: ``"-o --output FILE"``; with nothing to
        give it is a switch.
    text: The help; a default is added to it, unless it is zero or settings hide it.
    name: Of the argument, if not that of the flag.
    settings: Of `click.option`.
    """
    words = usage.split()
    flags = [word for word in words if word.startswith("-")]
    metavar = " ".join(words[len(flags) :])
    if not metavar and "type" not in settings:
        settings["is_flag"] = True
    settings.setdefault("show_default", bool(settings.get("default")))
    names = [*flags, name] if name else flags
    return click.option(*names, metavar=metavar or None, help=text or None, **settings)


def _terms() -> str:
    from gmwm.process import CATALOGUE

    return ", ".join(kind.short_name for kind in CATALOGUE)


class _ModelOption(click.Option):
    """An option whose help names the terms of a model, which take long to import."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        self.help = (self.help or "").replace("{terms}", _terms())
        return super().get_help_record(ctx)


def together(*options: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """One decorator that gives a command several options, listed in this order."""

    def decorated(command: Any) -> Any:
        for option in reversed(options):
            command = option(command)
        return command

    return decorated


def output_file(text: str, metavar: str = "FILE") -> Callable[[Any], Any]:
    """The option of a file to write; a path that cannot be written is rejected before any work."""

    def checked(_: click.Context, __: click.Parameter, path: Path | None) -> Path | None:
        from gmwm._core.files import writable_file

        return path and writable_file(path)

    return click.option("-o", "--output", type=PATH, metavar=metavar, help=text, callback=checked)


def output_folder(default: str, text: str, names: Sequence[str] = ()) -> Callable[[Any], Any]:
    """The option of a folder to fill with files of these names, checked likewise."""

    def checked(_: click.Context, __: click.Parameter, path: Path) -> Path:
        from gmwm._core.files import writable_folder

        return writable_folder(path, names)

    return option("-o --output", text, type=PATH, default=Path(default), callback=checked)


reading_options = together(
    option("--rate NUMBER", "Sampling rate in Hz; needed without a time column.", type=float),
    option("--gyro-unit TEXT", "Unit of the gyro columns: rad/s, deg/s, deg/h, ..."),
    option("--accel-unit TEXT", "Unit of the accelerometer columns: m/s^2, g, mg, ..."),
    option(
        "--channel NAME=COLUMN",
        "Role of a column by its name or 0-based number, e.g. gyro_x=wx or accel_z=5; "
        "repeat. By default roles are guessed from the column names.",
        name="channels",
        multiple=True,
    ),
    option(
        "--time COLUMN", "Time column by name or number; 'none' to ignore it.", name="time_column"
    ),
    option(
        "--format NAME",
        f"What the file is, where its content and its name do not show it: {', '.join(FORMATS)}.",
        name="form",
        type=click.Choice(FORMATS),
    ),
    option(
        "--layout LAYOUT",
        "Of a binary file without a header: IMAR, LN200, LN200IG, IXSEA, NAVCHIP_INT, "
        "NAVCHIP_FLT, KF-GINS, or TYPE,GYRO_SCALE,ACCEL_SCALE[,rates][,little|big].",
    ),
    option(
        "--damaged",
        "Use the readable part of a text or a flight log that is cut off or damaged;"
        " it is rejected otherwise.",
    ),
)
"""What the file is, for `read_recording`."""

part_options = together(
    option(
        "--topic NAME",
        "Topic of a bag or a flight log; needed where several have an IMU. Repeat for gyros"
        " and accelerometers in topics of their own.",
        name="topics",
        multiple=True,
    ),
    option(
        "--clock",
        "Stamps of messages: of their headers, or when they were recorded.",
        type=click.Choice(CLOCKS),
        default=CLOCKS[0],
    ),
    option(
        "--channels NAME,...",
        "Only these channels: gyro_x,accel_z, or gyro for all of them.",
        name="only",
    ),
    option("--start S", "Leave out samples before this time, in seconds.", type=float),
    option("--stop S", "Leave out samples after this time, in seconds.", type=float),
)
"""Topics, channels and a stretch, for `read_recording`."""

estimating_options = together(
    option(
        "--model [NAME=]MODEL",
        "Fit this in place of selecting: terms {terms}, e.g. 'N + K + 2 GM'; or "
        "'gyro=N + 2 GM' for a sensor or channel; repeat.",
        cls=_ModelOption,
        name="models",
        multiple=True,
    ),
    option(
        "--leave WHAT",
        "Leave events, lines, resonances, outliers or all as they are: samples of shocks "
        "are masked otherwise, lines and resonances are terms that a model may have, "
        "outliers all over it make the variances robust; repeat.",
        name="left",
        multiple=True,
        type=click.Choice(["events", "lines", "resonances", "outliers", "all"]),
    ),
    option(
        "--all",
        "Take everything as static; by default only the stretches at rest of a log that "
        "moves are used.",
        name="everything",
    ),
)
"""What is fitted, and to which samples."""

printing_options = together(
    option("--json", "Print the result as JSON, in SI units.", name="as_json"),
    option("-q --quiet", "Print nothing but errors."),
)
"""How results are printed."""


memory_option = option(
    "--memory GB",
    "For the samples: those of a longer file are kept on disk, in TMPDIR, and about "
    "three times one channel is in memory. By default 1 GB.",
    type=float,
)


def read_recording(
    file: Path, start: float | None = None, stop: float | None = None, **options: Any
) -> Recording:
    """Read a recording as the options say.

    Raises InputError if an option or the file cannot be used.
    """
    from gmwm.readers import read

    recording = read(file, **arguments_of_read(**options))
    return recording.part(0.0 if start is None else start, stop)


def arguments_of_read(**options: Any) -> dict[str, Any]:
    """Arguments of `gmwm.read` for `reading_options` and, where there are some, `part_options`.

    Raises InputError if an option cannot be used.
    """
    units = {kind: options[f"{kind}_unit"] for kind in ("gyro", "accel")}
    return {
        "rate": options["rate"],
        "units": {kind: unit for kind, unit in units.items() if unit is not None},
        "channels": _chosen(roles(options["channels"]), options.get("only")),
        "time": time_reference(options["time_column"]),
        "layout": options.get("layout"),
        "topic": options.get("topics", ()),
        "clock": options.get("clock", CLOCKS[0]),
        "format": options.get("form"),
    } | ({"damaged": True} if options.get("damaged") else {})


def _chosen(
    columns: dict[str, str | int] | None, only: str | None
) -> dict[str, str | int] | list[str] | None:
    """Channels with their columns, or their names alone."""
    if only is None:
        return columns
    names = [name.strip() for name in only.split(",") if name.strip()]
    if not names:
        raise InputError("--channels names no channel: write names, e.g. gyro_x,accel_z")
    if columns is None:
        return names
    for name in names:
        if name not in columns:
            raise InputError(f"--channels {only}: add --channel {name}=COLUMN, or leave it out")
    return {name: columns[name] for name in names}


def _column(text: str) -> str | int:
    return int(text) if text.isascii() and text.isdigit() else text


def roles(pairs: tuple[str, ...]) -> dict[str, str | int] | None:
    """Channel name -> column, of NAME=COLUMN."""
    found: dict[str, str | int] = {}
    for pair in pairs:
        name, separator, column = pair.partition("=")
        if not (name and separator and column):
            raise InputError(f"--channel {pair}: write NAME=COLUMN, e.g. gyro_x=wx or accel_z=5")
        if name in found:
            raise InputError(f"--channel {name}=... is given twice: a channel has one column")
        found[name] = _column(column)
    return found or None


def time_reference(text: str | None) -> str | int | bool | None:
    """A column of time stamps; ``False`` for "none"."""
    if text is None:
        return None
    return False if text.lower() == "none" else _column(text)


def seconds(option: str, text: str) -> list[float]:
    """Times of an option, separated by commas."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"{option} {text}: write seconds, e.g. 1,10,60") from None


# -- models ---------------------------------------------------------------------------------------


def written_models(texts: Sequence[str]) -> dict[str, Model]:
    """Models of ``--model MODEL`` and ``--model NAME=MODEL``, by name; empty for all channels.

    Raises InputError if a text is no model, or a name has two.
    """
    given: dict[str, Model] = {}
    for text in texts:
        name, _, model = map(str.strip, text.rpartition("="))
        if name in given:
            raise InputError(f"--model {text}: {name or 'all channels'} have a model: give one")
        given[name] = _model(model)
    return given


def models_of_channels(
    given: Mapping[str, Model], channels: Sequence[str]
) -> dict[str, Model] | None:
    """The model of each channel: its own, its sensor's, or the one for all.

    given: See `written_models`.
    Returns: None if nothing is given.
    Raises InputError if a channel has no model, or a model no channel.
    """
    if not given:
        return None
    keys = {name: (name, name.partition("_")[0], "") for name in channels}
    for name in given:
        if not any(name in each for each in keys.values()):
            raise InputError(f"--model {name}=...: the channels are {', '.join(channels)}")
    for name, each in keys.items():
        if given.keys().isdisjoint(each):
            raise InputError(
                f"--model gives {name} no model: add one, e.g. --model '{name}=N + K', or "
                "leave it out by --channels"
            )
    return {name: next(given[key] for key in each if key in given) for name, each in keys.items()}


def _model(text: str) -> Model:
    """A model with free parameters.

    Raises InputError if it is none.
    """
    from gmwm.process import CATALOGUE, Model

    kinds = {name: kind for kind in CATALOGUE for name in (kind.__name__, kind.short_name)}
    terms: list[Process] = []
    for part in text.split("+"):
        found = _TERM.fullmatch(part)
        if found is None or found[2] not in kinds:
            raise InputError(
                f"--model {text}: {part.strip()!r} is not a term: write {_terms()} with +, "
                "e.g. --model 'N + K + 2 GM'"
            )
        terms += [kinds[found[2]]() for _ in range(int(found[1] or 1))]
    try:
        return Model(tuple(terms))
    except InputError as error:
        raise InputError(f"--model {text}: {error}") from None
