"""Recordings or units: `compare` sets few side by side, `fleet` sums up many, `array` weighs."""

from gmwm.population.array import SensorArray as SensorArray, array as array
from gmwm.population.compare import compare as compare, labelled as labelled
from gmwm.population.comparison import (
    STATES as STATES,
    AxisComparison as AxisComparison,
    SensorComparison as SensorComparison,
)
from gmwm.population.fleet import PASS as PASS, Fleet as Fleet, fleet as fleet, in_words as in_words
from gmwm.population.spread import (
    Spread as Spread,
    needed_units as needed_units,
    outlier_distance as outlier_distance,
)
from gmwm.population.tuning import CONFIDENCE as CONFIDENCE, CONTENT as CONTENT
from gmwm.population.unit import LETTERS as LETTERS, SCHEMA as SCHEMA, Number as Number
