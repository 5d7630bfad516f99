"""Error-free motion: from files, manoeuvres and missions."""

from gmwm.ins.trajectory.missions import car_drive, fixed_wing_loiter, helicopter_mapping
from gmwm.ins.trajectory.splines import coefficients, unwrapped_angles, unwrapped_longitudes
from gmwm.ins.trajectory.trajectory import (
    HIGHEST_LATITUDE,
    NavState,
    Trajectory,
    check_latitudes,
    finite_numbers,
)

__all__ = [
    "HIGHEST_LATITUDE",
    "NavState",
    "Trajectory",
    "car_drive",
    "check_latitudes",
    "coefficients",
    "finite_numbers",
    "fixed_wing_loiter",
    "helicopter_mapping",
    "unwrapped_angles",
    "unwrapped_longitudes",
]
