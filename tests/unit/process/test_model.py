"""Sums, parameters, identifiability and what is said when they are wrong."""

import inspect
import pickle

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

import gmwm
from gmwm import AR, ARIMA, ARMA, GaussMarkov, RandomWalk, Resonance, Sinusoid, WhiteNoise
from gmwm.process import CATALOGUE, as_model
from gmwm.process.model import model_from_list


def test_repr_is_readable_and_evaluates_back():
    model = WhiteNoise(N=0.2) + 2 * GaussMarkov() + RandomWalk(1e-3)
    assert repr(model) == "WhiteNoise(N=0.2) + 2 * GaussMarkov() + RandomWalk(K=0.001)"
    assert eval(repr(model), vars(gmwm) | {k: getattr(gmwm, k) for k in gmwm.__all__}) == model


@pytest.mark.parametrize(
    "process",
    [
        AR([0.5, 0.1], 2.0),
        ARMA(2, 1),
        ARIMA(1),
        ARIMA([0.5], 1, [0.2], 1.0),
        Resonance(1.0, 2.0, 0.1),
    ],
    ids=repr,
)
def test_processes_survive_pickle_repr_and_json(process):
    scope = {k: getattr(gmwm, k) for k in gmwm.__all__}
    assert pickle.loads(pickle.dumps(process)) == process
    assert eval(repr(process), scope) == process
    assert model_from_list([process.to_dict()]).terms == (process,)
    assert ARIMA(1).d == 0


def test_parameters_are_numbered_only_where_they_have_to_be():
    one = WhiteNoise() + GaussMarkov() + Resonance()
    assert list(one.params) == [
        "N", "sigma", "tau", "resonance_sigma", "resonance_frequency", "resonance_damping",
    ]  # fmt: skip
    two = WhiteNoise() + 2 * GaussMarkov()
    assert list(two.params) == ["N", "sigma_1", "tau_1", "sigma_2", "tau_2"]


def test_gauss_markov_terms_stand_by_rising_time():
    model = GaussMarkov(1.0, 50.0) + WhiteNoise(0.1) + GaussMarkov(2.0, 5.0)
    assert model.params == {"sigma_1": 2.0, "tau_1": 5.0, "N": 0.1, "sigma_2": 1.0, "tau_2": 50.0}


def test_moments_of_a_sum_are_sums_of_moments():
    parts = (WhiteNoise(0.3), GaussMarkov(1.0, 7.0), RandomWalk(0.01))
    model = parts[0] + parts[1] + parts[2]
    tau, f = np.array([1.0, 8.0, 64.0]), np.array([0.01, 0.2])
    np.testing.assert_allclose(
        model.haar_variance(tau, 1.0), sum(p.haar_variance(tau, 1.0) for p in parts)
    )
    np.testing.assert_allclose(model.psd(f, 1.0), sum(p.psd(f, 1.0) for p in parts))
    assert model.state_space(1.0).n_states == 2
    assert model.state_space(1.0).measurement_noise == pytest.approx(0.09)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: WhiteNoise(1) + WhiteNoise(2), "two WhiteNoise .* keep one"),
        (lambda: 2 * RandomWalk(), "two RandomWalk"),
        (lambda: 2 * GaussMarkov(1.0, 2.0), "two GaussMarkov of equal tau = 2"),
        (lambda: Sinusoid(1.0, 3.0) + Sinusoid(2.0, 3.0), "equal frequency = 3"),
        (lambda: GaussMarkov(sigma=-1.0), r"sigma = -1 is out of range"),
        (lambda: GaussMarkov(tau=0.0), "tau = 0 is out of range"),
        (lambda: WhiteNoise(float("nan")), "N = nan is out of range"),
        (lambda: WhiteNoise("a"), "give a number"),
        (lambda: Resonance(1.0, 1.0, 1.5), r"damping = 1.5 is out of range"),
        (lambda: AR([1.1]), "not stationary"),
        (lambda: ARMA([0.1], [2.0]), "not invertible"),
        (lambda: ARIMA(0, 3), "d = 3"),
        (lambda: AR("two"), "give an order"),
        (lambda: 0 * WhiteNoise(), "must be 1 or more"),
        (lambda: True * WhiteNoise(), "must be 1 or more"),
        (lambda: 1 + WhiteNoise(), "not|no "),
        (lambda: WhiteNoise().simulate(10, 1.0), "free parameters"),
        (lambda: WhiteNoise(1.0).simulate(0, 1.0), "1 or more"),
        (lambda: WhiteNoise(1.0).simulate(5, -1.0), "positive sampling interval"),
        (lambda: (WhiteNoise() + RandomWalk()).psd(np.ones(1), 1.0), "free parameters .N, K."),
        (lambda: (WhiteNoise() + RandomWalk()).with_params({"Z": 1.0}), "no parameter 'Z'"),
        (lambda: ARIMA([0.1], 2, 0, 1.0).haar_variance(np.ones(1), 1.0), "d = 0 or 1"),
        (lambda: gmwm.simulate("noise", 5, 1.0), "'noise' is not a term"),
        (lambda: gmwm.simulate([WhiteNoise(1.0)], 5, 1.0), "not an error model: write one like"),
        (lambda: model_from_list([{"process": "Nonsense"}]), "unknown process 'Nonsense'"),
    ],
)
def test_what_is_wrong_is_said(build, words):
    with pytest.raises(gmwm.InputError, match=words):
        build()


