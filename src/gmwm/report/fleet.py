"""The report of a fleet: its data sheet, which units stand apart, and which miss limits."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.files import writable_file
from gmwm._core.pages import page_of
from gmwm._core.text import brief, per_cent
from gmwm.population import (
    CONFIDENCE,
    CONTENT,
    LETTERS,
    PASS,
    Fleet,
    Spread,
    in_words,
    needed_units,
    outlier_distance,
)
from gmwm.report.page import duration_text, origin, write_page
from gmwm.report.pictures import strip

_TITLES = {"N": "N, random walk", "B": "B, bias instability", "K": "K, rate random walk"}
_MARKS = {"pass": "good", "FAIL": "bad", "?": "care", "none": "bad"}
_MOSTLY = 0.5  # of the variance between units, which longer recordings would make less
_WIDE = 0.05  # spread from which that is worth it
_MOST_ROWS = 300  # of a table on the page: 3,000 units would take a browser 20 s


@page_of(Fleet)
def write_fleet_report(fleet: Fleet, path: str | os.PathLike[str]) -> Path:
    """Write the report of a fleet as one HTML file that needs no network.

    Raises InputError if the file cannot be written.
    """
    path = writable_file(path)
    # Without those that say nothing, or that the page has elsewhere.
    given = {key: each for key, each in fleet.options.items() if key != "version"}
    options = {key: _in_words(each) for key, each in given.items() if each or each is False}
    return write_page(
        path,
        "fleet.html",
        fleet=fleet,
        notices=[notice for notice in fleet.notices if notice not in fleet.failed.values()],
        about=_about(fleet),
        verdict=_verdict(fleet),
        content=f"{100.0 * CONTENT:g} %",
        confidence=f"{100.0 * CONFIDENCE:g} %",
        needed=needed_units(),
        groups=_groups(fleet),
        outliers=sorted(
            ((each, spread) for spread in fleet.spreads for each in spread.outliers),
            key=lambda pair: pair[0].device,
        ),
        farthest=outlier_distance,
        limits=_limits(fleet),
        troubled=_troubled(fleet)[:_MOST_ROWS],
        provenance=origin(options, "report of", None),
    )


def _about(fleet: Fleet) -> str:
    done = fleet.done.values()
    lengths = sorted(each.duration for each in done)
    ends = dict.fromkeys(map(duration_text, (lengths[0], lengths[-1])))
    rates = sorted({f"{each.rate:g}" for each in done}, key=float)
    return f"{' to '.join(ends)} of each at {' and '.join(rates)} Hz"


def _verdict(fleet: Fleet) -> dict[str, str]:
    valid = sum(each.valid for each in fleet.done.values())
    apart = len(fleet.findings)
    text = f"{valid} of {len(fleet)} units have a valid model of every axis"
    if fleet.failed:
        text += f"; {len(fleet.failed)} could not be calibrated"
    if apart:
        text += f"; {apart} stand{'' if apart > 1 else 's'} apart"
    if fleet.limits:
        text += "; " + ("no limit is missed" if fleet.meets_limits else "limits are missed")
    state, word = "good", "Uniform"
    if not fleet.valid:
        state, word = "bad", "No valid model"
    elif valid < len(fleet) or apart or not fleet.meets_limits:
        state, word = "care", "With exceptions"
    return {"state": state, "word": word, "text": text}


def _groups(fleet: Fleet) -> list[dict[str, Any]]:
    """The data sheet, by sensor and number."""
    groups = []
    for quantity in dict.fromkeys(each.quantity for each in fleet.spreads):
        numbers: list[dict[str, Any]] = []
        for letter in LETTERS:
            own = [e for e in fleet.spreads if (e.quantity, e.parameter) == (quantity, letter)]
            if own:
                head = {"title": _TITLES[letter], "unit": own[0].field_unit[0]}
                rows = [_row(each) for each in own]
                numbers.append({**head, "picture": strip(own), "rows": rows})
        is_free = any(row["free"] for number in numbers for row in number["rows"])
        title = quantity or "other channels"
        groups.append({"quantity": title, "numbers": numbers, "is_free": is_free})
    return groups


def _row(spread: Spread) -> dict[str, Any]:
    scale = spread.field_unit[1]

    def text(value: float) -> str:
        return brief(value * scale, 3) if np.isfinite(value) else "-"

    bounds, share = int(np.count_nonzero(~spread.found)), spread.of_estimation
    is_uncertain = share > _MOSTLY and spread.sd > _WIDE
    remarks = [f"{bounds} of them upper limits"] if bounds else []
    if is_uncertain:
        remarks.append(f"{100.0 * min(share, 1.0):.0f} % is estimation error: record longer")
    return {
        "channel": spread.channel,
        "n": spread.n,
        "median": f"{'≤ ' if spread.is_limit else ''}{text(spread.median)}",
        "range": f"{text(spread.values.min())} to {text(spread.values.max())}",
        "spread": per_cent(spread.sd) if np.isfinite(spread.sd) and not spread.is_limit else "-",
        "limit": text(spread.normal_limit),
        "free": "" if spread.free_limit is None else text(spread.free_limit),
        "remark": "; ".join(remarks),
    }


def _limits(fleet: Fleet) -> dict[str, Any]:
    """The grid of verdicts, those that pass last, and how many units of a large lot have none."""
    axes = list(dict.fromkeys(axis for row in fleet.grid.values() for axis in row))
    rows = []
    for name, row in fleet.grid.items():
        words = [in_words(row[axis]) if axis in row else "" for axis in axes]
        rows.append((name, [(word, _MARKS.get(word.partition(" ")[0], "")) for word in words]))
    if (more := max(len(rows) - _MOST_ROWS, 0)) > 0:
        rows.sort(key=lambda row: {word for word, _ in row[1]} <= {PASS, ""})
    return {"axes": axes, "rows": rows[:_MOST_ROWS], "more": more}


def _troubled(fleet: Fleet) -> list[tuple[list[str], str, str]]:
    """Units without a calibration, and axes without a valid model, by reason."""
    names = {path: unit.name for path, unit in fleet.units.items()}
    axes: dict[tuple[str, str], list[str]] = {}
    for path, why in fleet.failed.items():
        axes[names[path], why.text] = ["all"]
    for path, calibration in fleet.done.items():
        found = {channel: why.text for channel, why in calibration.skipped.items()}
        for channel, fit in calibration.items():
            texts = [str(notice) for notice in fit.notices if notice.severity == "bad"]
            found |= {channel: "; ".join(texts)} if texts else {}
        for channel, text in found.items():
            axes.setdefault((names[path], text), []).append(channel)
    units: dict[tuple[str, str], list[str]] = {}
    for (name, text), channels in axes.items():
        units.setdefault((", ".join(channels), text), []).append(name)
    return [(own, *key) for key, own in units.items()]


def _in_words(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_in_words(each)}" for key, each in value.items())
    return ", ".join(map(_in_words, value)) if isinstance(value, list | tuple) else str(value)
