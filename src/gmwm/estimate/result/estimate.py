"""One estimated parameter, and where in an Allan plot it was read."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from annotated_types import Ge, Le
from scipy.optimize import brentq
from scipy.special import gammaincinv, lambertw, ndtr, ndtri

from gmwm._core import checks
from gmwm._core.distributions import student as t
from gmwm._core.documents import Positive, Text
from gmwm._core.units import customary_unit, field_units, si_parameter_unit
from gmwm.estimate import tuning
from gmwm.estimate.problem.information import information_with
from gmwm.estimate.problem.moments import Scales
from gmwm.estimate.problem.parameters import Coordinates
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
_LEAST_QUANTILE = 1e-9  # of a chi-square: keeps the limit of a level without information finite
_NEGLIGIBLE = 1e-3  # of an upper limit: an amplitude that changes no standard error


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


def quantile_above_zero(centre: float, deviation: float) -> float:
    """95 % quantile of N(centre, deviation^2) restricted to positive values."""
    tail = ndtr(centre / deviation) * (1.0 - tuning.UPPER_LEVEL)
    return centre - deviation * float(ndtri(tail))


def upper_amplitude(
    coordinates: Coordinates,
    processes: Sequence[Process],
    term: int,
    estimate: tuple[float, float, float],
    wv: WaveletVariance,
    absent: Collection[int] = (),
) -> float:
    """95 % upper limit of a term's amplitude, in the power that the spectrum is linear in.

    The larger the true value, the more its estimate varies: a random walk that can hardly be seen
    shows in few degrees of freedom. So the limit is the amplitude whose own estimate lies below the
    one found in 5 % of records: with the standard error of a vanishing amplitude, and beside it the
    spread of a chi-square with the degrees of freedom by which the amplitude raises that error. It
    does not exceed the amplitude that explains all of the variance at any level.

    coordinates, processes: Of all noise terms, which have values.
    estimate: The amplitude without the restriction to positive values, its standard error, and the
        amplitude at which that standard error holds.
    """
    kept = [i for i in range(len(processes)) if i == term or i not in absent]
    coordinates = coordinates.without([i for i in absent if i != term])
    processes, term = [processes[i] for i in kept], kept.index(term)
    centre, deviation, at = estimate
    most = _all_of_the_variance(processes[term], wv)
    plain = min(quantile_above_zero(centre, deviation), most)
    if not (np.isfinite(plain) and plain > 0.0 and all(p.has_spectrum() for p in processes)):
        return plain
    owners = coordinates.owners
    free = [k for k, (i, is_amplitude) in enumerate(owners) if i != term or is_amplitude]
    place = free.index(owners.index((term, True)))
    present = [p.with_amplitude(plain) if i == term else p for i, p in enumerate(processes)]
    information_at = information_with(coordinates, present, term, wv.n, wv.dt)

    def error(amplitude: float) -> float:
        """Standard error of the amplitude where it is the true one, at the present shape."""
        information = information_at(amplitude)[np.ix_(free, free)]
        scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
        inverse = np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-10)
        variance = inverse[place, place]
        return float(amplitude * scale[place] * np.sqrt(variance)) if variance > 0.0 else np.nan

    vanishing, there = (error(max(value, _NEGLIGIBLE * plain)) for value in (0.0, at))
    if not (np.isfinite(vanishing * there) and vanishing > 0.0 and there > 0.0):
        return plain
    least = deviation * vanishing / there
    # An estimate that does not use all information shows it in fewer degrees of freedom too.
    efficiency = float(np.clip((there / deviation) ** 2, tuning.LEAST_EFFICIENCY, 1.0))

    def excess(log_amplitude: float) -> float:
        amplitude = float(np.exp(log_amplitude))
        growth = max(error(amplitude) ** 2 - vanishing**2, 0.0) / amplitude**2 / efficiency
        below = 0.0
        if growth > 0.0:
            dof = 2.0 / growth
            below = 1.0 - 2.0 * float(gammaincinv(0.5 * dof, 1.0 - tuning.UPPER_LEVEL)) / dof
        spread = np.hypot(least, amplitude * below / ndtri(tuning.UPPER_LEVEL))
        return amplitude - quantile_above_zero(centre, float(spread))

    # Terms that stand in for each other leave their amplitudes open, but not beyond the data.
    if most <= plain or excess(np.log(plain)) >= 0.0:
        return plain
    if excess(np.log(most)) <= 0.0:
        return most
    return float(np.exp(brentq(excess, np.log(plain), np.log(most))))


def _all_of_the_variance(process: Process, wv: WaveletVariance) -> float:
    """Smallest 95 % upper limit over the levels of an amplitude that explains all variance."""
    alone = Scales.of(wv).curve(process.with_amplitude(1.0))
    tail = (1.0 - tuning.UPPER_LEVEL) / wv.tau.size
    quantile = np.maximum(2.0 * gammaincinv(0.5 * wv.dof, tail), _LEAST_QUANTILE)
    upper = wv.dof * wv.variance / quantile
    known = (alone > 0.0) & (wv.variance > 0.0)
    return float(np.min(upper[known] / alone[known], initial=np.inf))
