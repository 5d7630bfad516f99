"""The report of a fleet: what its units have in common, and which of them stand apart."""

from __future__ import annotations

import os
from collections.abc import Mapping
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
from gmwm.report.page import duration_text, origin, write_page
from gmwm.report.pictures import strip

_TITLES = {"filter_N": "filter N", "filter_K": "filter K", "floor_B": "bias instability B"}
_MOSTLY = 0.5  # of the variance between units, which longer recordings would make less


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
        outliers=sorted(
            ((each, spread) for spread in fleet.spreads for each in spread.outliers),
            key=lambda pair: pair[0].device,
        ),
        farthest=outlier_distance,
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
    ends = dict.fromkeys(map(duration_text, (lengths[0], lengths[-1])))
    rates = sorted({f"{each.rate:g}" for each in done}, key=float)
    return f"{' to '.join(ends)} of each at {' and '.join(rates)} Hz"


def _verdict(fleet: Fleet) -> dict[str, str]:
    valid = sum(each.valid for each in fleet.done.values())
    apart = len({outlier.device for each in fleet.spreads for outlier in each.outliers})
    text = f"{valid} of {len(fleet)} units have a valid model of every axis"
    if fleet.failed:
        text += f"; {len(fleet.failed)} could not be calibrated"
    if apart:
        text += f"; {apart} outlier{'s' if apart > 1 else ''}"
    state, word = "good", "Uniform"
    if not fleet.valid:
        state, word = "bad", "No valid model"
    elif valid < len(fleet) or apart:
        state, word = "care", "With exceptions"
    return {"state": state, "word": word, "text": text}


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
                numbers.append({**head, "picture": strip(own), "rows": rows})
        is_free = any(row["free"] for number in numbers for row in number["rows"])
        title = quantity or "other channels"
        groups.append({"quantity": title, "numbers": numbers, "is_free": is_free})
    return groups


def _row(spread: Spread) -> dict[str, Any]:
    unit, scale = spread.field_unit

    def text(value: float) -> str:
        return brief(value * scale, 3) if np.isfinite(value) else "-"

    bounds = int(np.count_nonzero(~spread.found))
    share, free, both = spread.of_estimation, spread.free_limit, spread.free_limits
    estimation = f"{100.0 * min(share, 1.0):.0f} %" if np.isfinite(share) else ""
    text_of_sd = per_cent(spread.sd) if spread.is_logarithmic else text(spread.sd)
    remarks = [
        remark
        for is_said, remark in (
            (bounds, f"{bounds} of them upper limits"),
            (spread.without, f"{spread.without} units without"),
            (not spread.is_normal, f"not normal, p = {spread.normality:.1g}"),
            (share > _MOSTLY, f"{estimation} is estimation error: record longer"),
        )
        if is_said
    ]
    return {
        "channel": spread.channel,
        "parameter": f"{spread.parameter} of {spread.of}" if spread.of > 1 else spread.parameter,
        "unit": unit,
        "n": spread.n,
        "median": text(spread.median),
        "range": f"{text(spread.values.min())} to {text(spread.values.max())}",
        "spread": text_of_sd if np.isfinite(spread.sd) else "-",
        "estimation": estimation,
        "limit": text(spread.normal_limit),
        "limits": " to ".join(map(text, spread.normal_limits)) if spread.n > 1 else "-",
        "free": "" if free is None else text(free),
        "free_both": "" if both is None else " to ".join(map(text, both)),
        "doubtful": not spread.is_normal,
        "remark": "; ".join(remarks),
    }


def _troubled(fleet: Fleet) -> list[tuple[str, str, str]]:
    """Units without a calibration, and axes without a valid model, with the reasons."""
    names = {path: unit.name for path, unit in fleet.units.items()}
    rows = [(names[path], "all", why.text) for path, why in fleet.failed.items()]
    for path, calibration in fleet.done.items():
        for channel, fit in calibration.items():
            texts = [str(notice) for notice in fit.notices if notice.severity == "bad"]
            rows += [(names[path], channel, "; ".join(texts))] if texts else []
        rows += [(names[path], name, why.text) for name, why in calibration.skipped.items()]
    return rows


def _options(fleet: Fleet) -> dict[str, str]:
    """Those that say something, without those that the page has elsewhere."""
    shown = {k: each for k, each in fleet.options.items() if k not in ("horizon", "version")}
    return {key: _in_words(each) for key, each in shown.items() if each or each is False}


def _in_words(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_in_words(each)}" for key, each in value.items())
    return ", ".join(map(_in_words, value)) if isinstance(value, list | tuple) else str(value)
