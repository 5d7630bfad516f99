"""Parameters of an error process: name, unit, role, range, and the map to the real line."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError

Role = Literal["scale", "variance", "shape", "slope"]


@dataclass(frozen=True)
class Parameter:
    """One parameter of an error process; declared by `parameter`.

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
        return (self.linear and value == 0.0) or self.lower < value < self.upper

    def checked(self, value: Any, owner: str) -> float:
        """The value as a number in the range; raises InputError if it is none."""
        where = f"{owner}: {self.name}"
        try:
            number = float("x" if isinstance(value, str) else value)
        except (TypeError, ValueError, OverflowError):
            raise InputError(
                f"{where} is {checks.shown(value)}: give a number, or None to estimate"
            ) from None
        if not math.isfinite(number) or not self.admits(number):
            raise InputError(
                f"{where} = {number:g} is out of range: it must lie in "
                f"({self.lower:g}, {self.upper:g})"
            )
        return number

    def to_free(self, value: float) -> float:
        """Map a value to the whole real line."""
        if math.isfinite(self.lower) and math.isfinite(self.upper):
            return float(np.log((value - self.lower) / (self.upper - value)))
        return float(np.log(value - self.lower)) if math.isfinite(self.lower) else float(value)

    def from_free(self, free: float) -> float:
        """Inverse of `to_free`."""
        if math.isfinite(self.lower) and math.isfinite(self.upper):
            return float(self.lower + (self.upper - self.lower) / (1.0 + np.exp(-free)))
        return float(self.lower + np.exp(free)) if math.isfinite(self.lower) else float(free)

    def grid(self, dt: float, n: int, points: int = 16) -> FloatArray:
        """Values all over the range, for a record of ``n`` samples ``dt`` s apart."""
        lower, upper = self.lower, self.upper
        if self.unit == "s":
            lower, upper = max(lower, 0.5 * dt), min(upper, n * dt)
        elif self.unit == "Hz":
            lower, upper = max(lower, 1.0 / (n * dt)), min(upper, 0.5 / dt)
        if not math.isfinite(upper):
            upper = max(1e3 * lower, 1e3)
        if lower < 0.0:
            return np.linspace(lower, upper, points + 2)[1:-1]
        return np.geomspace(lower or 1e-3 * upper, upper, points + 2)[1:-1]


class _Declared(Parameter):
    """A parameter in a class body, which gives it its name; instances shadow this descriptor."""

    def __set_name__(self, owner: type, name: str) -> None:
        object.__setattr__(self, "name", name)

    def __get__(self, instance: object | None, owner: type) -> Parameter:
        if instance is None:
            return self
        raise InputError(f"{self.name} of {instance!r} is open: give it a value, or estimate it")


def parameter(
    unit: str,
    role: Role = "shape",
    *,
    lower: float = 0.0,
    upper: float = float("inf"),
    meaning: str = "",
) -> Any:
    """Declare a parameter in the body of a process; see `Parameter` for the arguments.

    On an instance the name reads as the value, and raises `InputError` where it is open.

    Examples
    --------
    >>> from gmwm import Process, parameter
    >>> class Flat(Process):
    ...     level: float = parameter("u/sqrt(Hz)", role="scale")
    ...     def psd(self, f, dt):
    ...         return self.level**2 + 0.0 * f
    >>> Flat(level=2.0).level
    2.0
    """
    return _Declared("", unit, role, lower, upper, meaning)
