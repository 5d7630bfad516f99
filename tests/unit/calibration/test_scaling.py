"""Fast noise that follows a covariate."""

import numpy as np
import pytest

from gmwm.calibration.scaling import scaling
from gmwm.readers import Channel

SIZE, DT = 8192, 0.1
TEMPERATURE = 25.0 + 40.0 * (1.0 - np.exp(-4.0 * np.arange(SIZE) / SIZE))
GROWTH = np.log(1.3) / 40.0


def part(seed, growth=GROWTH, temperature=TEMPERATURE, scale=1.0):
    rng = np.random.default_rng(seed)
    noise = scale * np.exp(growth * (temperature - 45.0)) * rng.normal(0.0, 1.0, SIZE)
    noise += np.cumsum(rng.normal(0.0, 0.005 * scale, SIZE))
    return Channel("gyro_x", noise, DT), DT * np.arange(SIZE)[::16], temperature[::16]


def test_a_growth_of_the_noise_is_found_and_said():
    found = scaling([part(1, 2.0 * GROWTH)])
    assert abs(found.gamma - 2.0 * GROWTH) < 1.5 * found.error
    said = found.notice("temperature", "degC", 25.0, 65.0)
    assert said.severity == "warning"
    assert said.values["ratio"] == pytest.approx(1.69, rel=0.2)
    assert "per degC of temperature" in said.sentence


def test_noise_of_one_size_is_not_remarked():
    found = scaling([part(2, 0.0)])
    assert found.p_value > 0.001
    assert found.notice("temperature", "degC", 25.0, 65.0) is None


def test_scale_does_not_matter():
    one, other = (scaling([part(3, scale=scale)]) for scale in (1.0, 1e-6))
    assert other.gamma == pytest.approx(one.gamma, rel=1e-6)
    assert other.p_value == pytest.approx(one.p_value, rel=1e-6)


def test_soaks_show_it_between_them():
    soaks = [part(k, temperature=np.full(SIZE, t)) for k, t in enumerate((25.0, 45.0, 65.0))]
    assert scaling(soaks[:1]) is None
    found = scaling(soaks)
    assert abs(found.gamma - GROWTH) < 1.5 * found.error


def test_a_short_record_tells_nothing():
    channel, time, covariate = part(1)
    few = Channel("gyro_x", channel.values[:64], DT)
    assert scaling([(few, time, covariate)]) is None


@pytest.mark.slow
@pytest.mark.parametrize("growth", [0.0, GROWTH])
def test_intervals_and_test_have_their_levels(growth):
    runs = 600
    found = [scaling([part([4, seed], growth)]) for seed in range(runs)]
    error = 3.0 * np.sqrt(0.05 * 0.95 / runs)
    held = [abs(each.gamma - growth) <= each.error for each in found]
    assert abs(np.mean(held) - 0.95) < error
    if growth == 0.0:
        assert abs(np.mean([each.p_value < 0.05 for each in found]) - 0.05) < error


def test_the_model_is_the_mean_square_of_the_record():
    found = scaling([part(5, 2.0 * GROWTH)])
    assert np.mean(found.factor(found.places) ** 2) == pytest.approx(1.0)
    assert np.mean(found.deviation**2) == pytest.approx(1.0)
    true = np.exp(2.0 * GROWTH * (found.places - 45.0))
    true /= np.sqrt(np.mean(true**2))
    reach = np.abs(found.places - found.reference) * found.error
    assert np.all(np.abs(np.log(found.factor(found.places) / true)) < 1.5 * reach + 1e-3)
