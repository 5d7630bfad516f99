"""Navigation of real IMU and GNSS logs."""

from gmwm.ins.field.compare import Comparison as Comparison, compare as compare
from gmwm.ins.field.measured import Measured as Measured
from gmwm.ins.field.navigated import Navigated as Navigated
from gmwm.ins.field.outage_pictures import outage_pictures as outage_pictures
