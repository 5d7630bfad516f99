"""``gmwm fleet``: many units of a sensor, each calibrated by itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from gmwm.cli.calibrate import NONE_VALID, exit_unless
from gmwm.cli.console import print_result, progress_bar
from gmwm.cli.hints import with_hint
from gmwm.cli.options import arguments_of_read, folder_to_write, options
from gmwm.errors import InputError

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

    PATTERN is the recording of a unit or, in quotes, a pattern such as 'lot-7/**/*.csv'; files
    are those of gmwm calibrate. N, B and K of an axis come from one model for all units.
    fleet.html shows how units differ, which stand apart and what a data sheet can promise;
    fleet.parquet and fleet.csv have every number; each unit has a calibration of its own. A file
    that cannot be used is reported and costs the others nothing.

    Exit status: 0 if all files were used and no limit is missed, 1 otherwise or if no unit has a
    valid model (the files are written all the same), 2 if no file can be used.

    \b
    Examples:
      gmwm fleet 'lot-7/*.csv' --gyro-unit deg/s --accel-unit g -o lot-7-out \\
        --resume --limits limits.yaml
    """
    from gmwm.population import fleet as run
    from gmwm.report import read_datasheet

    limits = given.pop("limits")
    work = {name: given.pop(name) for name in _PARTS}
    work["limits"] = {} if limits is None else read_datasheet(limits).entries
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
