"""``gmwm navigate``: parse, run, print, write."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import click

from gmwm.cli.console import progress_bar
from gmwm.cli.hints import with_option
from gmwm.cli.options import PATH, arguments_of_read, option, output_folder, reading_options
from gmwm.errors import InputError

_NEEDED = (
    "gmwm navigate needs a trajectory, a truth and filters: give STUDY.yaml, or --trajectory, "
    "--truth and --filter; or, for your own data, --imu, --gnss and --sensors (examples: gmwm "
    "navigate --help)"
)

_READING = {
    "units": "--gyro-unit or --accel-unit",
    "channels": "--channel",
    "time": "--time",
    "start": "--imu-start",
    "format": "--format",
    "layout": "--layout",
    "damaged": "--damaged",
}
_OF_DATA = frozenset({"imu", "gnss_fixes", "sensors", "compare"})
_OF_FILE = (
    "trajectory",
    "duration",
    "truth",
    "filters",
    "outages",
    "runs",
    "seed",
    "imu",
    "gnss_fixes",
    "lever_arm",
    "heading",
    "attitude",
    "barometer",
    "zero_velocity",
    "gate",
    "position_sd",
    "velocity_sd",
)
"""Options that are keys of the file of a study; paths are relative to where one is."""

_OF_STUDY, _OF_LOG = ("validation.txt", "validation.html"), ("solution.csv", "report.html")
_OF_SENSORS = "comparison.html"
"""What is written."""


def _as(convert: Callable[[Any], Any]) -> Callable[[Any, Any, Any], Any]:
    """A callback: what an option is in the file of a study, None where it is not given."""
    return lambda _, __, given: None if given in (None, ()) else convert(given)


def _without_none(found: dict[str, Any]) -> dict[str, Any]:
    return {name: each for name, each in found.items() if each is not None}


def _absolute(path: str) -> str:
    return str(Path(path).absolute())


def _degrees(angle: float) -> str:
    return f"{angle!r} deg"


def _three(name: str, text: str, form: str = "X,Y,Z in metres, e.g. 0.5,0,-1.2") -> list[float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"{name} {text}: write {form}") from None
    return [x, y, z]


def _sd(name: str, text: str) -> float | list[float]:
    try:
        return float(text)
    except ValueError:
        return _three(name, text, "one number, or NORTH,EAST,DOWN, e.g. 0.1,0.1,0.15")


def _attitude(text: str) -> list[str]:
    angles = _three("--attitude", text, "ROLL,PITCH,YAW in degrees, e.g. 2,-1,135")
    return [_degrees(angle) for angle in angles]


def _span(text: str) -> list[float]:
    try:
        start, length = (float(part) for part in text.split(":"))
    except ValueError:
        raise InputError(f"--outage {text}: write START:LENGTH in seconds, e.g. 600:60") from None
    return [start, length]


def _length(text: str) -> str | float:
    try:
        return "auto" if text == "auto" else float(text)
    except ValueError:
        raise InputError(f"--outages {text}: write auto, or seconds, e.g. 60") from None


def _sensors(texts: tuple[str, ...]) -> dict[str, Any]:
    if len(texts) == 1:
        return {"sensors": _absolute(texts[0])}
    return {"compare": _named("--sensors", texts)} if texts else {}


def _named(option: str, texts: tuple[str, ...]) -> dict[str, str]:
    found: dict[str, str] = {}
    for text in texts:
        name, separator, path = text.partition("=")
        if not (name and separator and path):
            raise InputError(f"{option} {text}: write NAME=FILE, e.g. GMWM=out/calibration.json")
        if name in found:
            raise InputError(f"{option} {name}=... is given twice: give each a name of its own")
        is_truth = option == "--filter" and path == "truth"
        found[name] = path if is_truth else _absolute(path)
    return found


@click.command()
@click.argument("file", required=False, type=PATH, metavar="[STUDY.yaml]")
@option(
    "--trajectory NAME",
    "helicopter, car, loiter, or a CSV of time, latitude, longitude, height, roll, pitch, yaw.",
)
@option("--duration NUMBER", "Of the trajectory, in seconds.", type=float)
@option(
    "--truth FILE", "calibration.json that sensor errors are drawn from.", callback=_as(_absolute)
)
@option(
    "--filter NAME=FILE",
    "A filter and its calibration.json; 'truth' for the true models; "
    "repeat. The others are compared with the first.",
    name="filters",
    multiple=True,
    callback=_as(partial(_named, "--filter")),
)
@option(
    "--outage START:LENGTH",
    "Seconds without GNSS; repeat.",
    name="outages",
    multiple=True,
    callback=_as(lambda texts: [_span(text) for text in texts]),
)
@option("--runs N", "Number of runs.  [default: 100]", type=click.IntRange(min=1))
@option("--seed N", "[default: 0]", type=click.IntRange(min=0))
@option("--jobs N", "Processes; one a core by default.", type=click.IntRange(min=1))
@output_folder(
    "gmwm-navigate",
    "Folder for the report, the table and the runs.",
    [*_OF_STUDY, *_OF_LOG, _OF_SENSORS],
)
@option("--resume", "Go on with the runs that the folder holds.")
@option("--cluster ADDRESS", "Dask scheduler that does the runs, e.g. tcp://10.0.0.1:8786.")
@option(
    "--imu FILE",
    "Your own data: IMU samples, with a header as for gmwm calibrate; axes forward, right, down.",
    callback=_as(_absolute),
)
@option(
    "--gnss FILE",
    "Fixes: time, latitude, longitude, height, on the IMU's clock.",
    name="gnss_fixes",
    callback=_as(_absolute),
)
@option(
    "--sensors [NAME=]FILE",
    "calibration.json of the IMU; several with names are compared.",
    multiple=True,
)
@option(
    "--outages auto|SECONDS",
    "Length of the outages that are cut into the log to compare sensors; auto is 30 s."
    "  [default: auto]",
    name="outage_length",
)
@option(
    "--lever-arm X,Y,Z",
    "From the IMU to the antenna, metres: forward, right, down.",
    callback=_as(partial(_three, "--lever-arm")),
)
@option(
    "--heading NUMBER",
    "Degrees, at the first fix; by default from GNSS once it moves.",
    type=float,
    callback=_as(_degrees),
)
@option(
    "--attitude ROLL,PITCH,YAW",
    "Degrees, at the first fix, of a record that begins in motion; by default from the data.",
    callback=_as(_attitude),
)
@option(
    "--imu-start S",
    "Time of the first IMU sample, without time stamps, on the clock of the fixes.",
    type=float,
)
@option("--barometer FILE", "Barometric heights: time, height.", callback=_as(_absolute))
@option(
    "--zero-velocity VALUE",
    "Use standstills that the IMU shows, to this accuracy, e.g. '0.02 m/s'.",
)
@option("--gate P", "Reject fixes whose innovation is less probable, e.g. 1e-5.", type=float)
@option(
    "--position-sd N[,E,D]",
    "Standard deviations of fixes that have none, metres: north, east, down.  [default: 1,1,1.5]",
    callback=_as(partial(_sd, "--position-sd")),
)
@option(
    "--velocity-sd N[,E,D]",
    "The same of velocities, m/s.  [default: 0.1,0.1,0.15]",
    callback=_as(partial(_sd, "--velocity-sd")),
)
@option("--gyro-bias VALUE", "Bias of a gyro at switch-on, 1 sigma.  [default: 0.1 deg/s]")
@option("--accel-bias VALUE", "The same of an accelerometer.  [default: 0.1 m/s^2]")
@option("--json", "Print JSON, of your own data.", name="as_json")
@reading_options
def navigate(
    file: Path | None,
    jobs: int | None,
    output: Path,
    resume: bool,
    cluster: str | None,
    sensors: tuple[str, ...],
    outage_length: str | None,
    imu_start: float | None,
    gyro_bias: str | None,
    accel_bias: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Prove sensor models by navigating, or filter your own data.

    INS/GNSS filters, outages, Monte Carlo: errors of the sensors, drawn from the true models or
    taken from real static recordings, are added to the error-free signals of a trajectory; every
    filter navigates on the same errors. Printed are the errors at the end of the outages and
    whether each filter is consistent. A YAML file can hold more than the options, which
    override it; see docs/navigation.md and docs/own-log.md.

    With --imu, --gnss and --sensors, real data are filtered: solution.csv and report.html are
    written; whether the innovations agree with the sensor models is printed, and which fault of
    the log explains them if they do not. Several --sensors are compared: outages are cut into the
    log, and the errors after them, from a smoother of all fixes, show which model to take.

    \b
    Examples:
      gmwm navigate study.yaml -o out
      gmwm navigate --trajectory car --truth cal.json --filter GMWM=cal.json \\
        --filter NK=small/calibration.json --outage 600:60 --outage 900:40
      gmwm navigate --imu imu.csv --gnss fixes.csv --sensors out/calibration.json
      gmwm navigate --imu imu.csv --gnss fixes.csv --sensors A=a.json \\
        --sensors B=b.json --outages auto
    """
    from gmwm.ins.spec import read_document

    given = {name: options.pop(name) for name in _OF_FILE}
    given |= _sensors(sensors)
    given["bias"] = _without_none({"gyro": gyro_bias, "accel": accel_bias}) or None
    if outage_length is not None:
        given["outages"] = _length(outage_length)
    given = _without_none(given)
    if file is None and not given:
        raise InputError(_NEEDED)
    content: dict[str, Any] = {} if file is None else read_document(file)
    content |= given
    folder = Path() if file is None else file.parent
    # With options, an error may be theirs.
    place = None if given else file
    reading = {
        name: each
        for name, each in arguments_of_read(**options).items()
        if name not in ("topic", "clock") and each not in (None, {})
    }
    if imu_start is not None:
        reading["start"] = imu_start
    if _OF_DATA.isdisjoint(content):
        if as_json or outage_length is not None:
            raise InputError(
                f"{'--json' if as_json else '--outages'} is about your own data: give --imu, "
                "--gnss and --sensors"
            )
        # The rate is also that of a ready-made trajectory.
        if "rate" in reading:
            content["rate"] = reading.pop("rate")
        if reading:
            raise InputError(
                f"{_READING[next(iter(reading))]} is about reading --imu, and there is none: leave "
                "it out"
            )
        _validate(content, folder, output, jobs or os.cpu_count() or 1, resume, cluster, place)
    else:
        if reading:
            imu = content.get("imu")
            content["imu"] = {**(imu if isinstance(imu, dict) else {"file": imu}), **reading}
        if "outages" in content and "compare" not in content:
            raise InputError("--outages needs sensors to compare: give --sensors A=a.json twice")
        _own_data(content, folder, output, place, as_json)


