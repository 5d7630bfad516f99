"""``gmwm bound``, ``gmwm reduce`` and ``gmwm budget``: what a calibration means for a filter."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm._core.text import bullets
from gmwm.cli.console import progress_bar
from gmwm.cli.options import PATH, option, output_file, seconds, together

if TYPE_CHECKING:
    from gmwm.filter_numbers import Certificate, SensorNumbers

units_option = option(
    "--units",
    "Units of the table; files and JSON are in SI.",
    type=click.Choice(["field", "si"]),
    default="field",
)

_number_options = together(
    click.argument("file", type=PATH),
    option("--form TEXT", "N+K, N+GM or N+K+GM; for gmwm reduce N+2GM too.", default="N+K"),
    option("--shared", "The same numbers for all axes of a sensor."),
    option(
        "--tau S",
        'Correlation time of the Gauss-Markov process in seconds; "shared": the one for all'
        " axes that costs least. Each axis has its own by default.",
        callback=lambda _, __, text: _tau(text),
    ),
    option("--gyro-bias RAD/S", "Standard deviation of the turn-on bias of a gyro.", default=0.0),
    option(
        "--accel-bias M/S^2",
        "Standard deviation of the turn-on bias of an accelerometer.",
        default=0.0,
    ),
    output_file("File to save the numbers in.", "JSON"),
    units_option,
    option("--json", "Print JSON.", name="as_json"),
)


def _tau(text: str | None) -> float | str | None:
    return text if text in (None, "shared") else seconds("--tau", text or "")[0]


@click.command()
@_number_options
@option(
    "--horizon S",
    "Longest outage in seconds; for relative poses, the interval of keyframes.",
    default=60.0,
)
@option(
    "--level P",
    "Cover the confidence region of this level, e.g. 0.95, and not the estimate alone.",
    type=float,
)
def bound(file: Path, horizon: float, level: float | None, **options: Any) -> None:
    """Find the smallest numbers that are never overconfident.

    FILE is a calibration.json.

    \b
    Example:
      gmwm bound out/calibration.json --horizon 10 -o numbers.json
    """
    from gmwm.calibration import Calibration
    from gmwm.filter_numbers import bound as run

    found = run(Calibration.load(file), horizon=horizon, level=level, **_arguments(options))
    show(found, **_printing(options), remark=_turn_on_hint(found, options))


@click.command()
@_number_options
@option(
    "--outages T,T,...",
    "Lengths of outages in seconds.",
    default="10,30,60",
)
@option(
    "--keyframe S",
    "Interval of keyframes or scans, in place of outages, for relative poses.",
    type=float,
)
def reduce(file: Path, outages: str, keyframe: float | None, **options: Any) -> None:
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
            calibration, outages=times, keyframe=keyframe, progress=bar, **_arguments(options)
        )
    show(found, **_printing(options), remark=_turn_on_hint(found, options))


@click.command()
@click.argument("file", type=PATH)
@option("--times T,T,...", "Coasting times in seconds.", default="1,10,60,600")
@option(
    "--unknown-start",
    "Nothing is known of the errors at the start; by default the initial values of the "
    "slow ones are, as after aiding.",
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


def _arguments(options: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of the function that finds the numbers."""
    bias_sd = {"gyro": options["gyro_bias"], "accel": options["accel_bias"]}
    return {"bias_sd": bias_sd} | {name: options[name] for name in ("form", "shared", "tau")}


def _printing(options: Mapping[str, Any]) -> dict[str, Any]:
    return {name: options[name] for name in ("output", "as_json", "units")}


def _turn_on_hint(numbers: SensorNumbers, options: Mapping[str, Any]) -> str:
    """A line for the sensors whose turn-on bias was not given."""
    kinds = [kind for kind in ("gyro", "accel") if numbers.of(kind)]
    flags = [f"--{kind}-bias" for kind in kinds if options[f"{kind}_bias"] == 0.0]
    text = f"add your turn-on bias (1 sigma) by {' and '.join(flags)}"
    return "\n".join(bullets([text])) if flags else ""


def show(
    result: SensorNumbers | Certificate,
    *,
    output: Path | None,
    as_json: bool,
    units: str,
    remark: str = "",
) -> None:
    """Save and print a result."""
    if output is not None:
        result.save(output)
    click.echo(json.dumps(result.to_dict(), indent=1) if as_json else result.text(units))
    if remark and not as_json:
        click.echo(remark)
    if output is not None and not as_json:
        click.echo(f"wrote {output}")