def test_the_least_that_is_right():
    noise = WhiteNoise(1.0)
    assert 1 * noise == as_model(noise) == sum([noise])
    assert noise.simulate(1, 1.0, 3).shape == (1,)


def test_instances_do_not_change():
    with pytest.raises(AttributeError, match="does not change"):
        WhiteNoise(1.0).N = 2.0
    with pytest.raises(AttributeError, match="does not change"):
        (WhiteNoise(1.0) + RandomWalk(1.0)).terms = ()


def test_partial_autocorrelations_are_a_bijection():
    process = ARMA(3, 2)
    z = np.array([0.3, -1.2, 0.7, 2.0, -0.4])
    np.testing.assert_allclose(process.shape_to_free(process.shape_from_free(z)), z, rtol=1e-9)


@given(hnp.arrays(float, 5, elements=st.floats(-40.0, 40.0)))
def test_every_point_of_the_real_line_is_a_stationary_process(z):
    """Rounding takes roots that nearly coincide onto the unit circle."""
    for process in (ARMA(3, 2), ARMA(5, 0), ARMA(0, 5)):
        shape = process.shape_from_free(z)
        process.at_unit(shape)
        assert np.all(np.isfinite(process.shape_to_free(shape)))


def test_a_process_times_a_number_is_that_many_terms():
    assert 1 * gmwm.GaussMarkov() == gmwm.Model([gmwm.GaussMarkov()])
    assert len((3 * gmwm.GaussMarkov()).terms) == 3
    for times in (0, -1, True, 1.0):
        with pytest.raises(gmwm.InputError, match="1 or more, whole"):
            times * gmwm.GaussMarkov()


@pytest.mark.parametrize("kind", CATALOGUE, ids=lambda kind: kind.__name__)
def test_a_value_more_than_a_process_has_parameters_is_refused(kind):
    full = [1.0] * len(inspect.signature(kind).parameters)
    with pytest.raises(gmwm.InputError, match="its parameters are"):
        kind(*full, 1.0)


# -- models as text -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "model"),
    [
        ("N + K + 2 GM", WhiteNoise() + RandomWalk() + 2 * GaussMarkov()),
        ("2GM+N", 2 * GaussMarkov() + WhiteNoise()),
        ("WhiteNoise() + 2 * GaussMarkov()", WhiteNoise() + 2 * GaussMarkov()),
    ],
)
def test_a_text_is_a_model(text, model):
    assert as_model(text) == model == as_model(repr(model))


def test_the_latest_process_of_a_name_of_ones_own_is_meant():
    def defined(power):
        class Tinted(gmwm.Process):
            level: float = gmwm.parameter("u", role="scale")

            def psd(self, f, dt):
                return self.level**2 * f**power

        return Tinted

    first, second = defined(-0.5), defined(-1.0)
    model = as_model("N + 1 Tinted")
    assert type(model.terms[1]) is second is not first
    with pytest.raises(gmwm.InputError, match=r"write .*, Tinted, "):
        as_model("N + Colored")


def test_open_parameters_are_shown_as_they_are_given():
    with pytest.raises(gmwm.InputError) as error:
        gmwm.simulate("N + GM", n=10, rate=100)
    written = str(error.value).partition("give values, ")[2]
    scope = {"WhiteNoise": WhiteNoise, "GaussMarkov": GaussMarkov}
    assert not eval(written.replace("...", "1.0"), scope).is_open


def test_a_repr_has_four_digits_and_a_document_all():
    model = WhiteNoise(1 / 3) + GaussMarkov(2 / 3, 1e5 / 3) + AR([1 / 3], 1 / 7)
    assert repr(model.terms[0]) == "WhiteNoise(N=0.3333)"
    assert repr(model.terms[1]) == "GaussMarkov(sigma=0.6667, tau=3.333e+04)"
    assert repr(model.terms[2]) == "AR(ar=[0.3333], sigma2=0.1429)"
    assert model_from_list([term.to_dict() for term in model.terms]) == model
