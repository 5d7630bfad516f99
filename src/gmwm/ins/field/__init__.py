"""Navigation of real IMU and GNSS logs."""

from gmwm.ins.field.measured import Measured
from gmwm.ins.field.navigated import Navigated
from gmwm.ins.field.outage_pictures import outage_pictures

__all__ = [
    "Measured",
    "Navigated",
    "outage_pictures",
]
