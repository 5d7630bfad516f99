"""The command line: what it prints and writes, and how it refuses what it cannot use."""

import io
import json
import os
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

import gmwm
from gmwm import GaussMarkov, RandomWalk, WhiteNoise, cli
from gmwm.process import as_model
from marks import slow
from places import GOLDEN

WIDTH = 80
SI = ("--gyro-unit", "rad/s", "--accel-unit", "m/s^2")
RATE = ("--rate", "100")


def invoked(folder, *arguments):
    """Run ``gmwm ARGUMENTS`` in a folder: exit code, what was printed, what was told."""
    code, ends = 0, [io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2)]
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(ends[0]), redirect_stderr(ends[1]):
        for name in ("FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
            patch.delenv(name, raising=False)
        patch.chdir(folder)
        patch.setattr(sys, "argv", ["gmwm", *map(str, arguments)])
        try:
            cli.main()
        except SystemExit as stop:
            code = stop.code
    return code, *(end.buffer.getvalue().decode() for end in ends)


def run_process(*arguments, cwd):
    command = [sys.executable, "-m", "gmwm", *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=120)


def write_csv(path, columns, digits=9):
    rows = np.column_stack(list(columns.values()))
    lines = [",".join(f"{value:.{digits}g}" for value in row) for row in rows]
    path.write_text("\n".join([",".join(columns), *lines, ""]))
    return path


def stripped(text):
    """Lines without the blanks at their ends."""
    return [line.rstrip() for line in text.strip().splitlines()]


def golden(name):
    return stripped((GOLDEN / name).read_text(encoding="utf-8"))


NUMBER = re.compile(r"[-+]?\d+(?:,\d{3})*(?:\.\d+)?(?:e[-+]\d+)?")


def assert_like(text, name):
    """Equal to a golden text, but for the last digits of its numbers and the blanks they take."""
    lines = stripped(text), golden(name)
    shapes = [
        [" ".join(re.sub("─+", "─", NUMBER.sub("#", line)).split()) for line in part]
        for part in lines
    ]
    assert shapes[0] == shapes[1]
    numbers = [NUMBER.findall("\n".join(part).replace(",", "")) for part in lines]
    np.testing.assert_allclose(*(np.array(part, dtype=float) for part in numbers), rtol=1e-3)


# -- help -----------------------------------------------------------------------------------------


def test_help_lists_the_commands():
    shown = CliRunner().invoke(cli.cli, ["--help"])
    assert shown.exit_code == 0
    assert {"calibrate", "demo"} <= cli.cli.commands.keys()
    for name in cli.cli.commands:
        assert re.search(rf"^  {name}  +\S", shown.output, re.MULTILINE), name


@pytest.mark.parametrize("command", sorted(cli.cli.commands))
def test_help_of_each_command_has_units_and_an_example(command):
    shown = CliRunner().invoke(cli.cli, [command, "--help"])
    assert shown.output == CliRunner().invoke(cli.cli, [command, "-h"]).output
    assert shown.exit_code == 0
    assert re.search(rf"Examples?:\n +gmwm {command} ", shown.output)
    assert re.search(r"\b(Hz|hours|seconds|rad/s|m/s\^2)\b", shown.output)
    assert max(map(len, shown.output.splitlines())) <= WIDTH


def test_temperatures_of_a_file_stay_in_step_with_a_part(run, tmp_path, no_pages):
    time = np.arange(4000.0)
    warm = 10.0 * np.sin(2.0 * np.pi * time / 1500.0)
    noise = np.random.default_rng(5).normal(size=time.size)
    write_csv(tmp_path / "n.csv", {"time [s]": time, "gyro_x [rad/s]": noise + 0.5 * warm})
    write_csv(tmp_path / "oven.csv", {"time [s]": time, "temperature [degC]": 25.0 + warm})
    given = ["n.csv", "--temperature-file", "oven.csv", "--degree", "1", "--start", "400"]
    assert run("calibrate", *given, "--model", "N", "-q", "-o", "out")[0] == 0
    (curve,) = gmwm.load(tmp_path / "out" / "calibration.json").curves.values()
    low, high = curve(np.array([20.0, 30.0]))
    assert high - low == pytest.approx(5.0, rel=0.05)


def test_example_of_calibrate_works(run, tmp_path, no_pages):
    # The very line that the help shows, on a file of that name.
    rng = np.random.default_rng(0)
    names = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "x"]
    for name in ("static", "a", "b"):
        columns = {name: rng.normal(size=500) for name in names}
        write_csv(tmp_path / f"{name}.csv", columns)
    units = {"gyro_x": "gyro_x [rad/s]", "accel_x": "accel_x [m/s^2]"}
    columns = {"time [s]": 0.01 * np.arange(500), **{units[n]: columns[n] for n in names}}
    columns["temp [degC]"] = np.linspace(20.0, 30.0, 500)
    write_csv(tmp_path / "chamber.csv", columns)
    shown = CliRunner().invoke(cli.cli, ["calibrate", "--help"]).output
    lines = re.findall(r"^ +gmwm (calibrate .*)$", shown, re.MULTILINE)
    assert len(lines) == 4
    for line in (line for line in lines if ".csv" in line):
        code, printed, told = run(*line.split())
        assert code == 0, told
        assert ("2 recordings" in printed) == ("b.csv" in line)
        assert "calibration.json" in printed


