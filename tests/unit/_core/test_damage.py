"""Files that others damaged, and what a machine refuses: one sentence, no signal, no traceback."""

import itertools
import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress

import numpy as np
import pytest

import gmwm
from gmwm import InputError
from gmwm._core import jobs
from gmwm._core.documents import read_yaml
from gmwm._core.files import moved_into_place, moved_together
from gmwm.datasheet import read_datasheet
from gmwm.export import read_numbers

SI = {"gyro": "rad/s", "accel": "m/s^2"}


def program(text, *args):
    done = subprocess.run(
        [sys.executable, "-c", text, *map(str, args)], capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout, done.stderr


# -- checkpoints -----------------------------------------------------------------------------------


def edited(path, name, place, value):
    with np.load(path) as stored:
        arrays = dict(stored)
    arrays[name][place] = value
    np.savez(path, **arrays)
    return path


COUNTS = [("0.state", (row, column)) for row in (0, 1, 31) for column in range(4)]
COUNTS += [("0.tallies", place) for place in range(5)]


def test_a_checkpoint_counts_within_its_arrays(tmp_path):
    stream = gmwm.StreamingVariance(0.01)
    stream.update(np.random.default_rng(0).normal(size=9000))
    whole = stream.save(tmp_path / "a.npz").read_bytes()
    for (name, place), value in itertools.product(COUNTS, (10**9, 2**62, -1)):
        (tmp_path / "a.npz").write_bytes(whole)
        with pytest.raises(InputError, match="is not a saved streaming variance"):
            gmwm.StreamingVariance.load(edited(tmp_path / "a.npz", name, place, value))


def test_sums_of_a_checkpoint_are_used_or_rejected(tmp_path):
    stream = gmwm.StreamingVariance(0.01)
    stream.update(np.random.default_rng(0).normal(size=9000))
    whole = stream.save(tmp_path / "a.npz").read_bytes()
    places = [("0.levels", (0, column)) for column in range(6)]
    places += [("0.totals", (place,)) for place in range(7)]
    for (name, place), value in itertools.product(places, (1e200, 1e60, 1e-170)):
        (tmp_path / "a.npz").write_bytes(whole)
        with suppress(InputError):
            gmwm.StreamingVariance.load(edited(tmp_path / "a.npz", name, place, value)).results()


# -- documents -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def calibration():
    x = 1e-3 * np.random.default_rng(1).normal(size=(700, 2))
    data = {"gyro_x": x[:, 0], "accel_x": x[:, 1]}
    given = gmwm.Recording.from_arrays(data, rate=100.0, units=SI)
    return gmwm.calibrate(given, gmwm.WhiteNoise() + gmwm.RandomWalk(K=1e-6))


def test_what_is_saved_is_read_whatever_its_size(calibration, tmp_path):
    content = calibration.to_dict() | {"of a later version": ["x" * 1000] * 34_000}
    path = tmp_path / "large.json"
    path.write_text(json.dumps(content))
    assert path.stat().st_size > 1 << 25
    assert gmwm.load(path).to_dict() == calibration.to_dict()


@pytest.mark.parametrize("name", ["pipe", "/dev/zero"])
def test_only_regular_files_are_opened(tmp_path, name):
    path = tmp_path / name
    if name == "pipe":
        os.mkfifo(path)
    for read in (read_numbers, read_datasheet, read_yaml, gmwm.load, gmwm.read):
        with pytest.raises(InputError, match="is a pipe or a device"):
            read(path)


@pytest.mark.parametrize("text", ["\n" * 200_000, "a: " + "9" * 200_000 + "x", "a" + " " * 200_000])
def test_numbers_of_programs_are_found_in_a_time_that_grows_with_the_file(tmp_path, text):
    path = tmp_path / "imu.yaml"
    path.write_text(text)
    start = time.process_time()
    with pytest.raises(InputError, match="no noise parameters"):
        read_numbers(path)
    assert time.process_time() - start < 5.0  # it was a minute


# -- absurd numbers --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("place", "value"), [("initial_sd", 1e200), ("stderr", {"x": 1.0}), ("initial_sd", 10**59)]
)
def test_absurd_numbers_of_a_file_are_rejected(calibration, tmp_path, place, value):
    content = gmwm.bound(calibration).to_dict()
    content["channels"]["gyro_x"][place] = value
    path = tmp_path / "numbers.json"
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=place):
        gmwm.load(path)


# -- files that change, and what a kill leaves -----------------------------------------------------


@pytest.mark.skipif(os.name != "posix", reason="a question about a process ends it elsewhere")
def test_what_a_kill_leaves_is_removed_by_the_next_run(tmp_path):
    text = """
import os, signal, sys
from pathlib import Path
from gmwm._core.files import moved_into_place, moved_together
with moved_together(Path(sys.argv[1])) as new, moved_into_place(Path(sys.argv[1]) / "b") as b:
    (new / "a").write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""
    assert program(text, tmp_path)[0] == -signal.SIGKILL
    assert len(list(tmp_path.iterdir())) == 2
    with moved_together(tmp_path) as new, moved_into_place(tmp_path / "c"):
        (new / "a").write_text("whole")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a", "c"]


def test_files_of_two_runs_are_never_side_by_side(tmp_path, monkeypatch):
    for name in "ab":
        (tmp_path / name).write_text("old")
    replace, seen = os.replace, []

    def watched(*args):
        replace(*args)
        seen.append({each.read_text() for each in tmp_path.iterdir() if each.is_file()})

    monkeypatch.setattr(os, "replace", watched)
    with moved_together(tmp_path) as new:
        for name in "ab":
            (new / name).write_text("new")
    assert seen == [{"new"}, {"new"}]


def test_threads_side_by_side_have_one_pool():
    before, pools = threading.Barrier(3), []

    def work():
        before.wait()
        with jobs.worker_pool(1, "os"):
            before.wait()
            pools.append(jobs._pool.get()[0])

    threads = [threading.Thread(target=work) for _ in range(3)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert sum(pool is not None for pool in pools) == 1


@pytest.mark.parametrize(("keys", "value", "message"), [
    (("channels", "gyro_x", "wavelet_variance", "name"), "accel_x", "is of channel 'accel_x'"),
    (("channels", "gyro_x", "covariance"), [[4.0]], "stderr contradicts"),
    (("channels", "gyro_x", "valid"), False, "valid contradicts"),
    (("channels", "gyro_x", "upper_bounds"), {"R": 1e-3}, "upper_bounds are not those"),
    (("rate_hz",), 1.0, "rate_hz is 1, but its channels have"),
])  # fmt: skip
def test_an_edited_calibration_is_rejected(calibration, tmp_path, keys, value, message):
    content = edited = calibration.to_dict()
    for key in keys[:-1]:
        edited = edited[key]
    assert edited[keys[-1]] != value
    edited[keys[-1]] = value
    path = tmp_path / "edited.json"
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=message):
        gmwm.load(path)
