"""Monte Carlo runs: the same whoever does them, kept when interrupted, never mixed up."""

from dataclasses import replace

import numpy as np
import pytest

from gmwm import AllanLines, InputError, RandomWalk, WhiteNoise
from gmwm.study.studies import STUDIES, Estimation, Quantity, Study, one_run, run_study
from marks import slow

SMALL = Study(
    name="small",
    title="White noise + random walk",
    truth=WhiteNoise(0.2) + RandomWalk(0.02),
    n=500,
    dt=1.0,
    runs=4,
    quantities=(Quantity("sigma2_WN", "N", 2, {"GMWM": 0.1}), Quantity("rate", "K", -1)),
    methods={"GMWM": Estimation(), "AV": Estimation(AllanLines())},
)


@pytest.fixture(autouse=True)
def small_study(monkeypatch):
    monkeypatch.setitem(STUDIES, "small", SMALL)


def test_every_method_sees_the_same_series_and_every_run_another(tmp_path):
    table = run_study(SMALL, tmp_path, runs=5)
    assert table.num_rows == 10
    assert table["run"].to_pylist() == [run for run in range(5) for _ in range(2)]
    estimates = table["sigma2_WN"].to_numpy()[table["method"].to_numpy(False) == "GMWM"]
    assert np.unique(estimates).size == 5
    assert one_run("small", ("GMWM",), 0, 3)["sigma2_WN"] == estimates[3]


def test_runs_are_those_of_seed_and_number_and_are_gone_on_with(tmp_path):
    first = run_study(SMALL, tmp_path / "a", runs=2, methods=["GMWM"])
    other = run_study(SMALL, tmp_path / "b", runs=2, methods=["GMWM"], seed=1)
    assert not set(first["sigma2_WN"].to_pylist()) & set(other["sigma2_WN"].to_pylist())
    again = run_study(SMALL, tmp_path / "a", runs=1, methods=["GMWM"], resume=True)
    assert again["sigma2_WN"].to_pylist() == first["sigma2_WN"].to_pylist()[:1]
    with pytest.raises(InputError, match="resume it, or give another folder"):
        run_study(SMALL, tmp_path / "a", runs=2, methods=["GMWM"])
    assert b'"seed": 0' in first.schema.metadata[b"gmwm"]


@pytest.mark.parametrize("change", [{"seed": 1}, {"methods": ["GMWM"]}])
def test_runs_of_another_study_are_not_mixed_in(tmp_path, change):
    run_study(SMALL, tmp_path, runs=2)
    other = rf"another study \(other {next(iter(change))}\): give another folder"
    with pytest.raises(InputError, match=other):
        run_study(SMALL, tmp_path, runs=3, resume=True, **change)


LONG = {
    "arma4",
    "five-gm",
    "table4",
    "em4",
    "weights2",
    "weights3",
    "weights4",
}  # long fits, or methods of another study


@pytest.mark.parametrize("name", [slow(name) if name in LONG else name for name in STUDIES])
def test_every_method_knows_its_options(name, tmp_path, monkeypatch):
    """A short series is estimated or refused with a sentence, never with an error in an option."""
    short = replace(STUDIES[name], n=128)
    monkeypatch.setitem(STUDIES, name, short)
    table = run_study(short, tmp_path, runs=1)
    assert set(table["method"].to_pylist()) == set(short.methods)
