"""Many runs of several filters on the same errors, and their statistics."""

from gmwm.ins.simulation.consistency import (
    GROUPS as GROUPS,
    QUANTITIES as QUANTITIES,
    FilterErrors as FilterErrors,
    Ratio as Ratio,
)
from gmwm.ins.simulation.trials import (
    Experiment as Experiment,
    Scenario as Scenario,
    Simulated as Simulated,
)
from gmwm.ins.simulation.validation import Validation as Validation
