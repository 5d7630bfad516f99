"""``gmwm health``: read, examine, print."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from gmwm.cli.options import (
    PATH,
    memory_option,
    output_file,
    part_options,
    printing_options,
    read_recording,
    reading_options,
)


@click.command()
@click.argument("file", type=PATH)
@output_file("Write all findings with their numbers, in SI units, to this file.")
@reading_options
@part_options
@memory_option
@printing_options
def health(
    file: Path,
    output: Path | None,
    memory: float | None,
    as_json: bool,
    quiet: bool,
    **reading: Any,
) -> None:
    """Find defects of a recording before it is calibrated.

    Motion, gaps, dead and stuck channels, saturation, spikes and shocks, rounding, periodic lines,
    resonances, drift, changes of the noise, dependence between channels; worst first, with what
    to do about it. The exit code is 0 whatever is found. FILE is as for gmwm calibrate.

    \b
    Example:
      gmwm health static.csv --rate 100 --gyro-unit deg/s --accel-unit g
    """
    from gmwm._core.memory import limited
    from gmwm.diagnosis import health as examine

    with limited(memory):
        recording = read_recording(file, **reading)
    found = examine(recording)
    # The file first: who pipes the table into head must not lose it.
    if output is not None:
        found.save(output)
    if as_json:
        click.echo(json.dumps(found.to_dict(), allow_nan=False))
    elif not quiet:
        click.echo(found)
        if output is not None:
            click.echo(f"\nwrote {output}")
