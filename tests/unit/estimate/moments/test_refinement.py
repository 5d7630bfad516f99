"""The search for shapes; what of fits is found once."""

import gc
import weakref

import numpy as np
import pytest

import gmwm
from gmwm.estimate.moments import GMWM, Design, Profile, dictionary_fit
from gmwm.estimate.problem import Scales, weight_root


@pytest.fixture(scope="module")
def wv():
    truth = gmwm.WhiteNoise(0.02) + gmwm.LowPassNoise(0.2, 12.0, 2.0, 0.7)
    truth += gmwm.Resonance(0.05, 1.0, 0.05) + gmwm.GaussMarkov(0.05, 40.0)
    return gmwm.wavelet_variance(truth.simulate(200_000, 0.01, seed=3), 0.01)


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
def test_a_refinement_ends_where_no_step_gains(model, shapes, wv):
    root = weight_root(dictionary_fit(wv, wv.variance).covariance)
    profile = Profile(Design(model, Scales.of(wv)), wv.variance, root)
    start = profile.at(shapes)
    found = profile.refine(start)
    assert found.objective < start.objective
    z, design = profile.design.pack(found.shapes), profile.design
    for step in 1e-3 * np.vstack([np.eye(z.size), -np.eye(z.size)]):
        assert profile.at(design.unpack(z + step, found.shapes)).objective > found.objective - 1e-6
    np.testing.assert_allclose(found.x, profile.at(found.shapes).x, rtol=1e-8)


def test_curves_beside_a_term_are_those_of_terms_of_a_model(wv):
    """They take what is theirs; a step stays within its reach."""
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
    assert found.objective == pytest.approx(expected.objective, rel=1e-7)
    assert found.shapes[0][0] == pytest.approx(expected.shapes[0][0], rel=1e-4)
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
