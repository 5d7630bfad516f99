"""``gmwm compare``, ``fleet``, ``array``, ``motion``: few recordings, many units, IMUs together."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm.cli.calibrate import NONE_VALID, exit_unless
from gmwm.cli.options import (
    FILE_TO_WRITE,
    PATH,
    arguments_of_read,
    command_line,
    folder_to_write,
    numbers,
    options,
    print_result,
    progress_bar,
    read_recording,
    with_hint,
)
from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm.calibration import Calibration
    from gmwm.readers import Recording


@click.command()
@click.argument("files", metavar="FILE FILE...", nargs=-1, required=True, type=PATH)
@options(
    """
    -o --output HTML  Page to write (prints on two pages).
    --horizon
    --datasheet
    --reading
    --part
    --json
    --quiet
    """,
    output=FILE_TO_WRITE,
)
def compare(
    files: Sequence[Path], output: Path | None, as_json: bool, quiet: bool, **given: Any
) -> None:
    """Compare recordings of a sensor, or units of one type.

    FILE is a calibration.json, or a recording, which is calibrated first as by gmwm calibrate. For
    each axis: whether the curves are equal, level by level; one structure for all recordings, with
    the spread of its parameters; N and K that a filter can use with any of them.

    \b
    Examples:
      gmwm compare monday/calibration.json friday/calibration.json -o compare.html
      gmwm compare unit-*/calibration.json --datasheet imu.yaml -o compare.html
    """
    from gmwm.datasheet import read_datasheet
    from gmwm.population import compare as run, labelled

    horizon, datasheet = given.pop("horizon"), given.pop("datasheet")
    if datasheet is not None:  # rejected before the work
        read_datasheet(datasheet)
    calibrations = [_calibration(file, given, quiet) for file in files]
    if datasheet is not None:
        quantities = {n: fit.wv.quantity or "" for each in calibrations for n, fit in each.items()}
        read_datasheet(datasheet, quantities)
    with progress_bar("comparing", "axes", quiet=quiet) as bar:
        found = run(labelled(calibrations, files), horizon=horizon, progress=bar)
    if output is not None:
        found.report(output, datasheet=datasheet, provenance={"command": command_line()})
    print_result(found, output, as_json=as_json, quiet=quiet)


def _calibration(file: Path, reading: dict[str, Any], quiet: bool) -> Calibration:
    from gmwm.calibration import Calibration, calibrate

    if file.suffix.lower() == ".json":
        return Calibration.load(file)
    with progress_bar(f"calibrating {file.name}", "channels", quiet=quiet) as bar:
        return calibrate(read_recording(file, **reading), progress=bar)


@click.command()
@click.argument("files", metavar="IMU IMU...", nargs=-1, required=True, type=PATH)
@options(
    """
    --horizon S  Length of the outages that the weights are for, in seconds.
    -o --output JSON  File to save the result in.
    --reading
    --part
    --json
    --quiet
    """,
    horizon={"default": 60.0},
    output=FILE_TO_WRITE,
)
def array(
    files: Sequence[Path],
    horizon: float,
    output: Path | None,
    as_json: bool,
    quiet: bool,
    **reading: Any,
) -> None:
    """Find the weighted sum of IMUs on one board that has the least error.

    Give a static recording of each IMU; all begin together, with aligned axes. The weights are for
    outages of one length: over seconds white noise matters, over minutes slow errors. Errors that
    IMUs share do not average out. The second table compares these weights with the best IMU alone,
    the mean of all, and weights 1/N^2.

    \b
    Examples:
      gmwm array imu1.csv imu2.csv imu3.csv --horizon 60
      gmwm array imu*.csv --rate 200 --gyro-unit deg/s --accel-unit g
    """
    from gmwm.population import array as run, labelled

    recordings = labelled([read_recording(file, **reading) for file in files], files)
    with progress_bar("array", "axes", quiet=quiet) as bar:
        found = run(recordings, horizon=horizon, progress=bar)
    if output is not None:
        found.save(output)
    print_result(found, output, as_json=as_json, quiet=quiet)


_PARTS = ("start", "stop", "screening", "still", "resume", "jobs", "cluster")


@click.command()
@click.argument("patterns", metavar="PATTERN...", nargs=-1, required=True)
@options(
    """
    -o --output  Folder for calibrations, fleet.parquet, fleet.csv, fleet.html, fleet.json.
    --limits YAML  Largest N, B and K by sensor or channel: 'gyro: {N: 0.25 deg/sqrt(h)}'.
    --jobs
    --cluster
    --resume
    --reading
    --part
    --estimating
    --json
    --quiet
    """,
    output=folder_to_write("gmwm-fleet"),
)
def fleet(
    patterns: Sequence[str], output: Path, models: Any, as_json: bool, quiet: bool, **given: Any
) -> None:
    """Calibrate many units of a sensor and tabulate their N, B and K.

    PATTERN is the recording of a unit or, in quotes, a pattern such as 'lot-7/**/*.csv'; it
    takes the same files as gmwm calibrate. N, B and K of an axis come from one model for all units.
    fleet.html shows how units differ, which stand apart and what a data sheet can promise;
    fleet.parquet and fleet.csv have every number; each unit has its own calibration. A file that
    cannot be used is reported and does not affect the others.

    Exit status: 0 if all files were used and no limit is missed, 1 otherwise or if no unit has a
    valid model (the files are written all the same), 2 if no file can be used.

    \b
    Examples:
      gmwm fleet 'lot-7/*.csv' --gyro-unit deg/s --accel-unit g -o lot-7-out \\
        --resume --limits limits.yaml
    """
    from gmwm.datasheet import read_datasheet
    from gmwm.population import fleet as run

    limits = given.pop("limits")
    work = {name: given.pop(name) for name in _PARTS}
    work["limits"] = {} if limits is None else read_datasheet(limits).letters
    try:
        with progress_bar("fleet", "units", quiet=quiet) as bar:
            work |= {"folder": output, "progress": bar, **arguments_of_read(**given)}
            found = run(patterns, models or None, **work)
    except KeyboardInterrupt:
        if (output / "calibrations").is_dir():
            click.echo(f"finished units are kept in {output}: add --resume to continue", err=True)
        raise
    files = f"{output}/: calibrations, fleet.parquet, fleet.csv, fleet.html, fleet.json"
    print_result(found, files, as_json=as_json, quiet=quiet)
    if found.failed:
        first = next(iter(found.failed.values()))
        reason = with_hint(InputError(first.text, first.code))
        count = "1 file" if len(found.failed) == 1 else f"{len(found.failed)} files"
        click.echo(f"gmwm: {count} cannot be used; the first: {reason}", err=True)
    exit_unless(bool(found.valid), "unit")
    click.get_current_context().exit(NONE_VALID if found.failed or not found.meets_limits else 0)


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=PATH)
@options(
    """
    --static FILE  Calibration of a recording at rest, of one of the IMUs or of their type.
    --imus N  Number of IMUs. Give the files flight by flight, with the IMUs in the same order. By
        default all files are of one flight.
    --reference FILE  Attitude of the body, one for each FILE of one IMU: columns time, qw, qx, qy,
        qz (body to a fixed frame), or files of EuRoC or TUM; repeat for flights.
    --limits A,B  Vibration in m/s^2 (rms, 20 to 60 Hz) between the classes low, middle and high,
        such as idle, hover and manoeuvres; by default each has a third of the time.
    --at CLASS  Result at low, middle or high vibration, or at rest.
    --logs  Each file is a log of one flight with all IMUs, as a single file always is.
    -o --output JSON  File to save the result in.
    --report HTML  Page of the curves, the factors over rest, vibration and numbers.
    --plot PNG  Picture of the Allan deviations, a panel for each channel.
    --reading
    --part
    --json
    --quiet
    """,
    output=FILE_TO_WRITE,
    report=FILE_TO_WRITE,
    plot=FILE_TO_WRITE,
    reference={"multiple": True},
    at={"type": click.Choice(["low", "middle", "high", "rest"])},
)
def motion(
    files: Sequence[Path],
    static: Path | None,
    imus: int | None,
    reference: tuple[Path, ...],
    limits: str | None,
    at: str | None,
    logs: bool,
    output: Path | None,
    report: Path | None,
    plot: Path | None,
    as_json: bool,
    quiet: bool,
    **reading: Any,
) -> None:
    """Measure the noise of IMUs in motion, from three or more on one rigid body.

    Give a recording of each IMU, all of the same motion, or one log with all IMUs: a bag, or a log
    of PX4 (vehicle_imu) or ArduPilot. Clocks need not agree. Clocks, mounting and lever arms are
    estimated; the rest that the IMUs do not share is their noise. The first table relates each IMU
    to the first one. The second has the Allan deviation of each in motion, with --static also at
    rest and the factor between both. Two IMUs give only the sum of their errors.

    \b
    Examples:
      gmwm motion imu1.csv imu2.csv imu3.csv --static calibration.json
      gmwm motion flight*_imu*.csv --imus 4 -o motion.json --plot motion.png
      gmwm motion flight.ulg
    """
    from gmwm.calibration import Calibration
    from gmwm.motion import motion as run

    count = imus or len(files)
    if len(files) % count:
        text = f"{len(files)} files are not a multiple of {count} IMUs"
        raise InputError(f"{text}: give a file of each IMU for every flight")
    levels = None if limits is None else numbers("--limits", limits, "two levels, e.g. 1,4", 2)
    at_rest = None if static is None else Calibration.load(static)
    is_log = not reference and (logs or len(files) == 1)
    read_one = _of_log if is_log else read_recording
    flights: list[Any] = [read_one(file, **reading) for file in files]
    if not (reference or is_log):
        flights = [flights[k : k + count] for k in range(0, len(files), count)]
    with progress_bar("motion", "flights", quiet=quiet) as bar:
        found = run(
            flights, static=at_rest, limits=levels, reference=reference or None, progress=bar
        )
    found = found if at is None else found.at(at)
    if output is not None:
        found.save(output)
    if report is not None:
        found.report(report)
    if plot is not None:
        _draw(found, plot)
    print_result(found, output, report, plot, as_json=as_json, quiet=quiet)


def _of_log(
    file: Path, *, start: float, stop: float | None, **reading: Any
) -> dict[str, Recording]:
    from gmwm.readers import read_imus

    found = read_imus(file, **arguments_of_read(**reading))
    return {imu: recording.part(start, stop) for imu, recording in found.items()}


def _draw(found: Any, path: Path) -> None:
    import matplotlib.pyplot as plt

    channels = list(dict.fromkeys(each.channel for each in found.curves))
    figure, axes = plt.subplots(-(-len(channels) // 3), 3, squeeze=False, layout="constrained")
    figure.set_size_inches(15.0, 5.0 * len(axes))
    for channel, ax in zip(channels, axes.flat, strict=True):
        found.plot(channel, ax=ax)
    figure.savefig(path)
    plt.close(figure)
