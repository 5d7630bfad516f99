"""``gmwm fleet``: what it prints and writes, how it ends, and how it refuses."""

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow.parquet as pq
import pytest

from gmwm import WhiteNoise
from marks import slow

READING = ("--rate", "1", "--gyro-unit", "rad/s", "--model", "N", "--leave", "all", "--jobs", "1")


@pytest.fixture
def lot(tmp_path):
    """Two units of white noise, and a file that cannot be read."""
    (tmp_path / "lot 7").mkdir()
    for i in range(2):
        values = WhiteNoise(1e-3).simulate(300, 1.0, seed=i)
        np.savez(tmp_path / "lot 7" / f"unit {i}.npz", gyro_x=values)
    (tmp_path / "lot 7" / "bad.npz").write_text("nothing")
    return "lot 7/*.npz"


def test_a_fleet_is_calibrated_and_gone_on_with(run, lot, tmp_path):
    code, printed, reported = run("fleet", lot, *READING, "-o", "out")
    assert code == 1  # a file failed
    assert "3 units: 2 calibrated" in printed
    assert "- bad: bad.npz is not an NPZ file" in printed
    assert reported.startswith("gmwm: 1 file cannot be used; the first: bad.npz")
    names = [path.name for path in sorted((tmp_path / "out").iterdir())]
    assert names == [
        ".lock",
        "calibrations",
        "fleet.csv",
        *(f"fleet.{each}" for each in ("html", "json", "parquet")),
    ]
    table = pq.read_table(tmp_path / "out" / "fleet.parquet")
    assert set(table["device"].to_pylist()) == {"bad", "unit 0", "unit 1"}

    code, _, reported = run("fleet", lot, *READING, "-o", "out")
    assert (code, reported.count("\n")) == (2, 1)
    assert "--resume, or -o FOLDER" in reported
    code, printed, _ = run("fleet", lot, *READING, "-o", "out", "--resume", "--json")
    assert code == 1
    assert json.loads(printed)["schema"] == "gmwm.fleet"
    code, printed, reported = run("fleet", lot, *READING, "-o", "out", "--start", 9, "--resume")
    assert (code, printed) == (2, "")
    assert "another fleet (other start)" in reported

    # A calibration of a fleet is one as any other.
    code, printed, _ = run("bound", tmp_path / "out" / "calibrations" / "unit 0.json")
    assert (code, "gyro_x" in printed) == (0, True)


@pytest.mark.parametrize(("n", "status", "word"), [("0.003", 0, "1 of 1"), ("0.0001", 1, "FAIL N")])
def test_limits_decide_the_status(run, lot, tmp_path, n, status, word):
    (tmp_path / "limits.yaml").write_text(f"gyro: {{N: {n} rad/s/sqrt(Hz)}}")
    chosen = ("lot 7/unit 0.npz", *READING, "-o", "out", "--limits", "limits.yaml")
    code, printed, _ = run("fleet", *chosen)
    assert (code, word in printed) == (status, True)


def test_where_no_model_is_valid_it_says_so(run, tmp_path):
    t = np.arange(300.0)
    np.savez(tmp_path / "bent.npz", gyro_x=1e-3 * np.sin(t / 9.0) + 1e-5 * (t % 7))
    code, _, reported = run("fleet", "bent.npz", *READING, "-o", "out", "-q")
    assert code == 1
    assert "no unit has a valid model" in reported
    assert (tmp_path / "out" / "fleet.html").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("lot 7/bad.npz", *READING), "bad.npz is not an NPZ file"),
        (("none-*.csv", *READING), "no file matches 'none-*.csv': check the pattern"),
        (("lot 7/unit*", "--jobs", "1"), "(on the command line: --rate 100 --gyro-unit deg/s)"),
        (("lot 7/*", *READING, "--cluster", "nonsense://x"), "no Dask scheduler answers"),
        (("lot 7/*", *READING[:-4], "--leave", "all", "--model", "X"), "--model X"),
        (("lot 7/*", *READING, "--limits", "lot 7/bad.npz"), "holds no sensors"),
        ((), "Missing argument"),
    ],
)
def test_it_refuses_in_one_sentence_and_writes_nothing(run, lot, tmp_path, arguments, words):
    code, printed, reported = run("fleet", *arguments, *(("-o", "out") if arguments else ()))
    assert (code, printed, reported.count("\n")) == (2, "", 1)
    assert words in reported
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="this system has no such signals")
@pytest.mark.parametrize("name", [slow("SIGTERM"), "SIGHUP"])
def test_what_ends_a_fleet_leaves_nothing_and_is_said_in_the_status(tmp_path, name):
    number = getattr(signal, name)
    before = signal.signal(number, signal.SIG_DFL)  # nohup has it ignored, by what it starts too
    for i in range(4):
        values = WhiteNoise(1e-3).simulate(400_000, 1.0, seed=i)
        np.savez(tmp_path / f"unit{i}.npz", gyro_x=values, gyro_y=values[::-1])
    command = [sys.executable, "-m", "gmwm", "fleet", "*.npz", *READING[:4], "--jobs", "2"]
    with subprocess.Popen([*command, "-o", "out"], cwd=tmp_path, stderr=subprocess.PIPE) as process:
        signal.signal(number, before)
        end = time.monotonic() + 60.0
        while not (tmp_path / "out" / "calibrations").exists():
            assert time.monotonic() < end
            assert process.poll() is None
            time.sleep(0.02)
        time.sleep(0.5)
        process.send_signal(number)
        time.sleep(0.1)
        process.send_signal(number)  # as a terminal and its shell do where a window is closed
        _, reported = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert b"interrupted, no file is half-written" in reported
    assert b"Traceback" not in reported
    assert b"resource_tracker" not in reported
