"""Filter numbers: ``gmwm bound``, ``reduce``, ``budget``, ``certify``, ``export``, ``sheet``."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm._core.files import content_of
from gmwm._core.text import brief, bullets, plain_table, wrapped
from gmwm.cli.options import (
    FILE_TO_WRITE,
    PATH,
    numbers,
    options,
    print_result,
    progress_bar,
    seconds,
    with_option,
)
from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm.calibration import Calibration
    from gmwm.filter_numbers import FilterNumbers


_number_options = options(
    """
    --form TEXT  N+K, N+GM or N+K+GM; for gmwm reduce N+2GM too.
    --shared  The same numbers for all axes of a sensor.
    --temperature
    --tau S  Correlation time of the Gauss-Markov process in seconds; "shared": the best one for
        all axes. By default each axis has its own.
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
    --level NUMBER  Cover the confidence region of this level, e.g. 0.95, instead of the estimate
        alone.
    """,
    horizon={"default": 60.0},
)
def bound(file: Path, temperature: float | None, **options: Any) -> None:
    """Find the smallest numbers that are never overconfident.

    FILE is a calibration.json. If a model has no random walk, K covers its 95 % upper limit.

    \b
    Example:
      gmwm bound out/calibration.json --horizon 10 -o numbers.json
    """
    from gmwm.calibration import Calibration
    from gmwm.filter_numbers import bound as run

    calibration = _at(Calibration.load(file), temperature)
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
def reduce(file: Path, outages: str, temperature: float | None, **options: Any) -> None:
    """Find the numbers with which a small filter is consistent.

    FILE is a calibration.json.

    \b
    Example:
      gmwm reduce out/calibration.json --form N+GM --outages 10,60
    """
    from gmwm.calibration import Calibration
    from gmwm.filter_numbers import reduce as run

    calibration = _at(Calibration.load(file), temperature)
    times = seconds("--outages", outages)
    with progress_bar("reducing", "channels") as bar:
        options |= {"outages": times, "progress": bar}
        _show(lambda **given: run(calibration, **given), **options)


@click.command()
@click.argument("file", type=PATH)
@options(
    """
    --times T,T,...  Outage lengths in seconds.
    --unknown-start  Slow errors are unknown at the start; by default they are known, as after
        aiding.
    --temperature
    """,
    times={"default": "1,10,60,600"},
)
def budget(file: Path, times: str, unknown_start: bool, temperature: float | None) -> None:
    """Predict the error growth in outages.

    FILE is a calibration.json. For each term of each channel's model it prints the errors of
    attitude (deg), velocity (m/s) and position (m), 1 sigma, after an outage. The platform is level
    and does not manoeuvre; attitude, velocity and position are exact at the start. Valid up to
    about 600 seconds. For errors that remain after fixes see gmwm certify.

    \b
    Example:
      gmwm budget out/calibration.json --times 1,10,60
    """
    from gmwm.calibration import Calibration
    from gmwm.filter_numbers import error_budget

    calibration = _at(Calibration.load(file), temperature)
    click.echo(error_budget(calibration, seconds("--times", times), calibrated=not unknown_start))


def _at(given: Any, temperature: float | None) -> Any:
    """A result with the noise at a temperature, if one is given."""
    from gmwm.calibration import Calibration

    if temperature is None:
        return given
    if not isinstance(given, Calibration):
        raise InputError("--temperature needs a calibration.json")
    return given.at(temperature)


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
    --aiding NAME  Aiding of the whole filter: gnss, pose (absolute poses at keyframes), odometry
        (relative poses, visual or lidar) or wheels.
    --reference FILE  Trajectory for the whole filter, a CSV of time, latitude, longitude, height,
        roll, pitch, yaw; by default a loiter or, with wheels, a car's drive.
    --motion NAME  Motion in which the errors below act: handheld, drone, car, fixed-wing, or a
        recording of your own. With a motion.json the numbers are judged in that motion too.
    --scale-error PERCENT  Scale error of both sensors.
    --misalignment DEG  Misalignment of the axes.
    --g-sensitivity DEG/S/G  g-sensitivity of the gyros.
    --time-offset MS  Delay of the IMU against the sensors that aid it.
    --vibration-rectification MG/G^2  Vibration rectification of the accelerometers; give
        the --vibration too.
    --vibration G  Vibration, root mean square.
    --temperature
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
    temperature: float | None,
    **given: Any,
) -> None:
    """Predict how consistent a filter is with the numbers in use.

    FILE is a calibration.json, which counts as the truth. The command prints the true errors and
    the errors that the filter predicts: for one axis without aiding, an aided INS in outages, and
    relative poses between keyframes. Then it lists the causes that N and K have to cover.

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

    calibration = _at(Calibration.load(file), temperature)
    imperfections = Imperfections(**{name: given[name] * unit for name, unit in _IN_SI.items()})
    if imperfections.needs_motion and motion is None:
        raise InputError("these errors have no effect at rest: add --motion drone")
    found = run(
        calibration,
        _numbers(given["imu"], given["white"], given["walk"], calibration),
        outages=seconds("--outages", given["outages"]),
        keyframe=given["keyframe"],
        imperfections=imperfections,
        motion=_motion(motion),
        aiding=given["aiding"],
        reference=None if given["reference"] is None else Trajectory.read(given["reference"]),
    )
    if output is not None:
        found.save(output)
    print_result(found, output, text=found.text(units, verbose=verbose), as_json=as_json)


