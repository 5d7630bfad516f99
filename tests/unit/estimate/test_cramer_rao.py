"""Cramer-Rao bounds against dense algebra, published numbers and each other."""

import numpy as np
import pytest

import gmwm
from gmwm import BiasInstability, GaussMarkov, RandomWalk, RateRamp, WhiteNoise, cramer_rao
from gmwm.estimate.problem.information import spectral_information
from gmwm.estimate.problem.parameters import Coordinates

MODELS = {
    "white": WhiteNoise(0.3),
    "white + walk": WhiteNoise(0.2) + RandomWalk(0.05),
    "white + Gauss-Markov": WhiteNoise(0.8) + GaussMarkov(0.5, 6.0),
    "quantization + Gauss-Markov": gmwm.QuantizationNoise(0.5) + GaussMarkov(0.5, 10.0),
    "autoregression": gmwm.AR([0.7, -0.2], 1.3) + WhiteNoise(0.4),
    "resonance": gmwm.Resonance(1.0, 0.1, 0.2) + WhiteNoise(0.5),
}


def dense_covariance(processes, n, dt):
    """Covariance of the first differences of n samples."""
    space = gmwm.StateSpace.stack([process.state_space(dt) for process in processes])
    p = space.n_states
    full = np.zeros((n * p, n * p))
    covariance = space.initial_covariance
    for k in range(n):
        block = covariance
        for later in range(k, n):
            full[later * p : (later + 1) * p, k * p : (k + 1) * p] = block
            full[k * p : (k + 1) * p, later * p : (later + 1) * p] = block.T
            block = space.transition @ block
        covariance = space.transition @ covariance @ space.transition.T + space.process_noise
    output = np.kron(np.eye(n), space.output)
    series = output @ full @ output.T + space.measurement_noise * np.eye(n)
    difference = np.diff(np.eye(n), axis=0)
    return difference @ series @ difference.T


def keys_of(bound, coordinates):
    by_term = {(i.term, i.parameter.name): i.key for i in bound.model.parameters}
    return [by_term[coordinates.terms[i].place, name] for i, name in coordinates.names]


@pytest.mark.parametrize("name", MODELS)
def test_exact_information_equals_dense_algebra_on_the_differences(name):
    model = gmwm.Model(MODELS[name].terms) if isinstance(MODELS[name], gmwm.Model) else MODELS[name]
    n, dt, step = 40, 0.5, 1e-4
    bound = cramer_rao(model, n, dt)
    assert bound.exact
    terms = bound.model.terms
    coordinates = Coordinates(bound.model.opened())
    z = coordinates.pack(terms)
    centre = dense_covariance(terms, n, dt)
    relative = []
    for k in range(z.size):
        pair = []
        for sign in (1.0, -1.0):
            moved = z.copy()
            moved[k] += sign * step
            pair.append(dense_covariance(coordinates.processes(moved, terms), n, dt))
        relative.append(np.linalg.solve(centre, (pair[0] - pair[1]) / (2.0 * step)))
    information = 0.5 * np.array([[np.trace(a @ b) for b in relative] for a in relative])
    jacobian = coordinates.jacobian(terms)
    expected = jacobian @ np.linalg.inv(information) @ jacobian.T
    names = keys_of(bound, coordinates)
    order = [names.index(key) for key in bound.keys]
    np.testing.assert_allclose(bound.covariance, expected[np.ix_(order, order)], rtol=2e-4)


@pytest.mark.parametrize(
    ("truth", "n", "relative"),
    [
        (
            WhiteNoise(0.2) + RandomWalk(0.02) + RateRamp(0.003),
            6000,
            {"N": 0.01924 / 2, "K": 0.1172 / 2, "R": 0.0862},
        ),
        (
            WhiteNoise(0.8) + GaussMarkov(0.5, 125.0) + RateRamp(0.001),
            6000,
            {"tau": 0.2603, "sigma": 0.2155 / 2, "N": 0.01911 / 2, "R": 0.0560},
        ),
        (
            GaussMarkov(29.5e-6**0.5, 0.5)
            + GaussMarkov(4.5e-6**0.5, 20.0)
            + GaussMarkov(2.5e-6**0.5, 125.0),
            1_000_000,
            {
                "tau_3": 0.0810,
                "sigma_3": 0.0723 / 2,
                "tau_2": 0.0429,
                "sigma_2": 0.0364 / 2,
                "tau_1": 0.00473,
                "sigma_1": 0.00185 / 2,
            },
        ),
    ],
)
def test_bounds_of_the_papers_scenarios(truth, n, relative):
    bound = cramer_rao(truth, n, 1.0)
    assert bound.exact == (n == 6000)
    for key, value in relative.items():
        assert bound.stderr[key] / truth.params[key] == pytest.approx(value, rel=3e-3)


@pytest.mark.parametrize("name", MODELS)
def test_spectral_information_tends_to_the_exact_one(name):
    model = MODELS[name] if isinstance(MODELS[name], gmwm.Model) else gmwm.Model((MODELS[name],))
    n, dt = 4000, 0.1
    bound = cramer_rao(model, n, dt)
    assert bound.exact
    coordinates = Coordinates(model.opened())
    spectral = np.linalg.inv(spectral_information(coordinates, model.terms, n, dt))
    scale = np.sqrt(
        np.diag(coordinates.jacobian(model.terms) @ spectral @ coordinates.jacobian(model.terms).T)
    )
    for key, value in zip(keys_of(bound, coordinates), scale, strict=True):
        assert value == pytest.approx(bound.stderr[key], rel=0.05)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("n", [1001, 5000])
