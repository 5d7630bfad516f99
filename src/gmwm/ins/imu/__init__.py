"""Inertial signals and the errors of sensors."""

from gmwm.ins.imu.emulation import Imu, emulate
from gmwm.ins.imu.preintegration import Preintegration, preintegrate
from gmwm.ins.imu.recorded import Recorded
from gmwm.ins.imu.sensors import AXES, SensorErrors, SensorModels

__all__ = [
    "AXES",
    "Imu",
    "Preintegration",
    "Recorded",
    "SensorErrors",
    "SensorModels",
    "emulate",
    "preintegrate",
]
