"""The error budget: how fast attitude, velocity and position are lost without aiding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gmwm._core.text import brief, bullets, plain_table
from gmwm._core.typing import BoolArray, FloatArray
from gmwm._core.units import SI_UNIT, factor
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.filter_numbers.axes import AxisModel, One, SensorAxes, Several, given_times
from gmwm.filter_numbers.propagation import integral_rms

if TYPE_CHECKING:
    from matplotlib.axes import Axes

QUANTITIES = {"attitude": "rad", "velocity": "m/s", "position": "m"}
"""Errors of the budget, with their SI units."""

FIELD_UNITS = {"attitude": "deg", "velocity": "m/s", "position": "m"}
"""Units in which they are shown."""

HORIZONTAL = "horizontal"
"""Name of the total over the x and y axes of both sensors."""

STARTS = {
    True: "slow errors known at the start",
    False: "slow errors unknown at the start",
}
"""Knowledge of the sensors' errors at the start, by `ErrorBudget.calibrated`; attitude, velocity
and position are exact there."""

TIMES = (1.0, 10.0, 60.0, 600.0)
"""Usual coasting times, s."""

LONGEST = 600.0
"""Coasting time up to which the formulas hold to within 10 %, s."""

_GRAVITY = factor("g", "m/s^2")
_SMALL_ANGLE = np.radians(10.0)
_RECORD_SHARE = 0.1  # of a record: errors over longer times are seen fewer than ten times
_CURVE_POINTS = 33
_HORIZONTAL_CHANNELS = ("gyro_x", "gyro_y", "accel_x", "accel_y")


@dataclass(frozen=True)
class ErrorRow:
    """Error of one quantity by one term of one channel's model.

    Attributes
    ----------
    channel : str
    component : str
        Label of the term in its model.
    quantity : {"attitude", "velocity", "position"}
    unit : {"rad", "m/s", "m"}
    values : tuple of float
        Standard deviation at the budget's ``times``; the absolute value for a rate ramp.
    curve : tuple of float
        The same at each time of its ``grid``.
    """

    channel: str
    component: str
    quantity: str
    unit: str
    values: tuple[float, ...]
    curve: tuple[float, ...]


@dataclass(frozen=True)
class ErrorBudget:
    """Predicted growth of attitude, velocity and position errors in free inertial coasting.

    Attributes
    ----------
    times : tuple of float
        Coasting times, s, rising.
    rows : tuple of ErrorRow
        Channel by channel, quantity by quantity, term by term.
    calibrated : bool
        Whether the initial values of the slow errors are known.
    grid : tuple of float
        Times of the curves of `plot`, s.
    notes : tuple of str
        Read these before using the numbers.
    """

    times: tuple[float, ...]
    rows: tuple[ErrorRow, ...]
    calibrated: bool
    grid: tuple[float, ...]
    notes: tuple[str, ...] = ()

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels, in their order."""
        return tuple(dict.fromkeys(row.channel for row in self.rows))

    @property
    def groups(self) -> tuple[str, ...]:
        """Names that `total` takes: the channels, and "horizontal" if there is an x or y axis."""
        flat = any(axis(channel) in ("x", "y") for channel in self.channels)
        return (*self.channels, HORIZONTAL) if flat else self.channels

    def total(self, of: str = HORIZONTAL) -> dict[str, FloatArray]:
        """Root sum of squares over the terms of a channel, or of both horizontal axes.

        Parameters
        ----------
        of : str, optional
            A channel, or "horizontal": tilt, and radial velocity and position errors (root of the
            sum of the variances of x and y), from the x and y axes of both sensors.

        Returns
        -------
        dict
            Quantity -> (T,) ndarray at ``times``, in rad, m/s and m.

        Raises
        ------
        InputError
            If there is no such channel, or no horizontal one.
        """
        return {
            quantity: root_sum([row.values for row in self._rows(of, quantity)])
            for quantity in self.quantities(of)
        }

    def quantities(self, of: str = HORIZONTAL) -> tuple[str, ...]:
        """Quantities that a channel, or the horizontal pair, contributes to."""
        present = {row.quantity for row in self._rows(of)}
        return tuple(quantity for quantity in QUANTITIES if quantity in present)

    def largest(self, quantity: str, of: str = HORIZONTAL) -> tuple[ErrorRow, float]:
        """The row that contributes most at the longest time, and its share of the variance."""
        rows = self._rows(of, quantity)
        squares = [row.values[-1] ** 2 for row in rows]
        total = sum(squares)
        place = int(np.argmax(squares))
        return rows[place], squares[place] / total if total > 0.0 else 0.0

    def _rows(self, of: str, quantity: str | None = None) -> list[ErrorRow]:
        if of not in self.groups:
            raise InputError(
                f"the error budget has no total {of!r}: it has {', '.join(self.groups)}"
            )
        flat = of == HORIZONTAL
        channels = [c for c in self.channels if (axis(c) in ("x", "y") if flat else c == of)]
        return [
            row for row in self.rows if row.channel in channels and quantity in (None, row.quantity)
        ]

    def __str__(self) -> str:
        lines = [
            "Errors (1 sigma) after an outage, for a level platform that does not manoeuvre.",
            f"Attitude, velocity and position exact, and {STARTS[self.calibrated]}.",
        ]
        for quantity in QUANTITIES:
            table: list[tuple[str, str, Sequence[float] | FloatArray]] = []
            for channel in self.channels:
                rows = self._rows(channel, quantity)
                table += [("" if i else channel, r.component, r.values) for i, r in enumerate(rows)]
                if len(rows) > 1:
                    table.append(("", "total", self.total(channel)[quantity]))
            if not table:
                continue
            if HORIZONTAL in self.groups and quantity in self.quantities():
                label = "tilt" if quantity == "attitude" else "horizontal, radial"
                table.append((label, "", self.total()[quantity]))
            cells = [
                [name, component, *(brief(per_si(quantity) * value, 3) for value in values)]
                for name, component, values in table
            ]
            heads = [f"{quantity} [{FIELD_UNITS[quantity]}]", "", *(f"{t:g} s" for t in self.times)]
            lines += ["", plain_table(heads, cells)]
        notes = bullets(self.notes)
        return "\n".join([*lines, *([""] if notes else []), *notes])

    def plot(
        self, ax: Axes | None = None, *, of: str | None = None, quantity: str | None = None
    ) -> Axes:
        """Growth of an error with time, log-log: its parts as lines and a bold total.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
        of : str, optional
            A channel, whose parts are its terms, or "horizontal", whose parts are the channels; by
            default "horizontal" where there is one.
        quantity : {"attitude", "velocity", "position"}, optional
            By default the last that there is.

        Raises
        ------
        InputError
            If there is no such channel, or it does not contribute to that quantity.
        """
        import matplotlib.pyplot as plt

        from gmwm.plotting import SUM_COLOUR, styles

        of = self.groups[-1] if of is None else of
        quantity = self.quantities(of)[-1] if quantity is None else quantity
        curves = self.curves(of, quantity)
        if ax is None:
            _, ax = plt.subplots(figsize=(7.0, 4.6), layout="constrained")
        for (colour, _), (label, curve) in zip(styles(curves), curves.items(), strict=True):
            ax.plot(self.grid, curve, color=colour, linewidth=1.3, linestyle="--", label=label)
        total = per_si(quantity) * root_sum([row.curve for row in self._rows(of, quantity)])
        ax.plot(self.grid, total, color=SUM_COLOUR, linewidth=2.6, label="total")
        ax.set_xscale("log")
        ax.set_yscale("log" if np.any(total > 0.0) else "linear")
        ax.set_xlabel("outage [s]")
        ax.set_ylabel(f"{quantity} error, 1 sigma [{FIELD_UNITS[quantity]}]")
        ax.set_title(f"{of}, {STARTS[self.calibrated]}")
        ax.grid(True, which="major", color="#cccccc", linewidth=0.6)
        ax.legend(fontsize="small", framealpha=0.9)
        return ax

    def curves(self, of: str, quantity: str) -> dict[str, FloatArray]:
        """Curves of `plot` beside the total: label -> curve on ``grid``, in field units."""
        known = self.quantities(of)
        if quantity not in known:
            raise InputError(
                f"{of} does not affect the {quantity!r} error: choose from {', '.join(known)}"
            )
        parts: dict[str, list[tuple[float, ...]]] = {}
        for row in self._rows(of, quantity):
            label = row.channel if of == HORIZONTAL else row.component
            parts.setdefault(label, []).append(row.curve)
        scale = per_si(quantity)
        return {label: scale * root_sum(part) for label, part in parts.items() if np.any(part)}


