"""``gmwm bound``, ``gmwm reduce`` and ``gmwm budget``: what a calibration means for a filter."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm._core.text import bullets
from gmwm.cli.console import print_result, progress_bar
from gmwm.cli.options import FILE_TO_WRITE, PATH, options, seconds

if TYPE_CHECKING:
    from gmwm.filter_numbers import FilterNumbers


_number_options = options(
    """
    --form TEXT  N+K, N+GM or N+K+GM; for gmwm reduce N+2GM too.
    --shared  The same numbers for all axes of a sensor.
    --tau S  Correlation time of the Gauss-Markov process in seconds; "shared": the one for all
        axes that costs least. Each axis has its own by default.
    --gyro-bias RAD/S  Standard deviation of the turn-on bias of a gyro.
    --accel-bias M/S^2  Standard deviation of the turn-on bias of an accelerometer.
    -o --output JSON  File to save the numbers in.
    --units
    --json
    """,
    form={"default": "N+K"},
    tau={
        "type": str,
        "callback": lambda _, __, text: (
            text if text in (None, "shared") else seconds("--tau", text)[0]
        ),
    },
    gyro_bias={"default": 0.0},
    accel_bias={"default": 0.0},
    output=FILE_TO_WRITE,
)


@click.command()
@click.argument("file", type=PATH)
@_number_options
@options(
    """
    --horizon S  Longest outage in seconds.
    --level NUMBER  Cover the confidence region of this level, e.g. 0.95, and not the estimate
        alone.
    """,
    horizon={"default": 60.0},
)
def bound(file: Path, **options: Any) -> None:
    """Find the smallest numbers that are never overconfident.

    FILE is a calibration.json.

    \b
    Example:
      gmwm bound out/calibration.json --horizon 10 -o numbers.json
    """
    from gmwm.calibration import Calibration
    from gmwm.filter_numbers import bound as run

    calibration = Calibration.load(file)
    _show(lambda **given: run(calibration, **given), **options)


@click.command()
@click.argument("file", type=PATH)
@_number_options
@options(
    """
    --outages T,T,...  Lengths of outages in seconds.
    --keyframe S  Interval of keyframes or scans instead of outages, for relative poses.
    """,
    outages={"default": "10,30,60"},
)
def reduce(file: Path, outages: str, **options: Any) -> None:
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
        options |= {"outages": times, "progress": bar}
        _show(lambda **given: run(calibration, **given), **options)


@click.command()
@click.argument("file", type=PATH)
@options(
    """
    --times T,T,...  Outage lengths in seconds.
    --unknown-start  Nothing is known of the errors at the start; by default the initial values of
        the slow ones are, as after aiding.
    """,
    times={"default": "1,10,60,600"},
)
def budget(file: Path, times: str, unknown_start: bool) -> None:
    """Predict the error growth in outages.

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


def _show(
    find: Callable[..., FilterNumbers],
    *,
    output: Path | None,
    as_json: bool,
    units: str,
    gyro_bias: float,
    accel_bias: float,
    **options: Any,
) -> None:
    """Find numbers, save and print them, and ask for turn-on biases that were not given."""
    bias_sd = {"gyro": gyro_bias, "accel": accel_bias}
    found = find(bias_sd=bias_sd, **options)
    if output is not None:
        found.save(output)
    flags = [f"--{kind}-bias" for kind in bias_sd if found.of(kind) and bias_sd[kind] == 0.0]
    hint = bullets([f"add your turn-on bias (1 sigma) by {' and '.join(flags)}"] if flags else [])
    print_result(found, output, text="\n".join([found.text(units), *hint]), as_json=as_json)
