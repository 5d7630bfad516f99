"""``gmwm certify``: how consistent a filter will be with given numbers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm.cli.console import print_result
from gmwm.cli.options import FILE_TO_WRITE, PATH, numbers, options, seconds
from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm.calibration import Calibration

_GRAVITY = 9.80665
_IN_SI = {
    "scale_error": 0.01,
    "misalignment": math.radians(1.0),
    "g_sensitivity": math.radians(1.0) / _GRAVITY,
    "time_offset": 1e-3,
    "vibration_rectification": 1e-3 / _GRAVITY,
    "vibration": _GRAVITY,
}
"""SI units in one of each option of errors."""


@click.command()
@click.argument("file", type=PATH)
@options(
    """
    --imu FILE  Numbers in use: a file of Kalibr, OpenVINS, VINS, ORB-SLAM3, FAST-LIO, LIO-SAM or
        their like, or of gmwm bound and gmwm reduce (.json).
    -N GYRO,ACCEL  White noise in use, instead of --imu, rad/s/sqrt(Hz) and m/s^2/sqrt(Hz).
    -K GYRO,ACCEL  Random walk in use, with -N, rad/s^2/sqrt(Hz) and m/s^3/sqrt(Hz).
    --outages T,T,...  Lengths of outages in seconds.
    --keyframe S  Interval of keyframes or scans in seconds.
    --motion NAME  Motion in which the errors below act: handheld, drone, car, fixed-wing, or a
        recording of your own.
    --scale-error PERCENT  Scale error of both sensors.
    --misalignment DEG  Misalignment of the axes.
    --g-sensitivity DEG/S/G  g-sensitivity of the gyros.
    --time-offset MS  Delay against what the IMU is fused with.
    --vibration-rectification MG/G^2  Vibration rectification of the accelerometers, for the
        vibration.
    --vibration G  Vibration, root mean square.
    -o --output JSON  File to save the certificate in.
    --units
    --json
    """,
    output=FILE_TO_WRITE,
    N={"name": "white"},
    K={"name": "walk"},
    outages={"default": "10,60"},
    keyframe={"default": 1.0},
    **{name: {"default": 0.0} for name in _IN_SI},
)
def certify(
    file: Path, output: Path | None, units: str, as_json: bool, motion: str | None, **given: Any
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
    from gmwm.readers import read

    calibration = Calibration.load(file)
    imperfections = Imperfections(**{name: given[name] * unit for name, unit in _IN_SI.items()})
    if imperfections.needs_motion and motion is None:
        raise InputError("these errors have no effect at rest: add --motion drone")
    found = run(
        calibration,
        _numbers(given["imu"], given["white"], given["walk"], calibration),
        outages=seconds("--outages", given["outages"]),
        keyframe=given["keyframe"],
        imperfections=imperfections,
        motion=read(motion) if motion is not None and Path(motion).is_file() else motion,
    )
    if output is not None:
        found.save(output)
    print_result(found, output, text=found.text(units), as_json=as_json)


def _numbers(
    imu: Path | None, white: str | None, walk: str | None, calibration: Calibration
) -> Any:
    from gmwm.export import read_numbers
    from gmwm.filter_numbers import FilterNumbers

    if (imu is None) == (white is None and walk is None):
        raise InputError("the numbers in use: give --imu FILE, or -N GYRO,ACCEL and -K GYRO,ACCEL")
    if imu is not None:
        is_basalt = imu.is_file() and b"gyro_noise_std" in imu.read_bytes()
        is_saved = imu.suffix.lower() == ".json" and not is_basalt
        return FilterNumbers.load(imu) if is_saved else read_numbers(imu, calibration.rate)
    if white is None or walk is None:
        raise InputError("-N and -K belong together: give both")
    kinds = sorted({fit.wv.quantity or "" for fit in calibration.values()}, reverse=True)
    form = f"a positive number for {' and '.join(kinds)}, e.g. {'1e-4,1e-3'[: 5 * len(kinds) - 1]}"
    columns = []
    for flag, text in (("-N", white), ("-K", walk)):
        columns.append(numbers(flag, text, form, len(kinds)))
        if not min(columns[-1]) > 0.0:
            raise InputError(f"{flag} {text}: write {form}")
    return dict(zip(kinds, zip(*columns, strict=True), strict=True))  # gyro before accel
