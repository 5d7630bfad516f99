"""What a parameter of an error process is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Role = Literal["scale", "variance", "shape", "slope"]


@dataclass(frozen=True)
class Parameter:
    """One parameter of an error process.

    Attributes
    ----------
    name : str
        As in the constructor and in ``params``, e.g. ``"N"``.
    unit : str
        SI, with ``u`` for the unit of the channel, e.g. ``"u/sqrt(Hz)"``.
    role : {"scale", "variance", "shape", "slope"}
        How the parameter enters the wavelet variance: as its square (``scale``), linearly
        (``variance``), non-linearly (``shape``), or not through the stochastic part at all
        (``slope``, the signed rate ramp).
    lower, upper : float
        Open interval of admissible values (a scale may also be zero).
    meaning : str
        A few words for tables.
    """

    name: str
    unit: str
    role: Role = "shape"
    lower: float = 0.0
    upper: float = float("inf")
    meaning: str = ""

    @property
    def linear(self) -> bool:
        """Whether a power of the parameter enters the wavelet variance as a factor."""
        return self.role in ("scale", "variance")

    @property
    def power(self) -> int:
        """The power with which a linear parameter enters: 2 for a scale, 1 for a variance."""
        return 2 if self.role == "scale" else 1

    def admits(self, value: float) -> bool:
        """Whether ``value`` lies in the parameter's range."""
        if self.linear and value == 0.0:
            return True
        return self.lower < value < self.upper
