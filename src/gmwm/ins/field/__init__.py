"""Navigation of real IMU and GNSS logs."""

from gmwm.ins.field.compare import Comparison, compare
from gmwm.ins.field.measured import Measured
from gmwm.ins.field.navigated import Navigated
from gmwm.ins.field.outage_pictures import outage_pictures

__all__ = [
    "Comparison",
    "Measured",
    "Navigated",
    "compare",
    "outage_pictures",
]
