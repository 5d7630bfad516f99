"""Recordings or units of a sensor: `compare` sets few side by side, `fleet` sums up many."""

from gmwm.population.compare import (
    compare as compare,
    labelled as labelled,
    parameter_spreads as parameter_spreads,
)
from gmwm.population.comparison import (
    STATES as STATES,
    AxisComparison as AxisComparison,
    AxisNumbers as AxisNumbers,
    ParameterSpread as ParameterSpread,
    SensorComparison as SensorComparison,
)
from gmwm.population.curves import Difference as Difference, Equality as Equality
from gmwm.population.fleet import Fleet as Fleet, fleet as fleet
from gmwm.population.spread import (
    Outlier as Outlier,
    Spread as Spread,
    Structures as Structures,
    content_of_largest as content_of_largest,
    needed_units as needed_units,
    one_sided_factor as one_sided_factor,
    outlier_distance as outlier_distance,
    rank_of_limit as rank_of_limit,
    rank_of_limits as rank_of_limits,
    spreads_of as spreads_of,
    structures_of as structures_of,
    two_sided_factor as two_sided_factor,
)
from gmwm.population.task import Item as Item, Task as Task, recordings as recordings
from gmwm.population.tuning import (
    CONFIDENCE as CONFIDENCE,
    CONTENT as CONTENT,
    OUTLIER_LEVEL as OUTLIER_LEVEL,
)
from gmwm.population.unit import (
    DERIVED as DERIVED,
    SCHEMA as SCHEMA,
    Number as Number,
    Unit as Unit,
    rows_of as rows_of,
)
