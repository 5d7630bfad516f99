"""Sensor models: given by axis or kind, refused with one sentence, simulated."""

import numpy as np
import pytest

from gmwm import GaussMarkov, QuantizationNoise, RandomWalk, RateRamp, WhiteNoise
from gmwm.errors import InputError
from gmwm.ins import SensorModels
from gmwm.ins.sensors import AXES

PLAIN = {"gyro": WhiteNoise(1e-4), "accel": WhiteNoise(1e-3)}


def test_an_axis_goes_before_its_kind():
    own = WhiteNoise(5e-4) + GaussMarkov(1e-4, 30.0)
    models = SensorModels.of({"gyro_y": own, **PLAIN}, {"gyro": 1e-5, "gyro_z": 0.0, "accel_x": 2})
    assert tuple(models.models) == AXES
    assert models.models["gyro_y"].params == own.params
    assert models.models["gyro_x"].params == {"N": 1e-4}
    assert models.bias_sd == {
        "gyro_x": 1e-5, "gyro_y": 1e-5, "gyro_z": 0.0,
        "accel_x": 2.0, "accel_y": 0.0, "accel_z": 0.0,
    }  # fmt: skip


def test_models_pass_through_and_take_another_bias():
    models = SensorModels.of(PLAIN, {"gyro": 1e-5})
    assert SensorModels.of(models) is models
    other = SensorModels.of(models, {"accel": 1e-2})
    assert other.models is models.models
    assert other.bias_sd["gyro_x"] == 0.0 and other.bias_sd["accel_z"] == 1e-2


@pytest.mark.parametrize(
    ("given", "bias", "words"),
    [
        ({"gyro": WhiteNoise(1e-4)}, None, "accel_x has none"),
        (
            {**PLAIN, "accel_y": GaussMarkov()},
            None,
            r"accel_y GaussMarkov\(\) has free parameters \(sigma, tau\)",
        ),
        ({**PLAIN, "gyro_q": WhiteNoise(1.0)}, None, "'gyro_q' is not a sensor"),
        ({**PLAIN, "gyro": 1e-4}, None, "gyro_x is 0.0001: give a process or model"),
        ({**PLAIN, "gyro_z": None}, None, "gyro_z is None"),
        (PLAIN, {"gyro": -1.0}, "bias_sd of gyro_x = -1.0"),
        (PLAIN, {"accel_z": np.nan}, "bias_sd of accel_z = nan"),
        (PLAIN, {"odometer": 1.0}, "'odometer' is not a sensor"),
        ("models.json", None, "give a calibration, or models"),
        (None, None, "give a calibration, or models"),
        ({}, None, "gyro_x has none"),
    ],
)
def test_what_cannot_be_used_is_said_in_one_sentence(given, bias, words):
    with pytest.raises(InputError, match=words) as caught:
        SensorModels.of(given, bias)
    assert "\n" not in str(caught.value)


def test_errors_are_the_slow_part_and_white_noise():
    n, dt = 20_000, 0.01
    models = SensorModels.of(
        {
            "gyro": WhiteNoise(1e-3) + RandomWalk(1e-4) + RateRamp(2e-5),
            "accel": GaussMarkov(1e-2, 0.5) + QuantizationNoise(1e-4),
        },
        {"gyro_x": 3.0, "accel_y": 5.0},
    )
    found = models.simulate(n, dt, np.random.default_rng(2))
    white = found.total - found.slow
    # A variance of n draws scatters by sqrt(2/n): 1 %.
    np.testing.assert_allclose(white[:, :3].var(axis=0), 1e-6 / dt, rtol=0.05)
    assert not np.any(white[:, 3:])
    # Biases are drawn per run, for the axes that have one.
    starts = np.array(
        [models.simulate(1, dt, np.random.default_rng(seed)).slow[0] for seed in range(400)]
    )
    spread = starts.std(axis=0)
    assert spread[0] == pytest.approx(3.0, rel=0.2) and spread[4] == pytest.approx(5.0, rel=0.2)
    assert not np.any(starts[:, 1:3])
