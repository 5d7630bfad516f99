"""The INS/GNSS filter: mechanization, error states, measurement updates."""

from gmwm.ins.filter.aiding import KINDS, Aiding, Events, Fixes, Outage, gnss
from gmwm.ins.filter.covariance_kernels import (
    NAVIGATION,
    excess,
    measurement_update,
    propagate,
    tilt_squared,
    transition,
)
from gmwm.ins.filter.filter import Filter, InitialSd, Outputs, modified, navigate, unmodified
from gmwm.ins.filter.measurement_kernels import (
    IS_HEIGHT,
    IS_POSITION,
    IS_VELOCITY,
    measurement_row,
    noise_state,
)
from gmwm.ins.filter.solution import FilterInnovations, Solution
from gmwm.ins.filter.states import IntArray, SensorStates

__all__ = [
    "IS_HEIGHT",
    "IS_POSITION",
    "IS_VELOCITY",
    "KINDS",
    "NAVIGATION",
    "Aiding",
    "Events",
    "Filter",
    "FilterInnovations",
    "Fixes",
    "InitialSd",
    "IntArray",
    "Outage",
    "Outputs",
    "SensorStates",
    "Solution",
    "excess",
    "gnss",
    "measurement_row",
    "measurement_update",
    "modified",
    "navigate",
    "noise_state",
    "propagate",
    "tilt_squared",
    "transition",
    "unmodified",
]
