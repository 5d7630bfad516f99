"""Many runs of several filters on the same errors, and their statistics."""

from gmwm.ins.simulation.consistency import (
    Consistency as Consistency,
    InnovationTest as InnovationTest,
    Ratio as Ratio,
    chi_square_ratio as chi_square_ratio,
    mean_ratio as mean_ratio,
    serial_ratio as serial_ratio,
)
from gmwm.ins.simulation.filter_errors import (
    GROUPS as GROUPS,
    QUANTITIES as QUANTITIES,
    FilterErrors as FilterErrors,
    lag_one as lag_one,
    normalised as normalised,
    place_of as place_of,
)
from gmwm.ins.simulation.trials import (
    ErrorSource as ErrorSource,
    Experiment as Experiment,
    Scenario as Scenario,
    Simulated as Simulated,
)
from gmwm.ins.simulation.validation import Validation as Validation
