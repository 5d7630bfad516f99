"""Small multiples of Allan deviations as SVG: no script, and the colours are those of the page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm._core.units import shown_unit
from gmwm.estimate import Fit
from gmwm.estimate.result import dense_curves
from gmwm.population import AxisComparison, Equality
from gmwm.report.datasheet import Datasheet

COLOURS = 8
"""Of the page; further recordings begin anew, with a dashed line."""

_WIDTH, _HEIGHT = 380.0, 316.0
_LEFT, _RIGHT = 46.0, 374.0
_TOP, _MIDDLE = 15.0, 196.0  # of the deviations
_LOW, _BOTTOM = 212.0, 284.0  # of the ratios
_LIMITS = (2.0, 5.0, 10.0, 20.0, 50.0, 100.0)  # per cent
_DODGE = 0.05  # decades between the first and the last recording at a level
_SURE = 0.1  # relative error of a ratio that counts for the limits of its axis


@dataclass(frozen=True)
class _Scale:
    """From logarithms (or numbers) to places."""

    low: float
    high: float
    start: float
    stop: float

    def __call__(self, value: FloatArray | float) -> FloatArray:
        share = (np.asarray(value, dtype=float) - self.low) / (self.high - self.low)
        return np.asarray(self.start + share * (self.stop - self.start))


def multiple(
    axis: AxisComparison, labels: Sequence[str], out: Sequence[Fit], sheet: Datasheet | None
) -> str:
    """The curves of an axis with their intervals, and below them their ratios to the common one.

    labels: Of all recordings, whose places are their colours.
    out: Of recordings that are not compared, drawn faintly.
    """
    fits = [*axis.fits.values(), *out]
    unit, factor = shown_unit(fits[0].wv.quantity, fits[0].wv.unit, "field")
    x, y = _scales(fits, factor)
    parts = [_frame(x, y, unit)]
    for fit in out:
        parts.append(_line("out", x(np.log10(fit.wv.tau)), y(_log(factor, fit.wv.variance))))
    if axis.joint is not None:
        tau, curves = dense_curves(axis.joint)
        total = np.sum([curve**2 for curve in curves.values()], axis=0)
        parts.append(_line("joint", x(np.log10(tau)), y(_log(factor, 0.5 * total))))
    if sheet is not None:
        tau = fits[0].wv.tau
        stated = sheet.deviation(axis.name, fits[0].wv.quantity, tau, fits[0].wv.dt)
        if stated is not None:
            parts.append(_line("sheet", x(np.log10(tau)), y(np.log10(factor * stated))))
    shifts = dict(
        zip(axis.fits, _DODGE * np.linspace(-0.5, 0.5, max(len(axis.fits), 2)), strict=False)
    )
    for label, fit in axis.fits.items():
        at = x(np.log10(fit.wv.tau) + shifts[label])
        ends = [y(_log(factor, each)) for each in (fit.wv.lower, fit.wv.upper)]
        parts.append(_points(labels.index(label), at, y(_log(factor, fit.wv.variance)), *ends))
    equality = axis.equality
    if equality is not None and equality.tau.size:
        parts.append(_ratios(equality, axis.fits, labels, x, shifts))
    else:
        middle = 0.5 * (_LEFT + _RIGHT), 0.5 * (_LOW + _BOTTOM) + 4.0
        parts.append(_text(*middle, "nothing to compare", "middle"))
    title = f"Allan deviation of {axis.name} in {unit} against averaging time in s"
    return (
        f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" aria-label="{escape(title)}">'
        f"{''.join(parts)}</svg>"
    )


def _log(factor: float, variance: FloatArray) -> FloatArray:
    """Decades of the Allan deviation, in the unit shown."""
    return np.log10(factor * np.sqrt(2.0 * np.maximum(variance, 1e-300)))


def _scales(fits: Sequence[Fit], factor: float) -> tuple[_Scale, _Scale]:
    tau = np.concatenate([fit.wv.tau for fit in fits])
    values = np.concatenate([_log(factor, fit.wv.variance) for fit in fits])
    low, high = float(np.min(values)) - 0.25, float(np.max(values)) + 0.15
    ends = np.log10([np.min(tau), np.max(tau)])
    return (
        _Scale(ends[0] - 0.15, ends[1] + 0.15, _LEFT, _RIGHT),
        _Scale(low, high, _MIDDLE, _TOP),
    )


def _frame(x: _Scale, y: _Scale, unit: str) -> str:
    """Grid, numbers and names of the axes."""
    parts = [
        f'<rect class="box-line" x="{_LEFT:g}" y="{a:g}" width="{_RIGHT - _LEFT:g}" '
        f'height="{b - a:g}"/>'
        for a, b in ((_TOP, _MIDDLE), (_LOW, _BOTTOM))
    ]
    for decade in range(int(np.ceil(x.low)), int(np.floor(x.high)) + 1):
        at = float(x(decade))
        for a, b in ((_TOP, _MIDDLE), (_LOW, _BOTTOM)):
            parts.append(f'<path class="grid" d="M{at:.1f} {a:g}V{b:g}"/>')
        parts.append(_text(at, _BOTTOM + 13.0, f"{10.0**decade:g}", "middle"))
    for value in _ticks(y):
        at = float(y(np.log10(value)))
        parts.append(f'<path class="grid" d="M{_LEFT:g} {at:.1f}H{_RIGHT:g}"/>')
        parts.append(_text(_LEFT - 4.0, at + 3.5, f"{value:g}", "end"))
    parts.append(_text(0.5 * (_LEFT + _RIGHT), _HEIGHT - 4.0, "averaging time [s]", "middle"))
    parts.append(_text(_LEFT, _TOP - 5.0, f"Allan deviation [{unit}]", "start"))
    return "".join(parts)


def _ticks(y: _Scale) -> list[float]:
    """Round numbers, as many as can be read."""
    decades = range(int(np.floor(y.low)), int(np.ceil(y.high)) + 1)
    for digits in ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)):
        ticks = [d * 10.0**k for k in decades for d in digits]
        shown = [t for t in ticks if y.low <= np.log10(t) <= y.high]
        if len(shown) >= 3:
            break
    return shown


def _ratios(
    equality: Equality,
    shown: Iterable[str],
    labels: Sequence[str],
    x: _Scale,
    shifts: dict[str, float],
) -> str:
    """Differences from the common curve in per cent, with their intervals."""
    away = 100.0 * (equality.ratios - 1.0)
    error = 196.0 * equality.errors
    sure = np.abs(away[equality.errors < _SURE])
    largest = float(np.max(sure)) if sure.size else _LIMITS[-1]
    limit = next((each for each in _LIMITS if each >= 1.2 * largest), _LIMITS[-1])
    y = _Scale(-limit, limit, _BOTTOM, _LOW)
    parts = [f'<path class="zero" d="M{_LEFT:g} {float(y(0.0)):.1f}H{_RIGHT:g}"/>']
    for value in (-0.5 * limit, 0.0, 0.5 * limit):
        parts.append(
            _text(_LEFT - 4.0, float(y(value)) + 3.5, f"{value:+g}" if value else "0", "end")
        )
    parts.append(_text(_LEFT, _LOW - 4.0, "ratio to common - 1 [%]", "start"))
    for row, label in enumerate(shown):
        known = np.isfinite(away[row])
        at = x(np.log10(equality.tau[known]) + shifts[label])
        value, half = away[row][known], error[row][known]
        ends = (y(np.clip(value + sign * half, -limit, limit)) for sign in (-1.0, 1.0))
        inside = np.where(np.abs(value) <= limit, value, np.nan)
        parts.append(_points(labels.index(label), at, y(inside), *ends, joined=False))
    return "".join(parts)


def _points(
    place: int,
    x: FloatArray,
    y: FloatArray,
    low: FloatArray,
    high: FloatArray,
    *,
    joined: bool = True,
) -> str:
    """A recording: points, their intervals, and a thin line."""
    bars = "".join(
        f"M{a:.1f} {max(min(b, _BOTTOM), _TOP):.1f}V{max(min(c, _BOTTOM), _TOP):.1f}"
        for a, b, c in zip(x, np.minimum(low, _MIDDLE) if joined else low, high, strict=True)
    )
    dots = "".join(
        f'<circle cx="{a:.1f}" cy="{b:.1f}" r="1.9"/>'
        for a, b in zip(x, y, strict=True)
        if np.isfinite(b)
    )
    dashed = " again" if place >= COLOURS else ""
    line = _line(f"thin{dashed}", x, y) if joined else ""
    return f'<g class="c{place % COLOURS}">{line}<path class="bar-line" d="{bars}"/>{dots}</g>'


def _line(name: str, x: FloatArray, y: FloatArray) -> str:
    known = np.isfinite(y)
    places = " ".join(
        f"{a:.1f},{min(b, _MIDDLE):.1f}" for a, b in zip(x[known], y[known], strict=True)
    )
    return f'<polyline class="{name}" points="{places}"/>'


def _text(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'
