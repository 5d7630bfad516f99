"""Names that come from files and command lines: text everywhere, obeyed nowhere."""

import io
import json
import os
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

import gmwm
from gmwm import cli
from gmwm.errors import InputError, printable
from gmwm.export import export
from marks import slow

X = np.random.default_rng(0).normal(size=(400, 6))


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Run ``gmwm ARGUMENTS`` in the folder of the test, with what a terminal gets as bytes."""
    monkeypatch.chdir(tmp_path)

    def _run(*arguments, encoding="utf-8", **variables):
        streams = {name: io.TextIOWrapper(io.BytesIO(), encoding) for name in ("stdout", "stderr")}
        with monkeypatch.context() as patch:
            patch.setattr(sys, "argv", ["gmwm", *arguments])
            for name, value in variables.items():
                patch.setenv(name, value)
            for name, stream in streams.items():
                patch.setattr(sys, name, stream)
            with pytest.raises(SystemExit) as stop:
                cli.main()
        for stream in streams.values():
            stream.flush()
        written = {name: stream.buffer.getvalue() for name, stream in streams.items()}
        return SimpleNamespace(returncode=stop.value.code, **written)

    return _run


def recording(path, names=("wx", "wy", "wz", "ax", "ay", "az"), extra="temp [/degC]"):
    header = ",".join([*names, extra])
    rows = [
        ",".join(f"{v:.6g}" for v in (*row, 20.0)) for row in X + np.array([0.0, 0, 0, 0, 0, 9.8])
    ]
    path.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    return path


OPTIONS = ("--rate", "100", "--gyro-unit", "rad/s", "--accel-unit", "m/s^2", "--leave", "all",
           "--model", "N")  # fmt: skip


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("gyro_x [deg/s] µ", "gyro_x [deg/s] µ"),
        ("a\nb\tc", "a b c"),
        ("\x1b[31m\x07", "\\x1b[31m\\x07"),
        ("\udcff", "\\udcff"),
        ("\u202eexe", "\\u202eexe"),
        ("\u2028", "\\u2028"),
    ],
)
def test_one_printable_line(text, line):
    assert printable(text) == line
    assert str(InputError(text)) == line


def test_a_message_is_not_longer_than_people_read():
    assert len(str(InputError("x" * 5000))) == 800


def test_markup_in_a_header_is_shown_as_it_is_and_escape_codes_reach_no_terminal(run, tmp_path):
    path = recording(tmp_path / "static.csv", extra="x [/degC][bold]:smile:\x1b[31mred")
    for command in (("health", *OPTIONS[:6]), ("calibrate", *OPTIONS, "-o", "out", "-v")):
        done = run(command[0], path.name, *command[1:])
        assert done.returncode == 0, done.stderr
        assert b"\x1b" not in done.stdout + done.stderr
    assert "x [/degC][bold]:smile:" in " ".join(done.stdout.decode().split())
    assert b"\x1b" not in (tmp_path / "out" / "report.html").read_bytes()


def test_names_inject_nothing_into_yaml(tmp_path):
    names = {"gyro_x\nupdate_rate: 1": X[:, 0], "accel_x": X[:, 3]}
    given = gmwm.Recording.from_arrays(
        names, 100.0, {"gyro": "rad/s", "accel": "m/s^2"}, source="a.csv\nrostopic: /evil"
    )
    calibration = gmwm.calibrate(given, gmwm.WhiteNoise() + gmwm.RandomWalk())
    path = tmp_path / "imu.yaml"
    export(calibration, "kalibr", path=path)
    content = yaml.safe_load(path.read_text())
    assert content["update_rate"] == 100
    assert content["rostopic"] == "/imu0"
    assert len(path.read_text().splitlines()) == len(path.read_bytes().split(b"\n")) - 1


def test_a_file_name_that_is_not_utf8(run, tmp_path, no_pages):
    name = os.fsdecode(b"stat\xff\x1b[31mic.csv")
    recording(tmp_path / name)
    done = run("calibrate", name, *OPTIONS, "-o", "out")
    assert done.returncode == 0, done.stderr
    assert b"stat\\udcff" in done.stdout
    assert b"\x1b" not in done.stdout
    assert gmwm.load(tmp_path / "out" / "calibration.json").source == "stat\\udcff\\x1b[31mic.csv"
    done = run("calibrate", os.fsdecode(b"no\xff.csv"), *OPTIONS)
    assert done.returncode == 2
    assert done.stderr.startswith(b"gmwm: no\\udcff.csv does not exist")


@pytest.mark.parametrize("encoding", ["ascii", slow("latin-1")])
def test_a_terminal_that_lacks_letters(run, tmp_path, encoding, no_pages):
    recording(tmp_path / "Größe²Ω.csv", extra="température Ω")
    done = run("calibrate", "Größe²Ω.csv", *OPTIONS, "-o", "out", encoding=encoding)
    assert done.returncode == 0, done.stderr
    assert "\\u03a9" in done.stdout.decode(encoding)


def test_a_pipe_is_refused(run, tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    done = run("calibrate", "pipe.csv", *OPTIONS)
    assert done.returncode == 2
    assert b"pipe.csv is a pipe or a device: write its content to a file first" in done.stderr
    for name in ("pipe.csv", "/dev/zero"):
        done = run("budget", name)
        assert done.returncode == 2
        assert b"is a pipe or a device" in done.stderr


@pytest.mark.parametrize(
    "text",
    ["!!float x", "!!bool 2", "!!timestamp x", "!!binary '='", "!!null 3", "!!map [1]", "!!omap 3",
     "!!set [a]", "1.0e+999", ".nan", "2001-13-45", "9" * 5000],
)  # fmt: skip
def test_values_of_a_study_that_are_none(run, tmp_path, text):
    (tmp_path / "study.yaml").write_text(
        f"trajectory: car\nduration: {text}\ntruth: x\nfilters: {{}}\n"
    )
    done = run("navigate", "study.yaml")
    assert done.returncode == 2, done.stdout
    assert done.stderr.startswith(b"gmwm: study.yaml: ")
    assert done.stderr.count(b"\n") == 1
    assert len(done.stderr) < 400


def test_a_document_of_aliases_is_not_written_out(run, tmp_path):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    (tmp_path / "study.yaml").write_text("\n".join([*lines, "trajectory: *a11", ""]))
    done = run("navigate", "study.yaml")
    assert done.returncode == 2
    assert len(done.stderr) < 400


def test_json_keeps_text(tmp_path):
    """What is escaped is what would be obeyed, and nothing else."""
    given = gmwm.Recording.from_arrays({"gyro_ä²": X[:, 0]}, 100.0, {"gyro": "rad/s"}, source="<b>")
    path = gmwm.calibrate(given, gmwm.WhiteNoise()).save(tmp_path / "a.json")
    assert json.loads(path.read_text())["source"] == "<b>"
    assert list(gmwm.load(path)) == ["gyro_ä²"]
