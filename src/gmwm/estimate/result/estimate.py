"""One estimated parameter, and where in an Allan plot it was read."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from annotated_types import Ge, Le
from scipy.special import lambertw

from gmwm._core import checks
from gmwm._core.distributions import student as t
from gmwm._core.documents import Positive, Text
from gmwm._core.units import customary_unit, field_units, si_parameter_unit
from gmwm.estimate import tuning
from gmwm.process import Model, Parameter, Process
from gmwm.variance import WaveletVariance

Kind = Literal["estimated", "bound", "fixed", "undefined"]


@dataclass(frozen=True)
class InUnit:
    """An estimate in a data-sheet unit."""

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

    @classmethod
    def of(
        cls,
        process: Process,
        kind: Kind,
        value: float,
        stderr: float | None,
        interval: tuple[float, float],
        wv: WaveletVariance,
    ) -> Self:
        """An estimate of the parameter of a process that has one, SI; ``wv`` has the units."""
        (parameter,) = process.parameters
        unit, meaning = parameter.unit, parameter.meaning
        usual, per_si = customary_unit(unit, wv.quantity, wv.unit)
        field = (InUnit(value * per_si, interval[0] * per_si, interval[1] * per_si, usual),)
        si = si_parameter_unit(unit, wv.quantity)
        return cls(parameter.name, kind, value, stderr, *interval, si, meaning, field)

    @property
    def usual(self) -> InUnit:
        """The estimate in the unit that data sheets use."""
        return self.in_units("field")

    def in_units(self, units: str) -> InUnit:
        """The estimate in the unit that data sheets use ("field"), or in SI ("si").

        Raises
        ------
        InputError
            If the units are neither.
        """
        if checks.choice("units", units, ("field", "si")) == "field" and self.field:
            return self.field[0]
        return InUnit(self.value, self.lower, self.upper, self.unit)

    def cells(self, units: str = "field") -> tuple[str, ...]:
        """Row of ``print(fit)``: key, estimate, standard error, 95 % interval and unit."""
        shown, error = self.in_units(units), ""
        value = f"{shown.value:.5g}"
        if self.kind == "undefined":
            value, interval = "-", "term has no amplitude"
        elif self.kind == "fixed":
            interval = "fixed"
        elif self.kind == "bound":
            interval = f"<= {shown.upper:.4g}"
        else:
            interval = f"{shown.lower:.4g} .. {shown.upper:.4g}"
            error = "" if self.stderr is None else f"{self.to_dict(units)['stderr']:.2g}"
        return self.key, value, error, interval, shown.unit

    def __str__(self) -> str:
        return "  ".join(filter(None, self.cells()))

    def to_dict(self, units: str = "si") -> dict[str, Any]:
        """The columns of `Fit.to_frame`, in JSON types; in SI, or in data-sheet units ("field")."""
        shown = self.in_units(units)
        values = {name: getattr(self, name) for name in self.COLUMNS}
        if self.stderr is not None and self.value:
            values["stderr"] = self.stderr * (shown.value / self.value)
        return values | {name: getattr(shown, name) for name in ("value", "lower", "upper", "unit")}


def estimates_of(
    model: Model,
    quantity: str,
    stderr: Mapping[str, float],
    intervals: Mapping[str, tuple[float, float]],
    upper_bounds: Mapping[str, float],
) -> Iterator[Estimate]:
    """Every parameter of a fitted model, in order.

    quantity: "gyro", "accel" or empty, for the units.
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


_NO_GROWTH = 1e-6
_EXACT = 1e-12  # relative error


def confidence_interval(
    parameter: Parameter,
    value: float,
    error: float,
    level: float,
    *,
    growth: float = 0.0,
    slope_dof: float = np.inf,
) -> tuple[float, float]:
    """Interval that stays in the parameter's range: lower and upper end.

    For a positive parameter it holds the values that the estimate does not contradict with the
    standard error that they would have themselves (Wilson 1927, *JASA* 22, 209-212), where the
    relative standard error is proportional to ``value^k``; deviations are those of the logarithm.
    The quantiles are Student's t for the degrees of freedom that the relative error stands for: a
    variance known to a relative error of r has 2/r^2 of them, and no fewer than three are taken, as
    the tails of t are then heavier than those of a variance's logarithm.

    growth: The exponent k, of positive parameters.
    """
    if parameter.lower == 0.0 and value > 0.0:
        relative = error / value
        if relative > tuning.UNDETERMINED:
            return 0.0, parameter.upper
        power = parameter.power if parameter.linear else 1
        dof = 2.0 / max(power * relative, _EXACT) ** 2
        width = relative * float(t.ppf(0.5 + 0.5 * level, max(dof, tuning.FEWEST_DOF)))
        low, high = (np.exp(_end(sign * width, growth)) for sign in (-1.0, 1.0))
        return float(value * low), min(float(value * high), parameter.upper)
    dof = slope_dof if parameter.role == "slope" else np.inf
    half_width = float(t.ppf(0.5 + 0.5 * level, max(dof, 1.0))) * error
    return max(value - half_width, parameter.lower), min(value + half_width, parameter.upper)


def _end(width: float, growth: float) -> float:
    """The x with x = width exp(growth x).

    A standard error that grows faster than the deviation leaves no end, but the power law does not
    hold that far. Then it is the largest deviation that has one, or that of the power of the
    parameter whose standard error is constant, whichever is farther.
    """
    steepness = growth * width
    if abs(steepness) < _NO_GROWTH:
        return width
    if steepness <= np.exp(-1.0):
        return float(-lambertw(-steepness).real / growth)
    constant = -np.log1p(-steepness) if steepness < 1.0 else np.inf
    return float(max(1.0, constant) / growth)