def _motion(given: str | None) -> Any:
    """A name, the motion of a recording, or a result of ``gmwm motion``."""
    from gmwm.motion import InMotion
    from gmwm.readers import read

    if given is None or not Path(given).is_file():
        return given
    return InMotion.load(given) if given.endswith(".json") else read(given)


def _numbers(
    imu: Path | None, white: str | None, walk: str | None, calibration: Calibration
) -> Any:
    from gmwm.export import read_numbers
    from gmwm.filter_numbers import FilterNumbers

    if (imu is None) == (white is None and walk is None):
        raise InputError("give the numbers in use: --imu FILE, or -N GYRO,ACCEL and -K GYRO,ACCEL")
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
    --horizon S  Longest outage that the numbers cover, in seconds; 60 by default, 1 in motion.
    --interval S  Shortest time between updates in seconds, for a motion.json; 0.1 by default.
    --form FORM  N+K, N+GM, ...: most programs take only one; state-space takes any.
    -o --output FILE  File to write instead of printing; .npz for state-space.
    --explain  Print what the numbers are, axis by axis, in place of the file.
    --temperature
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
    interval: float | None,
    form: str | None,
    temperature: float | None,
    output: Path | None,
    explain: bool,
    force: bool,
    listed: bool,
) -> None:
    """Write filter numbers as the file of a program.

    FILE is a calibration.json, numbers that gmwm bound or gmwm reduce saved, or a motion.json (its
    numbers are for updates every --interval and outages up to --horizon). Several files make one
    IMU, e.g. gyros and accelerometers of different rates. The numbers of a calibration are the
    smallest that are not overconfident for its error models; --explain has the details.

    Exit status: 0 if the numbers were written, 1 if an axis is not valid (nothing is written), 2 if
    the input cannot be used.

    \b
    Examples:
      gmwm export out/calibration.json --to openvins -o kalibr_imu_chain.yaml
      gmwm export gyro.json accel.json --to px4
      gmwm export --list
    """
    from gmwm.export import CURVES, TARGETS, in_motion, not_valid, refusal

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
    given = in_motion([_at(load(file), temperature) for file in files], horizon, interval)
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


_CONSERVATIVE = 0.5  # NEES below which predicted errors are 1.4 times the true ones


@click.command()
@click.argument("source", metavar="SHEET", required=False)
@options(
    """
    --horizon S
    --form TEXT  N+K, N+GM or N+K+GM.
    --unit-spread FACTOR  How many times noisier than typical your unit may be.
    --rate HZ  Sampling rate, for programs that need it with the numbers.
    --imu FILE  Numbers in use, to be judged: a file of Kalibr, OpenVINS, VINS or their like.
    --report HTML  Page to write: the models in the Allan plot, and the numbers.
    -o --output JSON  File to save the numbers in, for gmwm export.
    --list  List the sensors whose data sheets are installed.
    --units
    --json
    """,
    form={"default": "N+K"},
    unit_spread={"type": float, "default": 1.25},
    rate={"type": float, "default": float("nan"), "show_default": False},
    imu={"type": PATH},
    report=FILE_TO_WRITE,
    output=FILE_TO_WRITE,
    list={"name": "listed"},
)
def sheet(
    source: str | None,
    horizon: float,
    form: str,
    imu: Path | None,
    report: Path | None,
    output: Path | None,
    listed: bool,
    units: str,
    as_json: bool,
    **how: float,
) -> None:
    """Find numbers for a filter from a data sheet, without a recording.

    SHEET is a YAML file such as 'gyro: {N: 0.15 deg/sqrt(h), B: 7 deg/h}', or a sensor of --list.
    Many sheets call the lowest point of the Allan plot bias instability: then write
    lowest_deviation in place of B. All keys: docs/data-sheets.md.
    Many error models agree with two numbers. The command finds N and K for every kind of them, and
    prints first the N and K that cover them all. For your own unit record an hour.

    \b
    Examples:
      gmwm sheet --list
      gmwm sheet stim300 --rate 200 -o numbers.json
      gmwm export numbers.json --to kalibr
      gmwm sheet mine.yaml --imu imu.yaml
    """
    from gmwm.datasheet import datasheet, sheets

    if listed:
        for name in sheets():
            each = datasheet(name)
            about = f"{each.document}{'; N only' if each.leaves_K_open else ''}"
            click.echo("\n".join(wrapped(about, f"{name:<11} ", 12)))
        return
    if source is None:
        raise InputError("gmwm sheet needs a YAML file or a sensor (sensors: gmwm sheet --list)")
    found = datasheet(source)
    if found.leaves_K_open and not (output or report or imu or as_json):
        click.echo(found.text(units, form, horizon))
        return
    numbers = found.numbers(form, horizon, **how)
    if output is not None:
        numbers.save(output)
    answer = _for_filter(found.name, numbers, how["unit_spread"])
    if report is not None:
        from gmwm.report import write_sheet_report

        write_sheet_report(found, report, numbers, answer)
    parts = [answer, found.text(units, form, horizon)]
    if imu is not None:
        parts.append(
            _judged(found.judged(_in_use(imu, how["rate"]), horizon, how["unit_spread"]), imu)
        )
    print_result(numbers, report, output, text="\n\n".join(parts), as_json=as_json)


