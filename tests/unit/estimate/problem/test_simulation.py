"""Simulated moments: processes that are known by simulation only."""

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, Process, RandomWalk, RateRamp, SimulatedMoments, WhiteNoise, parameter
from gmwm.estimate.problem.moments import Simulation


class RoundedNoise(Process):
    """White noise behind a converter whose steps are as large as the noise."""

    sigma: float = parameter("u")
    lsb: float = parameter("u")

    def draw(self, n, dt, rng):
        return self.lsb * np.rint(self.sigma / self.lsb * rng.standard_normal(n))


class BlockBias(Process):
    """Bias instability as a value held for a time and then drawn anew."""

    level: float = parameter("u", role="scale")
    hold: float = parameter("s")
    prefix = "block_"

    def draw(self, n, dt, rng):
        length = max(round(self.hold / dt), 1)
        blocks = self.level * rng.standard_normal(-(-n // length) + 1)
        start = int(rng.integers(length))
        return np.repeat(blocks, length)[start : start + n]


TRUTH = WhiteNoise(1.0) + GaussMarkov(0.5, 20.0)


@pytest.fixture(scope="module")
def series():
    return TRUTH.simulate(8192, 1.0, 3)


def test_a_known_process_by_simulation_agrees_with_its_closed_form(series):
    closed = gmwm.fit(TRUTH.opened(), series, dt=1.0)
    simulated = gmwm.fit(TRUTH.opened(), series, dt=1.0, method=SimulatedMoments(replications=4))
    assert simulated.valid, simulated.message
    for key, error in closed.stderr.items():
        # The simulated series are so many more: their own error is half that of the data.
        assert simulated.params[key] == pytest.approx(closed.params[key], abs=3.0 * error / 2.0)
    assert "simulated moments" in str(simulated)


def test_one_long_series_agrees_with_as_many_short_ones(series):
    closed = gmwm.fit(TRUTH.opened(), series, dt=1.0)
    method = SimulatedMoments(replications=16, single=True)
    single = gmwm.fit(TRUTH.opened(), series, dt=1.0, method=method)
    assert single.valid, single.message
    for key, error in closed.stderr.items():
        assert single.params[key] == pytest.approx(closed.params[key], abs=3.0 * error / 4.0)


def test_the_covariance_grows_by_the_share_of_the_simulation():
    series = WhiteNoise(1.0).simulate(8192, 1.0, 4)
    closed = gmwm.fit(WhiteNoise(), series, dt=1.0)
    for replications in (1, 4):
        found = gmwm.fit(
            WhiteNoise(),
            series,
            dt=1.0,
            method=SimulatedMoments(replications=replications, discrepancy=0.0),
        )
        ratio = found.covariance[0, 0] / closed.covariance[0, 0]
        assert ratio == pytest.approx(1.0 + 1.0 / replications, rel=0.1)


def test_noise_rounded_as_coarsely_as_it_is_large():
    """White noise alone is off by the variance of rounding; the simulation is not."""
    x = RoundedNoise(sigma=0.7, lsb=1.0).simulate(8192, 1.0, 0)
    fit = gmwm.fit(RoundedNoise(lsb=1.0), x, dt=1.0, method=SimulatedMoments(replications=4))
    assert fit.valid, fit.message
    assert abs(fit.params["sigma"] - 0.7) < 3.3 * fit.stderr["sigma"]
    white = gmwm.fit(WhiteNoise(), x, dt=1.0)
    assert white.params["N"] - 0.7 > 5.0 * white.stderr["N"]


def test_a_bias_held_in_blocks():
    truth = WhiteNoise(1.0) + BlockBias(level=0.5, hold=64.0)
    x = truth.simulate(16_384, 1.0, 1)
    fit = gmwm.fit(truth.opened(), x, dt=1.0, method=SimulatedMoments(replications=4))
    for key, value in truth.params.items():
        assert abs(fit.params[key] - value) < 4.0 * fit.stderr[key], key
    low, high = fit.interval()["block_hold"]
    assert low < fit.params["block_hold"] < high
    # Its curves can be drawn though there is no closed form.
    assert fit.components.keys() == {"white noise", "BlockBias"}
    assert np.all(fit.deviation_interval(fit.wv.tau)[0] > 0.0)


def test_simulated_terms_are_simulated_without_being_asked_for():
    truth = WhiteNoise(1.0) + BlockBias(level=0.5, hold=64.0)
    x = truth.simulate(4096, 1.0, 1)
    asked = gmwm.fit(WhiteNoise() + BlockBias(hold=64.0), x, dt=1.0)
    assert asked.params["block_level"] == pytest.approx(0.5, abs=4 * asked.stderr["block_level"])


def test_a_drift_beside_a_simulated_term():
    truth = WhiteNoise(1.0) + BlockBias(level=0.3, hold=16.0) + RateRamp(2e-3)
    x = truth.simulate(8192, 1.0, 2)
    fit = gmwm.fit(WhiteNoise() + BlockBias(hold=16.0) + RateRamp(), x, dt=1.0)
    for key, error in fit.stderr.items():
        assert fit.params[key] == pytest.approx(truth.params[key], abs=4.0 * error)


def test_between_levels_curves_are_interpolated():
    tau = np.array([1.0, 2.0, 4.0])
    curve = Simulation(3, 0).curve(RandomWalk(1.0), tau, 4096, 1.0, "haar")
    between = Simulation(3, 0).curve(RandomWalk(1.0), np.array([1.5]), 4096, 1.0, "haar")
    assert curve[0] < between[0] < curve[1]
    np.testing.assert_allclose(curve, RandomWalk(1.0).haar_variance(tau, 1.0), rtol=0.1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"replications": 0}, "integer, 1 or more"),
        ({"replications": 1.5}, "integer, 1 or more"),
        ({"seed": -1}, "integer, 0 or more"),
        ({"discrepancy": 2.0}, "fraction of the variance"),
    ],
)
def test_bad_options_are_refused(options, words):
    with pytest.raises(gmwm.InputError, match=words):
        SimulatedMoments(**options)


@pytest.mark.slow
def test_two_parameters_of_one_number_are_said_not_to_be_told_apart(series):
    """Rounded white noise is white: its variance alone gives no step."""
    x = RoundedNoise(sigma=0.7, lsb=1.0).simulate(8192, 1.0, 1)
    fit = gmwm.fit(RoundedNoise(), x, dt=1.0, method=SimulatedMoments(replications=4))
    assert not fit.valid
    assert "lsb: cannot be distinguished from sigma" in fit.message
