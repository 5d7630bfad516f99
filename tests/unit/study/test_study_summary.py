"""Scores, tables and boxplots from rows that are known."""

import numpy as np
import pyarrow as pa
import pytest

from gmwm import Model, WhiteNoise, cramer_rao
from gmwm.study.figures import boxplots
from gmwm.study.studies import FIGURES, STUDIES, Estimation, Quantity, Study
from gmwm.study.summary import summarise

WHITE = Study(
    name="white",
    title="White noise",
    truth=Model((WhiteNoise(0.2),)),
    n=1000,
    dt=1.0,
    runs=4,
    quantities=(Quantity("sigma2_WN", "N", 2, {"B": 0.05}),),
    methods={"A": Estimation(), "B": Estimation()},
    notes=("A note that is long enough to be wrapped at the eightieth column of the terminal.",),
)


def rows(estimates, method, lower=0.03, upper=0.05):
    return [
        {
            "run": run,
            "method": method,
            "seconds": 0.5,
            "valid": np.isfinite(value),
            "message": "",
            "sigma2_WN": value,
            "sigma2_WN_lower": lower,
            "sigma2_WN_upper": upper,
        }
        for run, value in enumerate(estimates)
    ]


@pytest.fixture
def table():
    return pa.Table.from_pylist(
        rows([0.044, 0.036, 0.044, 0.036], "A")
        + rows([0.048, float("nan"), 0.048, 0.048], "B", lower=0.045)
    )


def test_scores(table):
    summary = summarise(WHITE, table, 0)
    bound = 2.0 * cramer_rao(WHITE.truth, 1000, 1.0).stderr["N"] / 0.2
    a, b = summary.scores["sigma2_WN", "A"], summary.scores["sigma2_WN", "B"]
    assert a.relative == pytest.approx(0.1)
    assert a.rmse == pytest.approx(0.004)
    assert a.bias == pytest.approx(0.0)
    assert a.coverage == 1.0
    assert a.ratio == pytest.approx(0.1 / bound)
    assert b.relative == b.bias == pytest.approx(0.2)
    assert (b.coverage, b.missing, b.published) == (0.0, 1, 0.05)
    assert summary.invalid == {"A": 0, "B": 1}
    assert summary.bounds == {"sigma2_WN": pytest.approx(bound)}


def test_printed_table(table):
    assert str(summarise(WHITE, table, 3)) == (
        "White noise\n"
        "4 runs of 1,000 samples at 1 Hz, seed 3\n"
        "\n"
        "quantity   method         RMSE  relative  / bound     bias   covers     paper\n"
        "sigma2_WN  A             0.004       0.1     2.23     0.0%   100.0%          \n"
        "sigma2_WN  B             0.008       0.2     4.47    20.0%     0.0%      0.05"
        "  (1 without)\n"
        "           bound       0.00179    0.0447     1.00\n"
        "           moments     0.00179    0.0448     1.00\n"
        "\n"
        "           method    not valid   median time\n"
        "           A                 0         0.5 s\n"
        "           B                 1         0.5 s\n"
        "\n"
        "relative, bias: over the true value; bound: Cramer-Rao; moments: the same for\n"
        "estimates by Haar wavelet variances only; covers: 95 % intervals\n"
        "- A note that is long enough to be wrapped at the eightieth column of the\n"
        "  terminal."
    )


def test_table_in_the_layout_of_the_paper(table):
    assert summarise(WHITE, table, 0).markdown() == (
        "|  | A | B | Cramer-Rao bound |\n"
        "| --- | --- | --- | --- |\n"
        "| sigma2_WN | 0.004 (0.1) | 0.008 (0.2) | 0.00179 (0.0447) |\n"
        "| sigma2_WN, paper | - | 0.002 (0.05) |  |"
    )


def test_boxplots_are_written_whole(table, tmp_path):
    paths = boxplots(WHITE, table, tmp_path / "white")
    assert [path.name for path in paths] == ["white.png", "white.svg"]
    assert paths[0].read_bytes()[:4] == b"\x89PNG"
    assert "<svg" in paths[1].read_text()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["white.png", "white.svg"]


def test_scenarios_are_those_of_the_paper():
    values = {s.name: {q.name: s.true_value(q) for q in s.quantities} for s in FIGURES.values()}
    assert values["table2"] == pytest.approx({"sigma2_WN": 0.04, "sigma2_RW": 4e-4, "omega": 3e-3})
    assert values["table3"] == pytest.approx(
        {"beta": 0.008, "sigma2_GM": 0.25, "sigma2_WN": 0.64, "omega": 1e-3}
    )
    assert values["table4"] == pytest.approx(
        {
            "beta_1": 0.008, "sigma2_1": 2.5e-6, "beta_2": 0.05, "sigma2_2": 4.5e-6,
            "beta_3": 2.0, "sigma2_3": 29.5e-6,
        }
    )  # fmt: skip
    assert len(STUDIES["five-gm"].truth.terms) == 6
