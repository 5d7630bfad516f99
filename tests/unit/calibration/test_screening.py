"""Which terms are offered for what a recording shows, and what is said of them."""

import numpy as np
import pytest

from gmwm import Channel, Recording, Resonance, Sinusoid, WhiteNoise
from gmwm.calibration import tuning
from gmwm.calibration.screening import screened, stretches_at_rest, with_outcomes
from gmwm.issues import Notice
from gmwm.process import as_model


@pytest.mark.parametrize(("off", "near"), [(0.99, True), (1.01, False), (-0.99, True)])
def test_what_became_of_a_line(off, near):
    frequency = 10.0 * (1.0 + off * tuning.SAME_FREQUENCY)
    line = Notice("line", "warning", "gyro_x", "", {"frequency": 10.0}, "find it")
    other = Notice("line", "warning", "gyro_y", "", {"frequency": 10.0}, "find it")
    with_it = {"gyro_x": WhiteNoise(1.0) + Sinusoid(1.0, frequency)}
    plain = {"gyro_x": as_model(WhiteNoise(1.0))}
    offered = {"gyro_x": (Sinusoid(frequency=frequency),)}

    def said(models, *arguments):
        first, second = with_outcomes((line, other), models, *arguments)
        assert second is other
        return first.hint

    term = "modelled, but not in filter N and K"
    assert (said(with_it, {}) == term) is near
    assert (said(plain, offered) == "tried as a term of the model, which does not need it") is near
    assert said(plain, {}) == "not tried as a term of the model"
    resonance = {"gyro_x": WhiteNoise(1.0) + Resonance(1.0, 10.0, 0.1)}
    assert said(resonance, {}) == "not tried as a term of the model"


def test_of_two_rates_each_has_its_stretches_at_rest():
    rng = np.random.default_rng(1)
    slow, fast = 1e-3 * rng.standard_normal(12_000), 1e-3 * rng.standard_normal(24_000)

    def recording(values):
        channels = (Channel("gyro_x", values, 0.01, "gyro", "rad/s"),
                    Channel("gyro_y", fast, 0.005, "gyro", "rad/s"))  # fmt: skip
        return Recording(channels, "log.csv")

    still = recording(slow)
    assert stretches_at_rest(still) == (still,)
    moving = slow + np.where(np.abs(np.arange(slow.size) - 6000) < 1000, 0.5, 0.0)
    parts = [
        (part.n, part.inertial[0].name, part.rate) for part in stretches_at_rest(recording(moving))
    ]
    assert parts[-1] == (24_000, "gyro_y", 200.0)
    assert [part[1:] for part in parts[:-1]] == [("gyro_x", 100.0)] * 2
    assert all(4000 < part[0] < 5000 for part in parts[:-1])


@pytest.mark.parametrize(("pulses", "is_told"), [(180, True), (10, False), (0, False)])
def test_many_shocks_may_be_the_noise_of_the_sensor(pulses, is_told):
    """Of p pulses of s samples and height a, means of m vary by p (a s / m)^2 m / n more."""
    n, rate, size, height = 180_000, 100.0, 10, 1e-2
    rng = np.random.default_rng(7)
    x = WhiteNoise(1e-4).simulate(n, 1.0 / rate, seed=0)
    for start in rng.permutation(n // 200)[:pulses] * 200:
        x[start : start + size] += height * rng.choice([-1.0, 1.0])
    given = Recording.from_arrays({"gyro_x": x}, rate, {"gyro": "rad/s"})
    event = [each for each in screened(given).notices if each.code == "event"]
    assert len(event) == (pulses > 0)
    if not is_told:
        assert all("taken" not in each.values and "noise" not in each.hint for each in event)
        return
    (event,) = event
    m = event.values["taken_at"] * rate
    white = 1e-8 * rate / m
    added = pulses * (height * size / m) ** 2 * m / n
    assert event.values["taken"] == pytest.approx(np.sqrt(1.0 + added / white), rel=0.25)
    assert f"{event.values['taken']:.2g} times as large" in event.hint