def test_help_answers_at_once():
    # Nothing heavy is loaded before there is something to compute.
    heavy = ["numpy", "scipy", "numba", "matplotlib", "plotly", "pyarrow", "joblib", "rich"]
    script = f"import sys, gmwm.cli; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stdout + done.stderr


# -- calibrate ------------------------------------------------------------------------------------


GYRO = WhiteNoise(4e-4) + RandomWalk(3e-4)
ACCEL = WhiteNoise(1e-3)


@pytest.fixture(scope="module")
def good_file(tmp_path_factory):
    """20,000 samples: a gyro that walks, an accelerometer of white noise, a dead axis, others."""
    rng = np.random.default_rng(2)
    n, dt = 20_000, 0.01
    columns = {
        "gyro_x": np.degrees(GYRO.simulate(n, dt, rng)),
        "gyro_y": np.zeros(n),
        "accel_z": ACCEL.simulate(n, dt, rng) / 9.80665 + 1.0,
        "temp": np.full(n, 25.0),
    }
    return write_csv(tmp_path_factory.mktemp("data") / "static.csv", columns)


FIELD = ("--gyro-unit", "deg/s", "--accel-unit", "g")


@pytest.fixture(scope="module")
def calibrated(good_file, tmp_path_factory):
    """What was printed and told, and the folder, which stays as it is."""
    folder = tmp_path_factory.mktemp("calibrated")
    code, printed, told = invoked(folder, "calibrate", good_file, *RATE, *FIELD, "-o", "out")
    assert code == 0, told
    return printed, told, folder / "out"


def test_calibrate(calibrated):
    printed, _, folder = calibrated
    # One page, no wider than a terminal, and where everything went.
    assert_like(printed, "cli_calibrate.txt")
    assert len(printed.splitlines()) <= 30
    assert max(map(len, printed.splitlines())) <= WIDTH
    assert "\x1b" not in printed
    # The files.
    files = ["calibration.json", "imu.yaml", "report.html"]
    assert sorted(path.name for path in folder.iterdir()) == files
    for name in files:
        assert name in printed.partition("wrote ")[2].partition(" in out\n")[0]
    calibration = gmwm.load(folder / "calibration.json")
    assert list(calibration) == ["gyro_x", "accel_z"]
    assert [str(why) for why in calibration.skipped.values()] == ["gyro_y: constant at 0 rad/s"]
    assert calibration.source == "static.csv"
    for name, truth in (("gyro_x", GYRO), ("accel_z", ACCEL)):
        for key, value in as_model(truth).params.items():
            low, high = calibration[name].interval(0.999)[key]
            assert low < value < high, (name, key)
    html = (folder / "report.html").read_text(encoding="utf-8")
    assert html.startswith("<!DOCTYPE html>")
    assert html.rstrip().endswith("</html>")
    assert "static.csv" in html
    content = yaml.safe_load((folder / "imu.yaml").read_text())
    assert content["update_rate"] == 100
    assert content["gyroscope_noise_density"] == pytest.approx(calibration["gyro_x"].params["N"])


