"""Time stamps: a rate, and the sample number of every row."""

from gmwm.readers.clock.stamps import Clock, Timing, agree

__all__ = ["Clock", "Timing", "agree"]
