"""What a data sheet states, the error models that agree with it, and numbers for a filter."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm import plotting
from gmwm._core import checks
from gmwm._core.text import brief, plain_table, wrapped
from gmwm._core.typing import FloatArray
from gmwm._core.units import customary_unit
from gmwm.errors import InputError
from gmwm.filter_numbers import (
    HORIZON,
    AxisFilterNumbers,
    FilterNumbers,
    InUnits,
    Predicted,
    bound,
    certify,
    shown_unit,
)
from gmwm.issues import Notice, notice
from gmwm.process import BiasInstability, GaussMarkov, Model, Process, RandomWalk, WhiteNoise

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# Least and greatest averaging time, over that at which white noise alone has the lowest deviation,
# and how many between them; 100 a decade show a flat place to 0.1 %:
_AVERAGING_TIMES = (1e-2, 1e4, 601)
_FLAT = 0.04  # Slope of log Allan variance from which on a curve counts as flat: flicker at 96 %
_ALIKE = 0.01  # Relative difference of lowest deviations that counts as none
# Correlation times of Gauss-Markov processes, over the same time; from 100 times on they are walks:
_TAU = (2.0, 60.0, 9)
# Of Gauss-Markov processes that make no flat place: their largest Allan deviation over that of
# white noise there. In a trial of 61 sensors the largest NEES was 1.19 with 0.3 and 0.98 with this;
# the median after 10 s was 0.67 and 0.50, and 0.35 with 1:
_SHOULDER = 0.7
_SHOULDER_TAU = (0.02, 2.0, 5)
_FASTEST_SHOULDER = 1.0  # s, below which it counts as white noise, which is read at 1 s
# Standard deviations of a unit over the typical ones of a sheet. The gyros of one ADIS16405 in four
# recordings: N 1.08 to 1.24 times, lowest deviation 0.95 to 1.33 times its sheet's. Of 200
# simulated sensors, K of recordings lies between the ends in 96 %: benchmarks/sheets.py
_UNIT_SPREAD = 1.25

# Densities of white noise that sensors have, SI: from hemispherical resonator gyros (1e-5
# deg/sqrt(h)) to 0.5 deg/s/sqrt(Hz), as for recordings; from seismic accelerometers (2 ng/sqrt(Hz))
# to 10 mg/sqrt(Hz):
_DENSITIES = {"gyro": (3e-9, 8.7e-3), "accel": (2e-8, 0.1)}
# s, averaging time at which white noise alone reaches the lowest deviation: 0.8 to 400 s for the
# sheets installed. The ends are a factor of 1,000 in N apart:
_CROSSINGS = (0.1, 1e5)
_FLICKER = float(np.sqrt(2.0 * np.log(2.0) / np.pi))
"""Plateau of the Allan deviation over B, 0.664 (IEEE Std 952-1997, C.1.3)."""
_PEAK_TIME, _PEAK = 1.89, 0.617
"""Peak of the Allan deviation of a Gauss-Markov process, over tau and sigma (the same, C.1.5)."""


def agreeing(where: str, values: Mapping[str, float], N: float) -> dict[str, Model]:
    """Models with white noise N whose Allan deviation is lowest where the sheet says, by terms.

    The other term is a random walk, flicker noise, or a Gauss-Markov process of any correlation
    time, of such a size that the curve is first flat at the stated deviation. A Gauss-Markov
    process too weak to make the curve flat, below a walk, stands for what N and B do not show. If a
    rate random walk or a correlation time is stated, all models have it.

    values: By key of `KEYS`, SI.
    Raises InputError if there is no such model, or no slow noise is stated.
    """
    lowest = lowest_deviation(values)
    known: list[Process] = [WhiteNoise(N)]
    if "K" in values:
        known.append(RandomWalk(values["K"]))
    if not lowest:
        if "K" in values:
            return {"N+K": Model(tuple(known))}
        raise InputError(
            f"{where}: no slow noise is stated, so K is unknown: add B, lowest_deviation or "
            "K, or record an hour at rest"
        )
    crossing = (N / lowest) ** 2  # s, where white noise alone has this deviation
    first, last, many = _AVERAGING_TIMES
    tau = crossing * np.geomspace(first, last, many)
    found = {}
    for label, base, slow in _candidates(known, lowest, values.get("correlation_time")):
        size = _size(_allan(base, tau), _allan([slow(1.0)], tau), tau, lowest**2)
        if size is not None:
            found[label] = Model((*base, slow(size)))
    least = np.sqrt(np.min(_allan(known, tau)))
    if not found and "K" in values and abs(least / lowest - 1.0) < _ALIKE:
        return {"N+K": Model(tuple(known))}
    if not found:
        raise InputError(
            f"{where}: no model with all of these numbers has a lowest Allan deviation of "
            f"{lowest:.3g} (SI): leave out {'K' if 'K' in values else 'correlation_time'}"
        )
    return found


def lowest_deviation(values: Mapping[str, float]) -> float:
    """The lowest Allan deviation that is stated, u; zero if none is."""
    return values.get("lowest_deviation", _FLICKER * values.get("B", 0.0))


def _candidates(
    known: list[Process], lowest: float, memory: float | None
) -> Iterator[tuple[str, list[Process], Callable[[float], Process]]]:
    """Terms that are known, and a slow one of any size."""
    label = "+".join(each.short_name for each in known)
    crossing = float(_allan(known[:1], np.ones(1))[0]) / lowest**2
    has_walk = len(known) > 1
    if memory is None:
        if not has_walk:
            yield f"{label}+K", known, RandomWalk
        yield f"{label}+B", known, BiasInstability
    first, last, many = _TAU
    taus = crossing * np.geomspace(first, last, many) if memory is None else [memory]
    for tau in map(float, taus):
        yield f"{label}+GM {brief(tau, 2)} s", known, partial(GaussMarkov, tau=tau)
    if memory is not None or has_walk:
        return
    first, last, many = _SHOULDER_TAU
    for tau in map(float, crossing * np.geomspace(first, last, many)):
        if tau > _FASTEST_SHOULDER:
            white = lowest * np.sqrt(crossing / (_PEAK_TIME * tau))  # its deviation at the peak
            weak = GaussMarkov(_SHOULDER * white / _PEAK, tau)
            yield f"{label}+GM {brief(tau, 2)} s+K", [*known, weak], RandomWalk


def _allan(terms: list[Process], tau: FloatArray) -> FloatArray:
    """Allan variance, u^2."""
    return 2.0 * Model(tuple(terms)).haar_variance(tau, float(tau[0]) / 100.0)


def _size(base: FloatArray, unit: FloatArray, tau: FloatArray, target: float) -> float | None:
    """Size of a term of Allan variance ``unit`` that makes the sum flat at ``target``, or None."""
    steps = np.diff(np.log(tau))

    def reading(square: float) -> float:
        total = base + square * unit
        flat = np.flatnonzero(np.diff(np.log(total)) >= -_FLAT * steps)
        return float(total[flat[0]]) if flat.size else 0.0

    low, high = target / float(np.max(unit)) * 1e-9, target / float(np.min(unit))
    if reading(low) > target:
        return None
    for _ in range(60):  # below the least size that makes it flat there is no reading
        middle = np.sqrt(low * high)
        low, high = (middle, high) if reading(middle) < target else (low, middle)
    return float(np.sqrt(high)) if abs(reading(high) / target - 1.0) < 2.0 * _ALIKE else None


UNITS = {"N": "u/sqrt(Hz)", "B": "u", "K": "u/s/sqrt(Hz)"}
"""Units of the numbers that most data sheets state."""

KEYS = {
    **UNITS,
    "noise_density": "u/sqrt(Hz)",
    "rms_noise": "u",
    "bandwidth": "Hz",
    "lowest_deviation": "u",
    "correlation_time": "s",
    "turn_on_bias": "u",
}
"""What an entry of a sensor may state, with units."""

_FINE = 1e-3  # s, sampling interval of curves: that of the sensor does not matter
_SHARED = ("bandwidth", "correlation_time")  # the same in noisier units
_TERMS: dict[str, type[Process]] = {"N": WhiteNoise, "B": BiasInstability, "K": RandomWalk}
_PER_DENSITY = np.sqrt(0.5)
"""N over a noise density: the variance of a band per hertz is one-sided, N^2 the two-sided power
spectral density (IEEE Std 952-1997, C.1.1)."""
_FIRST_ORDER = np.pi / 2.0
"""Equivalent noise bandwidth of a first-order filter over its bandwidth."""


@dataclass(frozen=True, repr=False)
class Datasheet(InUnits):
    """What a data sheet states, by sensor or channel.

    Attributes
    ----------
    name : str
        Of the sensor, or of the file.
    entries : dict
        "gyro", "accel" or a channel -> key of `KEYS` -> value, SI.
    document : str
        Where the values are from; empty if unknown.
    pages : dict
        Sensor -> key -> page of the document.
    temperature : str
        Range for which the values are stated; empty if unknown.
    """

    name: str
    entries: dict[str, dict[str, float]]
    document: str = ""
    pages: dict[str, dict[str, str]] = field(default_factory=dict)
    temperature: str = ""

    @property
    def letters(self) -> dict[str, dict[str, float]]:
        """N, B and K of each sensor or channel as far as they are stated, SI."""
        return {sensor: self.of(sensor, None) for sensor in self.entries}

    @property
    def leaves_K_open(self) -> bool:
        """Whether no slow noise is stated of any sensor, so that there are no `numbers`."""
        return not any("K" in v or lowest_deviation(v) for v in self.entries.values())

    def of(self, channel: str, quantity: str | None) -> dict[str, float]:
        """N, B and K of a channel as far as they are stated, SI."""
        values = self.entries.get(channel, self.entries.get(quantity or "", {}))
        found = {letter: values[letter] for letter in UNITS if letter in values}
        if "N" not in found and "noise_density" in values:
            found["N"] = _PER_DENSITY * values["noise_density"]
        return found

    def deviation(
        self, channel: str, quantity: str | None, tau: FloatArray, dt: float
    ) -> FloatArray | None:
        """The Allan deviation of N, B and K, u, or ``None``."""
        values = self.of(channel, quantity)
        if not values:
            return None
        curves = [_TERMS[key](value).haar_variance(tau, dt) for key, value in values.items()]
        return np.asarray(np.sqrt(2.0 * np.sum(curves, axis=0)), dtype=float)

    def models(self, sensor: str, unit_spread: float = 1.0) -> dict[str, Model]:
        """Error models that agree with what is stated of a sensor, by their terms.

        They go wherever models by channel do, e.g. ``gmwm.bound(sheet.models("gyro"),
        shared=True)`` or `gmwm.certify`; docs/data-sheets.md says how they are made.

        Parameters
        ----------
        sensor : str
            Key of ``entries``.
        unit_spread : float, optional
            Standard deviations of a unit's errors over the typical ones of the sheet, 1 or more.

        Raises
        ------
        InputError
            If nothing is stated of the sensor, or no white or no slow noise.
        """
        if sensor not in self.entries:
            raise InputError(
                f"{self.name} has no {sensor!r}: choose from {', '.join(self.entries)}"
            )
        if not checks.is_number(unit_spread) or not 1.0 <= unit_spread <= checks.LARGEST:
            raise InputError(f"unit_spread = {unit_spread}: give a factor of 1 or more")
        where = f"{self.name}: {sensor}"
        values = {
            k: v if k in _SHARED else unit_spread * v for k, v in self.entries[sensor].items()
        }
        white = _white(values)
        if not white:
            raise InputError(
                f"{where}: no white noise is stated: give N, noise_density, or rms_noise and "
                "bandwidth"
            )
        return {
            f"{sensor}_{label}{way}": model
            for way, N in white.items()
            for label, model in agreeing(where, values, N).items()
        }

    def numbers(
        self,
        form: str = "N+K",
        horizon: float = HORIZON,
        *,
        unit_spread: float = _UNIT_SPREAD,
        rate: float = float("nan"),
    ) -> FilterNumbers:
        """The smallest numbers that are not overconfident for any model that agrees with the sheet.

        Parameters
        ----------
        form, horizon
            As of `gmwm.bound`.
        unit_spread : float, optional
            As of `models`; docs/data-sheets.md has the reason for the default.
        rate : float, optional
            At which the sensor is sampled, Hz: for programs that want it beside the numbers.

        Returns
        -------
        FilterNumbers
            By sensor, each for all of its axes, of those that have white and slow noise. The
            predictions are the largest NEES and the smallest tightness over the models.

        Raises
        ------
        InputError
            If there is no such sensor, or as `gmwm.bound` does.
        """
        if not np.isnan(rate):
            rate = checks.positive("rate", rate, "give a rate in Hz")
        found, reasons = {}, []
        for sensor, values in self.entries.items():
            try:
                models = self.models(sensor, unit_spread)
            except InputError as error:
                reasons.append(error)
                continue
            sd = values.get("turn_on_bias", 0.0)
            axes = [*bound(models, form, horizon, bias_sd=sd, shared=True).values()]
            N = next(iter(_white(values).values()))
            found[sensor] = _of_all(axes, _unlikely(sensor.partition("_")[0], values, N))
        if not found:
            raise reasons[0]
        return FilterNumbers(
            found, f"{self.name}, from a data sheet: record an hour", rate, shared=True
        )

    def judged(
        self,
        numbers: Mapping[str, Any],
        horizon: float = HORIZON,
        unit_spread: float = _UNIT_SPREAD,
    ) -> dict[str, tuple[float, float]]:
        """Least and largest NEES of a filter with given numbers, by sensor.

        Parameters
        ----------
        numbers : mapping
            By sensor, as of `gmwm.certify`.
        horizon : float, optional
            Time without aiding, s.
        unit_spread : float, optional
            As of `models`; the least is that of a typical unit, the largest that of a noisy one.
        """
        found = {}
        for sensor in (name for name in self.entries if name in numbers):
            nees = [
                check.nees
                for spread in (1.0, unit_spread)
                for check in certify(
                    self.models(sensor, spread), {sensor: numbers[sensor]}, outages=(horizon,)
                ).of("free")
            ]
            found[sensor] = (min(nees), max(nees))
        return found

    def plot(
        self, sensor: str, numbers: FilterNumbers | None = None, ax: Axes | None = None
    ) -> Axes:
        """The Allan deviations of the models that agree with what is stated of a sensor.

        Parameters
        ----------
        sensor : str
            Key of ``entries``.
        numbers : FilterNumbers, optional
            Of a filter, drawn over them.
        ax : matplotlib Axes, optional

        Returns
        -------
        matplotlib Axes
        """
        quantity = sensor.partition("_")[0]
        unit, scale = customary_unit("u", quantity, "u")
        models = self.models(sensor)
        first = next(iter(models.values()))
        crossing = 2.0 * float(first.haar_variance(np.ones(1), _FINE)[0])
        lowest = lowest_deviation(self.entries[sensor]) or np.sqrt(crossing)
        tau = np.geomspace(0.1, 1e4, 81)
        curves = {key: np.sqrt(2.0 * m.haar_variance(tau, _FINE)) for key, m in models.items()}
        lines = {}
        if numbers is not None and sensor in numbers:
            own = numbers[sensor].model.haar_variance(tau, _FINE)
            lines[f"filter, {numbers.form} for {numbers.horizon:g} s"] = scale * np.sqrt(2.0 * own)
        title = f"{self.name}, {sensor}"
        return plotting.model_set(
            tau,
            scale * np.stack([*curves.values()]),
            lines,
            scale * lowest,
            unit=unit,
            title=title,
            ax=ax,
        )

    def __repr__(self) -> str:
        return f"<Datasheet of {self.name}: {', '.join(self.entries)}>"

    def text(self, units: str = "field", form: str = "N+K", horizon: float = HORIZON) -> str:
        """N and K that a filter needs for each kind of model that agrees with the sheet."""
        about = f"{self.name} ({self.document})" if self.document else self.name
        kinds = "Models that agree with it, and N and K that a filter needs for each"
        title = f"{about}: typical values of a data sheet. {kinds}, outages up to {horizon:g} s:"
        if self.leaves_K_open:
            title = f"{about}: typical values of a data sheet"
        parts = ["\n".join(wrapped(title))]
        if self.temperature:
            said = f"stated for {self.temperature}: add what the bias changes with temperature"
            parts.append("\n".join(wrapped(said)))
        for sensor, values in self.entries.items():
            quantity = sensor.partition("_")[0]
            try:
                models = self.models(sensor)
            except InputError as error:
                white = [*_white(values).values()]
                stated = (
                    f"{_ends(white, scale)} {unit}"
                    for unit, scale in (shown_unit("N", quantity, u) for u in ("field", "si"))
                )
                known = f"{sensor}: N {' or '.join(stated)}" if white else ""
                parts.append("\n".join(filter(None, (known, *wrapped(str(error), indent=2)))))
                continue
            by_kind: dict[str, list[AxisFilterNumbers]] = {}
            for label, model in models.items():
                found = bound(model, form, horizon)
                for kind in (_kind(label), "all"):
                    by_kind.setdefault(kind, []).append(found)
            by_kind["all"] = by_kind.pop("all")
            shown = {key: shown_unit(key, quantity, units) for key in "NK"}
            rows = [
                (kind, *(_ends([getattr(e, k) for e in same], shown[k][1]) for k in shown))
                for kind, same in by_kind.items()
            ]
            heads = (sensor, *(f"{key}, {unit}" for key, (unit, _) in shown.items()))
            parts.append(plain_table(heads, rows).rstrip())
        return "\n\n".join(parts)


def _unlikely(quantity: str, values: Mapping[str, float], N: float) -> list[Notice]:
    """Where N (u/sqrt(Hz)) is out of the range of sensors, or does not belong to what is stated."""
    least, largest = _DENSITIES.get(quantity, (0.0, np.inf))
    if not least <= N <= largest:
        end, limit = ("least", least) if least > N else ("largest", largest)
        return [notice("unlikely-sheet", quantity, ratio=N / limit, end=end)]
    lowest = lowest_deviation(values)
    time = (N / lowest) ** 2 if lowest else 1.0
    first, last = _CROSSINGS
    is_usual = first <= time <= last
    return [] if is_usual else [notice("unlikely-sheet", quantity, variant="pair", time=time)]


def _of_all(axes: Sequence[AxisFilterNumbers], notices: Sequence[Notice]) -> AxisFilterNumbers:
    """Numbers that models share, as those of one axis, with what is to be said."""
    worst = tuple(
        Predicted(same[0].time, max(e.nees for e in same), min(e.tightness for e in same))
        for same in zip(*(each.predicted for each in axes), strict=True)
    )
    return replace(axes[0], predicted=worst, notices=(*notices, notice("from-data-sheet")))


def _kind(label: str) -> str:
    """The terms of a model without its correlation time."""
    return re.sub(r" [\d.,e+-]+ s| \(.*\)", "", label.partition("_")[2]).replace("+", " + ")


def _ends(values: Sequence[float], scale: float) -> str:
    return " to ".join(dict.fromkeys(brief(scale * end(values), 3) for end in (min, max)))


def _white(values: Mapping[str, float]) -> dict[str, float]:
    """N by the way in which the sheet may mean it, u/sqrt(Hz); empty if none is stated."""
    if "N" in values:
        return {"": values["N"]}
    if "noise_density" in values:
        density = values["noise_density"]
        return {"": _PER_DENSITY * density, " (density is N)": density}
    if {"rms_noise", "bandwidth"} <= {*values}:
        density = values["rms_noise"] / np.sqrt(values["bandwidth"])
        least = _PER_DENSITY * density / np.sqrt(_FIRST_ORDER)
        return {"": least, " (sharp band)": _PER_DENSITY * density}
    return {}
