"""What is wrong with a recording, before a model is fitted to it."""

from gmwm.diagnosis.check import health
from gmwm.diagnosis.repeated import thinned
from gmwm.diagnosis.result import ChannelHealth, Health, Repetition
from gmwm.diagnosis.spectrum import Spectrum, spectrum

__all__ = ["ChannelHealth", "Health", "Repetition", "Spectrum", "health", "spectrum", "thinned"]
