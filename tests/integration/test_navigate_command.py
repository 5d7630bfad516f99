"""``gmwm navigate``: what it prints and writes, and how it refuses what it cannot use."""

import re
import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from gmwm import Calibration, Channel, WhiteNoise, fit, wavelet_variance
from gmwm.cli.main import cli
from gmwm.ins.sensors import AXES

MODELS = {"gyro": {"N": "140 deg/h/sqrt(Hz)"}, "accel": {"N": "140 ug/sqrt(Hz)"}}
STUDY = {
    "trajectory": "car",
    "duration": 30,
    "rate": 20,
    "truth": MODELS,
    "filters": {"truth": "truth", "<b>big": {"gyro": {"N": 0.01}, "accel": {"N": 0.1}}},
    "outages": [[18, 6]],
    "runs": 2,
}


@pytest.fixture
def run(run):
    return partial(run, "navigate")


def written(path="study.yaml", **changes):
    """A study file, with some keys changed; those of ``None`` are left out."""
    content = {name: each for name, each in (STUDY | changes).items() if each is not None}
    Path(path).write_text(yaml.safe_dump(content, sort_keys=False))
    return path


def without_time(printed):
    return printed.split("\n\nwrote ")[0]


def calibration(path, axes=AXES):
    """A calibration.json of white noise."""
    fits = {}
    for i, axis in enumerate(axes):
        values = 1e-3 * np.random.default_rng(i).standard_normal(2000)
        quantity = axis.partition("_")[0]
        unit = {"gyro": "rad/s", "accel": "m/s^2"}[quantity]
        wv = wavelet_variance(Channel(axis, values, 0.01, quantity, unit))
        fits[axis] = fit(WhiteNoise(), wv)
    Calibration(fits, {}, "test", 100.0, 2000).save(path)
    return path


