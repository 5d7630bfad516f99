"""What is wrong with a recording, before a model is fitted to it."""

from gmwm.diagnosis.check import health
from gmwm.diagnosis.result import ChannelHealth, Health

__all__ = ["ChannelHealth", "Health", "health"]
