"""Several recordings or units of a sensor beside each other."""

from gmwm.comparison.clock import ClockRatio
from gmwm.comparison.compare import compare, labelled
from gmwm.comparison.curves import Difference, Equality
from gmwm.comparison.result import STATES, AxisComparison, SensorComparison
from gmwm.comparison.structure import AxisNumbers, ParameterSpread

__all__ = [
    "STATES",
    "AxisComparison",
    "AxisNumbers",
    "ClockRatio",
    "Difference",
    "Equality",
    "ParameterSpread",
    "SensorComparison",
    "compare",
    "labelled",
]
