"""The curve of a channel against covariates, such as the temperature, beside its noise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
import scipy
from annotated_types import Ge, Le

from gmwm._core import checks
from gmwm._core.documents import Array, Document, NotNegative, Positive, Text, check_covariance
from gmwm._core.text import Printed, brief, plain_table, readable, with_error
from gmwm._core.typing import FloatArray
from gmwm._core.units import factor, shown_unit
from gmwm.calibration import tuning
from gmwm.calibration.scaling import Scaling
from gmwm.errors import InputError
from gmwm.estimate.result import CurveCoefficients, Fit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_POWER = 6

_POINTS = 101  # of a curve in tables and figures


@dataclass(frozen=True)
class Covariate:
    """What a curve depends on, over the range of its recording.

    centre, half: Of ``u = (x - centre) / half``, which lies between about -1 and 1.
    low, high: Range of x, in means of some samples; a curve is known `tuning.MARGIN` of it beyond.
    """

    name: Text
    unit: Text
    centre: float
    half: Positive
    low: float
    high: float

    @property
    def title(self) -> str:
        """The range in words, rounded to a thousandth of it."""
        digits = 2 - math.floor(math.log10(2.0 * self.half))
        low, high = (f"{round(each, digits):.10g}" for each in (self.low, self.high))
        return f"{self.name} {low} to {high} {self.unit}"


@dataclass(frozen=True)
class Regressor:
    """One regressor.

    kind: "power": u^power; "lag": (x of some time before, a first-order low-pass of it, less x) /
        half; "settling": exp(-t / constant) at the time t since the recording began.
    constant: Time constant, s.
    """

    kind: Literal["power", "lag", "settling"]
    covariate: Text = ""
    power: Annotated[int, Ge(0), Le(MOST_POWER)] = 0
    constant: NotNegative = 0.0

    @property
    def title(self) -> str:
        if self.kind == "power":
            return self.covariate + (f"^{self.power}" if self.power > 1 else "")
        return " ".join(filter(None, [self.covariate, self.kind, f"{brief(self.constant, 3)} s"]))

    def along(self, time: FloatArray, x: FloatArray | None, own: Covariate | None) -> FloatArray:
        """The regressor at even times (s, since switch-on) and values of its covariate."""
        if x is None or own is None:
            return np.exp(-time / self.constant)
        if self.kind == "power":
            return np.asarray(((x - own.centre) / own.half) ** self.power)
        share = (time[1] - time[0]) / self.constant
        keep = float(np.exp(-share))
        mean = (1.0 - keep) / share  # exact for a line between the times
        drive = np.concatenate([x[:1], (1.0 - mean) * x[1:] + (mean - keep) * x[:-1]])
        late = scipy.signal.lfilter([1.0], [1.0, -keep], drive)
        return np.asarray((late - x) / own.half)


@dataclass(frozen=True, eq=False, repr=False)
class BiasCurve(Document, Printed):
    """A deterministic curve beside the noise of a channel.

    ``curve(temperature)`` is what to subtract at a steady temperature, in SI units.

    Attributes
    ----------
    name, quantity, unit : str
        Of the channel.
    covariates : tuple of Covariate
    regressors : tuple of Regressor
    values : (p,) ndarray
        Coefficients of the regressors, u.
    covariance : (p, p) ndarray
        Of these, u^2, under the fitted noise.
    spread : (k, p p) ndarray
        Errors of ``covariance`` by the errors of the noise; with weights what it is less under each
        of k random walks.
    weights : (k,) ndarray
        Probabilities of walks; empty where the fitted noise is taken alone.
    offset : float
        Mean of the channel less the curve, u. The turn-on bias is part of it; zero for an
        accelerometer, where it would hold gravity.
    scaling : Scaling or None
        How the fast noise depends on the first covariate.
    """

    SCHEMA: ClassVar[str] = "gmwm.bias-curve"

    name: Text
    quantity: Text | None
    unit: Text
    covariates: tuple[Covariate, ...]
    regressors: tuple[Regressor, ...]
    values: Array
    covariance: Array
    spread: Array
    weights: Array
    offset: float
    scaling: Scaling | None = None

    @classmethod
    def of(
        cls,
        fit: Fit,
        covariates: tuple[Covariate, ...],
        regressors: tuple[Regressor, ...],
        offset: float,
        *,
        may_lack: bool = False,
    ) -> BiasCurve:
        """That of a fit beside these regressors.

        may_lack: Whether there may be a random walk where the model has none.
        """
        found, wv = CurveCoefficients.of(fit, may_lack=may_lack), fit.wv
        numbers = (found.values, found.covariance, found.spread, found.weights)
        offset = 0.0 if wv.quantity == "accel" else offset
        return cls(wv.name, wv.quantity, wv.unit, covariates, regressors, *numbers, offset)

    @property
    def mains(self) -> tuple[Covariate, ...]:
        """The covariates of powers."""
        powers = {each.covariate for each in self.regressors if each.kind == "power"}
        return tuple(each for each in self.covariates if each.name in powers)

    @property
    def main(self) -> Covariate | None:
        """The first covariate of powers; None for settling alone."""
        return next(iter(self.mains), None)

    def contrast(self, x: FloatArray, of: str = "") -> FloatArray:
        """Regressors at steady values of a covariate, the others at their centres, (k, p).

        Raises InputError for values outside the range of the recording, or an unknown covariate.
        """
        one = self._covariate(of)
        x = self._inside(np.atleast_1d(np.asarray(x, dtype=float)), one)
        columns = [
            each.along(x, x, one) if (each.kind, each.covariate) == ("power", one.name) else 0.0 * x
            for each in self.regressors
        ]
        return np.stack(columns, axis=1)

    def along(
        self, covariates: Mapping[str, FloatArray], dt: float, start: float = 0.0
    ) -> FloatArray:
        """The curve against its value at the centres, along a record, u, (n,).

        It is what a temperature does to the bias, with lag and settling; the level is the turn-on
        bias of that record.

        Parameters
        ----------
        covariates : mapping of str to (n,) ndarray
            Values of the `covariates` at all samples.
        dt : float
            Sampling interval, s.
        start : float, optional
            Time of the first sample since switch-on, s; infinite leaves settling out.

        Raises InputError for values outside the range of the recording, or a covariate missing.
        """
        known: dict[str, FloatArray] = {}
        for one in self.covariates:
            if one.name not in covariates:
                raise InputError(f"the curve of {self.name} needs values of {one.name}: give them")
            known[one.name] = self._inside(np.asarray(covariates[one.name], dtype=float), one)
        n = len(next(iter(known.values()), next(iter(covariates.values()), np.zeros(0))))
        time = np.asarray(start + dt * np.arange(n), dtype=float)
        by_name = {each.name: each for each in self.covariates}
        curve = np.zeros(n)
        for each, value in zip(self.regressors, self.values, strict=True):
            own = known.get(each.covariate), by_name.get(each.covariate)
            curve += value * each.along(time, *own)
        return curve

    def noise_factor(self, x: FloatArray | float) -> FloatArray:
        """Deviation of the fast noise at values of the first covariate over that of the model.

        Raises InputError outside the range of the recording, or if the growth is not known.
        """
        if self.scaling is None or not self.covariates:
            raise InputError(
                f"{self.name}: the growth of the noise is not known: calibrate some minutes in "
                "which the covariate changes"
            )
        return self.scaling.factor(self._inside(np.asarray(x, dtype=float), self.covariates[0]))

    def _inside(self, x: FloatArray, one: Covariate) -> FloatArray:
        margin = tuning.MARGIN * (one.high - one.low)
        if not np.all((x >= one.low - margin) & (x <= one.high + margin)):
            raise InputError(
                f"the curve of {self.name} is known from {one.low:.4g} to {one.high:.4g} "
                f"{one.unit}: give values in this range, or record a wider one"
            )
        return x

    def _covariate(self, name: str = "") -> Covariate:
        found = next((each for each in self.covariates if each.name == name), self.main)
        if found is None or name not in ("", found.name):
            known = ", ".join(each.name for each in self.covariates) or "time alone"
            raise InputError(f"{name!r} is not in the curve of {self.name}: choose from {known}")
        return found

    def __call__(self, x: FloatArray | float, of: str = "") -> FloatArray:
        """The curve at steady values of a covariate, in u; see `contrast`."""
        found = self.offset + self.contrast(np.asarray(x), of) @ self.values
        return np.asarray(found).reshape(np.shape(x))

    def errors(self, contrast: FloatArray, level: float = 0.95) -> FloatArray:
        """Half the interval of ``contrast @ values``, u, (k,)."""
        found = CurveCoefficients(self.values, self.covariance, self.spread, self.weights)
        return found.errors(contrast, checks.share("level", level, 0.95))

    def band(
        self, x: FloatArray | None = None, level: float = 0.95, of: str = ""
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Values of a covariate, the curve there, and half its interval.

        The interval is that of the difference from the curve at the covariate's centre: the level
        itself is the bias, which is another one each time that the sensor is switched on.
        """
        one = self._covariate(of)
        at = np.linspace(one.low, one.high, _POINTS) if x is None else np.asarray(x, dtype=float)
        contrast = self.contrast(at, of)
        return at, self.offset + contrast @ self.values, self.errors(contrast, level)

    def polynomial(self, reference: float | None = None) -> FloatArray:
        """Coefficients of the powers of (x - reference), the constant first, u per unit^k.

        By default about the covariate's centre.
        """
        one = self._covariate()
        powers = np.zeros(MOST_POWER + 1)
        powers[0] = self.offset
        for each, value in zip(self.regressors, self.values, strict=True):
            if each.kind == "power" and each.covariate == one.name:
                powers[each.power] += value / one.half**each.power
        shift = np.array([(one.centre if reference is None else reference) - one.centre, 1.0])
        found = np.polynomial.Polynomial(powers)(np.polynomial.Polynomial(shift)).coef
        padded = np.pad(found, (0, powers.size - found.size))[: max(self.degree, 0) + 1]
        return np.asarray(padded, dtype=float)

    @property
    def degree(self) -> int:
        """Degree of the polynomial; 0 if there is none."""
        return max((each.power for each in self.regressors), default=0)

    def span(self) -> tuple[float, float]:
        """Change over the range of the covariate, u, and half its interval."""
        one = self._covariate()
        low, high = self.contrast(np.array([one.low, one.high]))
        return float((high - low) @ self.values), float(self.errors((high - low)[None, :])[0])

    @property
    def estimates(self) -> list[tuple[str, float, float, str]]:
        """Name, value, half its 95 % interval and unit of each coefficient, in SI.

        Those of powers are per power of the unit of the covariate, about its centre.
        """
        known = {each.name: each for each in self.covariates}
        half, rows = self.errors(np.eye(self.values.size)), []
        for each, value, error in zip(self.regressors, self.values, half, strict=True):
            one, power = known.get(each.covariate), each.power or 1
            scale = 1.0 if one is None else one.half**-power
            per = "" if one is None else f"/{one.unit}" + (f"^{power}" if power > 1 else "")
            rows.append((each.title, float(value) * scale, float(error) * scale, self.unit + per))
        return rows

    def __repr__(self) -> str:
        return f"<BiasCurve of {self.name}: {', '.join(each.title for each in self.regressors)}>"

    def __str__(self) -> str:
        rows = [
            [title, f"{value:.4g}", f"+-{error:.2g}", unit]
            for title, value, error, unit in self.estimates
        ]
        ranges = (
            f"{each.name} from {each.low:.4g} to {each.high:.4g} {each.unit}, about "
            f"{each.centre:.4g} {each.unit}"
            for each in self.covariates
        )
        table = plain_table(("regressor", "estimate", "95 %", "unit"), rows)
        return "\n".join([f"{self.name}: {'; '.join(ranges) or 'settling'}", table])

    def sentence(self) -> str:
        """The change over the range, or of settling alone its size, in words."""
        change, error = float(self.values[0]), float(self.errors(np.eye(self.values.size))[0])
        if self.main is not None:
            change, error = self.span()
        unit = readable(change, self.unit).partition(" ")[2]
        scale = 1.0 if unit == self.unit else 1.0 / factor(unit, self.unit)
        ends = (scale * (change - error), scale * (change + error))
        return f"{self.name} {with_error(scale * change, *ends)} {unit}"

    def plot(self, ax: Axes | None = None, *, units: str = "field") -> Axes:
        """The curve with its 95 % band, less its value at the centre; returns the axes."""
        import matplotlib.pyplot as plt

        one, (unit, scale) = self._covariate(), shown_unit(self.quantity, self.unit, units)
        x, value, error = self.band()
        value = scale * (value - self(one.centre))
        axes = ax if ax is not None else plt.subplots()[1]
        (line,) = axes.plot(x, value, label=self.name)
        ends = (value - scale * error, value + scale * error)
        axes.fill_between(x, *ends, color=line.get_color(), alpha=0.3, linewidth=0.0)
        axes.set_xlabel(f"{one.name} [{one.unit}]")
        axes.set_ylabel(f"bias against that at {one.centre:.3g} {one.unit} [{unit}]")
        return axes

    def check_content(self) -> None:
        size = len(self.regressors)
        if self.values.shape != (size,) or self.spread.size % (size * size or 1):
            raise ValueError("coefficients are not those of the regressors")
        check_covariance(self.covariance.tolist(), size)
        known = {each.name for each in self.covariates}
        if not {each.covariate for each in self.regressors if each.covariate} <= known:
            raise ValueError("a regressor has no covariate")


def curves_by_covariate(curves: Mapping[str, BiasCurve]) -> dict[str, list[BiasCurve]]:
    """Curves by what they depend on and over which range, in words."""
    found: dict[str, list[BiasCurve]] = {}
    for each in curves.values():
        others = [term.title for term in each.regressors if term.constant]
        degree = [f"degree {each.degree}"] if each.main is not None else []
        what = "the record" if each.main is None else each.main.title
        found.setdefault(f"{what} ({', '.join([*degree, *others])})", []).append(each)
    return found
