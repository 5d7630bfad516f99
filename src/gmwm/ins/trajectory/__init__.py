"""Error-free motion: from files, manoeuvres and missions."""

from gmwm.ins.trajectory.missions import (
    car_drive as car_drive,
    fixed_wing_loiter as fixed_wing_loiter,
    helicopter_mapping as helicopter_mapping,
)
from gmwm.ins.trajectory.trajectory import (
    NavState as NavState,
    Trajectory as Trajectory,
    check_latitudes as check_latitudes,
    coefficients as coefficients,
    finite_numbers as finite_numbers,
    finite_rows as finite_rows,
    three_numbers as three_numbers,
    unwrapped_angles as unwrapped_angles,
    unwrapped_longitudes as unwrapped_longitudes,
)
from gmwm.ins.trajectory.trajectory_file import (
    POSITION_WORDS as POSITION_WORDS,
    LogColumns as LogColumns,
    is_time as is_time,
    read_log as read_log,
    words_of as words_of,
)
