"""Where and how a filter of real data starts."""

from gmwm.ins.field.start.alignment import Alignment, align, mean_sd, started
from gmwm.ins.field.start.standing import standstills

__all__ = ["Alignment", "align", "mean_sd", "standstills", "started"]