def test_wavelet_variances_know_no_more_than_the_series(name, n):
    bound = cramer_rao(MODELS[name], n, 0.01)
    for key in bound.keys:
        # One per cent for the approximation of the covariance at coarse levels.
        assert bound.wavelet_stderr[key] > 0.99 * bound.stderr[key]


@pytest.mark.parametrize(
    ("model", "n"),
    [
        (WhiteNoise(0.2) + RandomWalk(0.02) + RateRamp(1e-3), 20_000),
        (WhiteNoise(1.0) + GaussMarkov(1.0, 1000.0) + RateRamp(1e-3), 6000),
        (WhiteNoise(1.0) + BiasInstability(1.0) + RandomWalk(0.01) + RateRamp(1e-3), 20_000),
        (WhiteNoise(1.0) + BiasInstability(0.1) + RandomWalk(1e-3), 5000),
    ],
)
def test_no_direction_of_the_wavelet_bound_is_below_the_other(model, n):
    bound = cramer_rao(model, n, 1.0)
    scale = np.sqrt(np.diag(bound.covariance))
    excess = (bound.wavelet_covariance - bound.covariance) / np.outer(scale, scale)
    assert np.min(np.linalg.eigvalsh(excess)) > -1e-6
    for key in bound.keys:
        assert bound.wavelet_stderr[key] >= bound.stderr[key] * (1.0 - 1e-9)


@pytest.mark.parametrize(
    ("model", "n", "relative"),
    [
        (WhiteNoise(0.2) + RandomWalk(0.02), 1000, 0.01),
        (WhiteNoise(1.0) + RandomWalk(0.003), 4000, 0.01),
        (WhiteNoise(1.0) + GaussMarkov(1.0, 300.0), 4000, 0.05),
        (gmwm.Model((GaussMarkov(1.0, 50.0),)), 1000, 0.03),
    ],
)
def test_spectral_information_holds_for_what_shows_at_the_lowest_frequencies(model, n, relative):
    bound = cramer_rao(model, n, 1.0)
    assert bound.exact
    coordinates = Coordinates(model.opened())
    information = spectral_information(coordinates, model.terms, n, 1.0)
    jacobian = coordinates.jacobian(model.terms)
    spectral = np.sqrt(np.diag(jacobian @ np.linalg.inv(information) @ jacobian.T))
    for key, value in zip(keys_of(bound, coordinates), spectral, strict=True):
        assert value == pytest.approx(bound.stderr[key], rel=relative)


def test_separated_gauss_markov_processes_cost_the_moments_one_per_cent():
    model = GaussMarkov(1.0, 0.5) + GaussMarkov(1.0, 20.0)
    bound = cramer_rao(model, 1_000_000, 1.0)
    for key in bound.keys:
        assert 0.999 < bound.wavelet_stderr[key] / bound.stderr[key] < 1.01


def test_white_noise_beside_a_time_near_dt_costs_more():
    model = WhiteNoise(0.02) + GaussMarkov(1.0, 0.01) + GaussMarkov(1.0, 0.1)
    bound = cramer_rao(model, 1_000_000, 0.01)
    assert 1.1 < bound.wavelet_stderr["N"] / bound.stderr["N"] < 1.3


def test_white_noise_alone_has_the_chi_square_bound():
    n = 1000
    bound = cramer_rao(WhiteNoise(2.0), n, 0.01)
    assert bound.stderr["N"] == pytest.approx(2.0 / np.sqrt(2.0 * (n - 1)), rel=1e-6)


def test_slope_of_white_noise_has_the_regression_bound():
    n, dt = 1000, 0.1
    bound = cramer_rao(WhiteNoise(2.0) + RateRamp(-1.0), n, dt)
    variance = (2.0**2 / dt) * 12.0 / (n * (n**2 - 1.0)) / dt**2
    assert bound.stderr["R"] == pytest.approx(np.sqrt(variance), rel=1e-9)


def test_bound_falls_with_the_length_of_the_record():
    model = WhiteNoise(0.8) + GaussMarkov(0.5, 5.0)
    previous = None
    for n in (100, 333, 1000, 4097, 100_000, 3_000_001):
        bound = cramer_rao(model, n, 0.1)
        if previous is not None:
            assert all(bound.stderr[key] < previous.stderr[key] for key in bound.keys)
        previous = bound


def test_flicker_noise_and_own_spectra_take_the_spectral_way():
    class Own(gmwm.Process):
        level: float = gmwm.parameter("u", role="scale")

        def psd(self, f, dt):
            return np.full_like(f, self.level**2)

    assert not cramer_rao(WhiteNoise(0.1) + BiasInstability(0.01), 1000, 1.0).exact
    own = cramer_rao(Own(level=3.0), 1000, 1.0)
    assert not own.exact
    assert own.stderr["level"] == pytest.approx(3.0 / np.sqrt(2000.0), rel=2e-3)


@pytest.mark.parametrize(
    ("model", "n", "dt", "words"),
    [
        (WhiteNoise(), 100, 1.0, "free parameters"),
        (WhiteNoise(1.0), 7, 1.0, "n = 7"),
        (WhiteNoise(1.0), 100.5, 1.0, "n = 100.5"),
        (WhiteNoise(1.0), 100, 0.0, "dt = 0.0"),
        (WhiteNoise(1.0), 100, float("nan"), "dt = nan"),
        (WhiteNoise(1.0) + RandomWalk(0.0), 100, 1.0, "K is zero"),
        (WhiteNoise(1.0) + gmwm.Sinusoid(1.0, 0.1), 100, 1.0, "Sinusoid"),
        (RateRamp(1.0), 100, 1.0, "no noise process"),
        ("white", 100, 1.0, "'white' is not a term"),
    ],
)
def test_bad_input_is_one_sentence(model, n, dt, words):
    with pytest.raises(gmwm.InputError, match=words):
        cramer_rao(model, n, dt)
