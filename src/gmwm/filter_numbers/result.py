"""The numbers that a small filter should believe, axis by axis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

from gmwm._core import checks
from gmwm._core.documents import Document
from gmwm._core.frames import frame
from gmwm._core.frozen import freeze
from gmwm._core.notices import Notice
from gmwm._core.text import Printed, bullets, wrapped
from gmwm._core.units import SI_UNIT
from gmwm.errors import MissingNameError
from gmwm.estimate.result import plain
from gmwm.filter_numbers.table import shown_unit, stacked
from gmwm.process import Model, model_from_list

if TYPE_CHECKING:
    import pandas

    from gmwm._core.forms import Form

FORMS = ("N+K", "N+GM", "N+K+GM", "N+2GM")
"""White noise with a random walk, with one or two Gauss-Markov processes, or with both."""

METHODS = ("bound", "reduce", "given")
"""Where numbers come from: `bound`, `reduce`, or somebody who gave them."""


@dataclass(frozen=True)
class Predicted:
    """How well a filter with these numbers knows its error, after some time without aiding.

    It is the expected one of the filter of `gmwm.filter_numbers.chain.Chain`, by covariance
    analysis; of one integral, that of what it gains where this is the worse.

    time: Without aiding, s.
    nees: Normalised error squared per degree of freedom; 1 if the filter is consistent, above if it
        is too optimistic. NaN where a term of the truth has no state-space form.
    tightness: Predicted over true standard deviation, of the last integral of the sensor's error.
    """

    time: float
    nees: float
    tightness: float


@dataclass(frozen=True, repr=False)
class FilterNumbers(Document, Printed):
    """What a small filter should believe of one axis.

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
    method : {"bound", "reduce", "given"}
    predicted : tuple of Predicted
        At the horizon and at ten times the horizon.
    notices : tuple of Notice
        What of the error model the numbers leave out, and why.
    quantity : {"gyro", "accel", ""}
        What the axis measures; empty if it is not known.
    stderr : dict
        Standard errors of the N and K that bound a valid fit, from those of the fit; empty for
        other forms, for models, and where a level covers them.
    """

    SCHEMA: ClassVar[str] = "gmwm.axis-numbers"

    form: str
    model: Model
    horizon: float
    initial_sd: float
    method: str
    predicted: tuple[Predicted, ...] = ()
    notices: tuple[Notice, ...] = ()
    quantity: str = ""
    stderr: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze(self, "stderr")
        checks.choice("form", self.form, FORMS)
        checks.choice("method", self.method, METHODS)

    @property
    def unit(self) -> str:
        """Of the axis, SI; "u" if the quantity is not known."""
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
        return self._values("sigma")

    @property
    def tau(self) -> tuple[float, ...]:
        """Correlation times of the Gauss-Markov processes, rising, s."""
        return self._values("tau")

    def _values(self, name: str) -> tuple[float, ...]:
        params = self.model.params.items()
        return tuple(float(value or 0.0) for key, value in params if key.split("_")[0] == name)

    @property
    def nees(self) -> Mapping[float, float]:
        """Predicted normalised error squared per degree of freedom, by time without aiding."""
        return {each.time: each.nees for each in self.predicted}

    @property
    def tightness(self) -> Mapping[float, float]:
        """Predicted over true standard deviation, by time without aiding."""
        return {each.time: each.tightness for each in self.predicted}

    def __repr__(self) -> str:
        return f"<FilterNumbers {self.model!r}, {self.method} for {self.horizon:g} s>"

    def __str__(self) -> str:
        return self.text()

    def text(self, units: str = "field") -> str:
        """What `print` shows, in the units of the field or, with ``"si"``, in SI.

        Raises
        ------
        InputError
            If the units are neither.
        """
        lines = [f"{self.form} for {self.horizon:g} s, {self.method}"]
        for key, value in self._shown():
            unit, per_si = shown_unit(key, self.quantity, units)
            error = f" +- {self.stderr[key] * per_si:.2g}" if key in self.stderr else ""
            lines.append(f"  {key:<10} {value * per_si:>11.4g}{error} {unit}")
        for each in self.predicted:
            lines.append(
                f"  after {each.time:g} s without aiding: NEES {each.nees:.3g} per degree of "
                f"freedom, predicted/true standard deviation {each.tightness:.3g}"
            )
        lines += bullets(self.notices)
        return "\n".join(lines)

    def _shown(self) -> list[tuple[str, float]]:
        values = [(key, float(value or 0.0)) for key, value in self.model.params.items()]
        return [*values, ("initial_sd", self.initial_sd)]

    def _columns(self) -> tuple[dict[str, float], dict[str, float]]:
        """Of the table of a sensor: values with their errors, and predictions."""
        errors = {f"{key} +-": value for key, value in self.stderr.items()}
        return {**dict(self._shown()), **errors}, {
            **{f"NEES {each.time:g} s": each.nees for each in self.predicted},
            **{f"sd {each.time:g} s": each.tightness for each in self.predicted},
        }

    def row(self) -> dict[str, Any]:
        """What `to_frame` shows of it, SI."""
        first = self.predicted[0] if self.predicted else None
        return {
            "form": self.form,
            **dict(self._shown()),
            **{f"{key}_stderr": value for key, value in self.stderr.items()},
            "horizon": self.horizon,
            "nees": first.nees if first else float("nan"),
            "tightness": first.tightness if first else float("nan"),
            "method": self.method,
        }

    # -- files ------------------------------------------------------------------------------------

    def content(self) -> dict[str, Any]:
        return {
            "form": self.form,
            "model": [term.to_dict() for term in self.model.terms],
            "horizon_s": self.horizon,
            "initial_sd": self.initial_sd,
            "method": self.method,
            "predicted": [stored(each) for each in self.predicted],
            "notices": [notice.to_dict() for notice in self.notices],
            "quantity": self.quantity,
            "stderr": dict(self.stderr),
        }

    @classmethod
    def document_form(cls) -> type[Form]:
        from gmwm.filter_numbers.form import FilterNumbersForm

        return FilterNumbersForm

    @classmethod
    def from_content(cls, content: Mapping[str, Any]) -> Self:
        return cls(
            form=str(content["form"]),
            model=model_from_list(content["model"]),
            horizon=float(content["horizon_s"]),
            initial_sd=float(content["initial_sd"]),
            method=str(content["method"]),
            predicted=tuple(Predicted(**restored(each)) for each in content["predicted"]),
            notices=tuple(map(Notice.from_dict, content["notices"])),
            quantity=str(content["quantity"]),
            stderr={str(k): float(v) for k, v in content.get("stderr", {}).items()},
        )


@dataclass(frozen=True, repr=False)
class SensorNumbers(Mapping[str, FilterNumbers], Document, Printed):
    """What a small filter should believe of a sensor: a mapping of channels to `FilterNumbers`.

    Attributes
    ----------
    axes : dict
        Channel name -> `FilterNumbers`.
    source : str
        What was calibrated.
    rate : float
        Sampling rate, Hz; NaN if it is not known.
    duration : float
        Length of the recording, s; NaN if it is not known.
    shared : bool
        Whether the axes of a quantity have the same numbers.
    """

    SCHEMA: ClassVar[str] = "gmwm.filter-numbers"

    axes: Mapping[str, FilterNumbers]
    source: str = ""
    rate: float = float("nan")
    duration: float = float("nan")
    shared: bool = False

    def __post_init__(self) -> None:
        freeze(self, "axes")

    def __getitem__(self, name: str) -> FilterNumbers:
        if name not in self.axes:
            raise MissingNameError(
                f"there are no filter numbers of channel {name!r}: there are {', '.join(self.axes)}"
            )
        return self.axes[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.axes)

    def __len__(self) -> int:
        return len(self.axes)

    def of(self, quantity: str) -> dict[str, FilterNumbers]:
        """Those of the gyros ("gyro") or accelerometers ("accel")."""
        return {name: each for name, each in self.items() if each.quantity == quantity}

    @property
    def horizon(self) -> float:
        """Time without aiding that they are for, s."""
        return next(iter(self.values())).horizon

    @property
    def form(self) -> str:
        """Their form; see `FilterNumbers`."""
        return next(iter(self.values())).form

    @property
    def notices(self) -> tuple[Notice, ...]:
        """Those of all axes, with the channel as the place."""
        return tuple(
            replace(notice, where=name) for name, each in self.items() for notice in each.notices
        )

    def __repr__(self) -> str:
        where = self.source or "a sensor"
        return f"<SensorNumbers of {where}: {self.form} for {self.horizon:g} s, {', '.join(self)}>"

    def __str__(self) -> str:
        return self.text()

    def text(self, units: str = "field") -> str:
        """What `print` shows, in the units of the field or, with ``"si"``, in SI.

        Raises
        ------
        InputError
            If the units are neither.
        """
        first = next(iter(self.values()))
        head = f"{self.form} for {self.horizon:g} s, {first.method}"
        lines = [f"{self.source}: {head}" if self.source else head]
        for quantity in dict.fromkeys(each.quantity for each in self.values()):
            rows = {name: each._columns() for name, each in self.of(quantity).items()}
            lines += ["", *stacked(quantity or "channel", rows, quantity, units)]
        if first.predicted:
            lines += ["", *wrapped(
                "NEES: predicted, per degree of freedom, after a time without aiding; sd: "
                "predicted over true standard deviation then."
            )]  # fmt: skip
        if first.form != "N+GM":
            lines += wrapped(
                "N and the slow terms belong together: where one is smaller, a larger other pays "
                "for it."
            )
        places: dict[str, list[str]] = {}
        for notice in self.notices:
            places.setdefault(str(replace(notice, where="")), []).append(notice.where)
        lines += bullets(f"{', '.join(names)}: {text}" for text, names in places.items())
        return "\n".join(lines)

    def to_frame(self) -> pandas.DataFrame:
        """A table with one row a channel, in SI units; needs pandas."""
        rows = [{"channel": name, **each.row()} for name, each in self.items()]
        return frame(rows, tuple(dict.fromkeys(key for row in rows for key in row)))

    # -- files ------------------------------------------------------------------------------------

    def content(self) -> dict[str, Any]:
        return {
            "source": self.source,
            "rate_hz": plain(self.rate),
            "duration_s": plain(self.duration),
            "shared": self.shared,
            "channels": {name: each.to_dict() for name, each in self.items()},
        }

    @classmethod
    def document_form(cls) -> type[Form]:
        from gmwm.filter_numbers.form import SensorNumbersForm

        return SensorNumbersForm

    @classmethod
    def from_content(cls, content: Mapping[str, Any]) -> Self:
        known = restored(content)
        return cls(
            axes={name: FilterNumbers.from_dict(each) for name, each in known["channels"].items()},
            source=known["source"],
            rate=known["rate_hz"],
            duration=known["duration_s"],
            shared=known["shared"],
        )


def stored(row: Any) -> dict[str, Any]:
    """Fields of a dataclass in JSON types: None for a number that is not known."""
    return {k: plain(v) if isinstance(v, float) else v for k, v in asdict(row).items()}


def restored(row: Mapping[str, Any]) -> dict[str, Any]:
    """Inverse of `stored`."""
    return {k: float("nan") if v is None else v for k, v in row.items()}
