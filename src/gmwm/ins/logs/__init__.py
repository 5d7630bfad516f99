"""Own logs: an IMU's record and GNSS fixes, aligned, filtered, examined and compared."""

from gmwm.ins.logs.alignment import align as align
from gmwm.ins.logs.attitude import standstills as standstills, steady as steady
from gmwm.ins.logs.comparison import Comparison as Comparison, paired as paired
from gmwm.ins.logs.faults import Fault as Fault, Faults as Faults, fault_notice as fault_notice
from gmwm.ins.logs.fix_log import read_fix_log as read_fix_log
from gmwm.ins.logs.imu_log import read_imu_log as read_imu_log
from gmwm.ins.logs.measured import LogSpec as LogSpec, Measured as Measured
from gmwm.ins.logs.navigated import Navigated as Navigated
from gmwm.ins.logs.replay import Replay as Replay, smooth as smooth
