"""Monte Carlo runs: the same whoever does them, kept when interrupted, never mixed up."""

import numpy as np
import pyarrow.parquet as pq
import pytest

from gmwm import InputError, RandomWalk, WhiteNoise
from gmwm.study import runs as engine
from gmwm.study.runs import one_run, run_scenario
from gmwm.study.scenario import SCENARIOS, Estimation, Quantity, Scenario

SMALL = Scenario(
    name="small",
    title="White noise + random walk",
    truth=WhiteNoise(0.2) + RandomWalk(0.02),
    n=500,
    dt=1.0,
    runs=4,
    quantities=(Quantity("sigma2_WN", "N", 2, {"GMWM": 0.1}), Quantity("rate", "K", -1)),
    methods={"GMWM": Estimation(), "AV": Estimation("allan")},
)


@pytest.fixture(autouse=True)
def small_scenario(monkeypatch):
    monkeypatch.setitem(SCENARIOS, "small", SMALL)


def columns(table):
    return {name: table[name].to_pylist() for name in table.column_names if name != "seconds"}


def same(a, b):
    a, b = columns(a), columns(b)
    assert a.keys() == b.keys()
    for name in a:
        np.testing.assert_array_equal(a[name], b[name])


def test_every_method_sees_the_same_series_and_every_run_another(tmp_path):
    table = run_scenario(SMALL, tmp_path, runs=5)
    assert table.num_rows == 10
    assert table["run"].to_pylist() == [run for run in range(5) for _ in range(2)]
    estimates = table["sigma2_WN"].to_numpy()[table["method"].to_numpy(False) == "GMWM"]
    assert np.unique(estimates).size == 5
    assert one_run("small", ("GMWM",), 0, 3)[0]["sigma2_WN"] == estimates[3]


def test_a_seed_is_another_study(tmp_path):
    first = run_scenario(SMALL, tmp_path / "a", runs=2, methods=["GMWM"])
    other = run_scenario(SMALL, tmp_path / "b", runs=2, methods=["GMWM"], seed=1)
    assert not set(first["sigma2_WN"].to_pylist()) & set(other["sigma2_WN"].to_pylist())


def test_parallel_processes_give_what_one_gives():
    # The registered scenarios are what worker processes know.
    from gmwm.study.runs import _here

    work = _Table2()
    alone = sorted(map(str, _here(work, range(3), 1)))
    together = sorted(map(str, _here(work, range(3), 2)))
    assert alone == together


class _Table2:
    def __call__(self, run):
        rows = one_run("table2", ("GMWM",), 7, run)
        return [{k: v for k, v in row.items() if k != "seconds"} for row in rows]


def test_an_interrupted_study_goes_on_where_it_stopped(tmp_path, monkeypatch):
    whole = run_scenario(SMALL, tmp_path / "whole", runs=6)
    made = []

    def interrupted(name, methods, seed, run):
        if run == 3:
            raise KeyboardInterrupt
        made.append(run)
        return one_run(name, methods, seed, run)

    monkeypatch.setattr(engine, "one_run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_scenario(SMALL, tmp_path / "part", runs=6)
    assert made == [0, 1, 2]
    monkeypatch.undo()
    monkeypatch.setitem(SCENARIOS, "small", SMALL)
    seen = []
    again = run_scenario(
        SMALL, tmp_path / "part", runs=6, resume=True, progress=lambda *a: seen.append(a)
    )
    assert seen[0] == (3, 6, "") and seen[-1] == (6, 6, "")
    same(again, whole)


def test_fewer_runs_are_taken_from_more(tmp_path):
    run_scenario(SMALL, tmp_path, runs=4)
    table = run_scenario(SMALL, tmp_path, runs=2, resume=True)
    assert sorted(set(table["run"].to_pylist())) == [0, 1]


def test_earlier_runs_are_not_overwritten(tmp_path):
    run_scenario(SMALL, tmp_path, runs=2)
    with pytest.raises(InputError, match="add --resume"):
        run_scenario(SMALL, tmp_path, runs=2)


@pytest.mark.parametrize("change", [{"seed": 1}, {"methods": ["GMWM"]}])
def test_runs_of_another_study_are_not_mixed_in(tmp_path, change):
    run_scenario(SMALL, tmp_path, runs=2)
    other = f"belongs to another study, of other {next(iter(change))}: choose another folder"
    with pytest.raises(InputError, match=other):
        run_scenario(SMALL, tmp_path, runs=3, resume=True, **change)


def test_a_file_that_is_no_parquet_is_named(tmp_path):
    folder = tmp_path / "small-runs"
    folder.mkdir()
    (folder / "part-00000.parquet").write_text("no")
    with pytest.raises(InputError, match=r"part-00000\.parquet: is no Parquet file"):
        run_scenario(SMALL, tmp_path, runs=2, resume=True)


def test_a_method_without_an_answer_is_a_row_without_numbers(tmp_path):
    # In so short a record of this mixture the Allan plot has no straight parts.
    table = run_scenario(SMALL, tmp_path, runs=4, methods=["AV"])
    absent = np.isnan(table["rate"].to_numpy())
    assert np.all(absent)
    assert not any(table["valid"].to_pylist())
    assert all(table["message"].to_pylist())


def test_interval_of_an_inverse_is_in_order(tmp_path):
    table = run_scenario(SMALL, tmp_path, runs=3, methods=["GMWM"])
    lower, value, upper = (table["rate" + end].to_numpy() for end in ("_lower", "", "_upper"))
    assert np.all(lower < value) and np.all(value < upper)


def test_unknown_method_and_no_runs(tmp_path):
    with pytest.raises(InputError, match="it has GMWM, AV"):
        run_scenario(SMALL, tmp_path, runs=2, methods=["EM"])
    with pytest.raises(InputError, match="runs = 0"):
        run_scenario(SMALL, tmp_path, runs=0)


def test_parts_say_what_they_are(tmp_path):
    run_scenario(SMALL, tmp_path, runs=2)
    parts = list((tmp_path / "small-runs").iterdir())
    assert [part.name for part in parts] == ["part-00000.parquet"]
    assert b'"seed": 0' in pq.read_schema(parts[0]).metadata[b"gmwm"]


def test_a_dask_cluster_of_processes_gives_what_this_process_gives(tmp_path):
    distributed = pytest.importorskip("distributed")
    scenario = SCENARIOS["table2"]
    here = run_scenario(scenario, tmp_path / "here", runs=3, methods=["GMWM"])
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        there = run_scenario(
            scenario, tmp_path / "there", runs=3, methods=["GMWM"],
            cluster=cluster.scheduler_address,
        )  # fmt: skip
    same(here, there)


def test_a_scheduler_that_does_not_answer_is_named(tmp_path):
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match="no Dask scheduler answers at 'nonsense://here'"):
        run_scenario(SMALL, tmp_path, runs=2, cluster="nonsense://here")
