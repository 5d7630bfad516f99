"""The INS/GNSS filter: mechanization, error states, measurement updates."""

from gmwm.ins.filter.aiding import (
    Aiding as Aiding,
    Fixes as Fixes,
    Outage as Outage,
    gnss as gnss,
    odometry as odometry,
    poses as poses,
    wheels as wheels,
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
    FilterInnovations as FilterInnovations,
    InitialSd as InitialSd,
    Outputs as Outputs,
    Solution as Solution,
    navigate as navigate,
    unmodified as unmodified,
)
from gmwm.ins.filter.measurements import (
    IS_GNSS as IS_GNSS,
    IS_RELATIVE as IS_RELATIVE,
    KINDS as KINDS,
    new_keyframe as new_keyframe,
    observe as observe,
    observe_since as observe_since,
)
from gmwm.ins.filter.records import (
    Events as Events,
    Keyframe as Keyframe,
    Kinematics as Kinematics,
    SensorTable as SensorTable,
    Settings as Settings,
    Transition as Transition,
    new_transition as new_transition,
)
from gmwm.ins.filter.states import SensorStates as SensorStates
