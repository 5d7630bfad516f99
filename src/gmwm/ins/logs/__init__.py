"""Logs of trajectories, IMUs and receivers, column by column."""

from gmwm.ins.logs.log_columns import (
    POSITION_WORDS as POSITION_WORDS,
    angle_factor as angle_factor,
    angle_unit as angle_unit,
    check_angles as check_angles,
    check_rising as check_rising,
    find_columns as find_columns,
    is_time as is_time,
    length_factor as length_factor,
    open_log as open_log,
    place as place,
    unit_of as unit_of,
    words_of as words_of,
)
from gmwm.ins.logs.trajectory_file import read_log as read_log
