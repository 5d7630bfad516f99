"""What is wrong with a recording, before a model is fitted to it."""

from gmwm.diagnosis.check import health
from gmwm.diagnosis.repeated import thinned
from gmwm.diagnosis.result import ChannelHealth, Health, Repetition

__all__ = ["ChannelHealth", "Health", "Repetition", "health", "thinned"]
