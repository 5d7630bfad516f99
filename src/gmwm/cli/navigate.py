"""``gmwm navigate``: parse, run, print, write."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from gmwm.cli.console import progress_bar
from gmwm.cli.options import arguments_of_read, reading_options
from gmwm.errors import InputError

_NEEDED = (
    "gmwm navigate needs a trajectory, a truth and filters: give STUDY.yaml, or --trajectory, "
    "--truth and --filter; or, for your own data, --imu, --gnss and --sensors (examples: gmwm "
    "navigate --help)"
)

_READING = {"units": "--gyro-unit or --accel-unit", "channels": "--channel", "time": "--time",
            "start": "--imu-start", "format": "--format", "layout": "--layout"}  # fmt: skip
_OF_DATA = frozenset({"imu", "gnss_fixes", "sensors", "compare"})


@click.command()
@click.argument("file", required=False, type=click.Path(path_type=Path), metavar="[STUDY.yaml]")
@click.option("--trajectory", metavar="NAME",
              help="helicopter, car, loiter, or a CSV of time, latitude, longitude, height, roll, "
                   "pitch, yaw.")  # fmt: skip
@click.option("--duration", type=float, help="Of the trajectory, in seconds.")
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
@click.option("--cluster", metavar="ADDRESS",
              help="Dask scheduler that does the runs, e.g. tcp://10.0.0.1:8786.")  # fmt: skip
@click.option("--imu", metavar="FILE", help="Your own data: IMU samples, with a header as for gmwm "
                                            "calibrate; axes forward, right, down.")  # fmt: skip
@click.option("--gnss", "gnss_fixes", metavar="FILE",
              help="Fixes: time, latitude, longitude, height, on the IMU's clock.")  # fmt: skip
@click.option("--sensors", multiple=True, metavar="[NAME=]FILE",
              help="calibration.json of the IMU; several with names are compared.")  # fmt: skip
@click.option("--outages", "outage_length", metavar="auto|SECONDS",
              help="Length of the outages that are cut into the log to compare sensors; auto is "
                   "30 s.  [default: auto]")  # fmt: skip
@click.option("--lever-arm", metavar="X,Y,Z",
              help="From the IMU to the antenna, metres: forward, right, down.")  # fmt: skip
@click.option("--heading", type=float,
              help="Degrees, at the first fix; by default from GNSS once it moves.")  # fmt: skip
@click.option("--attitude", metavar="ROLL,PITCH,YAW",
              help="Degrees, at the first fix, of a record that begins in motion; by default "
                   "from the data.")  # fmt: skip
@click.option(
    "--imu-start",
    type=float,
    metavar="S",
    help="Time of the first IMU sample, without time stamps, on the clock of the fixes.",
)
@click.option("--barometer", metavar="FILE", help="Barometric heights: time, height.")
@click.option(
    "--zero-velocity",
    metavar="VALUE",
    help="Use standstills that the IMU shows, to this accuracy, e.g. '0.02 m/s'.",
)
@click.option("--gate", type=float, metavar="P",
              help="Reject fixes whose innovation is less probable, e.g. 1e-5.")  # fmt: skip
@click.option(
    "--gyro-bias",
    metavar="VALUE",
    help="Bias of a gyro at switch-on, 1 sigma.  [default: 0.1 deg/s]",
)
@click.option("--accel-bias", metavar="VALUE",
              help="The same of an accelerometer.  [default: 0.1 m/s^2]")  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print JSON, of your own data.")
@reading_options
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
    cluster: str | None,
    imu: str | None,
    gnss_fixes: str | None,
    sensors: tuple[str, ...],
    outage_length: str | None,
    lever_arm: str | None,
    heading: float | None,
    attitude: str | None,
    imu_start: float | None,
    barometer: str | None,
    zero_velocity: str | None,
    gate: float | None,
    gyro_bias: str | None,
    accel_bias: str | None,
    as_json: bool,
    **options_of_reading: Any,
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

    options = _given(trajectory, duration, truth, filters, outages, runs, seed)
    data = _given_data(imu, gnss_fixes, sensors, lever_arm, heading, gyro_bias, accel_bias)
    if outage_length is not None:
        data["outages"] = _length(outage_length)
    data |= _given_aiding(attitude, barometer, zero_velocity, gate)
    if file is None and not options and not data:
        raise InputError(_NEEDED)
    content: dict[str, Any] = {} if file is None else read_document(file)
    content |= options | data
    folder = Path() if file is None else file.parent
    # Where options were given too, what is wrong may be theirs.
    place = None if options or data else file
    reading = {
        name: each
        for name, each in arguments_of_read(**options_of_reading).items()
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
        content["imu"] = _with_reading(content.get("imu"), reading)
        if "compare" in content:
            _compare(content, folder, output, place, as_json)
        elif "outages" in content:
            raise InputError("--outages needs sensors to compare: give --sensors A=a.json twice")
        else:
            _filter(content, folder, output, place, as_json)


@contextmanager
def _named_in_messages(file: Path | None) -> Iterator[None]:
    """The file of a study before what is wrong with it."""
    try:
        yield
    except InputError as error:
        where = "" if file is None else f"{file}: "
        raise InputError(f"{where}{error}", error.code) from None


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
    from gmwm._core.files import folder_to_fill, replaceable, written
    from gmwm.ins.montecarlo import Validation
    from gmwm.ins.spec import experiment_from

    with _named_in_messages(place):
        experiment = experiment_from(content, base)
    with folder_to_fill(output) as folder:
        store = folder / "runs"
        table, page = (replaceable(folder / f"validation.{end}") for end in ("txt", "html"))
        with progress_bar("navigating", "runs") as bar:
            validation = Validation.of(
                experiment, jobs=jobs, cluster=cluster, folder=store,
                earlier="resume" if resume else "replace", progress=bar,
            )  # fmt: skip
        text = str(validation)
        with written(table) as stream:
            stream.write(text + "\n")
        report = validation.report(page)
    click.echo(text)
    click.echo(f"\nwrote {table}\nwrote {report}")


def _filter(
    content: dict[str, Any], base: Path, output: Path, place: Path | None, as_json: bool
) -> None:
    """Filter real data."""
    from gmwm._core.files import folder_to_fill, replaceable
    from gmwm.ins.field import Measured, Navigated

    with _named_in_messages(place):
        measured = Measured.of(content, base)
    with folder_to_fill(output) as folder:
        paths = [replaceable(folder / name) for name in ("solution.csv", "report.html")]
        navigated = Navigated.of(measured)
        navigated.write_solution(paths[0])
        navigated.report(paths[1])
    if as_json:
        click.echo(json.dumps(navigated.to_dict(), allow_nan=False))
        return
    click.echo(navigated)
    click.echo("\n" + "\n".join(f"wrote {path}" for path in paths))


def _compare(
    content: dict[str, Any], base: Path, output: Path, place: Path | None, as_json: bool
) -> None:
    """Compare sensor models on real data."""
    from gmwm._core.files import folder_to_fill, replaceable
    from gmwm.ins.field import Comparison

    with _named_in_messages(place):
        comparison = Comparison.of(content, base)
    with folder_to_fill(output) as folder:
        page = comparison.report(replaceable(folder / "comparison.html"))
    if as_json:
        click.echo(json.dumps(comparison.to_dict(), allow_nan=False))
        return
    click.echo(comparison)
    click.echo(f"\nwrote {page}")


def _given_data(
    imu: str | None,
    gnss_fixes: str | None,
    sensors: tuple[str, ...],
    lever_arm: str | None,
    heading: float | None,
    gyro_bias: str | None,
    accel_bias: str | None,
) -> dict[str, Any]:
    """The options of real data as the file would have them."""
    files = {"imu": imu, "gnss_fixes": gnss_fixes}
    found: dict[str, Any] = {
        name: _absolute(path) for name, path in files.items() if path is not None
    }
    if len(sensors) == 1:
        found["sensors"] = _absolute(sensors[0])
    elif sensors:
        found["compare"] = _named("--sensors", sensors)
    if lever_arm is not None:
        found["lever_arm"] = _three("--lever-arm", lever_arm)
    if heading is not None:
        found["heading"] = f"{heading!r} deg"
    bias = {"gyro": gyro_bias, "accel": accel_bias}
    if gyro_bias is not None or accel_bias is not None:
        found["bias"] = {kind: each for kind, each in bias.items() if each is not None}
    return found


def _given_aiding(
    attitude: str | None, barometer: str | None, zero_velocity: str | None, gate: float | None
) -> dict[str, Any]:
    """The options of what else aids the filter, as the file would have them."""
    found: dict[str, Any] = {"zero_velocity": zero_velocity, "gate": gate}
    if attitude is not None:
        angles = _three("--attitude", attitude, "ROLL,PITCH,YAW in degrees, e.g. 2,-1,135")
        found["attitude"] = [f"{angle!r} deg" for angle in angles]
    if barometer is not None:
        found["barometer"] = _absolute(barometer)
    return {name: each for name, each in found.items() if each is not None}


def _three(name: str, text: str, form: str = "X,Y,Z in metres, e.g. 0.5,0,-1.2") -> list[float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"{name} {text}: write {form}") from None
    return [x, y, z]


def _with_reading(imu: Any, reading: dict[str, Any]) -> Any:
    if not reading:
        return imu
    return {**imu, **reading} if isinstance(imu, dict) else {"file": imu, **reading}


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
        found["filters"] = _named("--filter", filters)
    if outages:
        found["outages"] = [_span(text) for text in outages]
    return {name: each for name, each in found.items() if each is not None}


def _length(text: str) -> str | float:
    try:
        return "auto" if text == "auto" else float(text)
    except ValueError:
        raise InputError(f"--outages {text}: write auto, or seconds, e.g. 60") from None


def _named(option: str, texts: tuple[str, ...]) -> dict[str, str]:
    found: dict[str, str] = {}
    for text in texts:
        name, path = _pair(option, text)
        if name in found:
            raise InputError(f"{option} {name}=... is given twice: give each a name of its own")
        found[name] = path
    return found


def _pair(option: str, text: str) -> tuple[str, str]:
    name, separator, path = text.partition("=")
    if not (name and separator and path):
        raise InputError(f"{option} {text}: write NAME=FILE, e.g. GMWM=out/calibration.json")
    is_truth = option == "--filter" and path == "truth"
    return name, path if is_truth else _absolute(path)


def _absolute(path: str) -> str:
    return str(Path(path).absolute())


def _span(text: str) -> list[float]:
    try:
        start, length = (float(part) for part in text.split(":"))
    except ValueError:
        raise InputError(f"--outage {text}: write START:LENGTH in seconds, e.g. 600:60") from None
    return [start, length]