@pytest.fixture(scope="module")
def studied(tmp_path_factory):
    """What the standard study printed, and its folder, which stays as it is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("studied"))
        done = CliRunner().invoke(cli, ["navigate", written(), "-o", "a", "--jobs", "1"])
        assert (done.exit_code, done.stderr) == (0, "")
        yield done.stdout, Path("a").resolve()


def test_a_study_prints_tables_and_writes_a_report(studied):
    printed, folder = studied
    table = (folder / "validation.txt").read_text()
    assert printed.startswith(table)
    assert table.startswith("car: 30 s at 20 Hz, 2 runs, seed 0\n")
    for block in ("Errors after 6 s without GNSS, at 24 s", "NEES per", "Innovations", "against"):
        assert block in table
    assert max(map(len, table.splitlines())) <= 80
    page = (folder / "validation.html").read_text()
    assert "<b>big" not in page
    assert "&lt;b&gt;big" in page


def test_resume_takes_finished_runs_and_refuses_those_of_another_study(run, studied, no_pages):
    first, folder = studied
    written()
    shutil.copytree(folder, "a")
    stamps = {path: path.stat().st_mtime_ns for path in Path("a/runs").iterdir()}
    code, again, _ = run("study.yaml", "-o", "a", "--jobs", 1, "--resume")
    assert code == 0
    assert without_time(again) == without_time(first)
    assert {path: path.stat().st_mtime_ns for path in Path("a/runs").iterdir()} == stamps
    code, _, told = run("study.yaml", "-o", "a", "--jobs", 1, "--resume", "--seed", 5)
    assert code == 2
    assert "another study" in told
    # The table of the first study is left as it was.
    assert Path("a/validation.txt").read_text() == without_time(first) + "\n"


def test_paths_in_the_file_are_relative_to_it_and_those_of_options_to_here(run, no_pages):
    folder = Path("deep/er")
    folder.mkdir(parents=True)
    calibration(folder / "cal.json")
    calibration(Path("here.json"))
    written(folder / "study.yaml", filters={"mine": "cal.json"}, outages=None, runs=1)
    assert run(folder / "study.yaml", "--jobs", 1)[0] == 0
    arguments = ("--jobs", 1, "--filter", "mine=here.json", "--truth", "here.json")
    assert run(folder / "study.yaml", *arguments)[0] == 0
    code, _, told = run(folder / "study.yaml", "--jobs", 1, "--filter", "mine=cal.json")
    assert code == 2
    assert "cal.json: cannot be read" in told


def test_a_study_from_options_alone(run, no_pages):
    calibration(Path("cal.json"))
    code, printed, _ = run("--trajectory", "car", "--duration", 15, "--truth", "cal.json",
                           "--filter", "A=truth", "--runs", 1, "--jobs", 1)  # fmt: skip
    assert code == 0
    assert printed.startswith("car: 15 s at 100 Hz, 1 run, seed 0\n")


BAD = {
    "nothing": ({"trajectory": None, "truth": None, "filters": None}, "no trajectory, no truth"),
    "unknown key": ({"filter": {}}, "'filter' is unknown: there are trajectory"),
    "filters: number": ({"filters": 5}, "filters: 5: write NAME"),
    "filters: list": ({"filters": ["truth"]}, "write NAME: calibration.json"),
    "filter: number": ({"filters": {"a": 5}}, "filters, a: 5: write a calibration.json, models"),
    "filter: missing file": ({"filters": {"a": "no.json"}}, "no.json: cannot be read"),
    "filter: folder": ({"filters": {"a": "."}}, "cannot be read"),
    "filter: no JSON": ({"filters": {"a": "study.yaml"}}, "is not JSON"),
    "filter: blank name": ({"filters": {" ": "truth"}}, "cannot be a name"),
    "filter: control": ({"filters": {"a\tb": "truth"}}, "cannot be a name"),
    "filter: endless name": ({"filters": {"a" * 41: "truth"}}, "cannot be a name"),
    "filter: unknown key": ({"filters": {"a": {"reduce": "N+K"}}}, "'reduce' is unknown"),
    "filter: flicker": (
        {"filters": {"a": {"gyro": {"B": "1 deg/h"}, "accel": {"N": 1}}}},
        "filters, a, gyro_x: BiasInstability.*approximate it by Gauss-Markov",
    ),
    "truth: list": ({"truth": [1]}, "truth: [1]: write a calibration.json"),
    "truth: lacks axis": ({"truth": {"gyro": {"N": 1}}}, "accel_x has none"),
    "truth: empty sensor": ({"truth": MODELS | {"gyro": {"bias": 1}}}, "there is no noise"),
    "truth: sensor": ({"truth": MODELS | {"mag": {"N": 1}}}, "truth: 'mag' is unknown: there are"),
    "truth: letter": ({"truth": MODELS | {"gyro": {"Z": 1}}}, "truth, gyro: 'Z' is unknown"),
    "truth: unit": ({"truth": MODELS | {"gyro": {"N": "1 deg/h"}}}, "cannot be converted"),
    "truth: negative": ({"truth": MODELS | {"gyro": {"N": -1}}}, "truth, gyro, N"),
    "truth: NaN": ({"truth": MODELS | {"gyro": {"N": float("nan")}}}, "is not a number"),
    "truth: huge": ({"truth": MODELS | {"gyro": {"N": "1e999"}}}, "is outside the plausible range"),
    "truth: yes": ({"truth": MODELS | {"gyro": {"N": True}}}, "is not a number"),
    "truth: flat GM": ({"truth": MODELS | {"gyro": {"GM": [1, 2]}}}, "write [[sigma, tau], ...]"),
    "truth: tau unit": ({"truth": MODELS | {"gyro": {"GM": [[1, "3 m"]]}}}, "converted to s"),
    "recordings: number": ({"truth": {"recordings": 5}}, "write [file, ...]"),
    "recordings: none": ({"truth": {"recordings": []}}, "no recordings given"),
    "recordings: missing": ({"truth": {"recordings": "x.csv"}}, "x.csv does not exist"),
    "recordings: key": ({"truth": {"recordings": "x.csv", "unit": 1}}, "'unit' is unknown"),
    "recordings: units": ({"truth": {"recordings": "x.csv", "units": 5}}, "write {gyro: deg/s"),
    "recordings: unit": ({"truth": {"recordings": "x", "units": {"gyro": 1}}}, "write {gyro: "),
    "recordings: channels": ({"truth": {"recordings": "x", "channels": 1}}, "write {gyro_x"),
    "recordings: channel": ({"truth": {"recordings": "x", "channels": {"gyro_x": 1.5}}}, "column"),
    "recordings: time": ({"truth": {"recordings": "x", "time": 1.5}}, "write a column, or none"),
    "recordings: rate": ({"truth": {"recordings": "x", "rate": "fast"}}, "is not a number"),
    "trajectory: number": ({"trajectory": 5}, "trajectory: 5: write helicopter"),
    "trajectory: missing": ({"trajectory": "no.csv"}, "'no.csv' is not a file, and none of"),
    "trajectory: folder": ({"trajectory": ".", "rate": None}, "is a directory"),
    "trajectory: rate": ({"trajectory": "study.yaml"}, "leave it out"),
    "trajectory: YAML": ({"trajectory": "study.yaml", "rate": None}, "study.yaml"),
    "duration: text": ({"duration": "long"}, "study.yaml: duration: 'long' is not a number"),
    "duration: unit": ({"duration": "30 m"}, "converted to s"),
    "duration: zero": ({"duration": 0}, "duration: 0: input should be greater than 0"),
    "duration: endless": ({"duration": 1e12}, "steps"),
    "rate: zero": ({"rate": 0}, "rate: 0: input should be greater than 0"),
    "outages: number": ({"outages": 5}, "write [[start, length], ...]"),
    "outages: flat": ({"outages": [18, 6]}, "outages[0]: 18: write [start, length] in seconds"),
    "outages: beyond": ({"outages": [[18, 60]]}, "goes beyond the end"),
    "outages: negative": ({"outages": [[18, -1]]}, "give seconds above zero"),
    "outages: early": ({"outages": [[-1, 5]]}, "seconds since the first epoch"),
    "outages: overlap": ({"outages": [[10, 9], [18, 6]]}, "join or separate them"),
    "outages: same": ({"outages": [[18, 6], [18, 6]]}, "join or separate them"),
    "outages: unit": ({"outages": [["1 m", 6]]}, "converted to s"),
    "outages: between": ({"outages": [[18, 6.01]]}, "between two epochs"),
    "outages: no fix": ({"outages": [[18.1, 0.4]]}, "no fix falls between"),
    "gnss: number": ({"gnss": 5}, "gnss: 5: write KEY: VALUE"),
    "gnss: key": ({"gnss": {"sd": 1}}, "'sd' is unknown: there are interval"),
    "gnss: none": ({"gnss": {"position_sd": "none"}}, "there is no fix"),
    "gnss: seldom": ({"gnss": {"interval": 60}}, "there is no fix"),
    "gnss: odd interval": ({"gnss": {"interval": 0.07}}, "give a multiple"),
    "gnss: text": ({"gnss": {"position_sd": "fine"}}, "is not a number"),
    "gnss: negative": ({"gnss": {"velocity_sd": -1}}, "gnss, velocity_sd[0]: -1: input should"),
    "gnss: mapping": ({"gnss": {"position_sd": {"north": 1}}}, "is not a number"),
    "gnss: two": ({"gnss": {"lever_arm": [1, 2]}}, "write three values"),
    "gnss: unit": ({"gnss": {"lever_arm": ["1 s", 0, 0]}}, "converted to m"),
    "initial_sd: number": ({"initial_sd": 5}, "initial_sd: 5: write KEY: VALUE"),
    "initial_sd: key": ({"initial_sd": {"roll": 1}}, "'roll' is unknown"),
    "initial_sd: unit": ({"initial_sd": {"tilt": "1 m"}}, "converted to rad"),
    "initial_sd: zero": ({"initial_sd": {"tilt": 0}}, "tilt: 0: input should be greater than 0"),
    "runs: part": ({"runs": 1.5}, "runs: 1.5: input should be a valid integer"),
    "seed: negative": ({"seed": -1}, "seed: -1: input should be greater"),
}  # fmt: skip


def refused(outcome, message):
    """One sentence, exit code 2, nothing printed and nothing left behind."""
    code, printed, told = outcome
    assert (code, printed) == (2, "")
    assert told.startswith("gmwm: ")
    assert told.count("\n") == 1
    assert "Traceback" not in told
    pattern = message if ".*" in message else re.escape(message)
    assert re.search(pattern, told), told
    assert not Path("gmwm-navigate").exists()


@pytest.mark.parametrize("case", BAD)
def test_a_file_that_cannot_be_used_is_refused_in_one_sentence(run, case):
    changes, message = BAD[case]
    refused(run(written(**changes), "--jobs", 1), message)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty"),
        ("hello", "is not a mapping"),
        ("- 1\n- 2", "is not a mapping"),
        ("a: [1", "invalid YAML (line 1"),
        ("a:\n\t- 1", "line 2, column 1"),
        ("a: *b", "undefined alias"),
        ("a: !!python/object:os.system 1", "invalid YAML"),
        ("truth: x\ntrajectory: car\ntruth: y", "line 3: 'truth' appears twice"),
        ("filters:\n  A: x\n  B: y\n  A: z", "line 4: 'A' appears twice"),
        ("filters: {1: x, '1': y}", "'1' appears twice"),
        ("a\0: 1", "invalid YAML"),
        ("\xff\xfe", "invalid YAML"),
    ],
)  # fmt: skip
def test_what_is_no_study_file(run, text, message):
    Path("study.yaml").write_bytes(text.encode("latin-1"))
    refused(run("study.yaml"), message)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "needs a trajectory, a truth and filters: give STUDY.yaml, or --trajectory"),
        (("no.yaml",), "no.yaml: cannot be read (No such file or directory)"),
        ((".",), "cannot be read (Is a directory)"),
        (("study.yaml", "--filter", "A"), "--filter A: write NAME=FILE"),
        (("study.yaml", "--filter", "A="), "write NAME=FILE"),
        (("study.yaml", "--filter", "A=x", "--filter", "A=y"), "--filter A=... is given twice"),
        (("study.yaml", "--outage", "5"), "--outage 5: write START:LENGTH"),
        (("study.yaml", "--outage", "nan:5"), "gmwm: outages[0][0]: nan is not a number"),
        (("study.yaml", "--duration", "-5"), "duration: -5.0: input should be greater than 0"),
        (("study.yaml", "--truth", "no.json"), "no.json: cannot be read"),
        (("--trajectory", "car"), "no truth, no filters"),
    ],
)
def test_options_that_cannot_be_used(run, arguments, message):
    written()
    refused(run(*arguments), message)


def test_a_place_that_cannot_be_written_is_refused_before_any_run(run):
    written()
    Path("out/validation.html").mkdir(parents=True)
    code, _, told = run("study.yaml", "-o", "out", "--jobs", 1)
    assert (code, "in the way" in told) == (2, True)
    assert not Path("out/runs").exists()
    Path("taken").mkdir()
    Path("taken/runs").write_text("mine")
    code, _, told = run("study.yaml", "-o", "taken", "--jobs", 1)
    assert (code, "cannot be written" in told) == (2, True)
    assert Path("taken/runs").read_text() == "mine"
    code, _, told = run("study.yaml", "-o", "study.yaml", "--jobs", 1)
    assert (code, "cannot be written" in told) == (2, True)
