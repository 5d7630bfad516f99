"""``gmwm health``: read, examine, print."""

from __future__ import annotations

from pathlib import Path

import click

from gmwm.cli.options import read_recording, reading_options


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--json", "json_path", type=click.Path(path_type=Path), metavar="PATH",
              help="Write all findings with their numbers, in SI units, to this file.")  # fmt: skip
@reading_options
def health(
    file: Path,
    json_path: Path | None,
    rate: float | None,
    gyro_unit: str | None,
    accel_unit: str | None,
    channels: tuple[str, ...],
    time_column: str | None,
) -> None:
    """Find what is wrong with a static recording before it is calibrated.

    Gaps, dead and stuck channels, saturation, spikes and shocks, rounding, periodic lines,
    resonances, drift, changes of the noise, dependence between channels; worst first, with what
    to do about it. The exit code is 0 whatever is found. FILE is as for gmwm calibrate.

    \b
    Example:
      gmwm health static.csv --rate 100 --gyro-unit deg/s --accel-unit g
    """
    from gmwm._core.files import replaceable
    from gmwm.diagnosis import health as examine

    if json_path is not None:
        replaceable(json_path)
    recording = read_recording(file, rate, gyro_unit, accel_unit, channels, time_column)
    found = examine(recording)
    # The file first: who pipes the table into head must not lose it.
    if json_path is not None:
        found.save(json_path)
    click.echo(found)
    if json_path is not None:
        click.echo(f"\nwrote {json_path}")
