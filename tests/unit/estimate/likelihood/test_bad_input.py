"""What the methods that need the samples refuse, and with which words."""

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, Sinusoid, WhiteNoise
from gmwm.errors import InputError
from gmwm.estimate import METHODS

OF_SAMPLES = ("mle", "whittle", "em")
X = WhiteNoise(1.0).simulate(100, 1.0, 1)


@pytest.mark.parametrize("method", OF_SAMPLES)
@pytest.mark.parametrize(
    ("start", "said"),
    [
        (WhiteNoise(0.2), "a positive number for every parameter"),
        (WhiteNoise(0.2) + RandomWalk(0.1), "a positive number for every parameter"),
        (WhiteNoise(0.2) + GaussMarkov(0.5, 30.0), "a positive number for every parameter"),
        (WhiteNoise(0.2) + GaussMarkov(0.5), "a positive number for every parameter"),
        (WhiteNoise(0.2) + GaussMarkov(0.5, 20.0) + RandomWalk(0.1), "RandomWalk"),
        (WhiteNoise(0.0) + GaussMarkov(0.5, 20.0), "a positive number for every parameter"),
        ("mle", "is not a term"),
        (3, "not an error model"),
    ],
    ids=repr,
)
def test_a_start_that_is_not_the_model_is_refused(method, start, said):
    with pytest.raises(InputError, match=said):
        gmwm.fit(WhiteNoise() + GaussMarkov(tau=20.0), X, 1.0, method=METHODS[method](start=start))


def test_whittle_needs_every_sample():
    x = X.copy()
    x[17] = np.nan
    with pytest.raises(InputError, match=r'1 samples are missing.* use method="mle"'):
        gmwm.fit(WhiteNoise(), x, dt=1.0, method="whittle")


@pytest.mark.parametrize("method", OF_SAMPLES)
def test_series_that_hold_no_noise_are_refused(method):
    for x, said in (
        (np.ones(100), "constant"),
        (np.r_[np.ones(99), np.inf], "infinite"),
        (np.arange(5.0), "8 samples"),
        (np.ones((10, 10)), "one series"),
        ("abc", "not one series"),
    ):
        with pytest.raises(InputError, match=said):
            gmwm.fit(WhiteNoise(), x, dt=1.0, method=method)
    with pytest.raises(InputError, match="dt"):
        gmwm.fit(WhiteNoise(), X, method=method)


@pytest.mark.parametrize("method", ["mle", "em"])
def test_a_series_of_gaps_is_refused(method):
    x = X.copy()
    x[np.arange(100) % 15 > 0] = np.nan
    with pytest.raises(InputError, match="7 samples that are not missing: give 8 or more"):
        gmwm.fit(WhiteNoise(), x, dt=1.0, method=method)
    with pytest.raises(InputError, match="0 samples that are not missing: give 8 or more"):
        gmwm.fit(WhiteNoise(), np.full(100, np.nan), dt=1.0, method=method)


class Drawn(gmwm.Process):
    level: float = gmwm.parameter("u", role="scale")

    def draw(self, n, dt, rng):
        return self.level * rng.standard_normal(n)


@pytest.mark.parametrize("method", OF_SAMPLES)
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"data": gmwm.wavelet_variance(X, 1.0)}, "give the series"),
        ({"model": Drawn()}, r"use method=.whittle|does not support|can only be simulated"),
        ({"model": WhiteNoise() + Sinusoid()}, r"support .*Sinusoid.*gmwm"),
        ({"weights": "model"}, "has no weights"),
        ({"model": WhiteNoise(1.0)}, "nothing to estimate"),
        ({"model": RateRamp()}, "no noise process"),
    ],
    ids=lambda value: None if isinstance(value, str) else next(iter(value)),
)
def test_what_a_likelihood_cannot_use_is_refused(method, arguments, said):
    with pytest.raises(InputError, match=said):
        gmwm.fit(**({"model": WhiteNoise(), "data": X, "dt": 1.0, "method": method} | arguments))
