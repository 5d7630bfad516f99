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

TERMS = "Q, N, B, K, R, GM, Resonance, LowPassNoise, AveragedNoise, Sinusoid, AR, MA, ARMA, ARIMA"
"""What `gmwm.process.CATALOGUE` has, which would take long to import for a line of help."""

def together(*options: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """One decorator that gives a command several options, listed in this order."""

    def decorated(command: Any) -> Any:
        for option in reversed(options):
            command = option(command)
        return command

    return decorated


def output_file(text: str, metavar: str = "FILE") -> Callable[[Any], Any]:
    """The option of a file to write, which is refused before any work if it cannot be."""

    def checked(_: click.Context, __: click.Parameter, path: Path | None) -> Path | None:
        from gmwm._core.files import writable_file

        return path and writable_file(path)

    return click.option("-o", "--output", type=click.Path(path_type=Path), metavar=metavar,
                        help=text, callback=checked)  # fmt: skip


def output_folder(default: str, text: str, names: Sequence[str] = ()) -> Callable[[Any], Any]:
    """The option of a folder to fill with files of some names, which is refused likewise."""

    def checked(_: click.Context, __: click.Parameter, path: Path) -> Path:
        from gmwm._core.files import writable_folder

        return writable_folder(path, names)

    return click.option("-o", "--output", type=click.Path(path_type=Path), default=Path(default),
                        show_default=True, help=text, callback=checked)  # fmt: skip


reading_options = together(
    click.option("--rate", type=float, help="Sampling rate in Hz; needed without a time column."),
    click.option("--gyro-unit", help="Unit of the gyro columns: rad/s, deg/s, deg/h, ..."),
    click.option("--accel-unit", help="Unit of the accelerometer columns: m/s^2, g, mg, ..."),
    click.option("--channel", "channels", multiple=True, metavar="NAME=COLUMN",
                 help="Role of a column by its name or 0-based number, e.g. gyro_x=wx or "
                      "accel_z=5; repeat. By default roles are guessed from the column names."),
    click.option("--time", "time_column", metavar="COLUMN",
                 help="Time column by name or number; 'none' to ignore it."),
    click.option("--format", "form", type=click.Choice(FORMATS), metavar="NAME",
                 help="What the file is, where its content and its name do not show it: "
                      f"{', '.join(FORMATS)}."),
    click.option("--layout", metavar="LAYOUT",
                 help="Of a binary file without a header: IMAR, LN200, LN200IG, IXSEA, "
                      "NAVCHIP_INT, NAVCHIP_FLT, KF-GINS, or TYPE,GYRO_SCALE,ACCEL_SCALE"
                      "[,rates][,little|big]."),
    click.option("--damaged", is_flag=True,
                 help="Use what is left of a text or a flight log that is cut off or damaged in "
                      "places; it is refused otherwise."),
)  # fmt: skip
"""What the file is, for `read_recording`."""

part_options = together(
    click.option("--topic", "topics", multiple=True, metavar="NAME",
                 help="Topic of a bag or a flight log; needed where several have an IMU. Repeat "
                      "for gyros and accelerometers in topics of their own."),
    click.option("--clock", type=click.Choice(CLOCKS), default=CLOCKS[0], show_default=True,
                 help="Stamps of messages: of their headers, or when they were recorded."),
    click.option("--channels", "only", metavar="NAME,...",
                 help="Only these channels: gyro_x,accel_z, or gyro for all of them."),
    click.option("--start", type=float, metavar="S",
                 help="Leave out what is before this time, in seconds."),
    click.option("--stop", type=float, metavar="S",
                 help="Leave out what is after this time, in seconds."),
)  # fmt: skip
"""Topics, channels and a stretch, for `read_recording`."""

estimating_options = together(
    click.option("--model", "models", multiple=True, metavar="[NAME=]MODEL",
                 help=f"Fit this in place of selecting: terms {TERMS}, e.g. 'N + K + 2 GM'; or "
                      "'gyro=N + 2 GM' for a sensor or channel; repeat."),
    click.option("--leave", "left", multiple=True,
                 type=click.Choice(["events", "lines", "resonances", "outliers", "all"]),
                 metavar="WHAT",
                 help="Leave events, lines, resonances, outliers or all as they are: samples of "
                      "shocks are masked otherwise, lines and resonances are terms that a model "
                      "may have, outliers all over it make the variances robust; repeat."),
    click.option("--all", "everything", is_flag=True,
                 help="Take everything as static; by default only the stretches at rest of a log "
                      "that moves are used."),
)  # fmt: skip
"""What is fitted, and to which samples."""

printing_options = together(
    click.option("--json", "as_json", is_flag=True, help="Print the result as JSON, in SI units."),
    click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors."),
)
"""How results are printed."""


memory_option = click.option(
    "--memory", type=float, metavar="GB",
    help="For the samples: those of a longer file are kept on disk, in TMPDIR, and about three "
         "times one channel is in memory. By default 1 GB.",
)  # fmt: skip


def read_recording(
    file: Path, start: float | None = None, stop: float | None = None, **options: Any
) -> Recording:
    """Read a recording as the options say.

    Raises InputError if an option or the file cannot be used.
    """
    from gmwm.readers import read

    recording = read(file, **arguments_of_read(**options))
    return recording.part(0.0 if start is None else start, stop)


def arguments_of_read(
    rate: float | None,
    gyro_unit: str | None,
    accel_unit: str | None,
    channels: tuple[str, ...],
    time_column: str | None,
    form: str | None = None,
    layout: str | None = None,
    damaged: bool = False,
    topics: tuple[str, ...] = (),
    clock: str = CLOCKS[0],
    only: str | None = None,
) -> dict[str, Any]:
    """What `gmwm.read` is given for the options.

    Raises InputError if an option cannot be used.
    """
    units = {k: v for k, v in (("gyro", gyro_unit), ("accel", accel_unit)) if v is not None}
    return {
        "rate": rate,
        "units": units,
        "channels": _chosen(roles(channels), only),
        "time": time_reference(time_column),
        "layout": layout,
        "topic": topics,
        "clock": clock,
        "format": form,
    } | ({"damaged": True} if damaged else {})


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
    """The model of each channel: its own, else that of its sensor, else that of all.

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
    """A model, all parameters of which are free.

    Raises InputError if it is none.
    """
    from gmwm.process import CATALOGUE, GaussMarkov, Model

    kinds: dict[str, type[Process]] = {"GM": GaussMarkov}
    for kind in CATALOGUE:
        kinds[kind.__name__] = kind
        if len(kind.parameters[0].name) == 1 and not kind.prefix:
            kinds[kind.parameters[0].name] = kind
    terms: list[Process] = []
    for part in text.split("+"):
        found = _TERM.fullmatch(part)
        if found is None or found[2] not in kinds:
            raise InputError(
                f"--model {text}: {part.strip()!r} is no term: write {TERMS} with +, e.g. "
                "--model 'N + K + 2 GM'"
            )
        terms += [kinds[found[2]]() for _ in range(int(found[1] or 1))]
    try:
        return Model(tuple(terms))
    except InputError as error:
        raise InputError(f"--model {text}: {error}") from None
