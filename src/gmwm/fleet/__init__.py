"""Many units of a sensor: each calibrated by itself, and what holds for most of them."""

from gmwm.fleet.fleet import Fleet as Fleet, fleet as fleet
from gmwm.fleet.spread import (
    Outlier as Outlier,
    Spread as Spread,
    Structures as Structures,
    outlier_distance as outlier_distance,
)
from gmwm.fleet.table import SCHEMA as SCHEMA
from gmwm.fleet.tolerance import (
    content_of_largest as content_of_largest,
    needed_units as needed_units,
    one_sided_factor as one_sided_factor,
    rank_of_limit as rank_of_limit,
    rank_of_limits as rank_of_limits,
    two_sided_factor as two_sided_factor,
)
from gmwm.fleet.tuning import (
    CONFIDENCE as CONFIDENCE,
    CONTENT as CONTENT,
    OUTLIER_LEVEL as OUTLIER_LEVEL,
)
from gmwm.fleet.unit import DERIVED as DERIVED, Number as Number, Unit as Unit
