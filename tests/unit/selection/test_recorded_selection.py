# ruff: noqa: E501 - tables
"""Rankings in full, and which candidate is chosen where fits are as they are made here."""

import random
import sys
from itertools import combinations
from string import ascii_lowercase
from types import SimpleNamespace

import numpy as np
import pytest

import gmwm
from gmwm import (
    GaussMarkov,
    LowPassNoise,
    Model,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    Sinusoid,
    WhiteNoise,
)
from gmwm._core.notices import Notice
from gmwm.estimate.moments import dictionary_fit
from gmwm.estimate.problem import Slope
from gmwm.selection import tuning
from gmwm.selection.bandwidth import _Beside, _families, sensor_bandwidth
from gmwm.selection.ranking import Candidate, Choices, _given_shape, rank, rank_key
from gmwm.selection.ties import ramp_or_walk, ranges, wider_ranges
from recorded import assert_as_recorded, edge

module = sys.modules["gmwm.selection.select"]


def numbers(items):
    return [[item.model.title(), item.criterion, item.objective, item.chi_square, item.n_parameters,
             item.dof, item.p_value] for item in items]  # fmt: skip


def series(truth, n, seed=1, dt=1.0):
    return gmwm.process.as_model(truth).simulate(n, dt, seed)


RAMP = 40.0 * np.sqrt(12.0 / 3000.0**3)
CASES = {
    "white": series(WhiteNoise(1.0), 3000),
    "walk": series(WhiteNoise(1.0) + RandomWalk(0.03), 3000),
    "fast and slow": series(WhiteNoise(1.0) + GaussMarkov(1.0, 8.0) + GaussMarkov(1.0, 300.0), 6000),
    "ramp": series(WhiteNoise(1.0) + RateRamp(RAMP), 3000),
    "slow": series(WhiteNoise(1.0) + RateRamp(0.22 * RAMP), 3000, 4),
    "filtered": np.convolve(series(WhiteNoise(1.0), 6003), np.ones(4) / 4, "valid"),
    "short": series(WhiteNoise(1.0), 40),
    "line": series(WhiteNoise(1.0) + Sinusoid(0.4, 0.02), 3000),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_ranking(name):
    wv = gmwm.wavelet_variance(CASES[name], 1.0)
    extra = [Sinusoid(frequency=0.02)] if name == "line" else []
    found = gmwm.select(wv, extra=extra, max_gauss_markov=1 + (name == "fast and slow"))
    whole = {
        "ranking": numbers(found), "chosen": found.chosen.model.title(), "text": str(found),
        "params": found.fit.params, "notices": found.fit.notices, "ties": len(found.ties),
        "rivals": [fit.model.title() for fit in found.rivals], "ranges": found.ranges(),
        "half": found.ranges(0.5), "wider": wider_ranges(found.fit, found.ranges()),
    }  # fmt: skip
    if name in ("ramp", "slow"):
        ranked, slope = rank(wv, Choices(1))
        whole["ranked"] = [numbers(ranked), slope and [slope.value, slope.variance]]
    if name == "white":
        merged = gmwm.select(wv, rule="merge", max_gauss_markov=3)
        whole["merged"] = [numbers(merged), merged.fit.params, merged.chosen.model.title()]
    assert_as_recorded(f"selection/{name.replace(' ', '_')}", whole, rtol=1e-3)


def test_low_passes():
    found = {}
    for name, taps in (("mean", np.ones(5) / 5), ("three", [0.25, 0.5, 0.25]), ("none", [1.0])):
        x = np.convolve(series(WhiteNoise(1.0), 6000, 7), taps, "valid")
        wv = gmwm.wavelet_variance(x, 1.0)
        reference = dictionary_fit(wv, wv.variance, ())
        problem = _Beside.of(wv, (), reference.covariance, tuning.FILTER_LIKE, QuantizationNoise)
        found[f"{name} alone"] = [problem.objective, problem.curves.shape]
        for family in _families():
            best, objective = problem.best(family)
            shape = [] if name == "none" else list(best.given.values.values())  # it is flat there
            kind = type(best.free).__name__
            found[f"{name} {family!r}"] = [objective, best.n_shapes, kind, shape]
        best = sensor_bandwidth(wv, (), 3.0)
        found[f"{name} found"] = best and [repr(best.free), best.n_shapes]
        if name == "mean":
            found["edge"] = edge(lambda p, w=wv: sensor_bandwidth(w, (), p), 1.0, 1e3, 5)
    assert_as_recorded("selection/low_passes", found, rtol=1e-3)


# -- choices among fits that are made up ----------------------------------------------------------

KINDS = (WhiteNoise(), QuantizationNoise(), RandomWalk(), GaussMarkov(), RateRamp())
MODELS = [Model(some) for k in (1, 2, 3, 4) for some in combinations(KINDS, k)]


class Goodness(SimpleNamespace):
    def loses_to(self, other):
        return other.level > self.level + 2


def made(rng, model):
    """A fit with the properties that a choice looks at, by chance."""
    codes = rng.choice(([], [], [], ["redundant-term"], ["search-limit"], ["note"], ["confounded"]))
    term = rng.choice(model.terms)
    return SimpleNamespace(
        model=model, notices=[Notice(code, "note", "", "", {"process": type(term).__name__}) for code in codes],
        valid=rng.random() < 0.4, discrepancy=rng.choice((0.0, 0.0, 0.1)), dof=rng.choice((0, 5)),
        chi_square_allowed=rng.uniform(0, 60), objective=1.0, keys=("a", "b"), wv=SimpleNamespace(n=1000),
        upper_bounds={}, goodness=Goodness(level=rng.randrange(6), misses_a_level=rng.random() < 0.5,
                                           is_excluded=rng.random() < 0.3),
    )  # fmt: skip


def test_choices_among_made_up_fits(monkeypatch):
    """Of fifty draws the place of the chosen one, large if it is valid, and how many were fitted."""
    found = {}
    for seed in range(400):
        rng = random.Random(seed)
        models = rng.sample(
            [m for m in MODELS if any(not t.is_drift for t in m.terms)], rng.randint(2, 9)
        )
        spread = rng.choice((1.0, 4.0, 20.0, 60.0))
        ranking = sorted(
            (Candidate(m, rng.uniform(0, spread), 1.0, rng.uniform(0, 50), rng.randint(1, 5), 3) for m in models),
            key=rank_key,
        )  # fmt: skip
        fits = {}

        def fitted(model, wv, fits=fits, rng=rng):
            return fits.setdefault(repr(model), made(rng, model))

        monkeypatch.setattr(module, "_fitted", fitted)
        chosen, fit = module._chosen(ranking, None)
        models = [item.model for item in ranking]  # or one of its parts: z
        place = models.index(chosen.model) if chosen.model in models else -1
        letter = ascii_lowercase[place]
        for of, each in (("chosen", letter.upper() if fit.valid else letter),
                         ("fitted", ascii_lowercase[len(fits)])):  # fmt: skip
            key = f"{of} from {seed // 50 * 50}"
            found[key] = found.get(key, "") + each
    assert_as_recorded("selection/choices", found)


@pytest.mark.parametrize(
    ("excluded", "place"), [((True, True, True), 0), ((True, False, False), 1), ((False, True), 0)]
)
def test_where_nothing_is_supported_the_first_is_chosen_that_data_do_not_exclude(
    monkeypatch, excluded, place
):
    fits = iter(SimpleNamespace(goodness=SimpleNamespace(is_excluded=each)) for each in excluded)
    monkeypatch.setattr(module, "_fitted", lambda model, wv: next(fits))
    monkeypatch.setattr(module, "_is_acceptable", lambda fit: False)
    monkeypatch.setattr(module, "_supported_part", lambda *_: None)
    ranking = [Candidate(model, 100.0 * k, 1.0, 1.0, 1, 3) for k, model in enumerate(MODELS)]
    assert module._chosen(ranking[: len(excluded)], None)[0] is ranking[place]


def test_parts_of_choices():
    found = {}
    model = WhiteNoise(1.0) + GaussMarkov(2.0, 30.0) + GaussMarkov(1.0, 300.0)
    for codes in ([], ["redundant-term"], ["indistinct-terms"], ["amplitude-bound"], ["other"]):
        for process in ("GaussMarkov", "WhiteNoise"):
            for upper in ({}, {"N": 1.0}, {"tau_2": 1.0}, {"sigma_1": 1.0}):
                fit = SimpleNamespace(
                    model=model, upper_bounds=upper,
                    notices=[Notice(code, "note", "", "", {"process": process}) for code in codes],
                )  # fmt: skip
                doubtful = module._doubtful_term(fit)
                found[f"{codes} {process} {list(upper)}"] = [
                    module._gauss_markov_is_redundant(fit), module._has_redundant_term(fit), repr(doubtful),
                ]  # fmt: skip
    named = SimpleNamespace(model=model, notices=[Notice("undetermined", "note", "tau_2", "", {})])
    found["named"] = repr(module._doubtful_term(named))
    found["stands"] = [module._stands_for(a, b) for a, b in (
        (GaussMarkov(), model.terms[1]), (GaussMarkov(tau=30.0), model.terms[1]), (WhiteNoise(), model.terms[1]),
        (GaussMarkov(tau=31.0), model.terms[1]))]  # fmt: skip
    found["shapes"] = [
        _given_shape(t)
        for t in (Sinusoid(frequency=0.3), LowPassNoise(bandwidth=2.0), WhiteNoise())
    ]
    for unit, quantity in (("rad/s", "gyro"), ("m/s^2", "accel"), ("V", None)):
        channel = gmwm.Channel("a", CASES["walk"], 1.0, quantity or "voltage", unit)
        wv = (
            gmwm.wavelet_variance(channel)
            if quantity
            else gmwm.wavelet_variance(CASES["walk"], 1.0)
        )
        one, other = gmwm.fit(WhiteNoise() + RandomWalk(), wv), gmwm.fit(WhiteNoise(), wv)
        third = gmwm.fit(WhiteNoise() + GaussMarkov(), wv)
        for name, fit in (("walk", one), ("white", other), ("slow", third)):
            found[f"{unit} {name}"] = ramp_or_walk(fit, Slope(2e-6, 4e-14))
        wide = {key: (0.9 * low, 1.5 * high) for key, (low, high) in one.interval().items()}
        found[f"{unit} wider"] = [wider_ranges(one, wide), wider_ranges(one, {"K": (0.0, np.inf)})]
        found[f"{unit} ranges"] = [ranges(one, [other, third], level) for level in (0.5, 0.95)]
        found[f"{unit} from"] = edge(
            lambda a, fit=one: wider_ranges(fit, {
                key: (low, low + a * (high - low)) for key, (low, high) in fit.interval().items()
            }), 1.01, 3.0,
        )  # fmt: skip
    assert_as_recorded("selection/parts", found, rtol=1e-3)


@pytest.mark.parametrize(
    ("change", "is_right"),
    [
        (lambda c: None, True), (lambda c: c.update(chosen=2), True), (lambda c: c.update(chosen=3), False),
        (lambda c: c.update(chosen=-1), False), (lambda c: c.update(ranking=[], chosen=0), False),
        (lambda c: c["ranking"][0].update(objective=0.0, chi_square=0.0, n_parameters=1), True),
        (lambda c: c["ranking"][0].update(objective=-0.01), False), (lambda c: c["ranking"][0].update(chi_square=-0.01), False),
        (lambda c: c["ranking"][0].update(n_parameters=0), False), (lambda c: c.update(ranking=c["ranking"][:1], chosen=0), True),
    ],
)  # fmt: skip
def test_a_stored_selection(change, is_right):
    fit = gmwm.fit(WhiteNoise(), CASES["short"], 1.0)
    ranking = tuple(
        Candidate(WhiteNoise() + RandomWalk(), 1.0 * k, 1.0, 1.0, 2, 3) for k in range(3)
    )
    stored = gmwm.Selection(ranking, ranking[0], fit).to_dict()
    change(stored)
    if is_right:
        assert gmwm.Selection.from_dict(stored).to_dict() == stored
    else:
        with pytest.raises(gmwm.InputError):
            gmwm.Selection.from_dict(stored)
