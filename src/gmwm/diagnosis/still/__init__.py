"""Stretches of a field log in which the sensor is at rest."""

from gmwm.diagnosis.still.blocks import vibration_notice as vibration_notice
from gmwm.diagnosis.still.stretches import (
    Still as Still,
    find_still as find_still,
    rest_of as rest_of,
)
