"""Logs of trajectories, IMUs and receivers, column by column."""

from gmwm.ins.logs.log_columns import (
    POSITION_WORDS,
    angle_factor,
    angle_unit,
    check_angles,
    check_rising,
    find_columns,
    is_time,
    length_factor,
    open_log,
    place,
    unit_of,
    words_of,
)
from gmwm.ins.logs.trajectory_file import read_log

__all__ = [
    "POSITION_WORDS",
    "angle_factor",
    "angle_unit",
    "check_angles",
    "check_rising",
    "find_columns",
    "is_time",
    "length_factor",
    "open_log",
    "place",
    "read_log",
    "unit_of",
    "words_of",
]
