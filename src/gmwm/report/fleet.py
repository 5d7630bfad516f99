"""The report of a fleet: what its units have in common, and which of them stand apart."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.files import writable_file
from gmwm._core.pages import page_of
from gmwm._core.text import brief, per_cent
from gmwm.population import (
    CONFIDENCE,
    CONTENT,
    DERIVED,
    OUTLIER_LEVEL,
    Fleet,
    Spread,
    content_of_largest,
    needed_units,
    outlier_distance,
)
from gmwm.report.page import origin, write_page
from gmwm.report.text import duration_text

_TITLES = {
    "filter_N": "filter N",
    "filter_K": "filter K",
    "floor_B": "bias instability B",
}
_MOSTLY = 0.5  # of the variance between units, which longer recordings would make less
_MOST_NAMED = 12  # units in a line of text

_WIDTH, _LEFT, _RIGHT, _ROW, _TOP = 400.0, 60.0, 12.0, 34.0, 8.0  # of a picture, pixels
_STEPS = (1.0, 2.0, 5.0)
_FARTHEST = 3.0  # a limit beyond so many times the largest value is not drawn


@page_of(Fleet)
def write_fleet_report(fleet: Fleet, path: str | os.PathLike[str]) -> Path:
    """Write the report of a fleet as one HTML file that needs no network.

    Raises InputError if the file cannot be written.
    """
    path = writable_file(path)
    return write_page(
        path,
        "fleet.html",
        fleet=fleet,
        notices=[notice for notice in fleet.notices if notice not in fleet.failed.values()],
        about=_about(fleet),
        verdict=_verdict(fleet),
        horizon=f"{fleet.horizon:g}",
        content=f"{100.0 * CONTENT:g} %",
        confidence=f"{100.0 * CONFIDENCE:g} %",
        level=f"{100.0 * OUTLIER_LEVEL:g} %",
        needed=needed_units(),
        largest=_largest(fleet),
        groups=_groups(fleet),
        parameters=[_row(each) for each in fleet.spreads if each.parameter not in DERIVED],
        outliers=_outliers(fleet.spreads),
        structures=[
            {
                "channel": each.channel,
                "counts": list(each.counts.items()),
                "different": each.different,
                "invalid": _named(each.invalid),
                "missing": _named(each.missing),
            }
            for each in fleet.structures
        ],
        troubled=_troubled(fleet),
        provenance=origin(_options(fleet), "report of", None),
    )


@page_of(Fleet, "fragment")
def fleet_fragment(fleet: Fleet) -> str:
    """The fleet for a notebook."""
    return f"<pre>{escape(str(fleet))}</pre>"


def _about(fleet: Fleet) -> str:
    done = fleet.done.values()
    lengths = sorted(each.duration for each in done)
    rates = sorted({f"{each.rate:g}" for each in done}, key=float)
    length = duration_text(lengths[0])
    if duration_text(lengths[-1]) != length:
        length += f" to {duration_text(lengths[-1])}"
    return f"{length} of each at {' and '.join(rates)} Hz"


def _verdict(fleet: Fleet) -> dict[str, str]:
    sound = [path for path, each in fleet.done.items() if each.valid]
    parts = [f"{len(sound)} of {len(fleet)} units have a valid model of every axis"]
    if fleet.failed:
        parts.append(f"{len(fleet.failed)} could not be calibrated")
    apart = {outlier.device for each in fleet.spreads for outlier in each.outliers}
    if apart:
        parts.append(f"{len(apart)} {'outliers' if len(apart) > 1 else 'outlier'}")
    if not fleet.valid:
        return {"state": "bad", "word": "No valid model", "text": "; ".join(parts)}
    is_good = len(sound) == len(fleet) and not apart
    word = "Uniform" if is_good else "With exceptions"
    return {"state": "good" if is_good else "care", "word": word, "text": "; ".join(parts)}


def _largest(fleet: Fleet) -> str:
    """What the largest value promises, of so few units."""
    n = len(fleet.done)
    if n >= needed_units():
        return ""
    return (
        f"A distribution-free limit needs {needed_units()} units. The largest of {n} values is "
        f"such a limit for {100.0 * content_of_largest(n):.3g} % of all units with "
        f"{100.0 * CONFIDENCE:g} % confidence."
    )


def _groups(fleet: Fleet) -> list[dict[str, Any]]:
    """What a data sheet could promise, by sensor and number."""
    groups = []
    derived = [each for each in fleet.spreads if each.parameter in DERIVED]
    for quantity in dict.fromkeys(each.quantity for each in derived):
        numbers: list[dict[str, Any]] = []
        for parameter in DERIVED:
            own = [e for e in derived if (e.quantity, e.parameter) == (quantity, parameter)]
            if own:
                head = {"title": _TITLES[parameter], "unit": own[0].field_unit[0]}
                rows = [_row(each) for each in own]
                numbers.append({**head, "picture": _picture(own), "rows": rows})
        is_free = any(row["free"] for number in numbers for row in number["rows"])
        title = quantity or "other channels"
        groups.append({"quantity": title, "numbers": numbers, "is_free": is_free})
    return groups


def _row(spread: Spread) -> dict[str, Any]:
    unit, scale = spread.field_unit

    def text(value: float) -> str:
        return brief(value * scale, 3) if np.isfinite(value) else "-"

    bounds = int(np.count_nonzero(~spread.found))
    free, both = spread.free_limit, spread.free_limits
    remarks = []
    if bounds:
        remarks.append(f"{bounds} of them upper limits")
    if spread.without:
        remarks.append(f"{spread.without} units without")
    if not spread.is_normal:
        remarks.append(f"not normal, p = {spread.normality:.1g}")
    text_of_sd = per_cent(spread.sd) if spread.is_logarithmic else text(spread.sd)
    share = spread.of_estimation
    if share > _MOSTLY:
        remarks.append(f"{100.0 * min(share, 1.0):.0f} % is estimation error: record longer")
    return {
        "channel": spread.channel,
        "parameter": f"{spread.parameter} of {spread.of}" if spread.of > 1 else spread.parameter,
        "unit": unit,
        "n": spread.n,
        "median": text(spread.median),
        "range": f"{text(spread.values.min())} to {text(spread.values.max())}",
        "spread": "-" if not np.isfinite(spread.sd) else text_of_sd,
        "estimation": f"{100.0 * min(share, 1.0):.0f} %" if np.isfinite(share) else "",
        "limit": text(spread.normal_limit),
        "limits": " to ".join(map(text, spread.normal_limits)) if spread.n > 1 else "-",
        "free": "" if free is None else text(free),
        "free_both": "" if both is None else " to ".join(map(text, both)),
        "doubtful": not spread.is_normal,
        "remark": "; ".join(remarks),
    }


def _outliers(spreads: Sequence[Spread]) -> list[dict[str, str]]:
    rows = []
    for spread in spreads:
        unit, scale = spread.field_unit
        for each in spread.outliers:
            rows.append(
                {
                    "device": each.device,
                    "channel": spread.channel,
                    "parameter": spread.parameter,
                    "value": f"{brief(each.value * scale, 3)} {unit}",
                    "times": brief(each.value / spread.median, 3) if spread.median else "",
                    "distance": f"{each.distance:+.3g}",
                    "needed": f"{outlier_distance(spread.n):.3g}",
                }
            )
    return sorted(rows, key=lambda row: row["device"])


def _troubled(fleet: Fleet) -> list[dict[str, str]]:
    """Units without a calibration, and axes without a valid model, with the reasons."""
    rows = [
        {"device": unit.name, "where": "", "text": fleet.failed[path].text}
        for path, unit in fleet.units.items()
        if path in fleet.failed
    ]
    for path, calibration in fleet.done.items():
        name = fleet.units[path].name
        for channel, fit in calibration.items():
            texts = [str(notice) for notice in fit.notices if notice.severity == "bad"]
            if texts:
                rows.append({"device": name, "where": channel, "text": "; ".join(texts)})
        for channel, why in calibration.skipped.items():
            rows.append({"device": name, "where": channel, "text": why.text})
    return rows


def _named(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMED
    return ", ".join(names[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def _options(fleet: Fleet) -> dict[str, str]:
    """Those that say something, without those that the page has elsewhere."""
    shown = fleet.options.items()
    return {
        key: _in_words(each)
        for key, each in shown
        if key not in ("horizon", "version") and (each or each is False)
    }


def _in_words(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_in_words(each)}" for key, each in value.items())
    return ", ".join(map(_in_words, value)) if isinstance(value, list | tuple) else str(value)


# -- pictures -------------------------------------------------------------------------------------


def _picture(spreads: Sequence[Spread]) -> dict[str, Any]:
    """Places of what is drawn: a row an axis, a point a unit, on a logarithmic scale."""
    _, scale = spreads[0].field_unit
    values = np.concatenate([each.values for each in spreads]) * scale
    limits = [each.normal_limit * scale for each in spreads]
    drawn = [x for x in limits if np.isfinite(x) and x < _FARTHEST * values.max()]
    low, high = values.min(), max([values.max(), *drawn])
    margin = max(0.04 * np.log(high / low), 0.02)
    low, high = low * np.exp(-margin), high * np.exp(margin)

    def place(value: float) -> float:
        part = np.log(value / low) / np.log(high / low)
        return round(float(_LEFT + part * (_WIDTH - _LEFT - _RIGHT)), 1)

    rows = []
    for i, each in enumerate(spreads):
        middle = _TOP + (i + 0.5) * _ROW
        apart = {outlier.device for outlier in each.outliers}
        # Rows of points that touch are spread a little, the same way each time.
        offsets = 0.5 * _ROW * ((np.arange(each.n) * 0.618034) % 1.0 - 0.5)
        points = list(zip(each.devices, each.values * scale, middle + offsets, strict=True))
        limit = limits[i]
        rows.append(
            {
                "channel": each.channel,
                "y": middle,
                "dots": "".join(
                    f"M{place(x)} {y:.1f}h0" for name, x, y in points if name not in apart
                ),
                "apart": [(place(x), round(y, 1), name) for name, x, y in points if name in apart],
                "median": place(each.median * scale),
                "limit": place(limit) if limit in drawn else None,
            }
        )
    height = _TOP + _ROW * len(spreads)
    return {
        "width": _WIDTH,
        "height": height + 22.0,
        "left": _LEFT,
        "top": _TOP,
        "bottom": height,
        "half": 0.36 * _ROW,
        "rows": rows,
        "ticks": [(place(value), brief(value, 3)) for value in _ticks(low, high)],
    }


def _ticks(low: float, high: float) -> list[float]:
    """Round values between two others, a few of them."""
    if high > 10.0 * low:
        decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1.0)
        steps = (1.0,) if high > 1000.0 * low else _STEPS
        ticks = [float(d * s) for d in decades for s in steps if low <= d * s <= high]
        return ticks[:: -(-len(ticks) // 6)]
    rough = (high - low) / 4.0
    unit = 10.0 ** np.floor(np.log10(rough))
    step = unit * next(s for s in (*_STEPS, 10.0) if s * unit >= rough)
    return [float(x) for x in np.arange(np.ceil(low / step), np.floor(high / step) + 1.0) * step]
