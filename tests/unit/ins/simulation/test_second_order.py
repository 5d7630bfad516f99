"""Where products of errors count: a filter that is tilted, without fixes."""

import numpy as np
import pytest

import gmwm
from gmwm import WhiteNoise
from gmwm.ins import SensorModels, Simulated, at_epoch, gnss, helicopter_mapping, monte_carlo

SENSORS = SensorModels.of({"gyro": WhiteNoise(1e-6), "accel": WhiteNoise(1e-5)})


@pytest.fixture(scope="module")
def found():
    truth = helicopter_mapping(duration=110.0, dt=0.05).segment(60.0, 110.0)
    outage = gmwm.ins.Outage(1.0, 45.0)
    scenario = gmwm.ins.Scenario(
        truth, gnss(truth), (outage,),
        gmwm.ins.InitialSd(tilt=np.radians(1.5), heading=np.radians(1.0)), interval=10.0,
    )  # fmt: skip
    runs = monte_carlo(scenario, Simulated(SENSORS), {"true": SENSORS}, 80, 1)["true"]
    return at_epoch(runs, runs.index(outage.end))


def test_the_tilt_squared_goes_together_with_the_horizontal_error_as_predicted(found):
    # The heights alone are wrong by less than predicted: their mean is not zero.
    assert found.nees["horizontal"].p_value > 1e-3
    assert found.nees["position"].p_value > 1e-3
    assert found.nees["velocity"].p_value > 1e-3
    assert found.nees["vertical"].value < found.nees["vertical"].upper
