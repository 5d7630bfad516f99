"""Many runs of several filters on the same errors, and their statistics."""

from gmwm.ins.simulation.consistency import (
    GROUPS as GROUPS,
    QUANTITIES as QUANTITIES,
    Consistency as Consistency,
    FilterErrors as FilterErrors,
    InnovationTest as InnovationTest,
    Ratio as Ratio,
    chi_square_ratio as chi_square_ratio,
    lag_one as lag_one,
    mean_ratio as mean_ratio,
    normalised as normalised,
    place_of as place_of,
    serial_ratio as serial_ratio,
)
from gmwm.ins.simulation.trials import (
    ErrorSource as ErrorSource,
    Experiment as Experiment,
    Scenario as Scenario,
    Simulated as Simulated,
)
from gmwm.ins.simulation.validation import Validation as Validation