@contextmanager
def _named_in_messages(file: Path | None) -> Iterator[None]:
    """Put the file of a study before its errors."""
    try:
        yield
    except InputError as error:
        where = "" if file is None else f"{file}: "
        raise InputError(f"{where}{error.problem}", error.code, error.hint, error.values) from None


def _validate(
    content: dict[str, Any],
    base: Path,
    output: Path,
    jobs: int,
    resume: bool,
    cluster: str | None,
    place: Path | None,
) -> None:
    """Do the runs of a study."""
    from gmwm._core.files import folder_to_fill, written
    from gmwm.ins.simulation import Validation
    from gmwm.ins.spec import experiment_from

    with _named_in_messages(place):
        experiment = experiment_from(content, base)
    with folder_to_fill(output) as folder:
        store = folder / "runs"
        table, page = (folder / name for name in _OF_STUDY)
        with progress_bar("navigating", "runs") as bar:
            validation = Validation.of(
                experiment,
                jobs=jobs,
                cluster=cluster,
                folder=store,
                earlier="resume" if resume else "replace",
                progress=bar,
            )
        text = str(validation)
        with written(table) as stream:
            stream.write(text + "\n")
        report = validation.report(page)
    click.echo(text)
    click.echo(f"\nwrote {table}\nwrote {report}")


def _own_data(
    content: dict[str, Any], base: Path, output: Path, place: Path | None, as_json: bool
) -> None:
    """Filter real data, or compare sensor models on them."""
    from gmwm._core.files import folder_to_fill
    from gmwm.ins.logs import Comparison, Measured, Navigated

    with _named_in_messages(place):
        given = (Comparison if "compare" in content else Measured).of(content, base)
    given = replace(given, notices=tuple(map(with_option, given.notices)))
    found: Comparison | Navigated
    with folder_to_fill(output) as folder:
        if isinstance(given, Comparison):
            found, paths = given, [given.report(folder / _OF_SENSORS)]
        else:
            found, paths = Navigated.of(given), [folder / name for name in _OF_LOG]
            found.write_solution(paths[0])
            found.report(paths[1])
    if as_json:
        click.echo(json.dumps(found.to_dict(), allow_nan=False))
        return
    click.echo(found)
    click.echo("\n" + "\n".join(f"wrote {path}" for path in paths))
