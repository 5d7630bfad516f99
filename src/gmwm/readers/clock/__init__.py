"""Time stamps: a rate, and the sample number of every row."""

from gmwm.readers.clock.stamps import Clock, Timing, agree
from gmwm.readers.clock.summer_time import without_summer_time

__all__ = ["Clock", "Timing", "agree", "without_summer_time"]
