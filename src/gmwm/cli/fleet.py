"""``gmwm fleet``: many units of a sensor, each calibrated by itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from gmwm.cli.calibrate import exit_unless
from gmwm.cli.console import print_result, progress_bar
from gmwm.cli.hints import with_hint
from gmwm.cli.options import arguments_of_read, folder_to_write, options
from gmwm.errors import InputError

_PARTS = ("start", "stop", "screening", "still", "horizon", "resume", "jobs", "cluster")


@click.command()
@click.argument("patterns", metavar="PATTERN...", nargs=-1, required=True)
@options(
    """
    -o --output  Folder for calibrations, fleet.parquet, fleet.html, fleet.json.
    --jobs
    --cluster
    --resume
    --horizon
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
    """Calibrate many units of a sensor and compare them.

    PATTERN is the recording of a unit or, in quotes, a pattern such as 'lot-7/**/*.csv'; files
    are those of gmwm calibrate. Each unit has a calibration of its own in the folder, as soon as
    it is done; fleet.parquet has a row per unit, channel and parameter; fleet.html shows how the
    units differ, which stand apart, and what a data sheet could promise. A file that cannot be
    used is reported and costs the others nothing. Several recordings of one unit are for gmwm
    calibrate.

    Exit status: 0 if a unit has a valid model, 1 if none has (the files are written all the same),
    2 if no file can be used.

    \b
    Examples:
      gmwm fleet 'lot-7/*.csv' --gyro-unit deg/s --accel-unit g -o lot-7-out
      gmwm fleet 'lot-7/*.csv' --gyro-unit deg/s --accel-unit g -o lot-7-out \\
        --resume
    """
    from gmwm.population import fleet as run

    work = {name: given.pop(name) for name in _PARTS}
    try:
        with progress_bar("fleet", "units", quiet=quiet) as bar:
            work |= {"folder": output, "progress": bar, **arguments_of_read(**given)}
            found = run(patterns, models or None, **work)
    except KeyboardInterrupt:
        if (output / "calibrations").is_dir():
            click.echo(f"finished units are kept in {output}: add --resume to continue", err=True)
        raise
    files = f"{output}/: calibrations, fleet.parquet, fleet.html, fleet.json"
    print_result(found, files, as_json=as_json, quiet=quiet)
    if found.failed:
        first = next(iter(found.failed.values()))
        reason = with_hint(InputError(first.text, first.code))
        count = "1 file" if len(found.failed) == 1 else f"{len(found.failed)} files"
        click.echo(f"gmwm: {count} cannot be used; the first: {reason}", err=True)
    exit_unless(bool(found.valid), "unit")
