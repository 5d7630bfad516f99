"""``gmwm health``: read, examine, print."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from gmwm.cli.console import print_result
from gmwm.cli.options import FILE_TO_WRITE, PATH, options, read_recording


@click.command()
@click.argument("file", type=PATH)
@options(
    """
    -o --output FILE  Write all findings with their numbers, in SI units, to this file.
    --reading
    --part
    --memory
    --json
    --quiet
    """,
    output=FILE_TO_WRITE,
)
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
    from gmwm.cli.hints import with_option
    from gmwm.diagnosis import health as examine

    with limited(memory):
        recording = read_recording(file, **reading)
    found = examine(recording)
    if output is not None:  # first: who pipes the table into head must not lose it
        found.save(output)
    span = (reading["start"], reading["start"] + recording.duration)
    shown = replace(found, notices=tuple(with_option(each, span) for each in found.notices))
    print_result(found, output, text=str(shown), as_json=as_json, quiet=quiet)
