"""``gmwm motion``: noise in motion, from several IMUs on one body."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm.cli.console import print_result, progress_bar
from gmwm.cli.options import (
    FILE_TO_WRITE,
    PATH,
    arguments_of_read,
    numbers,
    options,
    read_recording,
)
from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm.readers import Recording


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=PATH)
@options(
    """
    --static FILE  Calibration of a recording at rest, of one of the IMUs or of their kind.
    --imus N  Number of IMUs: the files are those of one flight, then those of the next, each in one
        order. By default all files are of one flight.
    --reference FILE  Attitude of the body, one for each FILE of one IMU: columns time, qw, qx, qy,
        qz (body to a fixed frame), or files of EuRoC or TUM; repeat for flights.
    --limits A,B  Vibration in m/s^2 (rms, 20 to 60 Hz) between the classes low, middle and high,
        such as idle, hover and manoeuvres; by default each has a third of the time.
    --at CLASS  Result at low, middle or high vibration, or at rest.
    --logs  Each file is a log of one flight with all IMUs; a single file is one anyway.
    -o --output JSON  File to save the result in.
    --report HTML  Page of the curves, the factors over rest, vibration and numbers.
    --plot PNG  Picture of the Allan deviations, a panel a channel.
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

    FILE is the recording of an IMU, all of the same motion, or one log with several instances: a
    bag, or a log of PX4 (vehicle_imu) or ArduPilot; clocks need not agree. Clocks, mounting
    and lever arms are estimated; what the IMUs do not have in common is their noise. The first
    table relates each IMU to the first one; the second has the Allan deviation of each in motion,
    with --static also at rest and the factor between both. Two IMUs give only the sum of
    their errors.

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
    flights: list[Any]
    if reference:
        flights = [read_recording(file, **reading) for file in files]
    elif logs or len(files) == 1:
        flights = [_of_log(file, **reading) for file in files]
    else:
        recordings = [read_recording(file, **reading) for file in files]
        flights = [recordings[k : k + count] for k in range(0, len(files), count)]
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
