"""Error-free motion: from files, manoeuvres and missions."""

from gmwm.ins.trajectory.columns import (
    POSITION_WORDS as POSITION_WORDS,
    LogColumns as LogColumns,
    is_time as is_time,
    words_of as words_of,
)
from gmwm.ins.trajectory.missions import (
    car_drive as car_drive,
    fixed_wing_loiter as fixed_wing_loiter,
    helicopter_mapping as helicopter_mapping,
)
from gmwm.ins.trajectory.splines import (
    coefficients as coefficients,
    unwrapped_angles as unwrapped_angles,
    unwrapped_longitudes as unwrapped_longitudes,
)
from gmwm.ins.trajectory.trajectory import (
    HIGHEST_LATITUDE as HIGHEST_LATITUDE,
    NavState as NavState,
    Trajectory as Trajectory,
    check_latitudes as check_latitudes,
    finite_numbers as finite_numbers,
)
