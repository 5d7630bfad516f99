"""What is wrong with a recording, before a model is fitted to it."""

from gmwm.diagnosis.check import health
from gmwm.diagnosis.findings import ChannelHealth, Finding, Health

__all__ = ["ChannelHealth", "Finding", "Health", "health"]
