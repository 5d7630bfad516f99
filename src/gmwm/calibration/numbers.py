"""Sensor numbers: N, B and K of every axis with their 95 % intervals, as data sheets state them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gmwm._core.frozen import ByName
from gmwm._core.text import Printed, brief, frame, html_table, plain_table, with_error
from gmwm._core.typing import FloatArray
from gmwm._core.units import shown_unit
from gmwm.calibration import tuning
from gmwm.errors import InputError
from gmwm.estimate import Estimate, Fit, estimate
from gmwm.estimate.result import confidence_interval
from gmwm.plotting import sensor_lines
from gmwm.process import BiasInstability, Model, Process, RandomWalk, WhiteNoise

if TYPE_CHECKING:
    import pandas

PLATEAU = float(np.sqrt(2.0 * np.log(2.0) / np.pi))
"""Allan deviation of bias instability over B, 0.664 (IEEE Std 952)."""

PROCESSES: Mapping[str, Process] = {"N": WhiteNoise(), "B": BiasInstability(), "K": RandomWalk()}
"""The process that has each sensor number as its parameter."""

_KEYS = ("kind", "value", "lower", "upper", "unit", "tau")
_TINY = np.finfo(float).tiny


@dataclass(frozen=True)
class AxisNumbers:
    """N, B and K of one axis.

    Attributes
    ----------
    N : Estimate
        Angle or velocity random walk, u/sqrt(Hz): the density at low frequencies of all that
        averages out within a second: white, low-pass and averaged noise, resonances, Gauss-Markov
        terms faster than 0.1 s.
    B : Estimate
        Bias instability, u: the lowest Allan deviation over 0.664 (IEEE Std 952). An upper limit
        where the deviation still falls at the longest averaging time.
    K : Estimate
        Rate random walk, u/s/sqrt(Hz).
    tau : float
        Averaging time of the lowest Allan deviation, s.
    valid : bool
        Whether the fit is valid.
    quantity : str
        "gyro", "accel" or empty.

    Notes
    -----
    A number that the record only limits has the kind "bound"; ``upper`` is its 95 % upper limit,
    infinite if the record is too short for one.
    """

    N: Estimate
    B: Estimate
    K: Estimate
    tau: float
    valid: bool
    quantity: str

    def __iter__(self) -> Iterator[Estimate]:
        return iter((self.N, self.B, self.K))

    @property
    def names(self) -> dict[str, str]:
        """What N, B and K are called."""
        kind = {"gyro": "angle ", "accel": "velocity "}.get(self.quantity, "")
        return {"N": f"{kind}random walk", "B": "bias instability", "K": "rate random walk"}

    def lines(self, units: str = "field") -> dict[str, tuple[float, float, float, float]]:
        """Lines of N, B and K in an Allan plot; see `gmwm.plotting.straight_lines`."""
        factor, found = shown_unit(self.quantity, "", units)[1], {}
        for number in self:
            value, equal = (number.upper, "") if number.kind == "bound" else (number.value, "= ")
            text = f"{equal}{self.text(number.key, units=units)} {number.in_units(units).unit}"
            found[number.key] = (f"{number.key} {text}", factor * value)
        return sensor_lines(found, self.tau)

    def text(self, letter: str, *, units: str = "field") -> str:
        """``2.66 +-0.01``, or ``<= 41.9`` for an upper limit; without the unit.

        letter: "N", "B" or "K"; units: "field" or "si".
        """
        number: Estimate = getattr(self, letter)
        shown = number.in_units(units)
        if number.kind == "bound":
            return f"<= {brief(shown.upper, 3)}" if np.isfinite(shown.upper) else "-"
        return with_error(shown.value, shown.lower, shown.upper)


class SensorNumbers(ByName[AxisNumbers], Printed):
    """N, B and K of every axis of a sensor: channel -> `AxisNumbers`; see `Calibration.numbers`."""

    COLUMNS: ClassVar = ("channel", "number", *_KEYS, "valid")
    _held = "_axes"
    _unknown = "there is no channel {name!r}: there are {known}"

    def __init__(self, axes: Mapping[str, AxisNumbers]) -> None:
        self._axes = dict(axes)

    def __repr__(self) -> str:
        return f"<SensorNumbers of {', '.join(self)}>"

    def __str__(self) -> str:
        return self.text()

    def text(self, *, units: str = "field") -> str:
        """A table of the numbers with their 95 % intervals.

        units: Data-sheet units ("field"), or "si".
        """
        rows = self._cells(units)
        if len((table := plain_table(rows[0], rows[1:])).splitlines()) > len(rows):  # too wide
            rows = [(name, n.replace("velocity ", ""), *others) for name, n, *others in rows]
            table = plain_table(rows[0], rows[1:])
        return table

    def _cells(self, units: str) -> list[Sequence[str]]:
        rows: list[Sequence[str]] = []
        for quantity in dict.fromkeys(axis.quantity for axis in self.values()):
            own = {name: axis for name, axis in self.items() if axis.quantity == quantity}
            first = next(iter(own.values()))
            rows.append((quantity, *(f"{key}, {name}" for key, name in first.names.items())))
            rows.append(("", *(number.in_units(units).unit for number in first)))
            for name, axis in own.items():
                n, b, k = (axis.text(letter, units=units) for letter in "NBK")
                b = f"{b} at {brief(axis.tau, 3)} s"
                rows.append((name, n, b, k) if axis.valid else (name, "not valid", "", ""))
        return rows

    def _repr_html_(self) -> str:
        heads, *rows = self._cells("field")
        return html_table("Sensor numbers", heads, rows)

    def rows(self, units: str = "field") -> list[dict[str, Any]]:
        """A row per channel and number, in data-sheet units or with "si" in SI."""
        rows = []
        for name, axis in self.items():
            for number in axis:
                shown = number.in_units(units)
                found = number.kind != "bound"
                values = (name, number.key, number.kind, shown.value if found else None)
                limits = (shown.lower, shown.upper if np.isfinite(shown.upper) else None)
                row = (*values, *limits, shown.unit, axis.tau if number.key == "B" else None)
                rows.append(dict(zip(self.COLUMNS, (*row, axis.valid), strict=True)))
        return rows

    def to_dict(self) -> dict[str, Any]:
        """Channel -> letter -> value with its interval, SI, in JSON types."""
        found: dict[str, Any] = {name: {"valid": axis.valid} for name, axis in self.items()}
        for row in self.rows("si"):
            known = {key: row[key] for key in _KEYS if key != "tau" or row["number"] == "B"}
            found[row["channel"]][row["number"]] = known
        return found

    def to_frame(self, *, units: str = "field") -> pandas.DataFrame:
        """A table with a row per channel and number; needs pandas.

        Parameters
        ----------
        units : {"field", "si"}, optional
            Data-sheet units, or SI.
        """
        return frame(self.rows(units), self.COLUMNS)


# -- one axis --------------------------------------------------------------------------------------


def axis_numbers(fit: Fit, rivals: Sequence[Model] = ()) -> AxisNumbers:
    """The sensor numbers of a fitted model.

    rivals: Models that fit equally well; the intervals of B and K cover them. If one has no random
        walk, K is an upper limit: the data do not tell it from other slow noise, such as flicker,
        or from a rate ramp.
    """
    n, k = (random_walk(fit, letter) for letter in "NK")
    bias, tau = _bias_instability(fit, rivals, k)
    others = [float(each.params.get("K") or 0.0) for each in rivals]
    others += [0.0 for each in fit.notices if each.code == "ramp-or-walk"]
    if k.kind == "estimated" and others:
        low, high, walk = min(k.lower, *others), max(k.upper, *others), PROCESSES["K"]
        if min(others) > 0.0:
            k = Estimate.of(walk, "estimated", k.value, k.stderr, (low, high), fit.wv)
        else:
            k = Estimate.of(walk, "bound", 0.0, None, (0.0, high), fit.wv)
    return AxisNumbers(n, bias, k, tau, fit.valid, fit.wv.quantity or "")


def fast_density(model: Model, dt: float) -> float:
    """Density at low frequencies of the terms that average out, u^2/Hz.

    These are the terms with at least half of this density at the corner frequency of a Gauss-Markov
    process of 0.1 s. Quantization noise and periodic lines leave none: their integrals are bounded.

    dt: Sampling interval, s; if it is long, the corner is at a quarter of the Nyquist frequency.
    """
    corner = 1.0 / (2.0 * np.pi * max(tuning.FAST, 4.0 * dt / np.pi))
    total = 0.0
    for term in model.terms:
        if term.is_line:
            continue
        if not term.has_spectrum():
            tau = np.array([1.0, 2.0]) / corner
            first, second = term.haar_variance(tau, dt)
            total += 2.0 * tau[0] * first if second < tuning.WHITE_RATIO * first else 0.0
            continue
        lower, low, there = term.psd(
            corner * np.array([0.5, 1.0, 1.0 / tuning.LOW]) * tuning.LOW, dt
        )
        is_fast = lower > tuning.FLAT * low and there >= 0.5 * low
        total += float(low) if is_fast else 0.0
    return total


def random_walk(fit: Fit, key: str) -> Estimate:
    """N or K of a fit: that of its own term, for N the density of fast terms, or an upper limit."""
    process, own = PROCESSES[key], fit.params.get(key, 0.0)

    def density(model: Model) -> FloatArray:
        return np.array([fast_density(model, fit.wv.dt)])

    total = float(density(fit.model)[0]) if key == "N" else own**2
    is_alone = total <= (1.0 + tuning.NO_OTHER) * own**2
    if is_alone and (own > 0.0 or key in fit.upper_bounds):
        return fit[key]
    if total > 0.0:
        error = 0.5 * float(fit.logarithmic_error(density)[0]) * total**0.5
        interval = confidence_interval(process.parameters[0], total**0.5, error, 0.95)
        return Estimate.of(process, "estimated", total**0.5, error, interval, fit.wv)
    limit = (0.0, _limit(fit, process, key))
    return Estimate.of(process, "bound", 0.0, None, limit, fit.wv)


def upper_limit(fit: Fit, key: str) -> float:
    """95 % upper limit of N or K of a model without such a term, in SI.

    Raises InputError if the data do not limit it.
    """
    limit = _limit(fit, PROCESSES[key], key)
    if not np.isfinite(limit):
        raise InputError(
            f"channel {fit.wv.name!r}: this record gives no upper limit of {key}: record longer"
        )
    return limit


def _limit(fit: Fit, process: Process, key: str) -> float:
    if key in fit.upper_bounds:
        return float(fit.upper_bounds[key])
    # Given shapes, such as that of a line or of a low-pass, stay as they are.
    opened = fit.model.with_params(dict.fromkeys([*fit.keys, *fit.upper_bounds]))
    again = estimate(opened if key in fit.params else opened + process, fit.wv)
    return float(again.interval()[key][1])


def _bias_instability(fit: Fit, rivals: Sequence[Model], walk: Estimate) -> tuple[Estimate, float]:
    """B from the lowest fitted Allan deviation at averaging times with data, and that time.

    Where the model runs below the 95 % interval of the data, its lower end counts. An upper limit
    allows for a random walk that the record only limits.
    """
    at, wv = fit.goodness, fit.wv
    known = np.sqrt(np.array([wv.lower, wv.upper]) / np.maximum(wv.variance, _TINY))
    fitted, low, high = fit.deviation_interval(wv.tau, rivals=rivals)
    deviation, highest = (np.fmax(each, at.data * known[0]) for each in (fitted, high))
    if np.argmin(deviation) == wv.tau.size - 1:
        # The lowest is no higher than any of them.
        if walk.kind == "bound":
            highest = np.hypot(highest, walk.upper * np.sqrt(wv.tau / 3.0))
            highest = np.fmin(highest, np.fmax(high, at.data * known[1]))
        lowest = int(np.argmin(highest))
        limit = float(highest[lowest]) / PLATEAU
        found = Estimate.of(PROCESSES["B"], "bound", 0.0, None, (0.0, limit), wv)
        return found, float(wv.tau[lowest])
    lowest = int(np.argmin(deviation))
    if deviation[lowest] > fitted[lowest]:
        low, high = deviation * known
    b, *ends = (float(each[lowest]) / PLATEAU for each in (deviation, low, high))
    interval = (ends[0], ends[1])
    return Estimate.of(PROCESSES["B"], "estimated", b, None, interval, wv), float(wv.tau[lowest])
