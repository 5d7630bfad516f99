"""Numbers for filters: ``gmwm bound``, ``reduce``, ``budget``, ``certify`` and ``export``."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm._core.files import content_of
from gmwm._core.tables import plain_table
from gmwm._core.text import bullets
from gmwm.cli.console import print_result, progress_bar, with_option
from gmwm.cli.options import FILE_TO_WRITE, PATH, numbers, options, seconds
from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm.calibration import Calibration
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
    --keyframe S  Interval of keyframes or scans instead of outages, for relative poses; 1 s or
        more.
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
    --aiding NAME  What aids the whole filter: gnss, pose (absolute poses at keyframes), odometry
        (relative poses, visual or lidar) or wheels.
    --reference FILE  Reference trajectory on which it is judged, a CSV of time, latitude,
        longitude, height, roll, pitch, yaw; a loiter or, with wheels, a car's drive by default.
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
    -v --verbose  Print every check, all notices and the recommended numbers by axis too.
    --units
    --json
    """,
    output=FILE_TO_WRITE,
    N={"name": "white"},
    K={"name": "walk"},
    outages={"default": "10,60"},
    keyframe={"default": 1.0},
    aiding={"default": "gnss"},
    **{name: {"default": 0.0} for name in _IN_SI},
)
def certify(
    file: Path,
    output: Path | None,
    units: str,
    as_json: bool,
    verbose: bool,
    motion: str | None,
    **given: Any,
) -> None:
    """Predict how consistent a filter is with the numbers in use.

    FILE is a calibration.json, taken for the truth. True errors beside those that the filter
    predicts, for free inertial growth, an aided INS in outages and relative poses between
    keyframes; then what N and K have to cover, cause by cause.

    \b
    Examples:
      gmwm certify out/calibration.json --imu kalibr.yaml
      gmwm certify out/calibration.json -N 1e-4,2e-3 -K 1e-6,3e-5
      gmwm certify out/calibration.json --imu kalibr.yaml --aiding wheels
      gmwm certify calibration.json --imu imu.yaml --motion car --scale-error 1
    """
    from gmwm.calibration import Calibration
    from gmwm.filter_numbers import Imperfections, certify as run
    from gmwm.ins import Trajectory
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
        aiding=given["aiding"],
        reference=None if given["reference"] is None else Trajectory.read(given["reference"]),
    )
    if output is not None:
        found.save(output)
    print_result(found, output, text=found.text(units, verbose=verbose), as_json=as_json)


def _numbers(
    imu: Path | None, white: str | None, walk: str | None, calibration: Calibration
) -> Any:
    from gmwm.export import read_numbers
    from gmwm.filter_numbers import FilterNumbers

    if (imu is None) == (white is None and walk is None):
        raise InputError("the numbers in use: give --imu FILE, or -N GYRO,ACCEL and -K GYRO,ACCEL")
    if imu is not None:
        is_json = imu.suffix.lower() == ".json"
        is_saved = is_json and b"gyro_noise_std" not in content_of(imu, 1 << 25)  # of Basalt
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


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, type=PATH)
@options(
    """
    --to NAME  The program; see --list.
    --horizon S  Longest outage that the numbers cover, in seconds; 60 by default.
    --form FORM  N+K, N+GM, ...: most programs hold one; state-space holds any.
    -o --output FILE  File to write instead of printing; .npz for state-space.
    --explain  Print what the numbers are, axis by axis, in place of the file.
    --force  Write the numbers although an axis is not valid.
    --list  List the programs.
    """,
    to={"name": "target"},
    output=FILE_TO_WRITE,
    list={"name": "listed"},
)
def export(
    files: tuple[Path, ...],
    target: str | None,
    horizon: float | None,
    form: str | None,
    output: Path | None,
    explain: bool,
    force: bool,
    listed: bool,
) -> None:
    """Write numbers for a filter as the program wants them.

    FILE is a calibration.json, numbers that gmwm bound or gmwm reduce saved, or a motion.json, then
    for updates every 0.1 s and outages up to --horizon, by default 1 s. Several files make one IMU,
    such as gyros and accelerometers of different rates. The numbers of a calibration are the
    smallest that are not overconfident for its error models; --explain has the details.

    Exit status: 0 if the numbers were written, 1 if an axis is not valid (nothing is written), 2 if
    the input cannot be used.

    \b
    Examples:
      gmwm export out/calibration.json --to openvins -o kalibr_imu_chain.yaml
      gmwm export gyro.json accel.json --to px4
      gmwm export --list
    """
    from gmwm.export import CURVES, TARGETS, not_valid, refusal

    if listed:
        rows = [(t.name, t.title, t.form, t.file_name) for t in TARGETS.values()]
        rows += [(name, each.title, "curve", each.file_name) for name, each in CURVES.items()]
        click.echo(plain_table(("name", "program", "form", "file"), rows))
        return
    if not files or target is None:
        usage = "gmwm export calibration.json --to NAME (names: gmwm export --list)"
        raise InputError(f"gmwm export needs files and a program: {usage}")
    from gmwm import export as written, load
    from gmwm._core import checks

    checks.choice("--to", target, (*TARGETS, *CURVES))
    given = [load(file) for file in files]
    for each in (n for one in given for n in getattr(one, "notices", ()) if n.code == "other-run"):
        click.echo(f"gmwm: {each}", err=True)
    if explain:
        about = CURVES[target].about() if target in CURVES else ""
        click.echo(about or TARGETS[target].explain(given, horizon, form), nl=False)
        return
    found = not_valid(given)
    if found and not force:
        why = refusal({name: with_option(each) for name, each in found.items()})
        click.echo(f"gmwm: {why}, or add --force", err=True)
        click.get_current_context().exit(1)
    text = written(given, target, horizon=horizon, form=form, path=output)
    click.echo(f"wrote {output}" if output else text, nl=output is not None)
