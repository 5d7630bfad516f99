"""Sensors that are known by their data sheets, and what follows for models and filters."""

from gmwm.datasheet.reading import (
    datasheet as datasheet,
    read_datasheet as read_datasheet,
    sheets as sheets,
)
from gmwm.datasheet.sheet import UNITS as UNITS, Datasheet as Datasheet
