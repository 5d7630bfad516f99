"""Open parameters as a point of the real space, and back."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gmwm
from gmwm import AR, ARMA, GaussMarkov, RandomWalk, RateRamp, Sinusoid, WhiteNoise
from gmwm.errors import InputError
from gmwm.estimate.problem.parameters import Coordinates, keys_by_term
from gmwm.process import CATALOGUE, Model, as_model

EXAMPLES = [p for kind in CATALOGUE if kind is not RateRamp for p in kind.examples()]
examples = pytest.mark.parametrize("process", EXAMPLES, ids=repr)


def opened(process):
    return Coordinates(as_model(process).opened())


def values(processes):
    return np.array([float(v) for p in processes for v in p.values.values()])


def in_order(coordinates, processes):
    """Values of the free parameters in the order of the coordinates."""
    return np.array([processes[i].values[name] for i, name in coordinates.names])


@examples
def test_every_example_comes_back(process):
    coordinates = opened(process)
    z = coordinates.pack([process])
    assert np.all(np.isfinite(z))
    assert len(coordinates.names) == len(coordinates.owners) == z.size == len(process.values)
    (back,) = coordinates.processes(z, [process])
    assert type(back) is type(process)
    np.testing.assert_allclose(values([back]), values([process]), rtol=1e-9, atol=1e-12)


@given(st.sampled_from(EXAMPLES), st.lists(st.floats(-3.0, 3.0), min_size=5, max_size=5))
@settings(max_examples=200, deadline=None)
def test_every_point_near_an_example_is_a_process_and_comes_back(process, steps):
    coordinates = opened(process)
    z = coordinates.pack([process])
    z = z + np.array(steps[: z.size])
    # Partial autocorrelations within 1e-9 of one are too close to hold more digits.
    z = np.where([name[:3] in ("ar_", "ma_") for _, name in coordinates.names],
                 np.clip(z, -4.0, 4.0), z)  # fmt: skip
    moved = coordinates.processes(z, [process])
    np.testing.assert_allclose(coordinates.pack(moved), z, rtol=1e-7, atol=1e-6)


@given(st.sampled_from(EXAMPLES), st.lists(st.floats(-0.5, 0.5), min_size=5, max_size=5))
@settings(max_examples=100, deadline=None)
def test_the_jacobian_is_that_of_finite_differences(process, steps):
    coordinates = opened(process)
    z = coordinates.pack([process])
    z = z + np.array(steps[: z.size])
    moved = coordinates.processes(z, [process])
    columns = []
    for k in range(z.size):
        step = np.zeros(z.size)
        step[k] = 1e-4
        ends = [
            in_order(coordinates, coordinates.processes(z + sign * step, moved))
            for sign in (2.0, 1.0, -1.0, -2.0)
        ]
        columns.append((8.0 * (ends[1] - ends[2]) - (ends[0] - ends[3])) / 1.2e-3)
    jacobian = coordinates.jacobian(moved)
    scale = np.max(np.abs(jacobian), axis=1, keepdims=True)
    np.testing.assert_allclose(jacobian / scale, np.stack(columns, axis=1) / scale, atol=1e-5)


def test_amplitudes_are_logarithms_of_powers():
    coordinates = opened(GaussMarkov(2.0, 5.0) + AR([0.5], 0.3) + WhiteNoise(0.1))
    z = coordinates.pack([GaussMarkov(2.0, 5.0), AR([0.5], 0.3), WhiteNoise(0.1)])
    np.testing.assert_allclose(
        z, [np.log(4.0), np.log(5.0), np.log(0.3), np.arctanh(0.5), np.log(0.01)]
    )
    assert coordinates.names == [(0, "sigma"), (0, "tau"), (1, "sigma2"), (1, "ar_1"), (2, "N")]
    assert [is_amplitude for _, is_amplitude in coordinates.owners] == [True, False] * 2 + [True]


@pytest.mark.parametrize(
    ("model", "names"),
    [
        (WhiteNoise() + GaussMarkov(tau=20.0), [(0, "N"), (1, "sigma")]),
        (WhiteNoise(0.3) + GaussMarkov(sigma=0.5), [(1, "tau")]),
        (WhiteNoise(0.3) + RandomWalk() + RateRamp(), [(1, "K")]),
        (RateRamp() + Sinusoid(frequency=0.1) + WhiteNoise(), [(0, "amplitude"), (1, "N")]),
        (WhiteNoise(0.3) + RateRamp(), []),
        (WhiteNoise() + ARMA([0.5], [0.2]), [(0, "N"), (1, "sigma2")]),
    ],
    ids=repr,
)
def test_given_parameters_and_ramps_take_no_part(model, names):
    coordinates = Coordinates(model)
    assert coordinates.names == names
    assert all(not isinstance(term, RateRamp) for term in coordinates.noise)
    assert [model.terms[term.place] for term in coordinates.terms] == list(coordinates.noise)
    filled = {"N": 0.2, "sigma": 0.4, "tau": 7.0, "K": 0.1, "amplitude": 2.0, "sigma2": 0.6}
    like = [
        t.with_values(**{k: filled[k] for k, v in t.values.items() if v is None})
        for t in coordinates.noise
    ]
    z = coordinates.pack(like)
    assert z.shape == (len(names),)
    moved = coordinates.processes(z + 0.1, like)
    for term, before, after in zip(coordinates.noise, like, moved, strict=True):
        for key, value in term.values.items():
            if value is None:
                assert after.values[key] > before.values[key]
            else:
                assert after.values[key] == value
    assert coordinates.jacobian(like).shape == (len(names),) * 2


def test_a_model_without_noise_is_refused():
    with pytest.raises(InputError, match="no noise process"):
        Coordinates(as_model(RateRamp()))


def test_terms_can_be_left_out():
    model = RateRamp() + WhiteNoise() + GaussMarkov() + RandomWalk()
    coordinates = Coordinates(model)
    assert coordinates.without([]).names == coordinates.names
    rest = coordinates.without([1])
    assert rest.names == [(0, "N"), (1, "K")]
    assert rest.model == RateRamp() + WhiteNoise() + RandomWalk()


def test_keys_follow_terms_that_change_places():
    model = Model((GaussMarkov(), WhiteNoise(), GaussMarkov()))
    found = [GaussMarkov(1.0, 50.0), WhiteNoise(0.3), GaussMarkov(2.0, 5.0)]
    coordinates = Coordinates(model)
    fitted, keys = coordinates.fitted(found)
    assert fitted.params == {"sigma_1": 2.0, "tau_1": 5.0, "N": 0.3, "sigma_2": 1.0, "tau_2": 50.0}
    assert keys == ["sigma_2", "tau_2", "N", "sigma_1", "tau_1"]
    assert set(keys) == set(keys_by_term(fitted).values())
    for (place, name), key in zip(coordinates.names, keys, strict=True):
        assert fitted.params[key] == found[place].values[name]


@pytest.mark.parametrize(
    "process", [GaussMarkov(0.5, 20.0), gmwm.Resonance(0.4, 0.2, 0.05), WhiteNoise(0.2)], ids=repr
)
def test_a_point_out_of_range_is_no_crash(process):
    """What has no process there says so as for any other value out of range."""
    coordinates = opened(process)
    at = coordinates.pack([process])
    for k, z in [(k, z) for k in range(at.size) for z in (-800.0, 800.0)]:
        point = at.copy()
        point[k] = z
        try:
            coordinates.processes(point, [process])
        except InputError as error:
            assert "out of range" in str(error)
