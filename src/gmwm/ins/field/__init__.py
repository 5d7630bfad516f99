"""Navigation of real IMU and GNSS logs."""

from gmwm.ins.field.compare import Comparison, compare
from gmwm.ins.field.measured import Measured
from gmwm.ins.field.navigated import Navigated

__all__ = [
    "Comparison",
    "Measured",
    "Navigated",
    "compare",
]
