"""What a model means: density, floor, random walk and its bound, sentences."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import (
    BiasInstability,
    Channel,
    GaussMarkov,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    Resonance,
    Sinusoid,
    WhiteNoise,
)
from gmwm._core.units import SI_UNIT
from gmwm.calibration.summary import floor, random_walk, sentence, white_density
from gmwm.process import as_model


def fitted(model, quantity="gyro", dt=0.01, n=20_000, scale=1.0):
    """A fit that says just this model, whatever the data behind it, white noise of ``scale``."""
    values = scale * np.random.default_rng(0).normal(size=n)
    channel = Channel("axis", values, dt, quantity, SI_UNIT.get(quantity, "V"))
    any_fit = gmwm.fit(WhiteNoise(), channel)
    return replace(any_fit, model=as_model(model), keys=(), covariance=np.zeros((0, 0)))


# -- density --------------------------------------------------------------------------------------


WHITE = WhiteNoise(3e-4)
SLOW = (RandomWalk(1.0), RateRamp(1.0), GaussMarkov(1.0, 1e4))
# Their integrals stay bounded: the line and the resonance raised the density by up to 60 %.
BOUNDED = QuantizationNoise(2e-5) + Sinusoid(amplitude=1e-3, frequency=7.3)


@pytest.mark.parametrize(
    ("model", "dt", "expected"),
    [
        *[(WHITE, dt, 3e-4) for dt in (0.001, 0.01, 1.0, 10.0)],
        *[(WHITE + slow, 0.01, 3e-4) for slow in SLOW],
        *[(slow, 0.01, 0.0) for slow in SLOW],
        (QuantizationNoise(2e-4), 0.01, 0.0),
        (WHITE + BOUNDED, 0.01, 3e-4),
    ],
)
def test_density_is_that_of_the_white_noise(model, dt, expected):
    assert white_density(fitted(model, dt=dt)) == pytest.approx(expected, rel=1e-9)


def test_a_fast_resonance_counts_with_the_foot_of_its_spectrum():
    resonance = Resonance(sigma=5e-3, frequency=10.0, damping=0.02)
    model = WhiteNoise(3e-4) + resonance
    foot = resonance.psd(np.array([1e-3]), 0.01)[0]
    assert white_density(fitted(model, dt=0.01)) == pytest.approx(np.sqrt(9e-8 + foot), rel=1e-3)


def test_fast_gauss_markov_acts_as_white_noise_of_its_density_at_zero_frequency():
    sigma, tau = 0.02, 0.01
    model = WhiteNoise(3e-4) + GaussMarkov(sigma, tau) + GaussMarkov(1e-3, 500.0)
    expected = np.sqrt(3e-4**2 + 2.0 * sigma**2 * tau)
    assert white_density(fitted(model, dt=0.001)) == pytest.approx(expected, rel=0.02)


# -- floor ----------------------------------------------------------------------------------------


def test_floor_is_the_lowest_point_of_the_allan_deviation():
    N, K, dt = 1e-3, 5e-4, 0.01
    fit = fitted(WhiteNoise(N) + RandomWalk(K), dt=dt, scale=1e-12)
    tau = fit.wv.tau
    allan = N**2 / tau + K**2 * (tau / 3.0 + dt**2 / (6.0 * tau))
    found = floor(fit)
    assert found.tau == tau[np.argmin(allan)]
    assert found.tau / (np.sqrt(3.0) * N / K) == pytest.approx(1.0, abs=0.5)
    assert found.deviation == pytest.approx(np.sqrt(allan.min()), rel=1e-9)


def test_bias_instability_is_read_off_a_plateau():
    found = floor(fitted(BiasInstability(2e-5), scale=1e-12))
    assert found.bias_instability == pytest.approx(2e-5, rel=0.01)
    assert found.deviation == pytest.approx(0.664 * 2e-5, rel=0.01)


# -- random walk and its bound --------------------------------------------------------------------


def test_random_walk_of_the_model_is_given_as_it_is():
    found = random_walk(fitted(WhiteNoise(1e-3) + RandomWalk(5e-4)))
    assert found.found
    assert found.value == 5e-4


@pytest.fixture(scope="module")
def bounds():
    """Bounds from records in which a walk of K = 0.001 is too small to be seen."""
    truth = WhiteNoise(1.0) + RandomWalk(0.001)
    result = []
    for seed in range(24):
        fit = gmwm.fit(WhiteNoise(), truth.simulate(4000, 1.0, seed), dt=1.0)
        result.append(random_walk(fit))
    return result


def test_a_model_without_random_walk_gets_a_bound_that_holds(bounds):
    assert not any(bound.found for bound in bounds)
    assert sum(bound.value >= 0.001 for bound in bounds) >= 21


def test_the_bound_is_always_a_number(bounds):
    values = np.array([bound.value for bound in bounds])
    assert np.all(values > 0.0)
    assert np.all(np.isfinite(values)), f"{np.isinf(values).sum()} of {values.size} are infinite"


def test_the_bound_does_not_depend_on_whether_a_walk_of_zero_was_fitted():
    seed = next(
        seed
        for seed in range(20)
        if gmwm.fit(
            WhiteNoise() + RandomWalk(), WhiteNoise(1.0).simulate(4000, 1.0, seed), dt=1.0
        ).params["K"]
        == 0.0
    )
    x = WhiteNoise(1.0).simulate(4000, 1.0, seed)
    without = random_walk(gmwm.fit(WhiteNoise(), x, dt=1.0))
    nil = random_walk(gmwm.fit(WhiteNoise() + RandomWalk(), x, dt=1.0))
    assert not nil.found
    assert nil.value == pytest.approx(without.value, rel=1e-3)


# -- sentences ------------------------------------------------------------------------------------


def test_sentence_for_a_gyro():
    # 3e-4 rad/s/sqrt(Hz) = 3e-4 * 180/pi * 60 deg/sqrt(h).
    fit = fitted(WhiteNoise(3e-4) + RandomWalk(3e-4), scale=1e-12)
    low = floor(fit)
    text = sentence(fit)
    assert text.startswith("Total white noise of 1.03 deg/sqrt(h); ")
    assert f"up to {low.tau:.3g} s" in text
    assert f"down to {np.degrees(low.deviation) * 3600.0:.3g} deg/h." in text
    assert "still falls" not in text


def test_sentence_for_an_accelerometer():
    fit = fitted(WhiteNoise(1e-3), "accel")
    text = sentence(fit)
    assert text.startswith("Total white noise of 102 ug/sqrt(Hz); ")
    assert f"{floor(fit).deviation / 9.80665e-6:.3g} ug" in text
    assert text.endswith("(the model still falls at the end of the record).")
    assert sentence(fitted(RandomWalk(1e-3))).startswith("No white noise; ")


def test_sentence_for_anything_else_keeps_its_unit():
    text = sentence(fitted(WhiteNoise(2e-3), None))
    assert "Total white noise of 0.002 V/sqrt(Hz)" in text
    assert "deg" not in text
    assert " V (the model still falls" in text


@pytest.mark.parametrize("seed", range(4))
def test_a_model_that_falls_has_its_floor_where_the_data_are_lowest(seed):
    """White noise: the last of its levels is as likely above the others as below them."""
    fit = gmwm.fit(WhiteNoise(), np.random.default_rng(seed).normal(size=5000), dt=1.0)
    found = floor(fit)
    assert found.falls
    assert found.deviation >= np.min(fit.goodness.data)
    assert "still falls at the end" in sentence(fit)


def test_no_floor_lies_below_the_data():
    """A model without the walk that the data have: its deviation goes on falling."""
    x = (WhiteNoise(1e-3) + RandomWalk(1e-4)).simulate(50_000, 0.1, 1)
    fit = gmwm.fit(WhiteNoise() + RandomWalk(), Channel("gyro_x", x, 0.1, "gyro", "rad/s"))
    blind = replace(fit, model=as_model(WhiteNoise(1e-3)), keys=(), covariance=np.zeros((0, 0)))
    found, low = floor(blind), np.sqrt(2.0 * fit.wv.lower)
    assert np.sqrt(2.0 * blind.implied[-1]) < 0.2 * found.deviation
    at = int(np.searchsorted(fit.wv.tau, found.tau))
    assert found.deviation >= low[at] * (1.0 - 1e-12)
    assert found.tau < 100.0
    # Where the model describes the data, its own lowest point is the floor.
    assert floor(fit).deviation == np.min(np.sqrt(2.0 * fit.implied))
