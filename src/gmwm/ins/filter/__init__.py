"""The INS/GNSS filter: mechanization, error states, measurement updates."""

from gmwm.ins.filter.aiding import (
    KINDS as KINDS,
    Aiding as Aiding,
    Events as Events,
    Fixes as Fixes,
    Outage as Outage,
    gnss as gnss,
)
from gmwm.ins.filter.covariance_kernels import (
    NAVIGATION as NAVIGATION,
    excess as excess,
    measurement_update as measurement_update,
    propagate as propagate,
    tilt_squared as tilt_squared,
    transition as transition,
)
from gmwm.ins.filter.filter import (
    Filter as Filter,
    InitialSd as InitialSd,
    Outputs as Outputs,
    modified as modified,
    navigate as navigate,
    unmodified as unmodified,
)
from gmwm.ins.filter.measurement_kernels import (
    IS_HEIGHT as IS_HEIGHT,
    IS_POSITION as IS_POSITION,
    IS_VELOCITY as IS_VELOCITY,
    measurement_row as measurement_row,
    noise_state as noise_state,
)
from gmwm.ins.filter.solution import FilterInnovations as FilterInnovations, Solution as Solution
from gmwm.ins.filter.states import IntArray as IntArray, SensorStates as SensorStates
