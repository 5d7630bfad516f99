"""Error-free motion: from files, manoeuvres and missions."""

from gmwm.ins.trajectory.missions import (
    car_drive as car_drive,
    helicopter_mapping as helicopter_mapping,
)
from gmwm.ins.trajectory.trajectory import unwrapped_angles as unwrapped_angles
