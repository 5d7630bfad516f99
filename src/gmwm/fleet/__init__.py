"""Many units of a sensor: each calibrated by itself, and what holds for most of them."""

from gmwm.fleet.fleet import Fleet, fleet
from gmwm.fleet.spread import Outlier, Spread, Structures, outlier_distance
from gmwm.fleet.table import SCHEMA
from gmwm.fleet.tolerance import (
    content_of_largest,
    needed_units,
    one_sided_factor,
    rank_of_limit,
    rank_of_limits,
    two_sided_factor,
)
from gmwm.fleet.tuning import CONFIDENCE, CONTENT, OUTLIER_LEVEL
from gmwm.fleet.unit import DERIVED, Number, Unit

__all__ = [
    "CONFIDENCE",
    "CONTENT",
    "DERIVED",
    "OUTLIER_LEVEL",
    "SCHEMA",
    "Fleet",
    "Number",
    "Outlier",
    "Spread",
    "Structures",
    "Unit",
    "content_of_largest",
    "fleet",
    "needed_units",
    "one_sided_factor",
    "outlier_distance",
    "rank_of_limit",
    "rank_of_limits",
    "two_sided_factor",
]
