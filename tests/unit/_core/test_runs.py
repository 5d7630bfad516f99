"""Runs of a study: the same whoever does them, kept when interrupted, never mixed up."""

import logging
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from gmwm import InputError
from gmwm._core.runs import do_runs

STUDY = {"name": "squares", "seed": 1}


def squares(run):
    """A number, a text and an array."""
    return {"square": run**2, "a/b": f"run {run}", "rows": np.full((2, 3), float(run))}


def same(first, second):
    assert first.keys() == second.keys()
    for name in first:
        np.testing.assert_array_equal(first[name], second[name])


def parts(folder):
    return sorted(path.name for path in folder.glob("part-*"))


def test_runs_are_stacked_in_order():
    found = do_runs(squares, 12, STUDY)
    assert found["square"].tolist() == [run**2 for run in range(12)]
    assert found["a/b"].tolist() == [f"run {run}" for run in range(12)]
    assert found["rows"].shape == (12, 2, 3)


def test_an_interrupted_study_goes_on_where_it_stopped(tmp_path):
    made = []

    def interrupted(run):
        if run == 3:
            raise KeyboardInterrupt
        made.append(run)
        return squares(run)

    with pytest.raises(KeyboardInterrupt):
        do_runs(interrupted, 6, STUDY, folder=tmp_path)
    assert made == [0, 1, 2]
    seen = []
    again = do_runs(squares, 6, STUDY, folder=tmp_path, progress=lambda *a: seen.append(a[0]))
    assert seen == [3, 4, 5, 6]
    same(again, do_runs(squares, 6, STUDY))
    assert parts(tmp_path) == ["part-00000.npz", "part-00001.npz"]


def test_fewer_runs_are_taken_from_more_and_more_are_added(tmp_path):
    do_runs(squares, 4, STUDY, folder=tmp_path)
    same(do_runs(None, 2, STUDY, folder=tmp_path), do_runs(squares, 2, STUDY))
    same(do_runs(squares, 7, STUDY, folder=tmp_path), do_runs(squares, 7, STUDY))


def test_earlier_runs_are_refused_or_replaced(tmp_path):
    do_runs(squares, 2, STUDY, folder=tmp_path)
    with pytest.raises(InputError, match="holds runs of an earlier study") as caught:
        do_runs(squares, 2, STUDY, folder=tmp_path, earlier="refuse")
    assert caught.value.code == "earlier-runs"
    do_runs(squares, 1, STUDY | {"seed": 2}, folder=tmp_path, earlier="replace")
    assert parts(tmp_path) == ["part-00000.npz"]


@pytest.mark.parametrize(
    ("change", "other"), [({"seed": 2}, "seed"), ({"new": 1, "name": "cubes"}, "name, new")]
)
def test_runs_of_another_study_are_not_mixed_in(tmp_path, change, other):
    do_runs(squares, 2, STUDY, folder=tmp_path)
    with pytest.raises(InputError, match=rf"another study \(other {other}\)") as caught:
        do_runs(squares, 3, STUDY | change, folder=tmp_path)
    assert caught.value.code == "other-runs"
    assert parts(tmp_path) == ["part-00000.npz"]


@pytest.mark.parametrize("damage", ["empty", "cut", "text", "bits", "other", "no array"])
def test_runs_of_a_damaged_file_are_done_again(tmp_path, damage, caplog):
    do_runs(squares, 3, STUDY, folder=tmp_path)
    do_runs(squares, 5, STUDY, folder=tmp_path)
    path = tmp_path / "part-00001.npz"
    content = path.read_bytes()
    with np.load(path) as arrays:
        arrays = dict(arrays)
    if damage == "other":
        np.savez(path, time=np.zeros(3))
    elif damage == "no array":
        np.savez(path, **arrays | {"run": np.array(3)})
    else:
        middle = content.index(b"r\0\0\0u\0\0\0n")
        broken = {
            "empty": b"",
            "cut": content[: len(content) // 2],
            "text": b"not an archive",
            "bits": content[:middle] + b"R" + content[middle + 1 :],
        }
        path.write_bytes(broken[damage])
    with caplog.at_level(logging.WARNING):
        found = do_runs(squares, 5, STUDY, folder=tmp_path)
    assert path.name in caplog.text
    same(found, do_runs(squares, 5, STUDY))
    same(do_runs(None, 5, STUDY, folder=tmp_path), found)


def test_a_folder_has_one_writer(tmp_path):
    def second(run):
        with pytest.raises(InputError, match="is in use") as caught:
            do_runs(squares, 2, STUDY, folder=tmp_path)
        assert caught.value.code == "runs-in-use"
        return squares(run)

    do_runs(second, 1, STUDY, folder=tmp_path)
    do_runs(squares, 2, STUDY, folder=tmp_path)


# ---- Processes that end ----

PROGRAM = """
import os, sys, time
from pathlib import Path
from gmwm._core.runs import do_runs

def work(run):
    if run > 3:
        Path(sys.argv[1], f"pid-{os.getpid()}").touch()
        time.sleep(300.0)
    return {"run": run}

def note(done, *_):
    Path(sys.argv[1], f"done-{done}").touch()

if __name__ == "__main__":
    folder = Path(sys.argv[1], "runs")
    do_runs(work, 20, {"name": "sleep"}, folder=folder, jobs=2, progress=note)
"""


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def until(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_an_end_leaves_no_worker_and_finished_runs(tmp_path, end):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    process = subprocess.Popen(
        [sys.executable, program, tmp_path], stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    until(lambda: len(list(tmp_path.glob("pid-*"))) == 2 and (tmp_path / "done-4").exists())
    workers = [int(path.name[4:]) for path in tmp_path.glob("pid-*")]
    process.send_signal(end)
    assert process.wait(60) != 0
    until(lambda: not any(map(alive, workers)))
    if end == signal.SIGINT:
        with np.load(tmp_path / "runs" / "part-00000.npz") as content:
            assert sorted(content["run"]) == [0, 1, 2, 3]


# ---- Clusters ----


def killed_once(folder, run):
    """At one run the process ends, the first time."""
    if run == 1 and not (folder / "killed").exists():
        (folder / "killed").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return squares(run)


@pytest.mark.slow
def test_a_dask_cluster_of_processes_gives_what_this_process_gives(tmp_path):
    """Also if a worker ends in the middle, even the only one, with all that it was sent."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        there = do_runs(
            partial(killed_once, tmp_path), 6, STUDY, folder=tmp_path / "runs",
            cluster=cluster.scheduler_address,
        )  # fmt: skip
    assert (tmp_path / "killed").exists()
    same(there, do_runs(squares, 6, STUDY))
    same(there, do_runs(None, 6, STUDY, folder=tmp_path / "runs"))


def test_a_scheduler_that_does_not_answer_is_named(tmp_path):
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match="no Dask scheduler answers at 'nonsense://here'"):
        do_runs(squares, 2, STUDY, folder=tmp_path / "new", cluster="nonsense://here")
    assert list(tmp_path.iterdir()) == []
