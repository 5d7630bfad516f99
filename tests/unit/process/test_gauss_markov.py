import numpy as np
import pytest

from gmwm import GaussMarkov


def test_a_process_of_a_peak_has_it_there():
    tau = np.geomspace(10.0, 1000.0, 2001)
    deviation = np.sqrt(2.0 * GaussMarkov.of_peak(3.0, 100.0).haar_variance(tau, 0.01))
    assert np.max(deviation) == pytest.approx(3.0, rel=2e-3)
    assert tau[np.argmax(deviation)] == pytest.approx(100.0, rel=1e-2)
