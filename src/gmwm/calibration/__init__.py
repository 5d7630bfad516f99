"""The main job: every channel of a recording, screening, a summary."""

from gmwm.calibration.calibration import AMBIGUITY, Calibration, calibrate, load
from gmwm.calibration.screening import SCREENING
from gmwm.calibration.summary import (
    Level,
    floor,
    noise_density,
    random_walk,
    sentence,
    white_density,
)

__all__ = [
    "AMBIGUITY",
    "SCREENING",
    "Calibration",
    "Level",
    "calibrate",
    "floor",
    "load",
    "noise_density",
    "random_walk",
    "sentence",
    "white_density",
]
