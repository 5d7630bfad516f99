"""Error models of tests: what bounds and reductions are held to."""

from gmwm import AR, BiasInstability, GaussMarkov, Model, RandomWalk, WhiteNoise
from gmwm.ins import SensorModels

TRUTHS = {
    "one": WhiteNoise(8e-5) + GaussMarkov(4e-5, 60.0),
    "two": WhiteNoise(5e-5) + GaussMarkov(4e-4, 5.0) + GaussMarkov(1e-4, 300.0),
    "three": WhiteNoise(1e-4)
    + GaussMarkov(2e-4, 0.5)
    + GaussMarkov(6e-5, 25.0)
    + GaussMarkov(9e-5, 2000.0),
    "walk": WhiteNoise(1e-4) + RandomWalk(2e-6) + GaussMarkov(1e-4, 30.0),
    "flicker": WhiteNoise(1e-4) + BiasInstability(5e-5),
    "slow": Model((GaussMarkov(4e-5, 60.0), GaussMarkov(3e-4, 6e5))),
    "fast": Model((GaussMarkov(1e-2, 0.02), GaussMarkov(3e-3, 0.3))),
    "far": WhiteNoise(1e-8) + GaussMarkov(1e-3, 3.0) + GaussMarkov(1e-7, 1e4),
    "autoregressive": WhiteNoise(1e-4) + AR([0.9997], 1e-13),
}
"""By name; sampled at DT."""

DT = 0.01


def triads(gyro, accel):
    """Sensors whose three axes have one model."""
    return SensorModels.of({"gyro": gyro, "accel": accel})


def noisy(imu, models, rng):
    """An IMU with errors drawn of its models."""
    errors = models.simulate(imu.n, imu.dt, rng).total
    return imu.with_errors(errors[:, :3], errors[:, 3:])
