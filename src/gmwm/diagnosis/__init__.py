"""What is wrong with a recording, before a model is fitted to it."""

from gmwm.diagnosis.check import health
from gmwm.diagnosis.joined import STRETCH, health_stream, joined
from gmwm.diagnosis.repeated import thinned
from gmwm.diagnosis.result import ChannelHealth, Health, Repetition
from gmwm.diagnosis.spectral import Spectrum, spectrum
from gmwm.diagnosis.still import Still, find_still, rest_of

__all__ = [
    "STRETCH",
    "ChannelHealth",
    "Health",
    "Repetition",
    "Spectrum",
    "Still",
    "find_still",
    "health",
    "health_stream",
    "joined",
    "rest_of",
    "spectrum",
    "thinned",
]
