"""The part of an error model that the numbers of a small filter dominate, and the rest."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from gmwm._core.text import brief, readable
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.filter_numbers import tuning
from gmwm.issues import Notice, Severity, notice
from gmwm.process import Model, Process, evaluated


@dataclass(frozen=True, eq=False)
class RequiredSpectrum:
    """The part of an error model that is dominated.

    terms: Those that count with their spectrum.
    weights: Share of each spectrum that counts: one, or less where its peak is fast.
    feet: Low-frequency density of the rest of each term, u^2/Hz.
    constant_sd: Standard deviation of the constant that stands for ramps, u.
    lowest: Frequency below which nothing changes, Hz.
    floor: Frequency above which a spectrum without a limit is bounded in time: that of the horizon.
    slope: Of the spectrum against 1/f at the lowest frequency, on logarithmic axes: 0 if it is
        flat, 2 of a random walk.
    """

    terms: tuple[Process, ...]
    weights: tuple[float, ...]
    feet: tuple[float, ...]
    constant_sd: float
    dt: float
    horizon: float
    lowest: float
    floor: float
    slope: float
    notices: tuple[Notice, ...]

    @classmethod
    def of(cls, model: Model, dt: float, horizon: float, unit: str = "u") -> Self:
        """Sort the terms of a model with given parameters; the unit is for notices.

        Raises InputError if a term can only be simulated, or nothing is left.
        """
        nyquist = 0.5 / dt
        passing = tuning.FAST / horizon
        fast = min(passing, 0.25 * nyquist)
        floor = 1.0 / (tuning.LOWEST * np.pi * max(10.0 * horizon, tuning.SHORTEST_MEMORY))
        floor = min(floor, 1e-3 * nyquist)
        kept: list[Process] = []
        weights: list[float] = []
        feet: list[float] = []
        notices: list[Notice] = []
        constant = 0.0
        for label, term in zip(model.term_labels(), model.terms, strict=True):
            if not term.has_spectrum():
                raise InputError(
                    f"{label} can only be simulated: give it a spectrum, or leave it out"
                )
            if term.is_drift:
                constant = abs(term.drift_rate()) * horizon
                values = {"R": term.drift_rate(), "sd": constant}
                size = readable(constant, unit)
                notices.append(notice("ramp-as-constant", "", values, label=label, size=size))
            elif term.is_line:
                notices += [
                    _line(label, f, amplitude, f < passing, unit) for f, amplitude in term.lines()
                ]
            else:
                band = _frequencies([term], floor, nyquist, tuning.PEAK_DECADE)
                density = evaluated(term.psd, band, dt)
                high, low = float(np.max(density)), float(np.max(density[band <= fast]))
                weight, own = _weight(band, density, low, passing)
                if high > tuning.PEAK * low and weight < 1.0:
                    notices.append(_peak(label, band, density, weight, fast))
                if weight * high > 0.0:
                    kept.append(term)
                    weights.append(weight)
                    feet.append((1.0 - weight) * own)
        lowest, slope = _limit(kept, floor, dt)
        if slope > tuning.STEEPEST:
            raise InputError(
                f"the spectrum of {model!r} rises as f^-{slope:.2g} towards zero frequency, more "
                "than a random walk, so no form covers it: leave that term out"
            )
        if not kept:
            raise InputError(
                f"{model!r} has no term that white noise, a random walk or a Gauss-Markov "
                "process can cover: add the white noise of the sensor"
            )
        parts = (tuple(kept), tuple(weights), tuple(feet))
        return cls(*parts, constant, dt, horizon, lowest, floor, slope, tuple(notices))

    @property
    def foot(self) -> float:
        """Low-frequency density of terms counted only there, u^2/Hz."""
        return sum(self.feet)

    def psd(self, f: FloatArray) -> FloatArray:
        """Spectral density, u^2/Hz."""
        return sum((density for _, density in self.densities(f)), np.full_like(f, self.foot))

    def densities(self, f: FloatArray) -> Iterator[tuple[Process, FloatArray]]:
        """Density of each term that counts, times its weight."""
        for term, weight in zip(self.terms, self.weights, strict=True):
            yield term, weight * term.psd(f, self.dt)

    def allan_variance(self, tau: FloatArray) -> FloatArray:
        """Allan variance at averaging times (s), u^2."""
        pairs = zip(self.terms, self.weights, strict=True)
        curves = (2.0 * weight * term.haar_variance(tau, self.dt) for term, weight in pairs)
        return sum(curves, self.foot / tau)

    @property
    def white(self) -> float:
        """Density of its white terms and of the feet, u^2/Hz."""
        one = np.ones(1)
        return self.foot + sum(float(term.psd(one, 1.0)[0]) for term in self.terms if term.is_white)

    @property
    def walk(self) -> float:
        """K^2 of the random walk in the limit of zero frequency, u^2/s."""
        if self.slope < 2.0 - tuning.RISING:
            return 0.0
        return float((2.0 * np.pi * self.lowest) ** 2 * self.psd(np.array([self.lowest]))[0])

    def frequencies(self, points: int) -> FloatArray:
        """Frequencies up to 1/(2 dt), some a decade, and more around resonances; Hz."""
        # Below the lowest there are only limits, which are as good as reached.
        below = self.lowest * np.array([1e-3, 1e-2, 1e-1])
        f = _frequencies(self.terms, self.lowest, 0.5 / self.dt, points)
        return np.unique(np.append(below, f))

    def slow_variance(self, stationary: Model) -> float:
        """Variance of the part above a stationary spectrum, random walks excluded, u^2.

        A term without a variance counts from the frequency of the horizon on.
        """
        f = self.frequencies(tuning.CHECKED_POINTS)
        total = self.foot - stationary.psd(f, self.dt)
        for term, density in self.densities(f):
            if term.is_walk:
                continue
            first, second = term.psd(f[0] * np.array([1.0, 2.0]), self.dt)
            rises = first > (1.0 + tuning.RISING) * second
            total += np.where(f >= self.floor, density, 0.0) if rises else density
        return 2.0 * _integral(np.maximum(total, 0.0) * f, np.log(f))


def _weight(
    band: FloatArray, density: FloatArray, low: float, passing: float
) -> tuple[float, float]:
    """Share of a spectrum that counts, and its low-frequency density (its foot).

    low: Largest density below ``passing`` (Hz), above which peaks average out within the horizon.
    """
    high, own = float(np.max(density)), float(density[0])
    if high <= low:
        return 1.0, own
    if own <= tuning.NO_FOOT * high:
        return float(high <= tuning.PEAK * low), 0.0
    near = (passing / band[int(np.argmax(density))]) ** tuning.FADING
    within = tuning.PEAK * (low - own) / (high - own)
    return float(np.clip(within, min(near, 1.0), 1.0)), own


def _frequencies(terms: Sequence[Process], low: float, high: float, points: int) -> FloatArray:
    """Some frequencies a decade, and more around resonances."""
    own = [
        np.linspace(0.9, 1.1, tuning.PEAK_POINTS) * (term.values[p.name] or 0.0)
        for term in terms
        for p in term.shape_parameters
        if p.unit == "Hz"
    ]
    grid = np.geomspace(low, high, int(np.ceil(np.log10(high / low) * points)) + 1)
    f = np.unique(np.concatenate([grid, *own]))
    return f[(f >= low) & (f <= high)]


def _limit(terms: list[Process], start: float, dt: float) -> tuple[float, float]:
    """Frequency where every spectrum has reached its limit, and the slope there."""
    if not terms:
        return start, 0.0
    f = np.asarray(start * 10.0 ** -np.arange(tuning.DECADES + 1.0), dtype=float)
    lowest, steepest = 0, 0.0
    for term in terms:
        density = np.maximum(evaluated(term.psd, f, dt), np.finfo(float).tiny)
        slopes = np.diff(np.log10(density))
        changes = np.abs(np.diff(slopes, prepend=np.inf))
        settled = np.abs(slopes) < tuning.SETTLED
        if not settled[0] and not _has_variance(term, dt):
            # Above the corner of a slow stationary process the slope is constant too.
            settled |= changes < tuning.SETTLED
        place = int(np.argmax(settled)) if np.any(settled) else slopes.size - 1
        lowest, steepest = max(lowest, place), max(steepest, float(slopes[place]))
    return float(f[lowest]), steepest


def _has_variance(term: Process, dt: float) -> bool:
    """Whether a process is stationary as far as it is known."""
    try:
        term.autocovariance(np.zeros(1, dtype=int), dt)
    except InputError:
        return False
    return True


def _line(label: str, f: float, amplitude: float, is_slow: bool, unit: str) -> Notice:
    values, size = {"frequency": f, "amplitude": amplitude}, readable(amplitude, unit)
    severity: Severity = "warning" if is_slow else "note"
    more = {"variant": "slow" if is_slow else "", "label": label, "size": size}
    return notice("line-left-out", "", values, severity=severity, **more)


def _peak(label: str, f: FloatArray, density: FloatArray, weight: float, fast: float) -> Notice:
    place = float(f[int(np.argmax(density))])
    high = f >= fast
    variance = 2.0 * _integral((density * f)[high], np.log(f[high]))
    also = f" and {brief(100.0 * weight)} % of the peak" if weight > tuning.FADED else ""
    values = {"density": float(density[0]), "frequency": place}
    values |= {"variance": variance, "share": weight}
    return notice("fast-peak-left-out", "", values, also=also, label=label, fast=fast)


def _integral(y: FloatArray, x: FloatArray) -> float:
    """By trapezoids, as one of the functions of scipy, which would all be imported."""
    return float(np.sum(np.diff(x) * (y[1:] + y[:-1]) / 2.0))
