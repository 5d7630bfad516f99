"""``gmwm bound``, ``gmwm reduce`` and ``gmwm budget``: what a calibration means for a filter."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gmwm._core.text import bullets
from gmwm.cli.console import progress_bar
from gmwm.cli.options import output_file, seconds, together

if TYPE_CHECKING:
    from gmwm.filter_numbers import Certificate, SensorNumbers

units_option = click.option(
    "--units", type=click.Choice(["field", "si"]), default="field", show_default=True,
    help="Units of what is printed; files and JSON are in SI.",
)  # fmt: skip

_number_options = together(
    click.argument("file", type=click.Path(path_type=Path)),
    click.option("--form", default="N+K", show_default=True,
                 help="N+K, N+GM or N+K+GM; for gmwm reduce N+2GM too."),
    click.option("--shared", is_flag=True, help="The same numbers for all axes of a sensor."),
    click.option("--tau", metavar="S", callback=lambda _, __, text: _tau(text),
                 help="Correlation time of the Gauss-Markov process in seconds; \"shared\": the "
                      "one for all axes that costs least. Each axis has its own by default."),
    click.option("--gyro-bias", type=float, default=0.0, metavar="RAD/S",
                 help="Standard deviation of the turn-on bias of a gyro."),
    click.option("--accel-bias", type=float, default=0.0, metavar="M/S^2",
                 help="Standard deviation of the turn-on bias of an accelerometer."),
    output_file("File to save the numbers in.", "JSON"),
    units_option,
    click.option("--json", "as_json", is_flag=True, help="Print JSON."),
)  # fmt: skip


def _tau(text: str | None) -> float | str | None:
    return text if text in (None, "shared") else seconds("--tau", text or "")[0]


@click.command()
@_number_options
@click.option("--horizon", type=float, default=60.0, show_default=True, metavar="S",
              help="Time without aiding in seconds; of relative poses, the interval of "
                   "keyframes.")  # fmt: skip
@click.option("--level", type=float, metavar="P",
              help="Cover the confidence region of this level, e.g. 0.95, and not the estimate "
                   "alone.")  # fmt: skip
def bound(
    file: Path, form: str, shared: bool, tau: float | str | None, gyro_bias: float,
    accel_bias: float, output: Path | None, units: str, as_json: bool, horizon: float,
    level: float | None,
) -> None:  # fmt: skip
    """Find the smallest numbers that are never too optimistic.

    FILE is a calibration.json.

    \b
    Example:
      gmwm bound out/calibration.json --horizon 10 -o numbers.json
    """
    from gmwm.calibration import Calibration
    from gmwm.filter_numbers import bound as run

    found = run(
        Calibration.load(file), form, horizon, level=level, shared=shared, tau=tau,
        bias_sd={"gyro": gyro_bias, "accel": accel_bias},
    )  # fmt: skip
    show(found, output, as_json, units, _left_out(found, gyro_bias, accel_bias))


@click.command()
@_number_options
@click.option("--outages", default="10,30,60", show_default=True, metavar="T,T,...",
              help="Times without aiding that the numbers are for, in seconds.")  # fmt: skip
@click.option("--keyframe", type=float, metavar="S",
              help="Interval of keyframes or scans, in place of outages, for relative "
                   "poses.")  # fmt: skip
def reduce(
    file: Path, form: str, shared: bool, tau: float | str | None, gyro_bias: float,
    accel_bias: float, output: Path | None, units: str, as_json: bool, outages: str,
    keyframe: float | None,
) -> None:  # fmt: skip
    """Find the numbers with which a small filter is consistent.

    FILE is a calibration.json.

    \b
    Example:
      gmwm reduce out/calibration.json --form N+GM --outages 10,60
    """
    from gmwm.calibration import Calibration
    from gmwm.filter_numbers import reduce as run

    calibration, times = Calibration.load(file), seconds("--outages", outages)
    with progress_bar("reducing", "channels") as bar:
        found = run(
            calibration, form, times, keyframe=keyframe, shared=shared, tau=tau, progress=bar,
            bias_sd={"gyro": gyro_bias, "accel": accel_bias},
        )  # fmt: skip
    show(found, output, as_json, units, _left_out(found, gyro_bias, accel_bias))


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
    (m/s) and position (m) errors, 1 sigma, after coasting level and without manoeuvres from exact
    attitude, velocity and position. Valid up to 600 seconds or so. After fixes, which leave errors
    of tilt and velocity too: gmwm certify.

    \b
    Example:
      gmwm budget out/calibration.json --times 1,10,60
    """
    from gmwm.calibration import Calibration
    from gmwm.filter_numbers import error_budget

    calibration = Calibration.load(file)
    click.echo(error_budget(calibration, seconds("--times", times), calibrated=not unknown_start))


def _left_out(numbers: SensorNumbers, gyro_bias: float, accel_bias: float) -> str:
    """A line on the bias at switch-on, of the sensors for which none was given."""
    given = {"gyro": gyro_bias, "accel": accel_bias}
    flags = [f"--{kind}-bias" for kind, sd in given.items() if sd == 0.0 and numbers.of(kind)]
    if not flags:
        return ""
    text = f"give the bias at switch-on (1 sigma) by {' and '.join(flags)}"
    return "\n".join(bullets([text]))


def show(
    result: SensorNumbers | Certificate, output: Path | None, as_json: bool, units: str,
    remark: str = "",
) -> None:  # fmt: skip
    """Save and print a result."""
    if output is not None:
        result.save(output)
    click.echo(json.dumps(result.to_dict(), indent=1) if as_json else result.text(units))
    if remark and not as_json:
        click.echo(remark)
    if output is not None and not as_json:
        click.echo(f"wrote {output}")
