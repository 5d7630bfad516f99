"""The numbers that a small filter should believe, axis by axis."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import add
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from annotated_types import MaxLen, MinLen

from gmwm._core import checks
from gmwm._core.documents import Document, NoneIs, NotNegative, Positive, Rate, Text
from gmwm._core.frozen import ByName, freeze
from gmwm._core.text import WIDTH, Printed, bullets, cell, frame, plain_table, wrapped
from gmwm._core.units import SI_UNIT, field_units, si_parameter_unit
from gmwm.issues import Notice
from gmwm.process import Model

if TYPE_CHECKING:
    import pandas

FORMS = ("N+K", "N+GM", "N+K+GM", "N+2GM")
"""White noise with a random walk, with one or two Gauss-Markov processes, or with both."""

METHODS = ("bound", "reduce", "given", "motion")
"""Where numbers come from: `bound`, `reduce`, the user, or curves in motion."""

UNITS = ("field", "si")
"""Data-sheet units (IEEE Std 952 / 1554), or SI."""

_UNITS = {"N": "u/sqrt(Hz)", "K": "u/s/sqrt(Hz)", "sigma": "u", "tau": "s", "initial_sd": "u"}
_NAN = float("nan")
_HALF = 1.96  # standard errors: half of a 95 % interval
_PREDICTION = (
    "NEES: predicted, per degree of freedom, after an outage of that length; sd: predicted over "
    "true standard deviation."
)


class InUnits(Printed, ABC):
    """A result that prints its numbers in data-sheet units or in SI."""

    @abstractmethod
    def text(self, units: str = "field") -> str:
        """The text of `print`, in data-sheet units or, with ``"si"``, in SI."""

    def __str__(self) -> str:
        return self.text()


@dataclass(frozen=True)
class Predicted:
    """How well a filter with these numbers knows its error, after some time without aiding.

    It is the expectation for the filter of `gmwm.filter_numbers.Chain`, by covariance analysis; of
    one integral, that of its gain since the last fix where this is the worse.

    nees: Normalised error squared per degree of freedom; 1 if the filter is consistent, above if it
        is overconfident. NaN where a term of the truth has no state-space form.
    tightness: Predicted over true standard deviation, of the last integral of the sensor's error.
    """

    time: Positive
    nees: Annotated[NotNegative, NoneIs(_NAN)]
    tightness: Annotated[NotNegative, NoneIs(_NAN)]


@dataclass(frozen=True, repr=False)
class AxisFilterNumbers(Document, InUnits):
    """The numbers that a small filter should believe of one axis.

    Attributes
    ----------
    form : {"N+K", "N+GM", "N+K+GM", "N+2GM"}
    model : Model
        White noise with a random walk, Gauss-Markov processes, or both.
    horizon : float
        Time without aiding that the numbers are for, s.
    initial_sd : float
        Standard deviation at the start of the walk or, in forms without one, of a constant that
        the Gauss-Markov processes are added to; u.
    method : {"bound", "reduce", "given", "motion"}
    predicted : tuple of Predicted
        At the horizon and at ten times the horizon.
    notices : tuple of Notice
        Terms of the error model that the numbers leave out, and why.
    quantity : {"gyro", "accel", ""}
        Of the axis; empty if unknown.
    stderr : dict
        Standard errors of the N and K that bound a valid fit, from those of the fit; empty for
        other forms, for models, and where a level covers them.
    turn_on_sd : float
        Of the turn-on bias that ``initial_sd`` contains, u; zero if none was given.
    """

    SCHEMA: ClassVar[str] = "gmwm.axis-numbers"
    KEYS: ClassVar[Mapping[str, str]] = {"horizon": "horizon_s"}

    form: Text
    model: Model
    horizon: Positive
    initial_sd: NotNegative
    method: Text
    predicted: Annotated[tuple[Predicted, ...], MaxLen(100)] = ()
    notices: tuple[Notice, ...] = ()
    quantity: Text = ""
    stderr: Mapping[Text, NotNegative] = field(default_factory=dict)
    turn_on_sd: NotNegative = 0.0

    def __post_init__(self) -> None:
        freeze(self, "stderr")
        for name, value in {"initial_sd": self.initial_sd, **self.model.params}.items():
            checks.plausible(name, abs(value or 0.0))
        for name in self.stderr:
            checks.choice("a key of stderr", name, ("N", "K"))
        checks.choice("form", self.form, FORMS)
        checks.choice("method", self.method, METHODS)

    @property
    def unit(self) -> str:
        """SI unit of the axis; "u" if the quantity is unknown."""
        return SI_UNIT.get(self.quantity, "u")

    @property
    def N(self) -> float:
        """White noise, u/sqrt(Hz)."""
        return float(self.model.params.get("N") or 0.0)

    @property
    def K(self) -> float:
        """Random walk, u/s/sqrt(Hz); zero in a form without one."""
        return float(self.model.params.get("K") or 0.0)

    @property
    def sigma(self) -> tuple[float, ...]:
        """Standard deviations of the Gauss-Markov processes by rising correlation time, u."""
        return tuple(v or 0.0 for key, v in self.model.params.items() if key[:5] == "sigma")

    @property
    def tau(self) -> tuple[float, ...]:
        """Correlation times of the Gauss-Markov processes, rising, s."""
        return tuple(v or 0.0 for key, v in self.model.params.items() if key[:3] == "tau")

    @property
    def upper(self) -> frozenset[str]:
        """Which of the numbers are 95 % upper limits of a term that was not found."""
        return frozenset(k for n in self.notices if n.code == "upper-limit" for k in n.values)

    @property
    def nees(self) -> Mapping[float, float]:
        """Predicted normalised error squared per degree of freedom, by time without aiding."""
        return {each.time: each.nees for each in self.predicted}

    @property
    def tightness(self) -> Mapping[float, float]:
        """Predicted over true standard deviation, by time without aiding."""
        return {each.time: each.tightness for each in self.predicted}

    def __repr__(self) -> str:
        return f"<AxisFilterNumbers {self.model!r}, {self.method} for {self.horizon:g} s>"

    def text(self, units: str = "field") -> str:
        lines = [f"{self.form} for {self.horizon:g} s, {self.method}"]
        for key, value in self._shown().items():
            unit, per_si = shown_unit(key, self.quantity, units)
            shown = f"{value * per_si:>11.4g} {unit}"
            if key in self.stderr:
                shown += f", +-{_HALF * self.stderr[key] * per_si:.2g} (95 %)"
            lines.append(f"  {key:<10} {shown}")
        for each in self.predicted:
            lines.append(
                f"  after {each.time:g} s without aiding: NEES {each.nees:.3g} per degree of "
                f"freedom, predicted/true standard deviation {each.tightness:.3g}"
            )
        return "\n".join([*lines, *bullets(self.notices)])

    def _shown(self) -> dict[str, float]:
        values = {key: float(value or 0.0) for key, value in self.model.params.items()}
        return values | {"initial_sd": self.initial_sd}

    def row(self, units: str) -> dict[str, Any]:
        """A row of `FilterNumbers.to_frame`; units: "field" or "si"."""
        first = next(iter(self.predicted), Predicted(self.horizon, _NAN, _NAN))
        values: dict[str, Any] = {}
        for key, value in self._shown().items():
            unit, scale = shown_unit(key, self.quantity, units)
            values |= {key: value * scale, f"{key}_unit": unit}
            if key in self.stderr:
                values[f"{key}_stderr"] = self.stderr[key] * scale
        return {
            "form": self.form,
            **values,
            "horizon": self.horizon,
            "nees": first.nees,
            "tightness": first.tightness,
            "method": self.method,
        }


@dataclass(frozen=True, repr=False)
class FilterNumbers(ByName[AxisFilterNumbers], Document, InUnits):
    """The numbers that a small filter should believe of a sensor: channel -> `AxisFilterNumbers`.

    Attributes
    ----------
    axes : dict
        Channel name -> `AxisFilterNumbers`.
    source : str
        Of the calibration.
    rate : float
        Sampling rate, Hz; NaN if unknown.
    duration : float
        Length of the recording, s; NaN if unknown.
    shared : bool
        Whether the axes of a quantity have the same numbers.
    """

    SCHEMA: ClassVar[str] = "gmwm.filter-numbers"
    KEYS: ClassVar[Mapping[str, str]] = {
        "axes": "channels",
        "rate": "rate_hz",
        "duration": "duration_s",
    }

    _held = "axes"
    _unknown = "there are no filter numbers of channel {name!r}: there are {known}"

    axes: Annotated[Mapping[Text, AxisFilterNumbers], MinLen(1), MaxLen(10_000)]
    source: Text = ""
    rate: Annotated[Rate, NoneIs(_NAN)] = _NAN
    duration: Annotated[Positive, NoneIs(_NAN)] = _NAN
    shared: bool = False

    def __post_init__(self) -> None:
        freeze(self, "axes")

    def of(self, quantity: str) -> dict[str, AxisFilterNumbers]:
        """The axes of the gyros ("gyro") or accelerometers ("accel")."""
        return {name: each for name, each in self.items() if each.quantity == quantity}

    @property
    def horizon(self) -> float:
        """Time without aiding that they are for, s."""
        return next(iter(self.values())).horizon

    @property
    def form(self) -> str:
        """Their form; see `AxisFilterNumbers`."""
        return next(iter(self.values())).form

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Notices of all axes, with the channel as the place."""
        return tuple(
            replace(notice, where=name) for name, each in self.items() for notice in each.notices
        )

    def __repr__(self) -> str:
        where = self.source or "a sensor"
        return f"<FilterNumbers of {where}: {self.form} for {self.horizon:g} s, {', '.join(self)}>"

    def text(self, units: str = "field") -> str:
        first = next(iter(self.values()))
        head = f"{self.form} for {self.horizon:g} s, {first.method}"
        lines = [f"{self.source}: {head}" if self.source else head]
        for quantity in dict.fromkeys(each.quantity for each in self.values()):
            lines += ["", *_tables(self.of(quantity), quantity, units)]
        if first.predicted:
            lines += ["", *wrapped(_PREDICTION)]
        if first.form != "N+GM":
            lines += wrapped("Use all numbers of an axis together.")
        places: dict[str, list[str]] = {}
        for notice in self.notices:
            places.setdefault(str(replace(notice, where="")), []).append(notice.where)
        lines += bullets(f"{', '.join(names)}: {text}" for text, names in places.items())
        return "\n".join(lines)

    def to_frame(self, *, units: str = "field") -> pandas.DataFrame:
        """A table with one row a channel, each number with its unit; needs pandas.

        Parameters
        ----------
        units : {"field", "si"}, optional
            Data-sheet units, or SI.
        """
        rows = [{"channel": name, **each.row(units)} for name, each in self.items()]
        return frame(rows, tuple(dict.fromkeys(key for row in rows for key in row)))


