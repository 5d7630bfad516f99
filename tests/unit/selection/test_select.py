"""Model choice: the right size where the data can tell, nothing invented where they cannot."""

import json
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, QuantizationNoise, RandomWalk, RateRamp, Sinusoid, WhiteNoise
from marks import slow


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
@pytest.mark.parametrize("seed", [0, slow(1)])
def test_the_true_model_is_chosen(truth, words, seed):
    truth = gmwm.process.as_model(truth)
    selection = gmwm.select(truth.simulate(100_000, 1.0, seed), dt=1.0)
    assert selection.fit.valid, selection.fit.message
    assert selection.model.title() == words


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
    criteria = [item.criterion for item in selection if "ramp" not in item.model.title()]
    assert criteria == sorted(criteria)
    lines = str(selection).splitlines()
    assert lines[0].split() == ["model", "difference", "p-value", "parameters"]
    assert "chosen" in lines[1] and not any("chosen" in line for line in lines[2:])
    assert max(map(len, lines)) <= 80
    assert any("fits equally well" in line for line in lines) == (len(selection.ties) > 1)
    assert selection[0].model in [item.model for item in selection]


@pytest.mark.parametrize("n", [8, 16, 64, 100])
def test_short_records_get_a_small_model(n):
    selection = gmwm.select(np.random.default_rng(n).normal(size=n), dt=1.0)
    assert len(selection.model.terms) <= 2


def test_limit_on_gauss_markov_terms():
    truth = WhiteNoise(1.0) + GaussMarkov(1.0, 8.0) + GaussMarkov(1.0, 800.0)
    x = truth.simulate(10_000, 1.0, 1)
    selection = gmwm.select(x, dt=1.0, max_gauss_markov=1)
    assert all(item.model.title().count("2 Gauss-Markov") == 0 for item in selection)
    with pytest.raises(gmwm.InputError, match="from 0 to 5"):
        gmwm.select(x, dt=1.0, max_gauss_markov=6)


def test_a_line_is_taken_where_there_is_one():
    noise = WhiteNoise(1.0) + GaussMarkov(0.5, 100.0)
    line = Sinusoid(frequency=0.013)
    with_line = (noise + Sinusoid(0.3, 0.013)).simulate(50_000, 1.0, 1)
    assert gmwm.select(with_line, dt=1.0, extra=[line]).model.title() == (
        "white noise + sinusoid + Gauss-Markov"
    )
    without = noise.simulate(50_000, 1.0, 1)
    selection = gmwm.select(without, dt=1.0, extra=[line])
    assert selection.model.title() == "white noise + Gauss-Markov"


def test_an_extra_term_must_have_a_shape():
    x = gmwm.simulate(WhiteNoise(1.0), 100, 1.0, 1)
    for extra in (Sinusoid(), Sinusoid(1.0, 0.1), RateRamp()):
        with pytest.raises(gmwm.InputError, match="free amplitude, as in"):
            gmwm.select(x, dt=1.0, extra=[extra])


def test_criteria_and_ties():
    selection = gmwm.select(gmwm.simulate(WhiteNoise(1.0), 5000, 1.0, 1), dt=1.0)
    assert 0.0 < selection.chosen.p_value < 1.0
    assert selection.chosen in selection.ties
    smallest = min(selection.ties, key=lambda item: item.n_parameters)
    assert selection.chosen.n_parameters == smallest.n_parameters


def test_several_recordings_have_one_model():
    truth = WhiteNoise(1.0) + GaussMarkov(0.3, 60.0) + GaussMarkov(0.3, 1500.0)
    rng = np.random.default_rng(3)
    parts = [truth.simulate(n, 1.0, rng) for n in (60_000, 50_000, 80_000)]
    selection = gmwm.select(parts, dt=1.0)
    assert selection.model.title() == "white noise + 2 Gauss-Markov"
    assert len(selection.fit.parts) == 3
    again = gmwm.Selection.from_dict(selection.to_dict())
    assert len(again.fit.parts) == 3 and again.fit.params == selection.fit.params


