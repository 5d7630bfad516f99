"""The INS/GNSS filter: mechanization, error states, measurement updates."""

from gmwm.ins.filter.aiding import Outage as Outage, gnss as gnss
from gmwm.ins.filter.filter import Filter as Filter
from gmwm.ins.filter.measurements import KINDS as KINDS
