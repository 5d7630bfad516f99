"""The debiased Whittle likelihood against the exact one."""

import numpy as np
import pytest

import gmwm
from gmwm import AR, GaussMarkov, QuantizationNoise, RandomWalk, RateRamp, Resonance, WhiteNoise
from gmwm.estimate.likelihood.likelihood import Columns, KalmanLikelihood, WhittleLikelihood
from gmwm.process import as_model
from marks import slow

MODELS = [
    slow(WhiteNoise(0.8) + GaussMarkov(0.5, 125.0) + RateRamp(0.001), 6000, 1.0),
    slow(WhiteNoise(0.2) + GaussMarkov(0.5, 20.0), 10_007, 1.0),
    (WhiteNoise(0.2) + GaussMarkov(0.5, 0.2), 4097, 0.01),
    (WhiteNoise(0.2) + RandomWalk(0.01) + RateRamp(-2e-3), 4097, 1.0),
    slow(QuantizationNoise(0.4) + WhiteNoise(0.2) + GaussMarkov(0.5, 20.0), 9999, 1.0),
    (QuantizationNoise(0.004) + WhiteNoise(0.02) + RandomWalk(0.02), 4096, 0.01),
    (AR([1.2, -0.6], 2.0) + WhiteNoise(1.0), 3001, 1.0),
    slow(GaussMarkov(1.0, 2.0) + GaussMarkov(0.7, 50.0) + GaussMarkov(0.5, 1000.0), 40_000, 1.0),
    (WhiteNoise(0.2) + Resonance(0.5, 0.05, 0.1), 4095, 1.0),
    (as_model(gmwm.ARMA([0.9], [-0.5], 1.0)), 5003, 1.0),
    (as_model(gmwm.MA([-0.9], 1.0)), 4097, 1.0),
    slow(as_model(gmwm.ARIMA(0, 1, [0.5], 1e-3)), 5001, 1.0),
    (as_model(QuantizationNoise(0.3)), 3001, 1.0),
    (as_model(WhiteNoise(2.0)), 1009, 0.01),
]


def both(model, x, dt):
    return [gmwm.fit(model, x, dt=dt, method=method) for method in ("mle", "whittle")]


@pytest.mark.parametrize(("truth", "n", "dt"), MODELS, ids=repr)
def test_it_agrees_with_the_exact_within_a_tenth_of_a_standard_error(truth, n, dt):
    exact, whittle = both(truth.opened(), truth.simulate(n, dt, seed=3), dt)
    assert whittle.valid, whittle.message
    assert set(whittle.stderr) == set(exact.stderr)
    for key, error in exact.stderr.items():
        assert abs(whittle.params[key] - exact.params[key]) < 0.1 * error, key
        assert whittle.stderr[key] == pytest.approx(error, rel=0.1), key
    assert whittle.log_likelihood == pytest.approx(exact.log_likelihood, abs=0.02)


@pytest.mark.parametrize("n", [997, 1024, 1025, 1331, slow(16_385)])
def test_no_length_is_awkward(n):
    truth = WhiteNoise(0.3) + RandomWalk(0.05)
    exact, whittle = both(truth.opened(), truth.simulate(n, 1.0, seed=n), 1.0)
    for key, error in exact.stderr.items():
        assert abs(whittle.params[key] - exact.params[key]) < 0.1 * error, key


@pytest.mark.parametrize("n", [8, 9, 16, 33, 100])
def test_very_short_series_are_no_crash(n):
    truth = as_model(WhiteNoise(0.3))
    exact, whittle = both(truth.opened(), truth.simulate(n, 1.0, seed=n), 1.0)
    assert whittle.params["N"] == pytest.approx(exact.params["N"], abs=0.1 * exact.stderr["N"])


@pytest.mark.parametrize(
    "processes",
    [
        (WhiteNoise(0.3), RandomWalk(0.05)),
        (QuantizationNoise(0.4), GaussMarkov(0.5, 20.0)),
        (AR([1.5, -0.7], 0.3), WhiteNoise(0.5)),
        (Resonance(0.4, 0.05, 0.1), WhiteNoise(0.1)),
    ],
    ids=repr,
)
@pytest.mark.parametrize("n", [500, 4099, 20_001])
@pytest.mark.parametrize("drift", [False, True])
def test_at_its_own_filter_it_is_the_exact_likelihood(processes, n, drift):
    """All of Parseval's sum is the sum of squares of the innovations, whatever n."""
    x = as_model(processes[0]).simulate(n, 1.0, seed=1)
    for process in processes[1:]:
        x += process.simulate(n, 1.0, seed=2)
    columns = Columns(x + 1e-3 * np.arange(n), 1.0, None, drift)
    exact = KalmanLikelihood(columns)(processes)
    # Exact but for the spectrum of bins in which the filter's is taken at one frequency.
    value = WhittleLikelihood(columns, processes)(processes)
    assert value == pytest.approx(exact, abs=1e-6 * n)


def test_its_information_is_that_of_the_exact_likelihood():
    truth = (WhiteNoise(0.3), RandomWalk(0.05))
    n = 4096
    x = (truth[0] + truth[1]).simulate(n, 1.0, seed=5)
    columns = Columns(x, 1.0, None, False)
    exact, whittle = KalmanLikelihood(columns), WhittleLikelihood(columns, truth)
    # Within some standard errors of the filter the two fall off alike.
    for white in (0.29, 0.3, 0.31):
        for walk in (0.046, 0.05, 0.054):
            point = (WhiteNoise(white), RandomWalk(walk))
            fall = exact(point) - exact(truth)
            assert whittle(point) - whittle(truth) == pytest.approx(fall, abs=0.03 + 0.02 * -fall)


def test_flicker_agrees_with_the_exact_too():
    """The bank of Gauss-Markov processes that stands for 1/f has the same spectrum at low
    frequencies; near 1/(2 dt), where it is up to a fifth too high, there must be white noise.
    """
    truth = WhiteNoise(0.5) + gmwm.BiasInstability(0.1)
    exact, whittle = both(truth.opened(), truth.simulate(2000, 1.0, seed=1), 1.0)
    for key, error in exact.stderr.items():
        assert abs(whittle.params[key] - exact.params[key]) < 0.1 * error, key
        assert whittle.stderr[key] == pytest.approx(error, rel=0.1), key


# -- a spectrum is enough -------------------------------------------------------------------------


class Coloured(gmwm.Process):
    level: float = gmwm.parameter("u", role="scale")
    slope: float = gmwm.parameter("-", lower=0.0, upper=2.0)

    def psd(self, f, dt):
        return self.level**2 * dt * (2.0 * f * dt) ** -self.slope


def test_coloured_noise_is_found_within_its_errors():
    truth = WhiteNoise(1.0) + Coloured(0.3, 1.2)
    scores = []
    for seed in range(3):
        x = gmwm.simulate(truth, n=4096, rate=1.0, seed=seed)
        found = gmwm.fit("N + Coloured", x, rate=1.0, method="whittle")
        scores += [(found.params[k] - truth.params[k]) / found.stderr[k] for k in found.keys]
    assert np.sqrt(np.mean(np.square(scores))) < 1.5


def test_an_exact_likelihood_names_the_one_that_needs_a_spectrum_only():
    with pytest.raises(gmwm.InputError, match=r'use method="whittle"$'):
        gmwm.fit("N + Coloured", np.arange(100.0), rate=1.0, method="mle")
