import numpy as np
import pytest

from gmwm import GaussMarkov, Resonance


def test_a_process_of_a_peak_has_it_there():
    tau = np.geomspace(10.0, 1000.0, 501)
    deviation = np.sqrt(2.0 * GaussMarkov.of_peak(3.0, 100.0).haar_variance(tau, 0.01))
    assert np.max(deviation) == pytest.approx(3.0, rel=2e-3)
    assert tau[np.argmax(deviation)] == pytest.approx(100.0, rel=1e-2)


def test_frequencies_are_tried_from_one_period_of_the_record_to_half_the_rate():
    (frequency,) = (each for each in Resonance().parameters if each.unit == "Hz")
    grid = frequency.grid(0.01, 1000, points=200)
    assert 0.1 < grid[0] < 0.11
    assert 47.0 < grid[-1] < 50.0
