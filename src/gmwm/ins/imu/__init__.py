"""Inertial signals and the errors of sensors."""

from gmwm.ins.imu.sensors import AXES as AXES, Recorded as Recorded, SensorModels as SensorModels
