"""``gmwm navigate``: options are keys of a study file; parse, run, print, write."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from gmwm._core.files import folder_to_fill, moved_together, write_text
from gmwm.cli.options import (
    PATH,
    READING,
    arguments_of_read,
    folder_to_write,
    numbers,
    options,
    print_result,
    progress_bar,
    with_option,
)
from gmwm.errors import InputError

_NEEDED = (
    "gmwm navigate needs a trajectory, a truth and filters: give STUDY.yaml, or --trajectory, "
    "--truth and --filter; or, for your own data, --imu, --gnss and --sensors (examples: gmwm "
    "navigate --help)"
)
_OF_DATA = frozenset({"imu", "gnss_fixes", "sensors", "compare"})
"""Keys of a study on one's own data."""

_OF_STUDY, _OF_LOG = ("validation.txt", "validation.html"), ("solution.csv", "report.html")
_OF_SENSORS = "comparison.html"
"""What is written."""


def _key(convert: Callable[[str, Any], Any], **settings: Any) -> dict[str, Any]:
    """Settings of an option that is a key of the study file; ``convert`` gives its value there."""

    def value(_: click.Context, flag: click.Parameter, given: Any) -> Any:
        return convert(flag.opts[0], given) if given or isinstance(given, float) else None

    return {"callback": value, **settings}


def _absolute(_: str, path: str | Path) -> str:
    return str(Path(path).absolute())  # paths of a study are relative to its file


def _sd(flag: str, text: str) -> list[float] | float:
    found = numbers(flag, text, "one number, or NORTH,EAST,DOWN, e.g. 0.1,0.1,0.15", 1, 3)
    return found if len(found) == 3 else found[0]


def _attitude(flag: str, text: str) -> list[str]:
    angles = numbers(flag, text, "ROLL,PITCH,YAW in degrees, e.g. 2,-1,135", 3)
    return [f"{angle!r} deg" for angle in angles]


def _spans(flag: str, texts: Sequence[str]) -> list[list[float]]:
    form = "START:LENGTH in seconds, e.g. 600:60"
    return [numbers(flag, text, form, 2, separator=":") for text in texts]


def _outages(flag: str, text: str) -> str | float:
    return text if text == "auto" else numbers(flag, text, "auto, or seconds, e.g. 60", 1)[0]


def _named(flag: str, texts: Sequence[str]) -> dict[str, str]:
    found: dict[str, str] = {}
    for text in texts:
        name, _, path = text.partition("=")
        if not (name and path):
            raise InputError(f"{flag} {text}: write NAME=FILE, e.g. GMWM=out/calibration.json")
        if name in found:
            raise InputError(f"{flag} {name}=... is given twice: give different names")
        found[name] = path if path == "truth" and flag == "--filter" else _absolute(flag, path)
    return found


def _sensors(flag: str, texts: Sequence[str]) -> str | dict[str, str]:
    return _absolute(flag, texts[0]) if len(texts) == 1 else _named(flag, texts)


