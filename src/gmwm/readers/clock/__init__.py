"""Time stamps: a rate, and the sample number of every row."""

from gmwm.readers.clock.stamps import Clock, Timing, agree
from gmwm.readers.clock.summer_time import without_summer_time
from gmwm.readers.clock.time_of_day import is_time_of_day, seconds_of_day

__all__ = ["Clock", "Timing", "agree", "is_time_of_day", "seconds_of_day", "without_summer_time"]
