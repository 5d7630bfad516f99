"""Precise fixes after long times without any: the filter recovers, and knows how well."""

import numpy as np
import pytest

from gmwm import GaussMarkov, WhiteNoise
from gmwm.ins import Outage, SensorModels, emulate, fixed_wing_loiter, gnss, navigate

DT, START, AFTER = 0.1, 300.0, 60.0
DEGREE = np.pi / 180.0
CONSUMER = SensorModels.of(
    {
        "gyro": WhiteNoise(0.005 * DEGREE) + GaussMarkov(20.0 * DEGREE / 3600.0, 300.0),
        "accel": WhiteNoise(2e-3) + GaussMarkov(5e-3, 300.0),
    },
    {"gyro": 0.1 * DEGREE, "accel": 0.1},
)
TACTICAL = SensorModels.of(
    {
        "gyro": WhiteNoise(0.1 * DEGREE / 60.0) + GaussMarkov(3.0 * DEGREE / 3600.0, 500.0),
        "accel": WhiteNoise(5e-4) + GaussMarkov(5e-4, 500.0),
    },
    {"gyro": 5.0 * DEGREE / 3600.0, "accel": 5e-3},
)


@pytest.fixture(scope="module", params=[("consumer", 1800.0), ("tactical", 3600.0)],
                ids=["consumer", "tactical"])  # fmt: skip
def flight(request):
    name, length = request.param
    truth = fixed_wing_loiter(duration=START + length + AFTER, dt=DT)
    return truth, emulate(truth), {"consumer": CONSUMER, "tactical": TACTICAL}[name], length


def run(flight, seed, **options):
    truth, imu, sensors, length = flight
    rng = np.random.default_rng(seed)
    errors = sensors.simulate(truth.n, DT, rng).total
    outage = Outage(START, length)
    fixes = gnss(truth, position_sd=0.01).noisy(rng).without([outage])
    noisy = imu.with_errors(errors[:, :3], errors[:, 3:])
    return navigate(noisy, truth.state(0), sensors, fixes, before=(outage.end,), interval=5.0,
                    **options)  # fmt: skip


@pytest.mark.parametrize("seed", range(2))
def test_centimetre_fixes_are_found_again(flight, seed):
    truth = flight[0]
    found = run(flight, seed)
    assert found.diverged_at is None
    lost = found.sd[np.flatnonzero(found.before)[0], :3]
    assert np.linalg.norm(lost) > 1e3
    late = found.time > truth.duration - 0.5 * AFTER
    errors = found.errors(truth)[late]
    assert np.abs(errors[:, :3]).max() < 0.1
    standard = errors / found.sd[late]
    assert np.mean(standard[:, :3] ** 2) < 3.0
    assert np.abs(standard[-1]).max() < 5.0
