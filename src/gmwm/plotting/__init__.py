"""Pictures from plain arrays and labels; knows no result object."""

from gmwm.plotting.deviation import (
    COMPONENT_COLOURS,
    DATA_COLOUR,
    LINEAR_RESIDUAL,
    SUM_COLOUR,
    boxes,
    curves,
    deviation,
    deviation_range,
    deviations,
    residuals,
    straight_lines,
)
from gmwm.plotting.intervals import intervals
from gmwm.plotting.navigation import (
    errors,
    growth,
    innovations,
    literal,
    measured_outage,
    measured_track,
    outages_compared,
    track,
)

__all__ = [
    "COMPONENT_COLOURS",
    "DATA_COLOUR",
    "LINEAR_RESIDUAL",
    "SUM_COLOUR",
    "boxes",
    "curves",
    "deviation",
    "deviation_range",
    "deviations",
    "errors",
    "growth",
    "innovations",
    "intervals",
    "literal",
    "measured_outage",
    "measured_track",
    "outages_compared",
    "residuals",
    "straight_lines",
    "track",
]
