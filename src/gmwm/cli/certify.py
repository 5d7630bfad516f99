"""``gmwm certify``: how consistent a filter will be with given numbers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm.cli.numbers import show, units_option
from gmwm.cli.options import PATH, option, output_file, seconds
from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm.calibration import Calibration

_GRAVITY = 9.80665
_SI = {
    "scale_error": 0.01,
    "misalignment": math.radians(1.0),
    "g_sensitivity": math.radians(1.0) / _GRAVITY,
    "time_offset": 1e-3,
    "vibration_rectification": 1e-3 / _GRAVITY,
    "vibration": _GRAVITY,
}
"""SI units of one unit of each option of errors."""


@click.command()
@click.argument("file", type=PATH)
@option(
    "--imu FILE",
    "Numbers in use: a file of Kalibr, OpenVINS, VINS, ORB-SLAM3, FAST-LIO, LIO-SAM or "
    "their like, or of gmwm bound and gmwm reduce (.json).",
    type=PATH,
)
@option(
    "-N GYRO,ACCEL",
    "White noise in use, in place of --imu, rad/s/sqrt(Hz) and m/s^2/sqrt(Hz).",
    name="white",
)
@option(
    "-K GYRO,ACCEL",
    "Random walk in use, with -N, rad/s^2/sqrt(Hz) and m/s^3/sqrt(Hz).",
    name="walk",
)
@option("--outages T,T,...", "Lengths of outages in seconds.", default="10,60")
@option("--keyframe S", "Interval of keyframes or scans in seconds.", default=1.0)
@option(
    "--motion NAME",
    "Motion in which the errors below act: handheld, drone, car, fixed-wing, or a "
    "recording of your own.",
)
@option("--scale-error PERCENT", "Scale error of both sensors.", default=0.0)
@option("--misalignment DEG", "Misalignment of the axes.", default=0.0)
@option("--g-sensitivity DEG/S/G", "g-sensitivity of the gyros.", default=0.0)
@option("--time-offset MS", "Delay against what the IMU is fused with.", default=0.0)
@option(
    "--vibration-rectification MG/G^2",
    "Vibration rectification of the accelerometers, with --vibration.",
    default=0.0,
)
@option("--vibration G", "Vibration, root mean square.", default=0.0)
@output_file("File to save the certificate in.", "JSON")
@units_option
@option("--json", "Print JSON.", name="as_json")
def certify(
    file: Path,
    imu: Path | None,
    white: str | None,
    walk: str | None,
    outages: str,
    keyframe: float,
    motion: str | None,
    output: Path | None,
    units: str,
    as_json: bool,
    **errors: float,
) -> None:
    """Predict how consistent a filter is with the numbers in use.

    FILE is a calibration.json, taken for the truth. True errors beside those that the filter
    predicts, for free inertial growth, an INS/GNSS filter in outages and relative poses between
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
    known = Imperfections(**{name: errors[name] * _SI[name] for name in errors})
    if known.needs_motion and motion is None:
        raise InputError("errors that come with motion do nothing at rest: add --motion drone")
    found = run(
        calibration,
        _numbers(imu, white, walk, calibration),
        outages=seconds("--outages", outages),
        keyframe=keyframe,
        imperfections=known,
        motion=_motion(motion),
    )
    show(found, output=output, as_json=as_json, units=units)


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