def axis(channel: str) -> str:
    """The axis that a channel's name ends with; empty if it names none."""
    last = channel.rpartition("_")[2].lower()
    return last if last in ("x", "y", "z") else ""


def root_sum(parts: Sequence[Sequence[float] | FloatArray]) -> FloatArray:
    """Root of the sum of squares over the parts, time by time."""
    return np.asarray(np.sqrt(np.sum(np.square(np.array(parts, dtype=float)), axis=0)))


def per_si(quantity: str) -> float:
    """Factor from a quantity's SI unit to its field unit."""
    return 1.0 / factor(FIELD_UNITS[quantity], QUANTITIES[quantity])


def error_budget(
    source: One | Several,
    times: Sequence[float] = TIMES,
    *,
    dt: float | None = None,
    rate: float | None = None,
    calibrated: bool = True,
) -> ErrorBudget:
    """Predicted growth of attitude, velocity and position errors without aiding.

    A platform stays level and does not manoeuvre; its initial attitude, velocity and position are
    right. A gyro's error is integrated to an attitude error; the tilt times gravity is an
    acceleration, integrated to velocity and position. An accelerometer's error is integrated to
    velocity and position. A gyro named ``..._z`` is the heading's and tilts nothing.

    Short-term only: no Schuler oscillation (84 min) and no Earth rate. Up to 600 s constant errors
    come out at most 10 % too large; beyond, the numbers are no longer what a navigator shows.

    Parameters
    ----------
    source : Calibration, Fit or mapping
        A mapping takes channel names that begin with "gyro" or "accel" to a `Process`, `Model` or
        `Fit`.
    times : sequence of float, optional
        Coasting times, s.
    dt, rate : float, optional
        Sampling interval (s) or rate (Hz) of models that are not fitted; 100 Hz by default.
    calibrated : bool, optional
        True: the initial value of every state of the models is known, as from a filter before an
        outage; its covariance is zero. False: nothing is known, stationary processes start in their
        stationary state. In both cases a random walk starts at zero, a line has a random phase, and
        flicker noise, of which True knows the past, is counted from its first sample by False. A
        constant bias is not part of a model: False counts what varies about the mean of the
        recording.

    Returns
    -------
    ErrorBudget
        Terms are independent: their squares add up. A rate ramp counts by its absolute value.

    Raises
    ------
    InputError
        If a model has free parameters or is known by simulation only, no channel is a gyro or an
        accelerometer, or a time is shorter than the sampling interval.

    Notes
    -----
    Titterton & Weston, *Strapdown Inertial Navigation Technology*, 2nd ed. 2004, ch. 12; Groves,
    *Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems*, 2nd ed. 2013,
    sec. 5.7. White noise N gives an angle N t^(1/2), as an accelerometer's a position
    N t^(3/2)/3^(1/2), as a gyro's g N t^(5/2)/20^(1/2).
    """
    if isinstance(source, Fit):
        source = {source.wv.name or "channel": source}
    axes = SensorAxes.of(source, dt, 0.0, rate).axes
    known = [each for each in axes if _quantity(each)]
    if not known:
        raise InputError(
            "the error budget needs a gyro or an accelerometer: give channels of that quantity, or "
            "models by names such as gyro_x and accel_z"
        )
    longest = max(each.dt for each in known)
    chosen = given_times("times", times)
    if chosen[0] < longest * (1.0 - 1e-6):
        raise InputError(
            f"an outage of {chosen[0]:g} s is shorter than the sampling interval of "
            f"{longest:g} s: give longer times"
        )
    first = chosen[0] if len(chosen) > 1 else max(0.01 * chosen[0], min(longest, chosen[0]))
    grid = tuple(np.geomspace(first, chosen[-1], _CURVE_POINTS).tolist())
    rows: list[ErrorRow] = []
    for each in known:
        rows += _channel_rows(each, chosen, grid, calibrated)
    budget = ErrorBudget(chosen, tuple(rows), calibrated, grid)
    return replace(budget, notes=tuple(_notes(axes, budget)))


