import numpy as np
import pytest
from hypothesis import given, strategies as st

from gmwm.ins.trajectory.manoeuvres import Pulse


@given(st.floats(-500, 500).filter(lambda x: abs(x) > 1e-3), st.floats(0.01, 10), st.floats(0.1, 5))
def test_rates_stay_within_the_limit_and_come_to_the_change(
    change: float, limit: float, ramp: float
) -> None:
    pulse = Pulse(change, limit, ramp)
    time = np.linspace(-1.0, pulse.duration + 1.0, 4001)
    value, slope = pulse.value(time), pulse.slope(time)
    assert value[0] == 0.0
    assert value[-1] == change
    assert np.max(np.abs(slope)) <= limit * (1 + 1e-12)
    assert np.all(slope * np.sign(change) >= -1e-12 * limit)
    # Trapezoids of the rate: the largest curvature times the step squared is what they miss.
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(time))])
    step = time[1] - time[0]
    np.testing.assert_allclose(integral, value, atol=limit * step**2 / ramp + 1e-9 * abs(change))


@pytest.mark.parametrize("change", [3.0, -0.4])
def test_derivatives_are_continuous(change: float) -> None:
    pulse = Pulse(change, 0.5, 2.0)
    time = np.linspace(-0.5, pulse.duration + 0.5, 200_001)
    step = time[1] - time[0]
    numeric = np.gradient(pulse.slope(time), step)
    np.testing.assert_allclose(pulse.curvature(time), numeric, atol=1e-6)
    assert np.max(np.abs(np.diff(pulse.curvature(time)))) < 10 * step


def test_no_change_takes_no_time() -> None:
    pulse = Pulse(0.0, 1.0, 2.0)
    assert pulse.duration == 0.0
    np.testing.assert_array_equal(pulse.value(np.array([-1.0, 0.0, 3.0])), 0.0)
    np.testing.assert_array_equal(pulse.slope(np.array([-1.0, 0.0, 3.0])), 0.0)
