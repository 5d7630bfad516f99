"""Where and how a filter of real data starts."""

from gmwm.ins.field.start.alignment import (
    Alignment as Alignment,
    align as align,
    mean_sd as mean_sd,
    started as started,
)
from gmwm.ins.field.start.standing import standstills as standstills