def shown_unit(key: str, quantity: str, units: str) -> tuple[str, float]:
    """The unit in which a number is shown, and its value per SI unit.

    Raises InputError if ``units`` is not one of `UNITS`.
    """
    unit = _UNITS[key if key in _UNITS else key.partition("_")[0]]
    known = field_units(unit, quantity) if checks.choice("units", units, UNITS) == "field" else ()
    return (known[0].unit, known[0].per_si) if known else (si_parameter_unit(unit, quantity), 1.0)


def _tables(axes: Mapping[str, AxisFilterNumbers], quantity: str, units: str) -> list[str]:
    """The values of axes with their units, and the predictions below them."""
    longest = max(axes.values(), key=lambda each: len(each._shown()) + len(each.stderr))
    heads, columns = [quantity or "channel"], [list(axes)]
    for key in longest._shown():
        unit, scale = shown_unit(key, quantity, units)
        heads.append(f"{key}\n{unit}")
        shown = [cell(each._shown().get(key), scale=scale) for each in axes.values()]
        limits = ["<= " * (key in each.upper) for each in axes.values()]
        columns.append(list(map(add, limits, shown)))
        if key in longest.stderr:
            heads.append("+-\n95 %")
            columns.append([cell(each.stderr.get(key), 2, _HALF * scale) for each in axes.values()])
    lines = _table(heads, columns)
    times = max((list(each.nees) for each in axes.values()), key=len)
    if not times:
        return lines
    heads, columns = ["predicted"], [list(axes)]
    for name in ("nees", "tightness"):
        for time in times:
            heads.append(f"{'NEES' if name == 'nees' else 'sd'} {time:g} s")
            columns.append([cell(getattr(each, name).get(time), 3) for each in axes.values()])
    return lines + _table(heads, columns)


def _table(heads: Sequence[str], columns: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table; in two parts beneath each other where it is wider than a page."""
    pairs = zip(heads, columns, strict=True)
    width = sum(2 + max(map(len, [*head.split("\n"), *column])) for head, column in pairs)
    if width > WIDTH and len(heads) > 2:
        half = (len(heads) + 2) // 2
        rest = [heads[0], *heads[half:]], [columns[0], *columns[half:]]
        return _table(heads[:half], columns[:half]) + _table(*rest)
    return plain_table(heads, list(zip(*columns, strict=True))).splitlines()
