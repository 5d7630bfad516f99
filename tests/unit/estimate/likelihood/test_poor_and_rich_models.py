"""Models that are too poor, too rich, or without white noise, and their likelihood estimates."""

import numpy as np
import pytest
from scipy.stats import norm

import gmwm
from gmwm import ARIMA, GaussMarkov, QuantizationNoise, RandomWalk, Resonance, Sinusoid, WhiteNoise
from gmwm.estimate import METHODS
from gmwm.process import as_model
from marks import slow

OF_SAMPLES = ("mle", "whittle", "em")


@pytest.mark.parametrize("method", OF_SAMPLES)
@pytest.mark.parametrize("ramp", [False, True])
def test_a_walk_alone_has_the_variance_of_its_steps(method, ramp):
    truth = RandomWalk(0.1) + gmwm.RateRamp(0.01) if ramp else as_model(RandomWalk(0.1))
    x = truth.simulate(1000, 1.0, seed=1)
    fit = gmwm.fit(truth.opened(), x, dt=1.0, method=method)
    steps = np.diff(x)
    expected = np.std(steps, ddof=1) if ramp else np.sqrt(np.mean(steps**2))
    assert fit.params["K"] == pytest.approx(expected, rel=1e-3)
    assert fit.stderr["K"] == pytest.approx(expected / np.sqrt(2.0 * 999), rel=0.01)
    if ramp:
        assert fit.params["R"] == pytest.approx(np.mean(steps), rel=1e-6)


def test_a_line_that_is_given_is_allowed_for():
    x = (WhiteNoise(0.1) + Sinusoid(1.0, 0.01)).simulate(2000, 1.0, seed=1)
    fit = gmwm.fit(WhiteNoise() + Sinusoid(1.0, 0.01), x, dt=1.0, method="mle")
    assert fit.params["N"] == pytest.approx(0.1, rel=4.0 / np.sqrt(4000))


@pytest.mark.parametrize(
    "truth",
    [
        as_model(QuantizationNoise(0.3)),
        as_model(ARIMA(0, 1, [0.5], 1e-3)),
        as_model(ARIMA([0.5], 1, 0, 1.0)),
        as_model(Resonance(0.5, 0.05, 0.1)),
        as_model(WhiteNoise(2.0)),
        as_model(GaussMarkov(1.0, 0.3)),
        RandomWalk(0.1) + QuantizationNoise(0.3),
    ],
    ids=repr,
)
def test_models_without_white_noise_are_found_again(truth):
    fit = gmwm.fit(truth.opened(), truth.simulate(3000, 1.0, seed=2), dt=1.0, method="mle")
    assert fit.valid, fit.message
    for key, error in fit.stderr.items():
        assert abs(fit.params[key] - truth.params[key]) < norm.isf(1e-4) * error


@pytest.mark.parametrize(
    ("method", "model"),
    [
        *((method, WhiteNoise() + GaussMarkov()) for method in OF_SAMPLES),
        slow("mle", 2 * GaussMarkov()),
        slow("whittle", WhiteNoise() + 2 * GaussMarkov()),
        slow("em", WhiteNoise() + 2 * GaussMarkov()),
        slow("em", 2 * GaussMarkov()),
    ],
    ids=repr,
)
def test_too_rich_a_model_of_white_noise_is_not_valid(method, model):
    x = WhiteNoise(1.0).simulate(1000, 1.0, seed=3)
    options = {"max_iterations": 200} if method == "em" else {}
    fit = gmwm.fit(model, x, dt=1.0, method=METHODS[method](**options))
    assert not fit.valid
    assert fit.message
    assert np.all(np.isfinite(list(fit.params.values())))
    assert np.all(np.isfinite(fit.covariance))
    assert np.isfinite(fit.log_likelihood)


@pytest.mark.parametrize("method", OF_SAMPLES)
def test_a_ramp_that_the_model_has_not_is_no_crash(method):
    x = np.arange(1000.0) + WhiteNoise(1e-3).simulate(1000, 1.0, seed=1)
    fit = gmwm.fit(WhiteNoise() + RandomWalk(), x, dt=1.0, method=method)
    assert not fit.valid
    assert np.all(np.isfinite(fit.covariance))
