"""Expectation-maximization: it climbs, and it arrives at the maximum of the likelihood."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.optimize import minimize

import gmwm
from gmwm import AR, ARIMA, GaussMarkov, RandomWalk, RateRamp, Resonance, Sinusoid, WhiteNoise
from gmwm.errors import InputError
from gmwm.estimate.likelihood.em import _gauss_markov, expect
from gmwm.estimate.likelihood.likelihood import Columns, KalmanLikelihood, stacked
from gmwm.process import as_model


def em(model, x, dt=1.0, **options):
    return gmwm.fit(model, x, dt=dt, method=gmwm.EM(**options))


def falls(trace):
    """Largest loss from one log-likelihood to the next."""
    return float(-np.min(np.diff(trace), initial=0.0))


def amplitudes(low, high):
    return st.floats(np.log(low), np.log(high)).map(lambda z: float(np.exp(z)))


@st.composite
def climbs(draw):
    """A model of white noise, a walk and Gauss-Markov processes, a start, and a series."""
    terms, start = [], []
    if draw(st.booleans()):
        terms.append(WhiteNoise(draw(amplitudes(0.1, 3.0))))
        start.append(WhiteNoise(draw(amplitudes(0.03, 10.0))))
    if draw(st.booleans()):
        terms.append(RandomWalk(draw(amplitudes(1e-3, 1.0))))
        start.append(RandomWalk(draw(amplitudes(1e-3, 3.0))))
    for low, high in ((1.0, 10.0), (15.0, 200.0))[: draw(st.integers(1, 2))]:
        terms.append(GaussMarkov(draw(amplitudes(0.1, 3.0)), draw(amplitudes(low, high))))
        start.append(GaussMarkov(draw(amplitudes(0.1, 3.0)), draw(amplitudes(low, high))))
    if draw(st.booleans()):
        terms.append(RateRamp(draw(st.floats(-0.1, 0.1))))
        start.append(RateRamp(0.0))
    model, first = (gmwm.process.Model(tuple(t)) for t in (terms, start))
    x = model.simulate(draw(st.integers(30, 120)), 1.0, draw(st.integers(0, 2**32)))
    if draw(st.booleans()):
        x[draw(st.lists(st.integers(20, x.size - 1), max_size=8))] = np.nan
    return model, first, x


@given(climbs())
@settings(max_examples=8, deadline=None)
def test_the_likelihood_never_falls(case):
    model, start, x = case
    fit = em(model.opened(), x, start=start, accelerate=False, max_iterations=10)
    assert falls(fit.trace) < 1e-8 * max(abs(fit.trace[-1]), 1.0)
    likelihood = KalmanLikelihood(
        Columns(x, 1.0, None, any(isinstance(t, RateRamp) for t in model.terms))
    )
    noise = [t for t in start.terms if not isinstance(t, RateRamp)]
    assert fit.trace[0] >= likelihood(noise) - 1e-7
    found = [t for t in fit.model.terms if not isinstance(t, RateRamp)]
    # Terms that the likelihood can do without, to 1e-4 of it, are set to zero at the end.
    vanished = sum(fit.params[key] == 0.0 for key in fit.upper_bounds)
    allowed = 1e-7 + 1e-4 * vanished
    assert fit.trace[-1] == pytest.approx(likelihood(found), rel=1e-9, abs=allowed)
    assert fit.log_likelihood == fit.trace[-1]


@pytest.mark.parametrize("dt", [1.0, 0.01])
@pytest.mark.parametrize("far", [0.2, 5.0])
def test_it_arrives_at_the_maximum_from_a_bad_start(far, dt):
    unit = np.sqrt(dt)
    truth = WhiteNoise(0.5 * unit) + RandomWalk(0.1 / unit)
    x = truth.simulate(1000, dt, seed=3)
    exact = gmwm.fit(truth.opened(), x, dt=dt, method="mle")
    start = WhiteNoise(0.5 * far * unit) + RandomWalk(0.1 / far / unit)
    fit = em(truth.opened(), x, dt=dt, start=start)
    assert fit.valid, fit.message
    assert fit.log_likelihood == pytest.approx(exact.log_likelihood, abs=1e-3)
    for key, error in exact.stderr.items():
        assert fit.params[key] == pytest.approx(exact.params[key], abs=0.05 * error)
        assert fit.stderr[key] == pytest.approx(error, rel=0.03)


@pytest.mark.parametrize(
    "truth",
    [
        WhiteNoise(0.5) + GaussMarkov(1.0, 20.0),
        WhiteNoise(0.5) + GaussMarkov(1.0, 20.0) + RateRamp(2e-3),
        GaussMarkov(1.0, 2.0) + GaussMarkov(1.0, 60.0),
        WhiteNoise(0.5) + RandomWalk(0.05) + RateRamp(1e-2),
        as_model(GaussMarkov(1.0, 20.0)),
        as_model(WhiteNoise(1.0)),
    ],
    ids=repr,
)
@pytest.mark.parametrize("missing", [0, 150], ids=["complete", "gaps"])
def test_it_finds_the_estimates_of_maximum_likelihood(truth, missing):
    x = truth.simulate(1500, 1.0, seed=4)
    x[np.random.default_rng(1).choice(1500, missing, replace=False)] = np.nan
    exact = gmwm.fit(truth.opened(), x, dt=1.0, method="mle")
    fit = em(truth.opened(), x)
    assert fit.valid, fit.message
    for key, error in exact.stderr.items():
        assert fit.params[key] == pytest.approx(exact.params[key], abs=0.05 * error)
        assert fit.stderr[key] == pytest.approx(error, rel=0.03)


def test_an_amplitude_that_has_hardly_risen_is_no_crash():
    model = RandomWalk() + GaussMarkov()
    x = (RandomWalk(1.0) + GaussMarkov(1.0, 1.0)).simulate(30, 1.0, seed=0)
    start = RandomWalk(2.5e-3) + GaussMarkov(1.0, 1.0)
    assert em(model, x, start=start, accelerate=False, max_iterations=15).message


def test_extrapolation_saves_steps_and_changes_nothing():
    truth = WhiteNoise(0.5) + GaussMarkov(1.0, 20.0)
    x = truth.simulate(1000, 1.0, seed=6)
    start = WhiteNoise(1.0) + GaussMarkov(0.5, 60.0)
    plain = em(truth.opened(), x, start=start, accelerate=False, tolerance=1e-11)
    fast = em(truth.opened(), x, start=start)
    assert len(fast.trace) < 0.5 * len(plain.trace)
    for key, error in plain.stderr.items():
        assert fast.params[key] == pytest.approx(plain.params[key], abs=0.05 * error)


@pytest.mark.parametrize("accelerate", [True, False])
def test_iterations_that_run_out_are_no_valid_fit(accelerate):
    truth = WhiteNoise(0.5) + GaussMarkov(1.0, 20.0)
    x = truth.simulate(1000, 1.0, seed=6)
    start = WhiteNoise(3.0) + GaussMarkov(0.1, 100.0)
    for most in (1, 2, 5):
        fit = em(truth.opened(), x, start=start, max_iterations=most, accelerate=accelerate)
        assert not fit.valid
        assert "EM did not converge" in fit.message
        assert "converged" in fit.reasons
        assert len(fit.trace) == most


# -- a drift of the state -------------------------------------------------------------------------


def test_a_drift_of_a_walk_is_a_ramp_of_the_signal():
    truth = WhiteNoise(0.5) + RandomWalk(0.05) + RateRamp(0.03)
    x = truth.simulate(1000, 1.0, seed=7)
    ramp = em(truth.opened(), x)
    state = em(truth.opened(), x, drift="state")
    for key, error in ramp.stderr.items():
        assert state.params[key] == pytest.approx(ramp.params[key], abs=0.2 * error)
    assert falls(state.trace) < 1e-8 * abs(state.trace[-1])


@pytest.mark.parametrize("order", [1, -1])
def test_a_drift_of_a_gauss_markov_state_is_forgotten(order):
    """x[k+1] = phi x[k] + R dt + w[k]: its mean rises to R dt / (1 - phi)."""
    tau, rate, n = 50.0, 0.05, 2000
    phi = np.exp(-1.0 / tau)
    rise = rate * (1.0 - phi ** np.arange(n)) / (1.0 - phi)
    x = (WhiteNoise(0.5) + GaussMarkov(0.5, tau)).simulate(n, 1.0, seed=8) + rise
    terms = [WhiteNoise(), GaussMarkov()][::order]
    fit = em(terms[0] + terms[1] + RateRamp(), x, drift="state", max_iterations=200)
    assert "not a ramp of the signal" in fit.message
    # The first state has the covariance of one step, which its M step does not know of.
    assert falls(fit.trace) < 0.02


def test_a_drift_needs_a_state_and_a_ramp():
    x = WhiteNoise(1.0).simulate(100, 1.0, 1)
    with pytest.raises(InputError, match="of free slope"):
        em(WhiteNoise() + RandomWalk(), x, drift="state")
    with pytest.raises(InputError, match="of free slope"):
        em(WhiteNoise() + RandomWalk() + RateRamp(0.1), x, drift="state")
    with pytest.raises(InputError, match="RandomWalk or GaussMarkov"):
        em(WhiteNoise() + RateRamp(), x, drift="state")
    with pytest.raises(InputError, match="choose from ramp, state"):
        em(WhiteNoise() + RandomWalk() + RateRamp(), x, drift="signal")


# -- the M step -----------------------------------------------------------------------------------


def moments(draw_phi, n, seed, spread):
    """Second moments of a state whose mean is a series and whose variance is ``spread``."""
    rng = np.random.default_rng(seed)
    x = as_model(AR([draw_phi], 1.0)).simulate(n, 1.0, rng)
    lagged = 0.9 * draw_phi * spread
    later = np.sum(x[1:] ** 2) + (n - 1) * spread
    cross = np.sum(x[1:] * x[:-1]) + (n - 1) * lagged
    earlier = np.sum(x[:-1] ** 2) + (n - 1) * spread
    return (later, cross, earlier, x[0] ** 2 + spread), n - 1


def expected_log_likelihood(process, m, dt):
    """Of a Gauss-Markov process whose states are seen, up to a constant."""
    variance, phi = process.sigma**2, np.exp(-dt / process.tau)
    (later, cross, earlier, first), steps = m
    noise = -variance * np.expm1(-2.0 * dt / process.tau)
    squares = later - 2.0 * phi * cross + phi**2 * earlier
    return -0.5 * (np.log(variance) + first / variance + steps * np.log(noise) + squares / noise)


@pytest.mark.parametrize("like", [GaussMarkov(), GaussMarkov(sigma=2.0), GaussMarkov(tau=0.5)])
@pytest.mark.parametrize("phi", [0.3, 0.9, 0.999])
@pytest.mark.parametrize(("n", "spread"), [(5, 0.3), (200, 0.0), (200, 3.0), (20_000, 1.0)])
def test_the_gauss_markov_step_is_the_maximum(like, phi, n, spread):
    dt = 0.1
    m = moments(phi, n, seed=n, spread=spread)
    start = GaussMarkov(*(value or 1.0 for value in like.values.values()))
    found = _gauss_markov(start, like, *m, dt)
    best = expected_log_likelihood(found, m, dt)
    free = [name for name, value in like.values.items() if value is None]
    assert all(found.values[k] == v for k, v in like.values.items() if v is not None)

    def loss(z):
        values = {k: float(np.exp(np.clip(v, -12, 12))) for k, v in zip(free, z, strict=True)}
        return -expected_log_likelihood(start.with_values(**values), m, dt)

    for first in (-2.0, 0.0, 2.0):
        search = minimize(loss, np.full(len(free), first), method="Nelder-Mead")
        assert best >= -search.fun - 1e-9 * abs(best) - 1e-7


@pytest.mark.parametrize("drift", [False, True])
def test_expected_moments_are_those_of_draws_from_the_posterior(drift):
    """By dense algebra, with flat priors of the regressors' coefficients."""
    n, walk, noise = 40, 0.4, 0.7
    processes = (GaussMarkov(1.0, 6.0), RandomWalk(walk), WhiteNoise(noise))
    x = np.random.default_rng(3).normal(size=n)
    x[[0, 7, 8]] = np.nan
    columns = Columns(x, 1.0, None, drift)
    e = expect(columns, stacked(processes, 1.0), np.zeros(2), np.zeros(2))
    k = np.arange(n)
    prior = np.zeros((2 * n, 2 * n))
    prior[:n, :n] = processes[0].autocovariance(np.abs(k[:, None] - k), 1.0)
    prior[n:, n:] = walk**2 * np.minimum(k[:, None], k)
    present = ~np.isnan(x)
    read = np.hstack([np.eye(n), np.eye(n)])[present]
    y, regressors = columns.matrix[present, 0], columns.matrix[present, 1:]
    inverse = np.linalg.inv(read @ prior @ read.T + noise**2 * np.eye(y.size))
    explained = np.linalg.inv(regressors.T @ inverse @ regressors)
    inverse -= inverse @ regressors @ explained @ regressors.T @ inverse
    mean = prior @ read.T @ inverse @ y
    covariance = prior - prior @ read.T @ inverse @ read @ prior
    second = covariance + np.outer(mean, mean)
    states = second[: 2 * n, : 2 * n].reshape(2, n, 2, n).transpose(0, 2, 1, 3)
    np.testing.assert_allclose(e.earlier, np.trace(states[..., :-1, :-1], axis1=2, axis2=3), 1e-8)
    np.testing.assert_allclose(e.later, np.trace(states[..., 1:, 1:], axis1=2, axis2=3), 1e-8)
    np.testing.assert_allclose(e.cross, np.trace(states[..., 1:, :-1], axis1=2, axis2=3), 1e-8)
    np.testing.assert_allclose(e.first, states[..., 0, 0], rtol=1e-5, atol=1e-8)
    left = np.sum((noise**2 * inverse @ y) ** 2) + np.sum(noise**2 - noise**4 * np.diag(inverse))
    assert e.residual == pytest.approx(left, rel=1e-8)
    assert e.count == n - 3