def is_steep(budget: ErrorBudget) -> BoolArray:
    """At which of its times the tilt is beyond a small angle: orders of magnitude from there on."""
    tilts = [
        budget.total(of)["attitude"]
        for of in budget.groups
        if axis(of) != "z" and "attitude" in budget.quantities(of)
    ]
    largest = np.max(tilts, axis=0, initial=0.0) * np.ones(len(budget.times))
    return np.maximum.accumulate(largest) > _SMALL_ANGLE


def _quantity(axis: AxisModel) -> str:
    """The kind of sensor; of models and fits that have none, by the name of the channel."""
    named = (kind for kind in SI_UNIT if axis.name.startswith(kind))
    return axis.quantity or next(named, "")


def _channel_rows(
    known: AxisModel, times: tuple[float, ...], grid: tuple[float, ...], calibrated: bool
) -> list[ErrorRow]:
    name, model, dt = known.name, known.model, known.dt
    if _quantity(known) == "accel":
        scales = {"velocity": 1.0, "position": 1.0}
    elif axis(name) == "z":
        scales = {"attitude": 1.0}
    else:
        scales = {"attitude": 1.0, "velocity": _GRAVITY, "position": _GRAVITY}
    labels = [
        f"{label}, |R|" if term.is_drift else label
        for label, term in zip(model.term_labels(), model.terms, strict=True)
    ]
    growths = [
        integral_rms(term, (*times, *grid), dt, known_start=calibrated) for term in model.terms
    ]
    rows = []
    for order, (quantity, scale) in enumerate(scales.items()):
        for label, growth in zip(labels, growths, strict=True):
            values = tuple((scale * growth[order]).tolist())
            unit, cut = QUANTITIES[quantity], len(times)
            rows.append(ErrorRow(name, label, quantity, unit, values[:cut], values[cut:]))
    return rows


