"""Pages of HTML: text that is not ours is escaped, and nothing runs or loads but what is ours."""

from __future__ import annotations

import os
import platform
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core import __version__
from gmwm._core.files import write_text
from gmwm._core.text import brief, per_cent
from gmwm._core.typing import FloatArray
from gmwm._core.units import field_units, shown_unit, si_parameter_unit
from gmwm.datasheet import Datasheet
from gmwm.errors import printable
from gmwm.estimate import Fit
from gmwm.population import AxisComparison, Spread
from gmwm.variance import WaveletVariance

_DAY, _YEAR = 86400.0, 365.25 * 86400.0
_DAYS, _YEARS = 5.0, 2.0  # from which on durations are given so
_MANY_YEARS = 100.0

if TYPE_CHECKING:
    from jinja2 import Environment

    from gmwm.datasheet import Datasheet


def resource(name: str) -> str:
    """The text of a file in this folder."""
    return files("gmwm.report").joinpath(name).read_text(encoding="utf-8")


def duration_text(seconds: float) -> str:
    """A duration as people say it: ``40 s``, ``35 min``, ``2 h 46 min``, ``12 days``."""
    if seconds > _MANY_YEARS * _YEAR:
        return "centuries"
    if seconds >= _YEARS * _YEAR:
        return f"{seconds / _YEAR:.2g} years"
    if seconds >= _DAYS * _DAY:
        return f"{seconds / _DAY:.3g} days"
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    parts = zip(divmod(round(seconds / 60.0), 60), ("h", "min"), strict=True)
    return " ".join(f"{count} {unit}" for count, unit in parts if count)


def begun(text: str) -> str:
    """With a capital at the beginning; units and names keep theirs."""
    return text[:1].upper() + text[1:]


def units_of(unit: str, wv: WaveletVariance) -> tuple[str, float, str]:
    """The field's unit for a parameter of a channel, its number per SI unit, and the SI unit."""
    known = field_units(unit, wv.quantity)
    si = si_parameter_unit(unit, wv.quantity)
    if wv.quantity is None:
        si = unit.replace("u", wv.unit or "u", 1)
    return (known[0].unit, known[0].per_si, si) if known else (si, 1.0, si)


def quantity_text(value: float, unit: str, fit: Fit) -> dict[str, str]:
    """A value in the field's first unit and in SI."""
    field, scale, si = units_of(unit, fit.wv)
    return {"field": f"{brief(value * scale, 3)} {field}", "si": f"{value:.3g} {si}"}


def write_page(path: str | os.PathLike[str], template: str, **values: Any) -> Path:
    """Write a page from its template; see `rendered`."""
    return write_text(path, rendered(template, **values))