# -- what it refuses ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "process",
    [
        gmwm.QuantizationNoise(),
        gmwm.BiasInstability(),
        Resonance(),
        Sinusoid(),
        gmwm.MA(1),
        AR(1),
        gmwm.ARMA(1, 1),
        ARIMA(1, 1, 0),
        ARIMA(0, 1, 0),
    ],
    ids=repr,
)
def test_processes_without_a_closed_form_are_refused_with_the_way_out(process):
    with pytest.raises(InputError, match=r'does not support .*takes WhiteNoise.*"mle" supports'):
        em(WhiteNoise() + process, WhiteNoise(1.0).simulate(100, 1.0, 1))


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("tolerance", 0.0),
        ("tolerance", -1.0),
        ("tolerance", np.nan),
        ("max_iterations", 0),
        ("max_iterations", 2.5),
        ("max_iterations", True),
    ],
)
def test_options_out_of_range_are_refused(option, value):
    with pytest.raises(
        InputError, match=f"{option} = .*give an? (small positive number|integer, 1 or more)"
    ):
        em(WhiteNoise(), WhiteNoise(1.0).simulate(100, 1.0, 1), **{option: value})


def test_a_removed_drift_is_the_line_of_least_squares():
    truth = WhiteNoise(0.8) + RandomWalk(0.02) + RateRamp(0.01)
    x = truth.simulate(500, 1.0, 3)
    found = gmwm.fit(truth.opened(), x, 1.0, method=gmwm.EM(drift="removed"))
    line = np.polyval(np.polyfit(np.arange(500), x, 1), np.arange(500))
    without = gmwm.fit(WhiteNoise() + RandomWalk(), x - line, 1.0, method="em")
    assert found.params["R"] == pytest.approx(np.polyfit(np.arange(500), x, 1)[0], rel=1e-9)
    assert found.params["N"] == pytest.approx(without.params["N"], rel=1e-3)
    assert "R" not in found.stderr
