"""``gmwm budget``: the error growth of unaided navigation."""

from __future__ import annotations

from pathlib import Path

import click

from gmwm.cli.options import seconds


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--times", default="1,10,60,600", show_default=True, metavar="T,T,...",
              help="Coasting times in seconds.")  # fmt: skip
@click.option("--unknown-start", is_flag=True,
              help="Nothing is known of the errors at the start; by default the initial values of "
                   "the slow ones are, as after aiding.")  # fmt: skip
def budget(file: Path, times: str, unknown_start: bool) -> None:
    """Predict the error growth of unaided navigation.

    FILE is a calibration.json. For each term of each channel's model: attitude (deg), velocity
    (m/s) and position (m) errors, 1 sigma, after coasting level and without manoeuvres. Valid up
    to 600 seconds or so.

    \b
    Example:
      gmwm budget out/calibration.json --times 1,10,60
    """
    from gmwm.budget import error_budget
    from gmwm.calibration import Calibration

    calibration = Calibration.load(file)
    click.echo(error_budget(calibration, seconds("--times", times), calibrated=not unknown_start))
