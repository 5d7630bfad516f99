import numpy as np
import pytest

from gmwm import GaussMarkov, Resonance
from gmwm.process.kinds.gauss_markov import real_slope


def test_a_process_of_a_peak_has_it_there():
    tau = np.geomspace(10.0, 1000.0, 501)
    deviation = np.sqrt(2.0 * GaussMarkov.of_peak(3.0, 100.0).haar_variance(tau, 0.01))
    assert np.max(deviation) == pytest.approx(3.0, rel=2e-3)
    assert tau[np.argmax(deviation)] == pytest.approx(100.0, rel=1e-2)


@pytest.mark.parametrize("tau", [0.3, 2.0, 40.0, 3e4])
def test_the_slope_is_the_derivative(tau):
    averaging, dt, step = 2.0 ** np.arange(10), 0.5, 1e-4

    def curve(log_tau):
        return GaussMarkov().unit_haar_variance((np.exp(log_tau),), dt * averaging, dt)

    difference = (curve(np.log(tau) + step) - curve(np.log(tau) - step)) / (2.0 * step)
    slope = real_slope(dt / tau, averaging)
    np.testing.assert_allclose(slope[:, 0], difference, rtol=1e-5, atol=1e-9)


def test_frequencies_are_tried_from_one_period_of_the_record_to_half_the_rate():
    (frequency,) = (each for each in Resonance().parameters if each.unit == "Hz")
    grid = frequency.grid(0.01, 1000, points=200)
    assert 0.1 < grid[0] < 0.11
    assert 47.0 < grid[-1] < 50.0
