"""Several recordings or units of a sensor beside each other."""

from gmwm.comparison.clock import ClockRatio as ClockRatio
from gmwm.comparison.compare import compare as compare, labelled as labelled
from gmwm.comparison.curves import Difference as Difference, Equality as Equality
from gmwm.comparison.result import (
    STATES as STATES,
    AxisComparison as AxisComparison,
    SensorComparison as SensorComparison,
)
from gmwm.comparison.structure import AxisNumbers as AxisNumbers, ParameterSpread as ParameterSpread