def _notes(axes: Sequence[AxisModel], budget: ErrorBudget) -> list[str]:
    notes = []
    skipped = [each.name for each in axes if not _quantity(each)]
    if skipped:
        notes.append(f"neither gyro nor accelerometer, left out: {', '.join(skipped)}")
    fits = {each.name: each.fit for each in axes if each.fit is not None}
    doubtful = [name for name in budget.channels if name in fits and not fits[name].valid]
    if doubtful:
        model, are = ("models", "are") if doubtful[1:] else ("model", "is")
        of = ", ".join(doubtful)
        notes.append(f"the {model} of {of} {are} not valid: read the notices first")
    shortest = min((fit.wv.n * fit.wv.dt for fit in fits.values()), default=np.inf)
    if budget.times[-1] > _RECORD_SHARE * shortest:
        notes.append(
            f"a record of {shortest:.4g} s shows little of what happens over more than "
            f"{_RECORD_SHARE * shortest:.3g} s"
        )
    present = {f"{_quantity(each)}_{axis(each.name)}" for each in axes}
    missing = [name for name in _HORIZONTAL_CHANNELS if name not in present]
    if HORIZONTAL in budget.groups and missing:
        notes.append(f"the horizontal total lacks {', '.join(missing)}")
    steep = is_steep(budget)
    if np.any(steep):
        notes.append(
            f"at {budget.times[int(np.argmax(steep))]:g} s the tilt exceeds "
            f"{np.degrees(_SMALL_ANGLE):.0f} deg: from there on velocity and position are orders "
            "of magnitude only"
        )
    if budget.times[-1] > LONGEST:
        notes.append(f"beyond {LONGEST:g} s the Schuler oscillation (84 min) bounds this growth")
    return notes