def test_no_random_walk_is_invented():
    """White noise of 15 minutes at 10 Hz: K is none, or its interval goes down to zero."""
    truth = WhiteNoise(0.005)
    held = 0
    for seed in range(20):
        fit = gmwm.fit(WhiteNoise() + RandomWalk(), truth.simulate(9_000, 0.1, seed), dt=0.1)
        held += fit.interval()["K"][0] == 0.0
    # 5 % of the bounds may fail: at least 16 of 20 hold in all but 0.3 % of cases.
    assert held >= 16


@pytest.mark.parametrize(
    ("truth", "count"),
    [
        (WhiteNoise(1.0), 0),
        slow(WhiteNoise(1.0) + GaussMarkov(1.0, 50.0), 1),
        (WhiteNoise(1.0) + GaussMarkov(1.0, 8.0) + GaussMarkov(1.0, 800.0), 2),
    ],
)
def test_merging_ends_at_the_true_number(truth, count):
    truth = gmwm.process.as_model(truth)
    found = []
    for seed in range(3):
        x = truth.simulate(20_000, 1.0, seed)
        selection = gmwm.select(x, dt=1.0, rule="merge", max_gauss_markov=3)
        found.append(sum(isinstance(term, GaussMarkov) for term in selection.model.terms))
        assert selection.chosen is selection[0]
        assert selection.chosen.model == selection.model.opened()
        assert max(map(len, str(selection).splitlines())) <= 80
    assert found.count(count) >= 2, found


def test_merging_stops_where_it_must():
    x = np.random.default_rng(1).normal(size=60)
    selection = gmwm.select(x, dt=1.0, rule="merge", max_gauss_markov=2)
    assert all(len(item.model.terms) <= 3 for item in selection)
    longer = gmwm.select(np.tile(x, 2)[:64], dt=1.0, rule="merge", max_gauss_markov=2)
    assert any(len(item.model.terms) == 3 for item in longer)  # five parameters of six levels
    # White noise that is not there is no reason to leave Gauss-Markov processes out.
    slow = gmwm.simulate(GaussMarkov(1.0, 300.0), 20_000, 1.0, 2)
    kept = gmwm.select(slow, dt=1.0, rule="merge").model
    assert sum(isinstance(term, GaussMarkov) for term in kept.terms) == 1
    with pytest.raises(gmwm.InputError, match="rule = 'magic': choose from criterion, merge"):
        gmwm.select(x, dt=1.0, rule="magic")


def test_merging_holds_a_time_that_the_record_does_not_determine():
    # Five correlation times: the record shows the process, but no upper limit of its time.
    x = gmwm.simulate(WhiteNoise(1.0) + GaussMarkov(1.0, 4000.0), 20_000, 1.0, 2)
    selection = gmwm.select(x, dt=1.0, rule="merge", max_gauss_markov=2)
    fit = selection.fit
    assert fit.valid
    assert set(fit.keys) == {"N", "sigma"}
    assert selection.chosen is selection[0]
    assert [each.n_parameters for each in selection] == [2, 3, 5]
    (held,) = (each for each in fit.notices if each.code == "time-held")
    assert held.where == "tau"
    assert held.values["shortest"] <= min(4000.0, held.values["tau"])


def test_bias_instability_as_a_candidate():
    truth = WhiteNoise(1.0) + gmwm.BiasInstability(0.5)
    selection = gmwm.select(truth.simulate(100_000, 1.0, 2), dt=1.0, extra=[gmwm.BiasInstability()])
    assert "bias instability" in selection.ranking[0].model.title()


@pytest.mark.parametrize(
    "truth",
    [
        WhiteNoise(1e-3) + RandomWalk(5e-6),
        slow(WhiteNoise(1e-3) + GaussMarkov(3e-4, 2000.0)),
        WhiteNoise(1e-3) + GaussMarkov(1e-3, 10_000.0),
    ],
    ids=repr,
)
def test_a_slow_process_that_is_seen_once_is_no_ramp(truth):
    # An hour: with the slope priced under what the line leaves, 12 of 60 of these were ramps.
    for seed in range(1000, 1002):
        selection = gmwm.select(truth.simulate(36_000, 0.1, seed), dt=0.1)
        assert "R" not in selection.fit.params, seed