def rendered(template: str, scripts: Sequence[str] = (), **values: Any) -> str:
    """A page from its template.

    scripts: The only ones that a browser will run, by a Content-Security-Policy; nothing is loaded
        from any network.
    **values: Of the template, where ``tojson`` writes figures and ``scripts`` are those above; it
        has the ``style`` of reports, the ``version`` of this package and filters for numbers
        and durations too.
    """
    hashes = (b64encode(sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{each}'" for each in hashes) or "'none'"
    policy = (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    return _environment().get_template(template).render(policy=policy, scripts=scripts, **values)


@cache
def _environment() -> Environment:
    """That compiles each template once."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("gmwm", "report"), autoescape=True, undefined=StrictUndefined
    )
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    environment.globals |= {"style": resource("report.css"), "version": __version__}
    environment.filters |= {
        "begun": begun,
        "brief": brief,
        "duration": duration_text,
        "per_cent": per_cent,
    }
    return environment


def origin(known: Mapping[str, str], what: str, sheet: Datasheet | None) -> dict[str, str]:
    """Sources of the numbers, versions, and the date as ``what``."""
    known = dict(known) if sheet is None else {**known, "data sheet": sheet.name}
    return {printable(key): printable(value) for key, value in known.items()} | {
        "versions": f"gmwm {__version__}, numpy {np.__version__}, "
        f"Python {platform.python_version()}",
        what: datetime.now(UTC).strftime("%Y-%m-%d (UTC)"),
    }


_LEFT, _RIGHT = 46.0, 374.0
_TOP, _MIDDLE = 15.0, 196.0  # of the deviations
_LOW, _BOTTOM = 212.0, 284.0  # of the ratios
_LIMITS = (2.0, 5.0, 10.0, 20.0, 50.0, 100.0)  # per cent
_DODGE = 0.05  # decades between the first and the last recording at a level
_SURE = 0.1  # relative error of a ratio that counts for the limits of its axis
_FARTHEST = 3.0  # a limit beyond so many times the largest value is not drawn
_ROW = 34.0
_NAMED = 3  # points of a row that stand apart and have their names beside them


@dataclass(frozen=True)
class Scale:
    """From logarithms (or numbers) to places."""

    low: float
    high: float
    start: float
    stop: float

    def __call__(self, value: FloatArray | float) -> FloatArray:
        share = (np.asarray(value, dtype=float) - self.low) / (self.high - self.low)
        return np.asarray(np.round(self.start + share * (self.stop - self.start), 1))


def round_values(low: float, high: float) -> list[float]:
    """A few round numbers between two, for a logarithmic axis."""
    from matplotlib.ticker import LogLocator, MaxNLocator

    if high > 10.0 * low:
        subs = (1.0,) if high > 1000.0 * low else (1.0, 2.0, 5.0)
        ticks = LogLocator(subs=subs, numticks=20).tick_values(low, high)
    else:
        ticks = MaxNLocator(5, steps=[1, 2, 5, 10]).tick_values(low, high)
    inside = [float(each) for each in ticks if low <= each <= high]
    return inside[:: -(-len(inside) // 6) or 1]


def multiple(
    axis: AxisComparison, labels: Sequence[str], out: Sequence[Fit], sheet: Datasheet | None
) -> dict[str, Any]:
    """The curves of an axis with their intervals, and below them their ratios to the common one.

    out: Of recordings that are not compared, drawn faintly.
    """
    fits = [*axis.fits.values(), *out]
    first = fits[0].wv
    unit, factor = shown_unit(first.quantity, first.unit, "field")

    def decades(variance: FloatArray) -> FloatArray:
        """Of the Allan deviation, in the unit shown."""
        return np.log10(factor * np.sqrt(2.0 * np.maximum(variance, 1e-300)))

    ends = np.log10([min(fit.wv.tau[0] for fit in fits), max(fit.wv.tau[-1] for fit in fits)])
    values = np.concatenate([decades(fit.wv.variance) for fit in fits])
    x = Scale(ends[0] - 0.15, ends[1] + 0.15, _LEFT, _RIGHT)
    y = Scale(float(values.min()) - 0.25, float(values.max()) + 0.15, _MIDDLE, _TOP)
    curves = [("out", fit.wv.tau, decades(fit.wv.variance)) for fit in out]
    stated = None
    if sheet is not None:
        stated = sheet.deviation(axis.name, first.quantity, first.tau, first.dt)
    if stated is not None:
        curves.append(("sheet", first.tau, np.log10(factor * stated)))
    shifts = _DODGE * np.linspace(-0.5, 0.5, max(len(axis.fits), 2))
    recordings = []
    for (label, fit), shift in zip(axis.fits.items(), shifts, strict=False):
        at, shown = x(np.log10(fit.wv.tau) + shift), y(decades(fit.wv.variance))
        bars = (np.minimum(y(decades(each)), _MIDDLE) for each in (fit.wv.lower, fit.wv.upper))
        recordings.append((labels.index(label), _line(at, shown), *_points(at, shown, *bars)))
    ticks, ratios = _ratios(axis, x, shifts)
    return {
        "title": f"Allan deviation of {axis.name} in {unit} against averaging time in s",
        "unit": unit,
        "times": [
            (float(x(k)), f"{10.0**k:g}")
            for k in range(int(np.ceil(x.low)), int(np.floor(x.high)) + 1)
        ],
        "deviations": [
            (float(y(np.log10(each))), f"{each:g}") for each in round_values(10**y.low, 10**y.high)
        ],
        "curves": [(name, _line(x(np.log10(tau)), y(value))) for name, tau, value in curves],
        "recordings": recordings,
        "ratios": [(row[0], *each) for row, each in zip(recordings, ratios, strict=False)],
        "ticks": ticks,
    }


def _ratios(
    axis: AxisComparison, x: Scale, shifts: FloatArray
) -> tuple[list[tuple[float, str]], list[tuple[str, str]]]:
    """Differences from the common curve in per cent: ticks, and points of each recording."""
    equality = axis.equality
    if equality is None or not equality.tau.size:
        return [], []
    away, error = 100.0 * (equality.ratios - 1.0), 196.0 * equality.errors
    largest = np.max(np.abs(away[equality.errors < _SURE]), initial=0.0) or _LIMITS[-1]
    limit = next((each for each in _LIMITS if each >= 1.2 * largest), _LIMITS[-1])
    y, rows = Scale(-limit, limit, _BOTTOM, _LOW), []
    for value, half, shift in zip(away, error, shifts, strict=False):
        ends = (y(np.clip(value + sign * half, -limit, limit)) for sign in (-1.0, 1.0))
        inside = y(np.where(np.abs(value) <= limit, value, np.nan))
        rows.append(_points(x(np.log10(equality.tau) + shift), inside, *ends))
    ticks = (-0.5 * limit, 0.0, 0.5 * limit)
    return [(float(y(v)), f"{v:+g}" if v else "0") for v in ticks], rows


def _points(x: FloatArray, y: FloatArray, low: FloatArray, high: FloatArray) -> tuple[str, str]:
    """Bars, and dots as lines of no length, as paths of an SVG."""
    low, high = np.clip(low, _TOP, _BOTTOM), np.clip(high, _TOP, _BOTTOM)
    bars = (f"M{a} {b}V{c}" for a, b, c in zip(x, low, high, strict=True) if np.isfinite(b))
    return "".join(bars), "".join(
        f"M{a} {b}h0" for a, b in zip(x, y, strict=True) if np.isfinite(b)
    )


def _line(x: FloatArray, y: FloatArray) -> str:
    known = np.isfinite(y)
    places = zip(x[known], np.minimum(y[known], _MIDDLE), strict=True)
    return " ".join(f"{a},{b}" for a, b in places)


def strip(spreads: Sequence[Spread]) -> dict[str, Any]:
    """A row an axis, a point a unit, on a logarithmic scale."""
    scale = spreads[0].field_unit[1]
    values = np.concatenate([each.values for each in spreads]) * scale
    limits = [each.normal_limit * scale for each in spreads]
    drawn = [each for each in limits if np.isfinite(each) and each < _FARTHEST * values.max()]
    low, high = values.min(), max([values.max(), *drawn])
    margin = max(0.04 * np.log(high / low), 0.02)
    place = Scale(np.log(low) - margin, np.log(high) + margin, 60.0, 388.0)
    rows = []
    for i, (each, limit) in enumerate(zip(spreads, limits, strict=True)):
        apart = [outlier.device for outlier in each.outliers]  # farthest first
        # Rows of points that touch are spread a little, the same way each time.
        offsets = 0.5 * _ROW * ((np.arange(each.n) * 0.618034) % 1.0 - 0.5)
        y = np.round(8.0 + (i + 0.5) * _ROW + offsets, 1)
        points = list(zip(place(np.log(each.values * scale)), y, each.devices, strict=True))
        rows.append(
            {
                "channel": each.channel,
                "y": 8.0 + (i + 0.5) * _ROW,
                "dots": "".join(f"M{x} {y}h0" for x, y, name in points if name not in apart),
                "apart": [
                    (*point, point[2] in apart[:_NAMED]) for point in points if point[2] in apart
                ],
                "median": float(place(np.log(each.median * scale))),
                "limit": float(place(np.log(limit))) if limit in drawn else None,
            }
        )
    ends = float(np.exp(place.low)), float(np.exp(place.high))
    ticks = [(float(place(np.log(v))), brief(v, 3)) for v in round_values(*ends)]
    return {"bottom": 8.0 + _ROW * len(spreads), "rows": rows, "ticks": ticks}
