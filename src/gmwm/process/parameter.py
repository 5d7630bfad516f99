"""What a parameter of an error process is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

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
        if self.linear and value == 0.0:
            return True
        return self.lower < value < self.upper


class _Declared(Parameter):
    """A parameter in the body of a class: its name is that under which it stands there.

    Values stand in the dictionary of an instance, which goes before this descriptor.
    """

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
