"""The axes that filter numbers are made for: one error model each, from any source."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Concatenate, ParamSpec, Protocol, Self, cast, overload

import numpy as np

from gmwm._core import checks
from gmwm._core.units import SI_UNIT
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.filter_numbers.propagation import Chain
from gmwm.filter_numbers.result import AxisFilterNumbers, FilterNumbers
from gmwm.process import Model, Process, as_model

One = Process | Model | Fit | str
Several = Calibration | Mapping[str, Process | Model] | Mapping[str, Fit]
Sd = float | Mapping[str, float]
"""For every axis, or by the name of an axis or its kind (gyro, accel)."""

SHARED = "shared"
"""Value of ``tau``: the one correlation time for all axes that costs least."""

DT = 0.01
"""s, sampling interval of models that are not fitted; slow terms and horizons are far above it."""

P = ParamSpec("P")


class PerAxis(Protocol[P]):
    """A function that gives the numbers of one axis, or those of several by channel name."""

    @overload
    def __call__(self, source: One, *args: P.args, **kwargs: P.kwargs) -> AxisFilterNumbers: ...
    @overload
    def __call__(self, source: Several, *args: P.args, **kwargs: P.kwargs) -> FilterNumbers: ...


def per_axis(
    function: Callable[Concatenate[One | Several, P], AxisFilterNumbers | FilterNumbers],
) -> PerAxis[P]:
    """The function itself; the type of its result depends on that of the source."""
    return cast(PerAxis[P], function)


@dataclass(frozen=True, eq=False)
class AxisModel:
    """The error model of one axis of a sensor.

    name: Of the channel; empty if there is none.
    bias_sd: Of a constant bias, u.
    fit: Where the model is from, if from a fit.
    rivals: Models that describe its data equally well, of a calibration.
    """

    name: str
    model: Model
    dt: float
    quantity: str
    bias_sd: float
    fit: Fit | None
    rivals: tuple[Model, ...] = ()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, AxisModel) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    @property
    def _key(self) -> tuple[object, ...]:
        """The same model and fit, not equal ones: a user's process may hold anything."""
        return self.name, self.dt, self.quantity, self.bias_sd, id(self.model), id(self.fit)

    @property
    def unit(self) -> str:
        """SI; "u" if the quantity is unknown."""
        return SI_UNIT.get(self.quantity, "u")

    @property
    def chain(self) -> Chain:
        """The filter by which its numbers are judged; the gyro of the vertical turns a heading."""
        is_heading = self.quantity == "gyro" and self.name.endswith("_z")
        return Chain.usual("" if is_heading else self.quantity)


