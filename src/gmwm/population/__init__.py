"""Recordings or units: `compare` sets few side by side, `fleet` sums up many, `array` weighs."""

from gmwm.population.array import (
    ArrayAxis as ArrayAxis,
    SensorArray as SensorArray,
    array as array,
)
from gmwm.population.compare import compare as compare, labelled as labelled
from gmwm.population.comparison import (
    STATES as STATES,
    AxisComparison as AxisComparison,
    SensorComparison as SensorComparison,
)
from gmwm.population.curves import Difference as Difference, Equality as Equality
from gmwm.population.fleet import (
    FAIL as FAIL,
    NONE as NONE,
    PASS as PASS,
    Fleet as Fleet,
    fleet as fleet,
    in_words as in_words,
)
from gmwm.population.spread import (
    Spread as Spread,
    needed_units as needed_units,
    one_sided_factor as one_sided_factor,
    outlier_distance as outlier_distance,
    rank_of_limit as rank_of_limit,
    spreads_of as spreads_of,
)
from gmwm.population.task import Item as Item, Task as Task, recordings as recordings
from gmwm.population.tuning import CONFIDENCE as CONFIDENCE, CONTENT as CONTENT
from gmwm.population.unit import (
    LETTERS as LETTERS,
    SCHEMA as SCHEMA,
    Choice as Choice,
    Number as Number,
    Structure as Structure,
    Unit as Unit,
    rows_of as rows_of,
)
