"""One estimated parameter, and where in an Allan plot it was read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Ge, Le

from gmwm._core.documents import Positive, Text
from gmwm._core.units import field_units, si_parameter_unit
from gmwm.process import Model

Kind = Literal["estimated", "bound", "fixed", "undefined"]

HEAD = f"{'parameter':<16} {'estimate':>11} {'std. error':>10}  {'95 % interval':<22} unit"


@dataclass(frozen=True)
class InUnit:
    """An estimate in a data-sheet unit.

    value, lower, upper: In ``unit``.
    """

    value: float
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True)
class Estimate:
    """One parameter of a fitted model.

    Attributes
    ----------
    key : str
        As in ``Fit.params``.
    kind : {"estimated", "bound", "fixed", "undefined"}
        "bound": not significantly above zero, ``upper`` is a 95 % upper limit; "fixed": given, not
        estimated; "undefined": the term has no amplitude, so that its shape means nothing.
    value : float
        SI.
    stderr : float or None
        Standard error, SI; ``None`` where it was not estimated, or is zero by the bound.
    lower, upper : float
        95 % confidence interval, SI.
    unit : str
        SI.
    meaning : str
    field : tuple of InUnit
        The estimate in data-sheet units, the usual one first; empty where SI is usual.
    """

    COLUMNS: ClassVar = ("key", "kind", "value", "stderr", "lower", "upper", "unit", "meaning")

    key: str
    kind: Kind
    value: float
    stderr: float | None
    lower: float
    upper: float
    unit: str
    meaning: str
    field: tuple[InUnit, ...] = ()

    @property
    def usual(self) -> InUnit:
        """The estimate in the unit that data sheets use."""
        if self.field:
            return self.field[0]
        return InUnit(self.value, self.lower, self.upper, self.unit)

    def __str__(self) -> str:
        """A line under `HEAD`."""
        error, value = "", f"{self.value:.5g}"
        if self.kind == "undefined":
            value, interval = "-", "term has no amplitude"
        elif self.kind == "fixed":
            interval = "fixed"
        elif self.kind == "bound":
            interval = f"< {self.upper:.4g}"
        else:
            interval = f"{self.lower:.4g} .. {self.upper:.4g}"
            error = f"{self.stderr:.2g}"
        # A long name takes the blanks before its value.
        name = f"{self.key} "
        return f"{name}{value:>{max(28 - len(name), 0)}} {error:>10}  {interval:<22} {self.unit}"

    def to_dict(self) -> dict[str, Any]:
        """The columns of `Fit.to_frame`, in JSON types."""
        return {name: getattr(self, name) for name in self.COLUMNS}


def estimates_of(
    model: Model,
    quantity: str,
    stderr: Mapping[str, float],
    intervals: Mapping[str, tuple[float, float]],
    upper_bounds: Mapping[str, float],
) -> Iterator[Estimate]:
    """Every parameter of a fitted model, in order.

    model: With values.
    quantity: "gyro", "accel" or empty, for the units.
    stderr, intervals, upper_bounds: By key, SI.
    """
    for item in model.parameters:
        key, value, term = item.key, float(item.value or 0.0), model.terms[item.term]
        low, high = intervals.get(key, (value, value))
        linear = term.linear_parameter
        kind: Kind = "fixed"
        if key in upper_bounds:
            kind = "bound"
        elif key in stderr:
            kind = "estimated"
        elif item.parameter.role == "shape" and linear and term.values[linear.name] == 0.0:
            kind = "undefined"
        yield Estimate(
            key=key,
            kind=kind,
            value=value,
            stderr=stderr.get(key),
            lower=low,
            upper=high,
            unit=si_parameter_unit(item.parameter.unit, quantity),
            meaning=item.parameter.meaning,
            field=tuple(
                InUnit(value * f.per_si, low * f.per_si, high * f.per_si, f.unit)
                for f in field_units(item.parameter.unit, quantity)
            ),
        )


@dataclass(frozen=True)
class Region:
    """A straight part of the log-log Allan plot from which a parameter was read.

    key: The parameter.
    slope: Of the Allan deviation: -1, -1/2, 0, 1/2 or 1.
    tau_min, tau_max: First and last averaging time of the region, s.
    coefficient: Of the line ``coefficient * tau^slope``, u/s^slope.
    """

    key: Text
    slope: Annotated[float, Ge(-1.0), Le(1.0)]
    tau_min: Positive
    tau_max: Positive
    coefficient: float


def slope_name(slope: float) -> str:
    """A slope of the Allan deviation as people write it: -1, -1/2, 0, +1/2, +1."""
    return f"{'+' if slope > 0.0 else ''}{Fraction(slope)}"
