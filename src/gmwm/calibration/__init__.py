"""The main job: every channel of a recording, screening, a summary."""

from gmwm.calibration.calibration import Calibration, load
from gmwm.calibration.channel import AMBIGUITY
from gmwm.calibration.departures import KINDS as DEPARTURES, Departure, departures
from gmwm.calibration.entrance import calibrate
from gmwm.calibration.removal import without_departures
from gmwm.calibration.screening import SCREENING
from gmwm.calibration.stages import Stopwatch, stage
from gmwm.calibration.streamed import calibrate_stream
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
    "DEPARTURES",
    "SCREENING",
    "Calibration",
    "Departure",
    "Level",
    "Stopwatch",
    "calibrate",
    "calibrate_stream",
    "departures",
    "floor",
    "load",
    "noise_density",
    "random_walk",
    "sentence",
    "stage",
    "white_density",
    "without_departures",
]