def test_nothing_but_results_where_there_is_no_terminal(calibrated):
    assert calibrated[1] == ""


# -- bad input ------------------------------------------------------------------------------------


ROWS = 200


def good_lines():
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(ROWS, 2))
    return ["gyro_x,accel_x", *(f"{a:.6f},{b:.6f}" for a, b in rows)]


def with_line(number, text):
    lines = good_lines()
    lines[number - 1] = text
    return lines


def with_time(gap, slower=1.0):
    t = np.arange(ROWS) * 0.01
    t[120:] += gap + (slower - 1.0) * (t[120:] - t[120])
    lines = good_lines()
    return [f"time_s,{lines[0]}", *(f"{a:.4f},{b}" for a, b in zip(t, lines[1:], strict=True))]


ALL = (*RATE, *SI)

MICROSECONDS = [
    f"{a},{b}" for a, b in zip(["t", *range(0, ROWS * 20_000, 20_000)], good_lines(), strict=True)
]
# what: (lines of the file or None, arguments, words that the sentence must have)
BAD = {
    "missing file": (None, ALL, ("f.csv", "does not exist", "check the path")),
    "empty file": ([], ALL, ("f.csv is empty", "give a file with samples")),
    "header alone": (good_lines()[:1], ALL, ("f.csv", "no data", "add samples")),
    "text in a number column": (with_line(50, "0.1,broken"), ALL,
        ("f.csv, line 50, column 'accel_x'", "'broken' is not a number", "correct the line")),
    "infinity": (with_line(60, "inf,0.1"), ALL, ("f.csv, line 60, column 'gyro_x'", "'inf'")),
    "mostly missing": ([*good_lines()[:90], *[","] * ROWS], ALL,
        ("gyro_x: 200 of 289 samples missing, more than half", "check the sensor")),
    "ragged row": (with_line(70, "1,2,3"), ALL, ("f.csv, line 70", "3 fields where 2 were")),
    "too few samples": (good_lines()[:64], ALL, ("63 samples", "at least 64", "record longer")),
    "rate against the time stamps": (with_time(0.0), ("--rate", "200", *SI),
        ("stamps give 100 Hz, not the given 200 Hz", "leave out the rate")),
    "time without a unit, nor have the channels": (MICROSECONDS, (),
        ("50 Hz if they are microseconds", "name the column 't [us]'",
         "e.g. --gyro-unit deg/s --accel-unit g --rate 50, or")),
    "a rate that time without a unit cannot have": (MICROSECONDS, ALL,
        ("50 Hz if they are microseconds, not the given 100 Hz", "e.g. --rate 50")),
    "a clock that stops": (with_time(0.0, 0.0), SI,
        ("f.csv, column 'time_s', line 123", "repeats the one before", "(rows come at 100 Hz")),
    "a clock that runs backwards": (with_time(0.0, -1.0), SI,
        ("column 'time_s', line 123", "goes back", "and 78 more", "--rate HZ --time none")),
    "all channels constant": (["gyro_x,accel_x", *["0.5,9.8"] * ROWS], ALL,
        ("f.csv: every channel is constant", "check the sensor and the columns")),
}  # fmt: skip
BAD |= {
    " ".join(arguments): (good_lines(), arguments, words)
    for arguments, words in (
        ((*RATE, "--gyro-unit", "furlong", *SI[2:]), ("unknown unit 'furlong'", "like deg/s")),
        ((*RATE, "--gyro-unit", "g", *SI[2:]), ("gyro_x", "'g'", "rad/s")),
        ((*RATE, *SI[:2]), ("unit of accel_x", "--accel-unit g")),
        (SI, ("no rate was given", "--rate 100")),
        (("--rate", "0", *SI), ("rate = 0", "positive", "in Hz")),
        ((*ALL, "--channel", "gyro_x"), ("--channel gyro_x: write NAME=COLUMN",)),
        ((*ALL, "--channel", "=gyro_x"), ("--channel =gyro_x: write NAME=COLUMN",)),
        ((*ALL, "--channel", "gyro_x="), ("--channel gyro_x=: write NAME=COLUMN",)),
        ((*ALL, "--channel", "gyro_x=wx"), ("no column 'wx' for gyro_x", "'gyro_x', 'accel_x'")),
        ((*ALL, "--channel", "gyro_x=7"), ("no column 7 for gyro_x", "from 0 to 1")),
        ((*ALL, "--channel", "gyro_x=0", "--channel", "gyro_x=1"), ("--channel", "gyro_x")),
        ((*ALL, "--time", "clock"), ("'clock'", "for time")),
    )
}