def test_a_ramp_that_no_walk_explains_is_chosen():
    sigma = np.sqrt(12.0 * 1e-6 / 3600.0**3)
    truth = WhiteNoise(1e-3) + RateRamp(40.0 * sigma)
    for seed in range(2):
        selection = gmwm.select(truth.simulate(36_000, 0.1, seed), dt=0.1)
        assert selection.model.title() == "white noise + rate ramp"


def test_a_model_of_several_recordings_is_loaded_with_all_of_them():
    parts = [
        gmwm.wavelet_variance(WhiteNoise(1.0).simulate(500, 1.0, seed), dt=1.0) for seed in (1, 2)
    ]
    selection = gmwm.select(parts, max_gauss_markov=0)
    again = type(selection).from_dict(json.loads(json.dumps(selection.to_dict())))
    assert [part.params for part in again.fit.parts] == [
        part.params for part in selection.fit.parts
    ]


def test_samples_missing_all_over_leave_a_model_without_a_ramp():
    # Every block mean of which a slope is made misses twelve samples.
    x = gmwm.simulate(WhiteNoise(1e-3), 20_000, 0.01, seed=3)
    x[np.arange(x.size) % 40 < 12] = np.nan
    best = gmwm.select(gmwm.wavelet_variance(x, dt=0.01)).fit
    assert list(best.params) == ["N"]
    assert best.params["N"] == pytest.approx(1e-3, rel=4.0 / np.sqrt(2.0 * 14_000))


# -- candidates that are given --------------------------------------------------------------------


@pytest.fixture(scope="module")
def walking():
    truth = WhiteNoise(1.0) + RandomWalk(0.01)
    return gmwm.wavelet_variance(gmwm.simulate(truth, 100_000, 1.0, seed=1), 1.0)


def test_only_the_candidates_are_ranked(walking):
    texts = ["N + GM", "K + N", "N", "N + 2 GM"]
    found = gmwm.select(walking, candidates=texts)
    models = [gmwm.process.as_model(text) for text in texts]

    assert found.chosen.model == models[1]
    assert {item.model for item in found} == set(models)
    free = gmwm.select(walking)
    for item in found:  # the same criterion as among all
        terms = Counter(item.model.terms)
        for each in free:
            if Counter(each.model.terms) == terms:
                assert each.criterion == pytest.approx(item.criterion, abs=0.5)


def test_a_candidate_is_chosen_though_another_model_is_better(walking):
    found = gmwm.select(walking, candidates=["N + 2 GM", "N + 3 GM"])
    assert found.chosen in found.ranking and len(found) == 2


def test_a_ramp_is_a_candidate_of_one_recording(walking):
    rng = np.random.default_rng(1)
    x = rng.normal(size=100_000) + 1e-4 * np.arange(100_000)
    found = gmwm.select(x, rate=1.0, candidates=["N + K", "R + N", "N + K + R"])
    assert found.chosen.model == RateRamp() + WhiteNoise() or found.model.title().endswith("ramp")
    assert found.fit.params["R"] == pytest.approx(1e-4, abs=4 * found.fit.stderr["R"])
    with pytest.raises(gmwm.InputError, match="leave R out"):
        gmwm.select([walking, walking], candidates=["N + R", "N"])


def test_the_chosen_model_comes_first(walking):
    found = gmwm.select(walking)
    moved = gmwm.Selection(found.ranking, found[1], gmwm.fit(found[1].model, walking))

    before, _, after = str(moved).partition(" chosen ")
    assert "parameters" in before and "fits equally well" in after
    table = moved.to_frame()
    assert list(table["chosen"]) == [True] + [False] * (len(found) - 1)
    assert "chosen" in moved._repr_html_().split("</tr>")[1]
