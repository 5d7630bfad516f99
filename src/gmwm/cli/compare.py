"""``gmwm compare``: recordings or units of a sensor beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm.cli.console import command_line, print_result, progress_bar
from gmwm.cli.options import FILE_TO_WRITE, PATH, options, read_recording

if TYPE_CHECKING:
    from gmwm.calibration import Calibration


@click.command()
@click.argument("files", metavar="FILE FILE...", nargs=-1, required=True, type=PATH)
@options(
    """
    -o --output HTML  Page to write, of two printed ones.
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
