"""Inertial signals and the errors of sensors."""

from gmwm.ins.imu.increments import Imu as Imu, emulate as emulate
from gmwm.ins.imu.sensors import (
    AXES as AXES,
    Recorded as Recorded,
    SensorErrors as SensorErrors,
    SensorModels as SensorModels,
    require_axes as require_axes,
)
