"""The main job: every channel of a recording, what is done about findings, a summary."""

from gmwm.calibration.calibration import Calibration, calibrate, load
from gmwm.calibration.screening import REMEDIES
from gmwm.calibration.summary import (
    Level,
    floor,
    noise_density,
    random_walk,
    sentence,
    white_density,
)

__all__ = [
    "REMEDIES",
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