def assert_refused(code, printed, told, words=()):
    assert code == 2
    assert printed == ""
    assert told.startswith("gmwm: ")
    assert told.endswith("\n")
    assert told.count("\n") == 1
    assert ": " in told.removeprefix("gmwm: "), "no hint is given"
    for word in words:
        assert word in told


@pytest.mark.parametrize("what", BAD)
def test_bad_input_is_one_sentence_and_exit_code_2(run, tmp_path, what):
    lines, arguments, words = BAD[what]
    if lines is not None:
        (tmp_path / "f.csv").write_text("\n".join([*lines, ""]) if lines else "")
    assert_refused(*run("calibrate", "f.csv", *arguments, "-o", "out"), words)
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").iterdir())


@pytest.mark.parametrize("what", ["infinity", "all channels constant"])
def test_bad_input_leaves_earlier_results_alone(run, tmp_path, what):
    (tmp_path / "f.csv").write_text("\n".join(BAD[what][0]))
    (tmp_path / "calibration.json").write_text("old")
    code, _, _ = run("calibrate", "f.csv", *ALL, "-o", ".")
    assert code == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["calibration.json", "f.csv"]
    assert (tmp_path / "calibration.json").read_text() == "old"


@pytest.mark.parametrize(
    ("arguments", "culprit"),
    [
        (("calibrate",), "FILE"),
        (("calibrate", "f.csv", "--rate", "fast"), "--rate"),
        (("calibrate", "f.csv", "--jobs", "0"), "--jobs"),
        (("demo", "--hours", "0"), "--hours"),
        (("demo", "--seed", "x"), "--seed"),
        (("demo", "--nonsense"), "--nonsense"),
        (("nonsense",), "nonsense"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_wrong_usage_is_told_with_exit_code_2(run, tmp_path, arguments, culprit):
    code, printed, told = run(*arguments)
    assert code == 2
    assert printed == ""
    assert culprit in told
    assert "Traceback" not in told
    assert list(tmp_path.iterdir()) == []


def test_interruption_is_told_and_leaves_nothing(run, tmp_path, monkeypatch):
    def interrupted(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr("gmwm.calibration.calibrate", interrupted)
    (tmp_path / "f.csv").write_text("\n".join(good_lines()))
    code, printed, told = run("calibrate", "f.csv", *ALL, "-o", "out")
    assert code == 130
    assert printed == ""
    assert told.strip() == "gmwm: interrupted, no file is half-written"
    assert not (tmp_path / "out").exists()


def test_exit_code_of_the_process(tmp_path):
    done = run_process("calibrate", "nowhere.csv", "--jobs", "0", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "--jobs" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.skipif(os.name != "posix", reason="pipes are those of POSIX")
def test_who_stops_reading_does_not_lose_the_results(tmp_path):
    # As in "gmwm calibrate ... | head -1".
    (tmp_path / "f.csv").write_text("\n".join(good_lines()))
    command = [sys.executable, "-m", "gmwm", "calibrate", "f.csv", *ALL, "--model", "N"]
    command += ["--channels", "gyro_x", "-o", "out"]
    read_end, write_end = os.pipe()
    os.close(read_end)
    try:
        done = subprocess.run(
            command, cwd=tmp_path, stdout=write_end, stderr=subprocess.PIPE, text=True, timeout=120
        )
    finally:
        os.close(write_end)
    assert "Traceback" not in done.stderr
    files = ["calibration.json", "report.html"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == files


# -- what is calibrated, how it is printed, how it ends -------------------------------------------


def test_what_is_missing_is_asked_for_at_once(run, tmp_path, no_pages):
    rng = np.random.default_rng(1)
    write_csv(tmp_path / "f.csv", {"gyro_x": rng.normal(size=99), "accel_z": np.ones(99)})
    code, printed, told = run("calibrate", "f.csv")
    assert_refused(code, printed, told)
    assert told == (
        "gmwm: f.csv has no time column and no rate was given, and it does not give the unit of "
        "gyro_x and accel_z: give e.g. --rate 100 --gyro-unit deg/s --accel-unit g\n"
    )
    *_, told = run("calibrate", "f.csv", "--accel-unit", "g")
    assert told.endswith(" unit of gyro_x: give e.g. --rate 100 --gyro-unit deg/s\n")
    *_, told = run("calibrate", "f.csv", "--channels", "accel", *RATE)
    assert told == "gmwm: f.csv does not give the unit of accel_z: give e.g. --accel-unit g\n"
    # The line that it asks for is enough.
    command = re.search(r"give e.g. (.*)$", run("calibrate", "f.csv")[2])[1]
    assert run("calibrate", "f.csv", *command.split())[0] == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--channels", "gyro_z"), "has no channel 'gyro_z': it has gyro_x, gyro_y, accel_z"),
        (("--channels", ","), "--channels names no channel"),
        (("--channels", "gyro_z", "--channel", "gyro_x=0"), "add --channel gyro_z=COLUMN"),
        (("--start", "199.9"), "fewer than 64 samples from 199.9 to 200 s"),
        (("--start", "60", "--stop", "50"), "fewer than 64 samples"),
        (("--start", "-1"), "fewer than 64 samples"),
        (("--stop", "nan"), "fewer than 64 samples"),
        (("--start", "inf"), "fewer than 64 samples"),
        (("--model", "N + X"), "'X' is not a term: write B, K, N, Q, R, AR, GM"),
        (("--model", "N - K"), "'N - K' is not a term"),
        (("--model", ""), "is not a term"),
        (("--model", "N + N"), "two WhiteNoise"),
        (("--model", "0 N"), "is not a term"),
        (("--model", "gyro=N"), "no model is given for channel 'accel_z': give e.g. --model"),
        (("--model", "mag=N"), "choose a channel from gyro_x, gyro_y, accel_z"),
        (("--model", "N", "--model", "K"), "give one"),
    ],
    ids=str,
)
def test_choices_that_cannot_be(run, good_file, tmp_path, arguments, words):
    assert_refused(*run("calibrate", good_file, *RATE, *FIELD, *arguments), (words,))
    assert list(tmp_path.iterdir()) == []


def test_json_and_quiet(run, good_file, tmp_path, no_pages):
    options = (*RATE, *FIELD, "--model", "N", "--channels", "accel_z")
    code, printed, told = run("calibrate", good_file, *options, "--json")
    assert (code, told) == (0, "")
    assert json.loads(printed) == json.loads(Path("gmwm-out/calibration.json").read_text())
    assert run("calibrate", good_file, *options, "--quiet") == (0, "", "")
    assert run("health", good_file, *options[:-4], "-q", "-o", "h.json") == (0, "", "")
    assert json.loads((tmp_path / "h.json").read_text())["schema"] == "gmwm.health"


@pytest.fixture(scope="module")
def turned_file(tmp_path_factory):
    """Two minutes of six axes, of which the second quarter turns about the vertical."""
    rng = np.random.default_rng(4)
    columns = {name: 0.2 * rng.normal(size=12_000) for name in ("gyro_x", "gyro_y", "gyro_z")}
    columns["gyro_z"][3000:6000] += 60.0
    columns |= {name: 2e-3 * rng.normal(size=12_000) for name in ("accel_x", "accel_y", "accel_z")}
    columns["accel_z"] += 1.0
    return write_csv(tmp_path_factory.mktemp("data") / "turned.csv", columns)


def test_stretches_at_rest_of_a_log_that_moves(run, turned_file, no_pages):
    code, printed, told = run("calibrate", turned_file, *RATE, *FIELD, "--model", "N", "-v")
    assert (code, told) == (0, "")
    shown = " ".join(printed.split())
    assert "at rest from 0 to 29.75, 60.5 to 120 s |###" in shown
    assert "limits the averaging time" in shown
    assert "turned.csv: 89.2 s at 100 Hz in 2 parts at rest." in shown
    rows = np.loadtxt(turned_file, delimiter=",", skiprows=1)
    rows += 30.0 * np.sin(np.arange(len(rows)) / 70.0)[:, None] * [1, 1, 1, 0, 0, 0]
    names = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
    write_csv(Path("moving.csv"), dict(zip(names, rows.T, strict=True)))
    code, _, told = run("calibrate", "moving.csv", *RATE, *FIELD, "--model", "N")
    assert code == 2
    assert told.startswith("gmwm: moving.csv is not static, and its longest stretch at rest has ")
    assert told.endswith("where 10 s are needed: give e.g. --all to treat everything as static\n")


def test_exit_status_where_no_axis_is_valid(run, turned_file, no_pages):
    chosen = ("--model", "N", "--all", "--channels", "gyro_z")
    code, printed, told = run("calibrate", turned_file, *RATE, *FIELD, *chosen)
    assert code == 1
    assert told == "gmwm: no channel has a valid model, see the report\n"
    shown = " ".join(printed.split())
    assert "not static: it turns at up to 60" in shown
    assert "No axis is usable." in shown
    assert shown.count("not static") == 1
    assert max(map(len, printed.splitlines())) <= WIDTH
    assert Path("gmwm-out/calibration.json").exists()
    # The options that it names mend it.
    options = re.search(r"rerun with (--\S+ \S+)", shown)[1]
    code, printed, told = run(
        "calibrate", turned_file, *RATE, *FIELD, "--model", "N", *options.split()
    )
    assert (code, told) == (0, "")
    assert "not static" not in printed
    shown = CliRunner().invoke(cli.cli, ["calibrate", "--help"]).output
    assert "1 if none has" in shown


HOUR = np.arange(0.0, 3600.0, 0.2)
"""s, of recordings with a departure."""

DEPARTURES = {
    "step": 0.02 * (HOUR > 2500.0),
    "early step": 0.02 * (HOUR > 700.0),
    "two steps": 0.02 * (HOUR > 700.0) - 0.03 * (HOUR > 1000.0),
    "transient": 0.05 * np.exp(-HOUR / 150.0),
    "louder at the end": GaussMarkov(0.02, 20.0).simulate(HOUR.size, 0.2, seed=6)
    * np.where(HOUR > 2400.0, 4.0, 1.0),
}


@pytest.mark.parametrize("given", ["", slow("--start 100")])
@pytest.mark.parametrize("what", ["two steps", "louder at the end",
                                  *map(slow, ("early step", "step", "transient"))])  # fmt: skip
def test_every_command_that_is_advised_works(run, tmp_path, no_pages, what, given):
    """Each gives a valid fit, also where times count from the start of a part."""
    x = 0.05 * np.random.default_rng(3).normal(size=HOUR.size) + DEPARTURES[what]
    write_csv(tmp_path / "f.csv", {"gyro_x": x})
    arguments = ("calibrate", "f.csv", "--rate", "5", "--gyro-unit", "deg/s", *given.split())
    code, printed, _ = run(*arguments)
    assert code == 1
    to_do = " ".join(printed.split())
    (way,) = re.findall(r"rerun with (--.*?): keeps (?:the whole|about)", to_do)
    assert ("--remove-departures" in way) == (what != "louder at the end")
    code, printed, told = run(*arguments, *way.split())
    assert (code, told) == (0, ""), (way, printed)
    assert "rerun" not in printed
    # The next command that is printed is one.
    _, *command = shlex.split(re.search(r"^next: (.*)$", printed, re.MULTILINE)[1])
    assert run(*command)[0] == 0


# -- health ---------------------------------------------------------------------------------------


def shaken_csv(path):
    rng = np.random.default_rng(3)
    n = 6000
    gyro = 0.3 * rng.normal(size=n)
    gyro[4000:4003] += 17.0
    accel = 4e-3 * rng.normal(size=n) + 4e-3 * np.sin(2.0 * np.pi * 3.3 * np.arange(n) / 100.0)
    return write_csv(path, {"gyro_x": gyro, "accel_x": np.rint(accel / 0.00333) * 0.00333})


def test_health_says_what_is_wrong(run, tmp_path):
    shaken_csv(tmp_path / "static.csv")
    units = ("--gyro-unit", "deg/s", "--accel-unit", "g")
    code, printed, told = run("health", "static.csv", *RATE, *units, "-o", "health.json")
    assert (code, told) == (0, "")
    assert max(map(len, printed.splitlines())) <= WIDTH
    words = " ".join(printed.split())
    assert re.search(r"warning a spike or shock \+1\d(\.\d)? deg/s at (39|40)\.\d+ s", words)
    assert "a periodic line at 3.3 Hz, amplitude" in words
    assert "samples come in steps of 3.33 mg" in words
    content = json.loads((tmp_path / "health.json").read_text())
    assert content["schema"] == "gmwm.health"
    ((frequency, amplitude),) = content["channels"]["accel_x"]["lines"]
    assert frequency == pytest.approx(3.3, abs=0.005)
    assert amplitude == pytest.approx(4e-3 * 9.80665, rel=0.1)
    ((start, stop),) = content["channels"]["gyro_x"]["events"]
    assert start <= 4000 < 4003 <= stop
    assert words.endswith("wrote health.json")


# -- demo -----------------------------------------------------------------------------------------


def test_demo_files_can_be_read_and_are_named_in_what_to_try(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(cli.cli, ["demo", "--files", "--hours", "0.01", "-o", "try"])
    assert done.exit_code == 0, done.output
    folder = Path("try")
    assert sorted(path.name for path in folder.iterdir()) == ["fixes.csv", "imu.csv", "static.csv"]
    recording = gmwm.read(folder / "static.csv")
    assert (recording.rate, recording.n) == (25.0, 900)
    assert gmwm.read(folder / "imu.csv").n == 15_000
    tried = done.output.partition("Try:")[2].replace("\\\n", " ")
    for line in filter(None, map(str.strip, tried.splitlines())):
        command, *arguments = line.split()[1:]
        assert command in cli.cli.commands
        names = [each for each in arguments if each.endswith(".csv")]
        assert names and all(Path(each).is_file() for each in names)
        # Every option is one of the command.
        known = {name for each in cli.cli.commands[command].params for name in each.opts}
        assert {each for each in arguments if each.startswith("-")} <= known
    again = CliRunner().invoke(cli.cli, ["demo", "--files", "--hours", "0.01", "-o", "try/imu.csv"])
    assert again.exit_code != 0


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    with pytest.MonkeyPatch.context() as patch:  # as `no_pages`
        patch.setattr(gmwm.Calibration, "report", lambda self, path, *_, **__: path.touch())
        return invoked(folder, "demo", "--hours", "0.05", "-v", "-o", "out"), folder / "out"


def test_demo_runs(demo):
    (code, _, told), folder = demo
    assert code == 0, told
    assert "Traceback" not in told
    files = ["calibration.json", "imu.yaml", "report.html"]
    assert sorted(path.name for path in folder.iterdir()) == files
    axes = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
    assert list(gmwm.load(folder / "calibration.json")) == axes


def test_demo_finds_the_white_noise_of_every_axis(demo):
    # Three minutes tell it to a per cent.
    for sensor, truth in (("gyro", 0.2), ("accel", 80.0)):
        for axis in "xyz":
            row = re.search(rf"^{sensor}_{axis} +(\S+) \+-(\S+) ", demo[0][1], re.MULTILINE)
            value, error = map(float, row.groups())
            assert value == pytest.approx(truth, rel=0.1)
            assert abs(value - truth) < 2.0 * error


# -- tables of results made by hand ---------------------------------------------------------------


def test_json_of_the_command_line_is_strict(calibrated):
    def refuse(constant):
        raise AssertionError(f"{constant} is no JSON")

    text = (calibrated[2] / "calibration.json").read_text()
    json.loads(text, parse_constant=refuse)


# -- reproduce ------------------------------------------------------------------------------------


def test_reproduce_prints_the_table_and_keeps_the_runs(run, tmp_path):
    arguments = ("reproduce", "table2", "--runs", 3, "--jobs", 1, "--method", "GMWM", "-o", "s")
    code, printed, told = run(*arguments)
    assert code == 0, told
    lines = printed.splitlines()
    assert lines[0] == "Table II: white noise + random walk + rate ramp"
    assert lines[1] == "3 runs of 6,000 samples at 1 Hz, seed 0"
    assert max(map(len, lines)) <= WIDTH
    names = sorted(path.name for path in (tmp_path / "s").iterdir())
    assert names == ["table2-runs", "table2.parquet", "table2.txt"]
    assert (tmp_path / "s" / "table2.txt").read_text() in printed
    # The figure is drawn from the same runs, which are not touched without being asked.
    before = (tmp_path / "s" / "table2.parquet").read_bytes()
    code, _, told = run(*arguments)
    assert code == 2
    assert "resume it, or give another folder (on the command line: --resume" in told
    code, printed, told = run("reproduce", "fig2", *arguments[2:], "--resume")
    assert code == 0, told
    assert (tmp_path / "s" / "fig2.png").exists() and (tmp_path / "s" / "fig2.svg").exists()
    assert (tmp_path / "s" / "table2.parquet").read_bytes() == before
    assert "wrote s/fig2.png" in printed


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("table9",), "table9"),
        (("table2", "--runs", 1), "--runs"),
        (
            ("table2", "--method", "AV2", "--runs", 2),
            "it has EM, EM*, AV, AV IRLS, MLE, eq. (9), GMWM",
        ),
        (("table2", "--seed", -1), "--seed"),
        (("table2", "--cluster", "nonsense://x", "--runs", 2), "no Dask scheduler"),
    ],
)
def test_reproduce_refuses_in_one_sentence(run, arguments, words):
    if "--cluster" in arguments:
        pytest.importorskip("distributed")
    code, _, told = run("reproduce", *arguments, "-o", "s")
    assert code == 2
    assert words in told
    assert "Traceback" not in told


@pytest.mark.parametrize(
    "arguments",
    [
        ("reproduce", "table2", "--method", "AV2", "--runs", 2),
        ("reproduce", "table2", "--cluster", "nonsense://x", "--runs", 2),
        ("calibrate", "missing.csv", "--rate", 100),
    ],
    ids=lambda arguments: " ".join(map(str, arguments[:3])),
)
def test_a_failed_command_leaves_no_empty_folder(run, tmp_path, arguments):
    if "--cluster" in arguments:
        pytest.importorskip("distributed")
    code, _, _ = run(*arguments, "-o", "new/s")
    assert code == 2
    assert not (tmp_path / "new").exists()
    (tmp_path / "mine").mkdir()
    run(*arguments, "-o", "mine")
    assert list((tmp_path / "mine").iterdir()) == []
