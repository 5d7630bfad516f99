"""Pictures from plain arrays and labels; knows no result object."""

from gmwm.plotting.deviation import (
    COMPONENT_COLOURS as COMPONENT_COLOURS,
    DATA_COLOUR as DATA_COLOUR,
    SUM_COLOUR as SUM_COLOUR,
    allan_axes as allan_axes,
    boxes as boxes,
    curves as curves,
    deviation as deviation,
    deviation_range as deviation_range,
    deviations as deviations,
    intervals as intervals,
    model_set as model_set,
    residuals as residuals,
    sensor_lines as sensor_lines,
    straight_lines as straight_lines,
    styles as styles,
)
from gmwm.plotting.navigation import (
    errors as errors,
    growth as growth,
    innovations as innovations,
    literal as literal,
    measured_track as measured_track,
    outages_compared as outages_compared,
    track as track,
)
