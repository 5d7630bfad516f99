"""``gmwm certify``: how consistent a filter will be with given numbers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm.cli.numbers import show, units_option
from gmwm.cli.options import output_file, seconds
from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm.calibration import Calibration

_GRAVITY = 9.80665


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--imu", type=click.Path(path_type=Path), metavar="FILE",
              help="Numbers in use: a file of Kalibr, OpenVINS, VINS, ORB-SLAM3, FAST-LIO, LIO-SAM "
                   "or their like, or of gmwm bound and gmwm reduce (.json).")  # fmt: skip
@click.option("-N", "white", metavar="GYRO,ACCEL",
              help="White noise in use, in place of --imu, rad/s/sqrt(Hz) and "
                   "m/s^2/sqrt(Hz).")  # fmt: skip
@click.option("-K", "walk", metavar="GYRO,ACCEL",
              help="Random walk in use, with -N, rad/s^2/sqrt(Hz) and m/s^3/sqrt(Hz).")  # fmt: skip
@click.option("--outages", default="10,60", show_default=True, metavar="T,T,...",
              help="Times without aiding in seconds.")  # fmt: skip
@click.option("--keyframe", type=float, default=1.0, show_default=True, metavar="S",
              help="Interval of keyframes or scans in seconds.")  # fmt: skip
@click.option(
    "--motion",
    metavar="NAME",
    help="Motion in which the errors below act: handheld, drone, car, fixed-wing, or a recording "
    "of your own.",
)
@click.option("--scale-error", type=float, default=0.0, metavar="PERCENT",
              help="Scale error of both sensors.")  # fmt: skip
@click.option(
    "--misalignment", type=float, default=0.0, metavar="DEG", help="Misalignment of the axes."
)
@click.option("--g-sensitivity", type=float, default=0.0, metavar="DEG/S/G",
              help="g-sensitivity of the gyros.")  # fmt: skip
@click.option("--time-offset", type=float, default=0.0, metavar="MS",
              help="Delay against what the IMU is fused with.")  # fmt: skip
@click.option("--vibration-rectification", type=float, default=0.0, metavar="MG/G^2",
              help="Vibration rectification of the accelerometers, with --vibration.")  # fmt: skip
@click.option(
    "--vibration", type=float, default=0.0, metavar="G", help="Vibration, root mean square."
)
@output_file("File to save the certificate in.", "JSON")
@units_option
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def certify(
    file: Path, imu: Path | None, white: str | None, walk: str | None, outages: str,
    keyframe: float, motion: str | None, scale_error: float, misalignment: float,
    g_sensitivity: float, time_offset: float, vibration_rectification: float, vibration: float,
    output: Path | None, units: str, as_json: bool,
) -> None:  # fmt: skip
    """Predict how consistent a filter is with the numbers in use.

    FILE is a calibration.json, taken for the truth. True errors beside those that the filter
    believes, for free inertial growth, an INS/GNSS filter in outages and relative poses between
    keyframes; then what N and K have to cover, cause by cause.

    \b
    Examples:
      gmwm certify out/calibration.json --imu kalibr.yaml
      gmwm certify out/calibration.json -N 1e-4,2e-3 -K 1e-6,3e-5
      gmwm certify calibration.json --imu imu.yaml --motion car --scale-error 1
    """
    from gmwm.calibration import Calibration
    from gmwm.filter_numbers import Imperfections, certify as run

    calibration = Calibration.load(file)
    known = Imperfections(
        scale_error=scale_error / 100.0,
        misalignment=math.radians(misalignment),
        g_sensitivity=math.radians(g_sensitivity) / _GRAVITY,
        time_offset=time_offset / 1000.0,
        vibration_rectification=vibration_rectification * 1e-3 / _GRAVITY,
        vibration=vibration * _GRAVITY,
    )
    if known.needs_motion and motion is None:
        raise InputError("errors that come with motion do nothing at rest: add --motion drone")
    found = run(
        calibration, _numbers(imu, white, walk, calibration),
        outages=seconds("--outages", outages), keyframe=keyframe, imperfections=known,
        motion=_motion(motion),
    )  # fmt: skip
    show(found, output, as_json, units)


def _numbers(
    imu: Path | None, white: str | None, walk: str | None, calibration: Calibration
) -> Any:
    from gmwm.export import read_numbers
    from gmwm.filter_numbers import SensorNumbers

    if (imu is None) == (white is None and walk is None):
        raise InputError("the numbers in use: give --imu FILE, or -N GYRO,ACCEL and -K GYRO,ACCEL")
    if imu is not None:
        is_basalt = imu.is_file() and b"gyro_noise_std" in imu.read_bytes()
        is_saved = imu.suffix.lower() == ".json" and not is_basalt
        return SensorNumbers.load(imu) if is_saved else read_numbers(imu, calibration.rate)
    if white is None or walk is None:
        raise InputError("-N and -K belong together: give both")
    kinds = {fit.wv.quantity or "" for fit in calibration.values()}
    order = sorted(kinds, reverse=True)  # gyro before accel
    columns = [_values(letter, text, order) for letter, text in (("-N", white), ("-K", walk))]
    return dict(zip(order, zip(*columns, strict=True), strict=True))


def _values(option: str, text: str, kinds: list[str]) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != len(kinds) or not all(value > 0.0 for value in values):
        raise InputError(
            f"{option} {text}: write a positive number for {' and '.join(kinds)}, such as "
            f"{','.join(['1e-4', '1e-3'][: len(kinds)])}"
        )
    return values


def _motion(text: str | None) -> Any:
    from gmwm.readers import read

    return read(text) if text is not None and Path(text).is_file() else text
