"""The error budget: how fast attitude, velocity and position are lost without aiding.

What it holds is computed by `gmwm.error_budget.coasting`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core.text import brief, bullets
from gmwm._core.typing import FloatArray
from gmwm._core.units import factor
from gmwm.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

QUANTITIES = {"attitude": "rad", "velocity": "m/s", "position": "m"}
"""What is lost, with its SI unit."""

FIELD_UNITS = {"attitude": "deg", "velocity": "m/s", "position": "m"}
"""Units in which the quantities are shown."""

HORIZONTAL = "horizontal"
"""Name of the total over the x and y axes of both sensors."""

STARTS = {
    True: "initial values of the slow errors known",
    False: "initial values of the errors unknown",
}
"""What is known of the sensors' errors at the start, by `ErrorBudget.calibrated`; attitude,
velocity and position are exact there."""


@dataclass(frozen=True)
class ErrorRow:
    """What one term of one channel's model does to one quantity.

    Attributes
    ----------
    channel : str
    component : str
        Label of the term in its model.
    quantity : {"attitude", "velocity", "position"}
    unit : str
        "rad", "m/s" or "m".
    values : tuple of float
        Standard deviation at each of the budget's ``times``; the absolute value for a rate ramp.
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
        What to know before using the numbers.
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
        """What `total` knows: the channels, and "horizontal" where there is an x or y axis."""
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
        """The quantities that a channel, or the horizontal pair, has a part in."""
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
        return [
            row
            for row in self.rows
            if (row.channel == of or (of == HORIZONTAL and axis(row.channel) in ("x", "y")))
            and quantity in (None, row.quantity)
        ]

    # -- looks ------------------------------------------------------------------------------------

    def __str__(self) -> str:
        lines = [
            "Error (1 sigma) after free inertial coasting, level and not manoeuvring, from",
            f"exact attitude, velocity and position; {STARTS[self.calibrated]}.",
        ]
        names = max(len(row.channel) for row in self.rows)
        labels = max(len(row.component) for row in self.rows)
        head = 2 + names + 2 + labels
        for quantity in QUANTITIES:
            channels = [c for c in self.channels if quantity in self.quantities(c)]
            if not channels:
                continue
            title = f"{quantity} [{FIELD_UNITS[quantity]}]"
            lines += ["", f"{title:<{head}}{_cells([f'{t:g} s' for t in self.times])}"]
            for channel in channels:
                rows = self._rows(channel, quantity)
                texts = [(row.component, np.array(row.values)) for row in rows]
                if len(rows) > 1:
                    texts.append(("total", self.total(channel)[quantity]))
                for i, (label, values) in enumerate(texts):
                    name = channel if i == 0 else ""
                    lines.append(f"  {name:<{names}}  {label:<{labels}}{_row(quantity, values)}")
            if HORIZONTAL in self.groups and quantity in self.quantities():
                label = "tilt" if quantity == "attitude" else "horizontal, radial"
                values = self.total()[quantity]
                lines.append(f"  {label:<{head - 2}}{_row(quantity, values)}")
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
            If there is no such channel, or it has no part in that quantity.
        """
        import matplotlib.pyplot as plt

        from gmwm.plotting import COMPONENT_COLOURS, SUM_COLOUR

        of = self.groups[-1] if of is None else of
        quantity = self.quantities(of)[-1] if quantity is None else quantity
        curves = self.curves(of, quantity)
        if ax is None:
            _, ax = plt.subplots(figsize=(7.0, 4.6), layout="constrained")
        for i, (label, curve) in enumerate(curves.items()):
            colour = COMPONENT_COLOURS[i % len(COMPONENT_COLOURS)]
            ax.plot(self.grid, curve, color=colour, linewidth=1.3, linestyle="--", label=label)
        total = per_si(quantity) * root_sum([row.curve for row in self._rows(of, quantity)])
        ax.plot(self.grid, total, color=SUM_COLOUR, linewidth=2.6, label="total")
        ax.set_xscale("log")
        ax.set_yscale("log" if np.any(total > 0.0) else "linear")
        ax.set_xlabel("coasting time [s]")
        ax.set_ylabel(f"{quantity} error, 1 sigma [{FIELD_UNITS[quantity]}]")
        ax.set_title(f"{of}, {STARTS[self.calibrated]}")
        ax.grid(True, which="major", color="#cccccc", linewidth=0.6)
        ax.legend(fontsize="small", framealpha=0.9)
        return ax

    def curves(self, of: str, quantity: str) -> dict[str, FloatArray]:
        """What `plot` draws beside the total: label -> curve on ``grid``, in field units."""
        known = self.quantities(of)
        if quantity not in known:
            raise InputError(
                f"{of} has no part in the {quantity!r} error: choose among {', '.join(known)}"
            )
        parts: dict[str, list[tuple[float, ...]]] = {}
        for row in self._rows(of, quantity):
            label = row.channel if of == HORIZONTAL else row.component
            parts.setdefault(label, []).append(row.curve)
        return {
            label: per_si(quantity) * root_sum(part)
            for label, part in parts.items()
            if np.any(part)
        }

    def to_dict(self) -> dict[str, Any]:
        """Everything in JSON types and SI units, with the totals."""
        totals = {
            of: {quantity: values.tolist() for quantity, values in self.total(of).items()}
            for of in self.groups
        }
        return {
            "times_s": list(self.times),
            "calibrated": self.calibrated,
            "rows": [_json(asdict(row)) for row in self.rows],
            "totals": totals,
            "grid_s": list(self.grid),
            "notes": list(self.notes),
        }


def axis(channel: str) -> str:
    """The axis that a channel's name ends with; empty if it names none."""
    last = channel.rpartition("_")[2].lower()
    return last if last in ("x", "y", "z") else ""


def root_sum(parts: Sequence[Sequence[float] | FloatArray]) -> FloatArray:
    """Root of the sum of squares over the parts, time by time."""
    return np.asarray(np.sqrt(np.sum(np.square(np.array(parts, dtype=float)), axis=0)))


def per_si(quantity: str) -> float:
    """Multiply a quantity's SI value by this to have it in its field unit."""
    return 1.0 / factor(FIELD_UNITS[quantity], QUANTITIES[quantity])


def _row(quantity: str, values: FloatArray) -> str:
    return _cells([brief(value, 3) for value in values * per_si(quantity)])


def _cells(texts: Sequence[str]) -> str:
    return "".join(f"{text:>10}" for text in texts)


def _json(row: dict[str, Any]) -> dict[str, Any]:
    return {key: list(value) if isinstance(value, tuple) else value for key, value in row.items()}
