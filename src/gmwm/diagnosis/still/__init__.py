"""Stretches of a field log in which the sensor is at rest."""

from gmwm.diagnosis.still.blocks import vibration_notice
from gmwm.diagnosis.still.stretches import Still, find_still, rest_of

__all__ = ["Still", "find_still", "rest_of", "vibration_notice"]
