"""What the methods that need the samples refuse, and with which words."""

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, Sinusoid, WhiteNoise
from gmwm.errors import InputError
from gmwm.estimate import METHODS

OF_SAMPLES = ("mle", "whittle", "em")


@pytest.mark.parametrize("method", OF_SAMPLES)
@pytest.mark.parametrize(
    ("start", "said"),
    [
        (WhiteNoise(0.2), "does not give every term"),
        (WhiteNoise(0.2) + RandomWalk(0.1), "does not give every term"),
        (WhiteNoise(0.2) + GaussMarkov(0.5), "does not give every term"),
        (WhiteNoise(0.2) + GaussMarkov(0.5, 20.0) + RandomWalk(0.1), "RandomWalk"),
        (WhiteNoise(0.0) + GaussMarkov(0.5, 20.0), "N must be positive"),
        ("mle", "not an error model"),
    ],
    ids=repr,
)
def test_a_start_that_is_not_the_model_is_refused(method, start, said):
    x = WhiteNoise(1.0).simulate(100, 1.0, 1)
    with pytest.raises(InputError, match=said):
        gmwm.fit(WhiteNoise() + GaussMarkov(), x, dt=1.0, method=METHODS[method](start=start))


@pytest.mark.parametrize("method", OF_SAMPLES)
def test_a_start_that_contradicts_a_given_value_is_refused(method):
    x = WhiteNoise(1.0).simulate(100, 1.0, 1)
    model = WhiteNoise() + GaussMarkov(tau=20.0)
    with pytest.raises(InputError, match="does not give every term"):
        start = WhiteNoise(1.0) + GaussMarkov(0.5, 30.0)
        gmwm.fit(model, x, dt=1.0, method=METHODS[method](start=start))


def test_whittle_needs_every_sample():
    x = WhiteNoise(1.0).simulate(100, 1.0, 1)
    x[17] = np.nan
    with pytest.raises(InputError, match=r'misses 1 sample.* take method = "mle"'):
        gmwm.fit(WhiteNoise(), x, dt=1.0, method="whittle")


@pytest.mark.parametrize("method", OF_SAMPLES)
def test_series_that_hold_no_noise_are_refused(method):
    for x, said in (
        (np.ones(100), "constant"),
        (np.r_[np.ones(99), np.inf], "infinite"),
        (np.arange(5.0), "8 samples"),
        (np.ones((10, 10)), "one series"),
        ("abc", "not a number"),
    ):
        with pytest.raises(InputError, match=said):
            gmwm.fit(WhiteNoise(), x, dt=1.0, method=method)
    with pytest.raises(InputError, match="dt"):
        gmwm.fit(WhiteNoise(), WhiteNoise(1.0).simulate(100, 1.0, 1), method=method)


@pytest.mark.parametrize("method", ["mle", "em"])
def test_a_series_of_gaps_is_refused(method):
    x = WhiteNoise(1.0).simulate(100, 1.0, 1)
    x[np.arange(100) % 15 > 0] = np.nan
    with pytest.raises(InputError, match="7 samples that are not missing: give 8 or more"):
        gmwm.fit(WhiteNoise(), x, dt=1.0, method=method)
    with pytest.raises(InputError, match="0 samples that are not missing: give 8 or more"):
        gmwm.fit(WhiteNoise(), np.full(100, np.nan), dt=1.0, method=method)


@pytest.mark.parametrize("method", OF_SAMPLES)
def test_methods_that_need_the_samples_refuse_their_variance(method):
    wv = gmwm.wavelet_variance(WhiteNoise(1.0).simulate(100, 1.0, 1), 1.0)
    with pytest.raises(InputError, match="give the series"):
        gmwm.fit(WhiteNoise(), wv, method=method)


@pytest.mark.parametrize("method", OF_SAMPLES)
def test_a_process_without_state_space_is_refused(method):
    class Pink(gmwm.Process):
        level: float = gmwm.parameter("u", role="scale")

        def psd(self, f, dt):
            return self.level**2 * dt * (2.0 * f * dt) ** -0.5

    x = WhiteNoise(1.0).simulate(500, 1.0, 1)
    with pytest.raises(InputError, match=r"state-space form|does not know"):
        gmwm.fit(Pink(), x, dt=1.0, method=method)


@pytest.mark.parametrize("method", ["mle", "whittle"])
def test_a_line_is_refused(method):
    x = WhiteNoise(1.0).simulate(500, 1.0, 1)
    with pytest.raises(InputError, match=r"knows no.* Sinusoid.*gmwm"):
        gmwm.fit(WhiteNoise() + Sinusoid(), x, dt=1.0, method=method)


@pytest.mark.parametrize("method", OF_SAMPLES)
def test_weights_are_refused(method):
    x = WhiteNoise(1.0).simulate(100, 1.0, 1)
    for chosen in (method, METHODS[method]()):
        with pytest.raises(InputError, match=f"method '{method}' has no weights"):
            gmwm.fit(WhiteNoise(), x, dt=1.0, method=chosen, weights="model")


@pytest.mark.parametrize("method", OF_SAMPLES)
def test_there_must_be_something_to_estimate(method):
    x = WhiteNoise(1.0).simulate(100, 1.0, 1)
    with pytest.raises(InputError, match="nothing to estimate"):
        gmwm.fit(WhiteNoise(1.0), x, dt=1.0, method=method)
    with pytest.raises(InputError, match="no noise process"):
        gmwm.fit(RateRamp(), x, dt=1.0, method=method)


def test_an_unknown_method_is_refused():
    with pytest.raises(InputError, match="known are"):
        gmwm.fit(WhiteNoise(), np.arange(100.0), dt=1.0, method="MLE")
