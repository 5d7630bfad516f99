"""The search for shapes by compiled curves and by any others; what of fits is found once."""

import gc
import weakref

import numpy as np
import pytest

import gmwm
from gmwm.estimate.moments import GMWM, Design, Profile, dictionary_fit
from gmwm.estimate.problem import Scales, weight_root
from gmwm.process import compiled_levels, quadrature, shaped_curve, shaped_slope

TAU = 0.01 * 2.0 ** np.arange(18)
SHAPED = (gmwm.GaussMarkov(), gmwm.Resonance(), gmwm.LowPassNoise())


@pytest.fixture(scope="module")
def wv():
    truth = gmwm.WhiteNoise(0.02) + gmwm.LowPassNoise(0.2, 12.0, 2.0, 0.7)
    truth += gmwm.Resonance(0.05, 1.0, 0.05) + gmwm.GaussMarkov(0.05, 40.0)
    return gmwm.wavelet_variance(truth.simulate(200_000, 0.01, seed=3), 0.01)


@pytest.mark.parametrize("process", SHAPED, ids=lambda p: type(p).__name__)
def test_compiled_curves_are_those_of_the_process(process):
    kind = process.compiled_kind
    levels = compiled_levels(TAU, 0.01, {kind})
    rng = np.random.default_rng(1)
    grid = process.shape_grid(0.01, 400_000)
    for place in rng.integers(len(grid), size=20):
        found = shaped_curve(kind, np.array(grid[place]), levels)
        expected = process.unit_haar_variance(grid[place], TAU, 0.01)
        if found.size:  # else on finer nodes than compiled code has
            np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("order", [1.0, 1.4, 2.0, 4.0])
def test_wide_panels_are_fine_enough(order):
    process = gmwm.LowPassNoise(1.0, 9.0, order, np.sqrt(0.5))
    nodes = quadrature(tuple((TAU / 0.01).tolist()))
    expected = nodes.haar_variance(process.psd, 0.01)
    np.testing.assert_allclose(process.haar_variance(TAU, 0.01), expected, rtol=1e-7)


def test_only_a_gauss_markov_process_has_a_slope_in_closed_form():
    levels = compiled_levels(TAU, 0.01, {1, 2})
    slope = shaped_slope(1, np.array([0.3]), levels)
    near = [gmwm.GaussMarkov(1.0, 0.3 * np.exp(h)).haar_variance(TAU, 0.01) for h in (1e-5, -1e-5)]
    np.testing.assert_allclose(slope, (near[0] - near[1]) / 2e-5, rtol=1e-6, atol=1e-12)
    assert shaped_slope(2, np.array([0.3, 0.1]), levels).size == 0


def test_a_subclass_is_no_compiled_kind():
    class Mine(gmwm.GaussMarkov):
        def haar_variance(self, tau, dt):
            return 2.0 * super().haar_variance(tau, dt)

    assert Mine.compiled_kind == 0
    assert Design(gmwm.WhiteNoise() + Mine(), Scales(TAU, 0.01, 400_000)).compiled is None


def by_any_curves(model, wv, root, beside=None):
    """The problem as for processes whose curves compiled code does not know."""
    design = Design(model, Scales.of(wv))
    design.compiled = None
    return Profile(design, wv.variance, root, beside)


@pytest.mark.parametrize(
    ("model", "shapes"),
    [
        (gmwm.WhiteNoise() + gmwm.GaussMarkov(), [(), (1e3,)]),
        (gmwm.WhiteNoise() + gmwm.GaussMarkov(), [(), (1e-2,)]),
        (gmwm.WhiteNoise() + 2 * gmwm.GaussMarkov(), [(), (0.3,), (0.2,)]),
        (gmwm.WhiteNoise() + 2 * gmwm.GaussMarkov(), [(), (0.3,), (0.3,)]),  # one has all
        (
            gmwm.WhiteNoise() + gmwm.RandomWalk(K=1e-4) + 2 * gmwm.GaussMarkov(),
            [(), (), (30.0,), (900.0,)],
        ),
        (
            gmwm.LowPassNoise(order=2.0, damping=0.7)
            + gmwm.Resonance(damping=0.05)
            + gmwm.GaussMarkov(),
            [(40.0, 2.0, 0.7), (4.0, 0.05), (0.5,)],
        ),
    ],
    ids=str,
)
def test_compiled_and_other_curves_lead_to_the_same_minimum(model, shapes, wv):
    root = weight_root(dictionary_fit(wv, wv.variance).covariance)
    compiled = Profile(Design(model, Scales.of(wv)), wv.variance, root)
    start = compiled.at(shapes)
    found, other = (each.refine(start) for each in (compiled, by_any_curves(model, wv, root)))
    assert found.objective < start.objective
    assert found.objective == pytest.approx(other.objective, rel=1e-7)
    pack = compiled.design.pack
    np.testing.assert_allclose(pack(found.shapes), pack(other.shapes), atol=1e-4)
    np.testing.assert_allclose(found.x, compiled.at(found.shapes).x, rtol=1e-8)


def test_curves_beside_a_term_are_those_of_terms_of_a_model(wv):
    """They take what is theirs, in both searches; a step stays within its reach."""
    root = weight_root(dictionary_fit(wv, wv.variance).covariance)
    low_pass = gmwm.LowPassNoise(order=2.0, damping=0.7)
    others = (gmwm.WhiteNoise(), gmwm.Resonance(frequency=1.0, damping=0.05), gmwm.RandomWalk())
    whole = Design(gmwm.Model((low_pass, *others)), Scales.of(wv))
    shapes = [(6.0, 2.0, 0.7), (), (1.0, 0.05), ()]
    beside = whole.curves(shapes)[:, 1:]
    design = Design(gmwm.Model((low_pass,)), Scales.of(wv))
    alone = Profile(design, wv.variance, root, beside)
    start = alone.at(shapes[:1])
    found = alone.refine(start)
    together = Profile(whole, wv.variance, root)
    expected = together.refine(together.at(shapes))
    stepwise = by_any_curves(gmwm.Model((low_pass,)), wv, root, beside).refine(start)
    for other in (expected, stepwise):
        assert found.objective == pytest.approx(other.objective, rel=1e-7)
        assert found.shapes[0][0] == pytest.approx(other.shapes[0][0], rel=1e-4)
    assert abs(np.log(found.shapes[0][0] / 6.0)) > 0.2
    near = alone.refine(start, 0.1)
    assert abs(np.log(near.shapes[0][0] / 6.0)) == pytest.approx(0.1, rel=1e-6)


def test_an_estimation_is_searched_once_and_does_not_keep_the_series(monkeypatch):
    x = (gmwm.WhiteNoise(0.2) + gmwm.GaussMarkov(0.05, 4.0)).simulate(20_000, 0.01, seed=5)
    data = gmwm.wavelet_variance(x, 0.01)
    searched = []
    real = GMWM._solve
    monkeypatch.setattr(GMWM, "_solve", lambda *args: searched.append(args[1]) or real(*args))
    model = gmwm.WhiteNoise() + gmwm.GaussMarkov()
    first, second = gmwm.fit(model, data), gmwm.fit(model, data)
    assert searched.count(model) == 1
    assert first.to_dict() == second.to_dict()
    gmwm.fit(model, data, weights="diagonal")
    assert searched.count(model) == 1
    kept = weakref.ref(data)
    searched.clear()
    del data, first, second
    gc.collect()
    assert kept() is None