def _for_filter(name: str, numbers: FilterNumbers, unit_spread: float) -> str:
    """N, K and the start bias of each sensor in SI by key, and how consistent they are."""
    from gmwm._core.units import SI_UNIT
    from gmwm.filter_numbers import shown_unit
    from gmwm.process import GaussMarkov
    from gmwm.report import filter_key

    is_usual = numbers.form == "N+K"
    what = "keys of Kalibr, OpenVINS" if is_usual else f"all terms of the form {numbers.form}"
    title = (
        f"{name}, for your filter ({what}): covers all models that agree with the sheet, units up "
        f"to {unit_spread:g} times as noisy, outages up to {numbers.horizon:g} s"
    )
    lines = wrapped(title)
    for sensor, each in numbers.items():
        quantity = sensor.partition("_")[0]
        for letter in "NK" if each.K else "N":
            (unit, scale), value = shown_unit(letter, quantity, "field"), getattr(each, letter)
            si = f"{value:.2e} {shown_unit(letter, quantity, 'si')[0]}"
            key = filter_key(quantity, letter) if is_usual and sensor == quantity else sensor
            lines.append(f"{key:<27}  {letter} {si:<25}  {brief(value * scale, 3)} {unit}")
        lines += [
            f"{sensor:<27}  Gauss-Markov {term.sigma:.2e} {SI_UNIT[quantity]}, {term.tau:.3g} s"
            for term in each.model.terms
            if isinstance(term, GaussMarkov)
        ]
    starts = [
        f"{k} {n.initial_sd:.2e} {SI_UNIT[k.partition('_')[0]]}"
        for k, n in numbers.items()
        if n.initial_sd
    ]
    if starts:
        start = "start bias, 1 sigma (with the turn-on bias of the sheet, if any)"
        lines += wrapped(f"{start}: {', '.join(starts)}")
    worst = [f"{k} {max(n.nees.values()):.2g}" for k, n in numbers.items()]
    warnings = [n for each in numbers.values() for n in each.notices if n.severity == "warning"]
    lines += bullets(dict.fromkeys(map(str, warnings)))
    lines += wrapped(f"largest NEES: {', '.join(worst)} (1: consistent, below 1: conservative)")
    return "\n".join([*lines, *wrapped("For your unit, record an hour: gmwm calibrate")])


def _in_use(imu: Path, rate: float) -> Any:
    from gmwm.export import read_numbers

    found = read_numbers(imu, rate)
    if not {"gyro", "accel"} & {*found}:
        raise InputError(f"{imu} has numbers for each axis: use gmwm certify with a recording")
    return found


def _judged(nees: dict[str, tuple[float, float]], imu: Path) -> str:
    """NEES of a filter with numbers in use in typical and in noisy units, by sensor."""
    lines = wrapped(f"{imu}: NEES of a filter with these numbers, over the models (1: consistent)")
    for sensor, (least, largest) in nees.items():
        verdict = "conservative" if largest < _CONSERVATIVE else "consistent"
        if largest > 1.0:
            verdict = "overconfident" + " where the sensor is noisier" * (least <= 1.0)
        lines += bullets([f"{sensor}: {least:.2g} to {largest:.2g}, {verdict}"])
    return "\n".join(lines)
