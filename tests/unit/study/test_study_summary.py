"""Scores, tables and boxplots from rows that are known."""

import numpy as np
import pyarrow as pa
import pytest

from gmwm import Model, WhiteNoise, cramer_rao
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
            "from_grid": False,
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


def test_scenarios_are_those_of_the_paper():
    values = {s.name: {q.name: s.true_value(q) for q in s.quantities} for s in FIGURES.values()}
    assert values["table2"] == pytest.approx({"sigma2_WN": 0.04, "sigma2_RW": 4e-4, "omega": 3e-3})
    assert values["table3"] == pytest.approx(
        {"beta": 0.008, "sigma2_GM": 0.25, "sigma2_WN": 0.64, "omega": 1e-3}
    )
    rates, variances = (0.008, 0.05, 2.0), (2.5e-6, 4.5e-6, 29.5e-6)
    three = {f"beta_{i}": value for i, value in enumerate(rates, 1)}
    three |= {f"sigma2_{i}": value for i, value in enumerate(variances, 1)}
    assert values["table4"] == pytest.approx(three)
    assert len(STUDIES["five-gm"].truth.terms) == 6
