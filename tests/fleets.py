"""Fleets that take milliseconds a unit."""

from gmwm import WhiteNoise

QUICK = {"model": WhiteNoise(), "screening": (), "rate": 1.0, "units": {"gyro": "rad/s"}}
