"""``gmwm compare``: recordings or units of a sensor beside each other."""

from __future__ import annotations

import json
import shlex
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm.cli.console import progress_bar
from gmwm.cli.options import (
    PATH,
    option,
    output_file,
    part_options,
    printing_options,
    read_recording,
    reading_options,
)

if TYPE_CHECKING:
    from gmwm.calibration import Calibration


@click.command()
@click.argument("files", metavar="FILE FILE...", nargs=-1, required=True, type=PATH)
@output_file("Page to write, of two printed ones.", "HTML")
@option("--horizon S", "Longest outage that the filter numbers cover, in seconds.", default=60.0)
@option(
    "--datasheet YAML",
    "N, B and K by sensor or channel, each with its unit, to be drawn over the curves "
    "of the page: 'gyro: {N: 0.15 deg/sqrt(h), B: 7 deg/h}'.",
    type=PATH,
)
@reading_options
@part_options
@printing_options
def compare(
    files: tuple[Path, ...],
    output: Path | None,
    horizon: float,
    datasheet: Path | None,
    as_json: bool,
    quiet: bool,
    **reading: Any,
) -> None:
    """Compare recordings of a sensor, or units of a kind.

    FILE is a calibration.json, or a recording, which is calibrated first as by gmwm calibrate. For
    each axis: whether the curves are equal, level by level; one structure for all recordings, with
    the spread of its parameters; N and K that a filter can use with any of them.

    \b
    Examples:
      gmwm compare monday/calibration.json friday/calibration.json -o compare.html
      gmwm compare unit-*/calibration.json --datasheet imu.yaml -o compare.html
    """
    from gmwm.population import compare as run, labelled
    from gmwm.report import read_datasheet

    if datasheet is not None:  # rejected before the work
        read_datasheet(datasheet)
    calibrations = [_calibration(file, reading, quiet) for file in files]
    if datasheet is not None:
        read_datasheet(
            datasheet,
            {name: fit.wv.quantity or "" for each in calibrations for name, fit in each.items()},
        )
    with nullcontext() if quiet else progress_bar("comparing", "axes") as bar:
        found = run(labelled(calibrations, files), horizon=horizon, progress=bar)
    if output is not None:
        origin = {"command": shlex.join(["gmwm", *sys.argv[1:]])}
        found.report(output, datasheet=datasheet, provenance=origin)
    if as_json:
        click.echo(json.dumps(found.to_dict(), allow_nan=False))
    elif not quiet:
        click.echo(str(found))
        if output is not None:
            click.echo(f"wrote {output}")


def _calibration(file: Path, reading: dict[str, Any], quiet: bool) -> Calibration:
    from gmwm.calibration import Calibration, calibrate

    if file.suffix.lower() == ".json":
        return Calibration.load(file)
    with nullcontext() if quiet else progress_bar(f"calibrating {file.name}", "channels") as bar:
        return calibrate(read_recording(file, **reading), progress=bar)
