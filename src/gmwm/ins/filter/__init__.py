"""The INS/GNSS filter: mechanization, error states, measurement updates."""

from gmwm.ins.filter.aiding import Aiding as Aiding, Fixes as Fixes, Outage as Outage, gnss as gnss
from gmwm.ins.filter.covariance_kernels import (
    measurement_update as measurement_update,
    propagate as propagate,
    tilt_squared as tilt_squared,
    transition as transition,
)
from gmwm.ins.filter.filter import (
    Filter as Filter,
    InitialSd as InitialSd,
    unmodified as unmodified,
)
from gmwm.ins.filter.measurements import (
    KINDS as KINDS,
    observe as observe,
    observe_since as observe_since,
)
from gmwm.ins.filter.records import (
    Keyframe as Keyframe,
    Kinematics as Kinematics,
    new_transition as new_transition,
)
from gmwm.ins.filter.states import SensorStates as SensorStates
