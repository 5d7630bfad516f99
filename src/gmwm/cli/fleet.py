"""``gmwm fleet``: many units of a sensor, each calibrated by itself."""

from __future__ import annotations

import json
import os
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import click

from gmwm.cli.calibrate import exit_unless
from gmwm.cli.console import progress_bar
from gmwm.cli.hints import with_hint
from gmwm.cli.options import (
    arguments_of_read,
    estimating_options,
    option,
    output_folder,
    part_options,
    printing_options,
    reading_options,
    written_models,
)


@click.command()
@click.argument("patterns", metavar="PATTERN...", nargs=-1, required=True)
@output_folder("gmwm-fleet", "Folder for calibrations, fleet.parquet, fleet.html, fleet.json.")
@option("--jobs N", "Processes; one a core by default.", type=click.IntRange(min=1))
@option(
    "--cluster ADDRESS",
    "Dask scheduler that does the work, e.g. tcp://10.0.0.1:8786; its workers read the files.",
)
@option("--resume", "Go on with what the folder holds; what changed is done again.")
@option("--horizon S", "Longest outage that filter N and K cover, in seconds.", default=60.0)
@reading_options
@part_options
@estimating_options
@printing_options
def fleet(
    patterns: tuple[str, ...],
    output: Path,
    jobs: int | None,
    cluster: str | None,
    resume: bool,
    horizon: float,
    models: tuple[str, ...],
    left: tuple[str, ...],
    everything: bool,
    start: float | None,
    stop: float | None,
    as_json: bool,
    quiet: bool,
    **reading: Any,
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
    from gmwm.calibration import SCREENING
    from gmwm.errors import InputError
    from gmwm.population import fleet as run

    try:
        with nullcontext() if quiet else progress_bar("fleet", "units") as bar:
            found = run(
                patterns,
                written_models(models) or None,
                screening=() if "all" in left else [n for n in SCREENING if n not in left],
                still=not everything,
                horizon=horizon,
                start=0.0 if start is None else start,
                stop=stop,
                folder=output,
                resume=resume,
                jobs=jobs or os.cpu_count() or 1,
                cluster=cluster,
                progress=bar,
                **arguments_of_read(**reading),
            )
    except KeyboardInterrupt:
        if (output / "calibrations").is_dir():
            click.echo(f"finished units are kept in {output}: add --resume to go on", err=True)
        raise
    if as_json:
        click.echo(json.dumps(found.to_dict(), allow_nan=False))
    elif not quiet:
        click.echo(found)
        click.echo(f"wrote {output}/: calibrations, fleet.parquet, fleet.html, fleet.json")
    if found.failed:
        first = next(iter(found.failed.values()))
        reason = with_hint(InputError(first.text, first.code))
        count = "1 file" if len(found.failed) == 1 else f"{len(found.failed)} files"
        click.echo(f"gmwm: {count} cannot be used; the first: {reason}", err=True)
    exit_unless(bool(found.valid), "unit")
