"""Model choice: the right size where the data can tell, nothing invented where they cannot."""

from itertools import pairwise

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, QuantizationNoise, RandomWalk, RateRamp, WhiteNoise
from gmwm.selection import describe


@pytest.mark.parametrize(
    ("truth", "words"),
    [
        (WhiteNoise(1.0), "white noise"),
        (WhiteNoise(1.0) + RandomWalk(0.01), "white noise + random walk"),
        (QuantizationNoise(3.0) + WhiteNoise(1.0), "white noise + quantization noise"),
        (WhiteNoise(1.0) + GaussMarkov(0.5, 50.0), "white noise + Gauss-Markov"),
        (
            WhiteNoise(1.0) + GaussMarkov(1.0, 8.0) + GaussMarkov(1.0, 800.0),
            "white noise + 2 Gauss-Markov",
        ),
        (WhiteNoise(1.0) + RateRamp(1e-4), "white noise + rate ramp"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_the_true_model_is_chosen(truth, words):
    truth = gmwm.process.as_model(truth)
    chosen = []
    for seed in range(8):
        selection = gmwm.select(truth.simulate(100_000, 1.0, seed), dt=1.0)
        chosen.append(describe(selection.model))
        assert selection.fit.valid, selection.fit.message
        assert len(selection.model.terms) <= len(truth.terms) + 1
    assert chosen.count(words) >= 7, chosen


def test_a_larger_model_is_never_worse():
    truth = WhiteNoise(1.0) + GaussMarkov(0.5, 50.0)
    selection = gmwm.select(truth.simulate(50_000, 1.0, 1), dt=1.0)
    objectives = {}
    for item in selection:
        terms = {type(t).__name__ for t in item.model.terms}
        if terms <= {"WhiteNoise", "GaussMarkov"} and "WhiteNoise" in terms:
            objectives[len(item.model.terms)] = item.objective
    sizes = sorted(objectives)
    assert len(sizes) >= 1
    assert all(objectives[b] <= objectives[a] + 1e-6 for a, b in pairwise(sizes))


def test_ranking_is_sorted_and_printed():
    selection = gmwm.select(gmwm.simulate(WhiteNoise(1.0), 5000, 1.0, 1), dt=1.0)
    criteria = [item.criterion for item in selection if "ramp" not in describe(item.model)]
    assert criteria == sorted(criteria)
    lines = str(selection).splitlines()
    assert lines[0].split() == ["difference", "objective", "parameters", "model"]
    assert sum(line.startswith(">") for line in lines) == 1
    assert selection[0].model in [item.model for item in selection]


@pytest.mark.parametrize("n", [8, 16, 64, 100])
def test_short_records_get_a_small_model(n):
    selection = gmwm.select(np.random.default_rng(n).normal(size=n), dt=1.0)
    assert len(selection.model.terms) <= 2


def test_limit_on_gauss_markov_terms():
    truth = WhiteNoise(1.0) + GaussMarkov(1.0, 8.0) + GaussMarkov(1.0, 800.0)
    x = truth.simulate(50_000, 1.0, 1)
    selection = gmwm.select(x, dt=1.0, max_gauss_markov=1)
    assert all(describe(item.model).count("2 Gauss-Markov") == 0 for item in selection)
    with pytest.raises(gmwm.InputError, match="from 0 to 5"):
        gmwm.select(x, dt=1.0, max_gauss_markov=6)