@dataclass(frozen=True, eq=False)
class SensorAxes:
    """The axes of a source."""

    axes: tuple[AxisModel, ...]
    source: str
    rate: float
    duration: float
    single: bool

    @classmethod
    def of(
        cls, source: One | Several, dt: float | None, bias_sd: Sd, rate: float | None = None
    ) -> Self:
        """Axes of a model, a fit, a calibration or a mapping."""
        dt = checks.sampling_interval(DT if dt is rate is None else dt, rate)
        is_file = isinstance(source, str) and source.endswith(".json")
        if isinstance(source, One) and not is_file:
            name = (source.wv.name or "") if isinstance(source, Fit) else ""
            axis = _axis(name, source, dt, bias_sd)
            duration = source.wv.n_all * axis.dt if isinstance(source, Fit) else float("nan")
            return cls((axis,), "", 1.0 / axis.dt, duration, True)
        if not isinstance(source, Mapping) or not source:
            hint = f"or gmwm.load({source!r})" if is_file else "a calibration or models by channel"
            raise InputError(f"{checks.shown(source)} has no error model: give a fit, {hint}")
        axes = tuple(_axis(name, item, dt, bias_sd) for name, item in source.items())
        if isinstance(source, Calibration):
            axes = tuple(replace(axis, rivals=source.rivals.get(axis.name, ())) for axis in axes)
            rate = source.rate if source.has_one_rate else float("nan")
            return cls(axes, source.source, rate, source.duration, False)
        return cls(axes, "", 1.0 / axes[0].dt, float("nan"), False)

    def as_given(self, numbers: FilterNumbers) -> AxisFilterNumbers | FilterNumbers:
        """The numbers of the one axis, or of all by channel."""
        return next(iter(numbers.values())) if self.single else numbers

    def check_interval(self, name: str, shortest: float) -> None:
        """Raise `InputError` if a time (s) is below two sampling intervals of an axis."""
        least = 2.0 * max(axis.dt for axis in self.axes)
        if least > shortest:
            raise InputError(
                f"{name} = {shortest:g} s: give at least two sampling intervals, {least:g} s"
            )
        if shortest > checks.LONGEST_TIME:
            raise InputError(f"{name} = {shortest:g} s: give at most {checks.LONGEST_TIME:g} s")

    @property
    def groups(self) -> tuple[tuple[AxisModel, ...], ...]:
        """The axes of each quantity."""
        kinds = dict.fromkeys(axis.quantity for axis in self.axes)
        return tuple(tuple(a for a in self.axes if a.quantity == kind) for kind in kinds)

    def sharing(self, shared: bool) -> tuple[tuple[AxisModel, ...], ...]:
        """Groups of axes that have the same numbers."""
        return self.groups if shared else tuple((axis,) for axis in self.axes)

    def numbers(
        self, found: Callable[[tuple[AxisModel, ...]], Sequence[AxisFilterNumbers]], shared: bool
    ) -> FilterNumbers:
        """The numbers by channel, given those of axes that share them."""
        by_name = {
            axis.name: each
            for group in self.sharing(shared)
            for axis, each in zip(group, found(group), strict=True)
        }
        ordered = {axis.name: by_name[axis.name] for axis in self.axes}
        return FilterNumbers(ordered, self.source, self.rate, self.duration, shared)


def given_tau(form: str, tau: float | str | None) -> float | str | None:
    """A correlation time as users give it, checked; s or "shared"."""
    if tau is None:
        return None
    if form not in ("N+GM", "N+K+GM"):
        raise InputError(
            f"tau needs a form with one Gauss-Markov process, not {form}: leave tau out, or give "
            "N+GM or N+K+GM"
        )
    hint = f"give a time in seconds, or {SHARED!r}"
    return SHARED if tau == SHARED else checks.positive("tau", tau, hint)


def given_times(name: str, times: Sequence[float]) -> tuple[float, ...]:
    """Times (s) as users give them, rising; raises InputError if there is none."""
    hint = "give positive numbers of seconds, e.g. (1, 60)"
    rising = sorted({checks.positive(name, each, hint) for each in np.ravel(times).tolist()})
    if not rising:
        raise InputError(f"{name} is empty: give at least one outage length in seconds")
    return tuple(rising)


def _axis(name: str, item: object, dt: float, bias_sd: Sd) -> AxisModel:
    if not isinstance(item, One):
        hint = "give a fit, or a model such as gmwm.WhiteNoise(1e-4)"
        raise InputError(f"{name}: {checks.shown(item)} is not an error model: {hint}")
    model = item.model if isinstance(item, Fit) else as_model(item)
    model.require_given(name or "the model")
    fit = item if isinstance(item, Fit) else None
    if fit is not None:
        dt, quantity = fit.wv.dt, fit.wv.quantity or ""
    else:
        quantity = name.partition("_")[0]
    quantity = quantity if quantity in SI_UNIT else ""
    sd = bias_sd
    if isinstance(sd, Mapping):
        sd = sd.get(name, sd.get(quantity, 0.0))
    if not checks.is_number(sd) or sd < 0.0:
        raise InputError(f"bias_sd = {checks.shown(sd)}: give a number, zero or more")
    return AxisModel(name, model, dt, quantity, float(sd), fit)