@click.command()
@click.argument("file", required=False, type=PATH, metavar="[STUDY.yaml]")
@options(
    """
    --trajectory NAME  helicopter, car, loiter, or a CSV of time, latitude, longitude, height,
        roll, pitch, yaw.
    --duration NUMBER  Duration of the trajectory, in seconds.
    --truth FILE  calibration.json from which sensor errors are simulated.
    --filter NAME=FILE  A filter and its calibration.json, or numbers that gmwm bound or gmwm reduce
        saved; 'truth' for the true models; repeat. The others are compared with the first.
    --outage START:LENGTH  Seconds without GNSS; repeat.
    --runs N  Number of runs.  [default: 100]
    --seed N  Seed of the errors. [default: 0]
    --jobs
    -o --output  Folder for the report, the table and the runs.
    --resume
    --cluster
    --imu FILE  Your own data: IMU samples, with a header as for gmwm calibrate; axes forward,
        right, down.
    --gnss FILE  Fixes: time, latitude, longitude, height, on the IMU's clock.
    --sensors [NAME=]FILE  calibration.json or filter numbers of the IMU; several with names are
        compared.
    --outages auto|SECONDS  Length of the outages that are cut into the log to compare sensors; auto
        is 30 s.  [default: auto]
    --lever-arm X,Y,Z  From the IMU to the antenna, metres: forward, right, down.
    --heading NUMBER  Heading at the first fix in degrees; by default from GNSS in motion.
    --attitude ROLL,PITCH,YAW  Attitude at the first fix in degrees, if the record begins in motion;
        by default from the data.
    --imu-start S  Time of the first IMU sample on the clock of the fixes, if it has no time stamps.
    --barometer FILE  Barometric heights: time, height.
    --zero-velocity VALUE  Use standstills that the IMU shows, to this accuracy, e.g. '0.02 m/s'.
    --reference FILE  Compare the solution with a more accurate trajectory of the IMU: a CSV of
        time, latitude, longitude, height, roll, pitch, yaw, on the IMU's clock.
    --gate NUMBER  Reject fixes whose innovation is less probable, e.g. 1e-5.
    --position-sd N[,E,D]  Standard deviations of fixes that have none, metres: north, east, down.
        [default: 1,1,1.5]
    --velocity-sd N[,E,D]  The same for velocities, m/s.  [default: 0.1,0.1,0.15]
    --gyro-bias VALUE  Bias of a gyro at switch-on, 1 sigma.  [default: 0.1 deg/s]
    --accel-bias VALUE  The same for an accelerometer.  [default: 0.1 m/s^2]
    --json
    --reading
    """,
    truth=_key(_absolute),
    filter=_key(_named, name="filters", multiple=True),
    outage=_key(_spans, multiple=True),
    seed={"type": click.IntRange(min=0)},
    output=folder_to_write("gmwm-navigate", [*_OF_STUDY, *_OF_LOG, _OF_SENSORS]),
    imu=_key(_absolute),
    gnss=_key(_absolute, name="gnss_fixes"),
    sensors=_key(_sensors, multiple=True),
    outages=_key(_outages),
    lever_arm=_key(lambda flag, arm: numbers(flag, arm, "X,Y,Z in metres, e.g. 0.5,0,-1.2", 3)),
    heading=_key(lambda _, angle: f"{angle!r} deg"),
    attitude=_key(_attitude),
    barometer=_key(_absolute),
    reference=_key(_absolute),
    position_sd=_key(_sd),
    velocity_sd=_key(_sd),
)
def navigate(
    file: Path | None, output: Path, as_json: bool, imu_start: float | None, **keys: Any
) -> None:
    """Test sensor models by navigating, or filter your own data.

    A study simulates INS/GNSS filters with outages (Monte Carlo). Sensor errors are drawn from the
    true models or taken from real static recordings, and added to the error-free signals of a
    trajectory; every filter navigates with the same errors. The command prints the errors at the
    end of the outages and whether each filter is consistent. A YAML file can hold more settings;
    options override it. See docs/navigation.md and docs/own-log.md.

    With --imu, --gnss and --sensors it filters real data and writes solution.csv and report.html.
    It prints whether the innovations agree with the sensor models, and if not, which fault of the
    log explains them. Several --sensors are compared: the command cuts outages into the log and
    compares the positions after them with a smoother of all fixes, to show which model to use.

    \b
    Examples:
      gmwm navigate study.yaml -o out
      gmwm navigate --trajectory car --truth cal.json --filter GMWM=cal.json \\
        --filter NK=numbers.json --outage 600:60 --outage 900:40
      gmwm navigate --imu imu.csv --gnss fixes.csv --sensors out/calibration.json
      gmwm navigate --imu imu.csv --gnss fixes.csv --sensors A=a.json \\
        --sensors B=b.json --outages auto
    """
    from gmwm.ins.fields import read_document

    reading = {name: keys.pop(name) for name in READING}
    work = {name: keys.pop(name) for name in ("jobs", "resume", "cluster")}
    bias = {name: keys.pop(f"{name}_bias") for name in ("gyro", "accel")}
    spans, length = keys.pop("outage"), keys.pop("outages")
    if isinstance(keys["sensors"], dict):
        keys["compare"] = keys.pop("sensors")
    keys["bias"] = {kind: sd for kind, sd in bias.items() if sd is not None} or None
    keys["outages"] = spans if length is None else length
    given = {name: each for name, each in keys.items() if each is not None}
    if file is None and not given:
        raise InputError(_NEEDED)
    content = ({} if file is None else read_document(file)) | given
    is_own = not _OF_DATA.isdisjoint(content)
    if is_own:
        of_imu = arguments_of_read(**reading) | ({} if imu_start is None else {"start": imu_start})
        if of_imu:
            imu = content.get("imu")
            content["imu"] = {**(imu if isinstance(imu, dict) else {"file": imu}), **of_imu}
        if "outages" in content and "compare" not in content:
            raise InputError("--outages needs sensors to compare: give --sensors A=a.json twice")
    else:
        if (rate := reading.pop("rate")) is not None:  # also that of a ready-made trajectory
            content["rate"] = rate
        alone = {"json": as_json, "outages": length, "imu-start": imu_start, **reading}
        for name, each in alone.items():
            if each not in (None, (), False):
                flag = name.replace("_", "-")
                raise InputError(f"--{flag} needs your own data: give --imu, --gnss and --sensors")
    try:
        subject = _subject(content, Path() if file is None else file.parent, is_own)
    except InputError as error:
        if file is None or given:  # with options, it may be theirs
            raise
        text = f"{file}: {error.problem}"
        raise InputError(text, error.code, error.hint, error.values) from None
    with folder_to_fill(output) as folder:
        found, write = _own_data(subject) if is_own else _validated(subject, folder, **work)
        with moved_together(folder) as new:
            paths = write(new)
    print_result(found, *(folder / each.name for each in paths), as_json=as_json)


def _subject(content: dict[str, Any], base: Path, is_own: bool) -> Any:
    """What a file or options describe: an experiment, real data, or sensors to compare on them."""
    if not is_own:
        from gmwm.ins.spec import experiment_from

        return experiment_from(content, base)
    from gmwm.ins.logs import Comparison, Measured

    found = (Comparison if "compare" in content else Measured).of(content, base)
    return replace(found, notices=tuple(map(with_option, found.notices)))


def _validated(experiment: Any, folder: Path, *, resume: bool, **work: Any) -> Any:
    """Do the runs of a study; its result, and what writes its files into a folder."""
    from gmwm.ins.simulation import Validation

    table, page = _OF_STUDY
    work |= {"folder": folder / "runs", "earlier": "resume" if resume else "replace"}
    with progress_bar("navigating", "runs") as bar:
        found = Validation.of(experiment, progress=bar, **work)
    return found, lambda new: (write_text(new / table, str(found)), found.report(new / page))


def _own_data(given: Any) -> Any:
    """Filter real data, or compare sensor models on them; as `_validated`."""
    from gmwm.ins.logs import Comparison, Navigated

    if isinstance(given, Comparison):
        return given, lambda new: [given.report(new / _OF_SENSORS)]
    found, (solution, page) = Navigated.of(given), _OF_LOG
    return found, lambda new: (found.write_solution(new / solution), found.report(new / page))
