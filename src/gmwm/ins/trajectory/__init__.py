"""Error-free motion: from files, manoeuvres and missions."""

from gmwm.ins.trajectory.missions import (
    car_drive as car_drive,
    helicopter_mapping as helicopter_mapping,
)
