"""Where in an Allan plot a parameter was read."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True)
class Region:
    """A straight part of the log-log Allan plot from which a parameter was read.

    key: The parameter.
    slope: Of the Allan deviation: -1, -1/2, 0, 1/2 or 1.
    tau_min, tau_max: First and last averaging time of the region, s.
    coefficient: Of the line ``coefficient * tau^slope``, u/s^slope.
    """

    key: str
    slope: float
    tau_min: float
    tau_max: float
    coefficient: float


def slope_name(slope: float) -> str:
    """A slope of the Allan deviation as people write it: -1, -1/2, 0, +1/2, +1."""
    return f"{'+' if slope > 0.0 else ''}{Fraction(slope)}"
