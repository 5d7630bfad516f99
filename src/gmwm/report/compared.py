"""The page of a comparison: verdicts, curves, parameters, and the numbers for a filter."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.files import writable_file
from gmwm._core.pages import page_of
from gmwm._core.text import brief
from gmwm.estimate import Estimate, Fit
from gmwm.issues import worst_first
from gmwm.population import STATES, AxisComparison, ParameterSpread, SensorComparison
from gmwm.report.datasheet import Datasheet, read_datasheet
from gmwm.report.page import origin, write_page
from gmwm.report.pictures import multiple

_SIDE_BY_SIDE = 6
"""Recordings whose values stand in columns of their own; of more the range is shown."""

_NARROW, _WIDE = 1.02, 1.5
"""Ratios of the ends of an interval: four digits below the one, two above the other."""

_ASIDE = ("not-noise", "channel-missing", "channel-skipped")
"""Codes of notices that the verdicts have in a word."""

_REPEATED = ("curves-differ", "curves-close")
"""Codes of those that the verdicts repeat."""

_MARKS = {"agree": "good", "close": "good", "differ": "care", "untested": "bad"}
_LETTERS = {"N": "u/sqrt(Hz)", "K": "u/s/sqrt(Hz)"}


@page_of(SensorComparison)
def write_sensor_comparison_report(
    comparison: SensorComparison,
    path: str | os.PathLike[str],
    *,
    datasheet: str | os.PathLike[str] | None = None,
    provenance: Mapping[str, str] | None = None,
) -> Path:
    """Write the comparison of recordings or units as one HTML file that needs no network.

    Parameters
    ----------
    comparison : SensorComparison
    path : path-like
    datasheet : path-like, optional
        YAML of N, B and K by sensor or channel, drawn over the curves; see `write_report`.
    provenance : mapping of str to str, optional
        What else is known of where the numbers come from.

    Raises InputError if the file cannot be written, or the data sheet not be read.
    """
    path, sheet = writable_file(path), None
    if datasheet is not None:
        sheet = read_datasheet(datasheet, {name: a.quantity for name, a in comparison.items()})
    sources = {label: each.source for label, each in comparison.calibrations.items()}
    return write_page(
        path,
        "compared.html",
        comparison=comparison,
        state="care" if {"differ", "untested"} & {a.state for a in comparison.values()} else "good",
        axes=[_axis(axis, comparison, sheet) for axis in comparison.values()],
        notices=[n for n in worst_first(list(comparison.notices)) if n.code not in _REPEATED],
        aside=_ASIDE,
        columns=comparison.labels if len(comparison.labels) <= _SIDE_BY_SIDE else ("range",),
        sheet=sheet,
        stated={
            letter: sheet is not None
            and any(letter in sheet.of(name, a.quantity) for name, a in comparison.items())
            for letter in _LETTERS
        },
        provenance=origin(sources | dict(provenance or {}), "comparison of", sheet),
    )


def _axis(
    axis: AxisComparison, comparison: SensorComparison, sheet: Datasheet | None
) -> dict[str, Any]:
    labels = comparison.labels
    others = [
        comparison.calibrations[label][axis.name]
        for label in axis.left_out
        if axis.name in comparison.calibrations[label]
    ]
    return {
        "of": axis,
        "state": _MARKS[axis.state],
        "word": STATES[axis.state],
        "figure": multiple(axis, labels, others, sheet) if axis.fits or others else None,
        "codes": _codes(axis.joint),
        "equality": _p(axis.joint.equality_p, "= ") if axis.joint else "",
        "rows": [_row(p, axis, labels) for p in axis.parameters if p.joint.kind != "fixed"],
        "numbers": [_numbers(axis, letter, sheet) for letter in _LETTERS],
        "nees": _nees(axis),
    }


def _codes(fit: Fit | None) -> str:
    bad = [n.code.replace("-", " ") for n in fit.notices if n.severity == "bad"] if fit else []
    return ", ".join(dict.fromkeys(bad))


def _row(spread: ParameterSpread, axis: AxisComparison, labels: tuple[str, ...]) -> dict[str, Any]:
    by_label = dict(zip(axis.fits, spread.each, strict=True))
    cells = [_cell(by_label.get(label)) for label in labels]
    if len(labels) > _SIDE_BY_SIDE:
        known = [e.usual.value for e in spread.each if e is not None and e.kind == "estimated"]
        text = f"{brief(min(known), 4)} to {brief(max(known), 4)}" if known else "none"
        cells = [{"value": text, "interval": f"{len(known)} of {len(spread.each)}"}]
    return {
        "key": spread.key,
        "unit": spread.joint.usual.unit,
        "joint": _cell(spread.joint),
        "cells": cells,
        "spread": "–" if np.isnan(spread.spread) else _share(spread.spread),
        "p": _p(spread.p_value) or "–",
        "differs": spread.p_value < 0.01,
    }


def _cell(estimate: Estimate | None) -> dict[str, str]:
    """A value and its interval, with the digits that this leaves."""
    if estimate is None:
        return {"value": "–", "interval": ""}
    usual = estimate.usual
    if estimate.kind == "bound":
        return {"value": f"< {brief(usual.upper, 3)}", "interval": ""}
    if estimate.kind != "estimated":
        return {"value": brief(usual.value, 3), "interval": estimate.kind}
    if not (np.isfinite(usual.upper) and usual.lower > 0.0):
        return {"value": brief(usual.value, 3), "interval": "not determined"}
    ratio = usual.upper / usual.lower
    digits = 4 if ratio < _NARROW else 3
    ends = [brief(end, digits if ratio < _WIDE else 2) for end in (usual.lower, usual.upper)]
    return {"value": brief(usual.value, digits), "interval": "–".join(ends)}


def _share(value: float) -> str:
    return f"{100.0 * value:.1f} %" if value < 1.0 else f"{100.0 * value:.0f} %"


def _p(value: float, sign: str = "") -> str:
    return "" if np.isnan(value) else f"{sign}{value:.2g}" if value >= 1e-4 else "< 0.0001"


def _numbers(axis: AxisComparison, letter: str, sheet: Datasheet | None) -> dict[str, str]:
    found = [n for each in axis.numbers.each.values() if (n := getattr(each, letter)) > 0.0]
    ends = [axis.number_text(letter, end)[0] for end in found and (min(found), max(found))]
    row = {"range": " to ".join(dict.fromkeys(ends)) or "none found"}
    covering, ratio = axis.numbers.value(letter), axis.numbers.inflation(letter)
    if not np.isfinite(covering):
        return row | {"covering": "none", "unit": "", "details": "", "stated": ""}
    text, row["unit"] = axis.number_text(letter, covering)
    row["covering"] = f"{'≤ ' if letter in axis.numbers.upper else ''}{text}"
    times = f", {ratio:.2f} x joint" if np.isfinite(ratio) else ""
    stated = sheet.of(axis.name, axis.quantity).get(letter) if sheet is not None else None
    row["stated"] = f"{brief(covering / stated, 3)} times" if stated else ""
    return row | {"details": f"{covering:.3e} SI{times}"}


def _nees(axis: AxisComparison) -> str:
    """Of the covering numbers, in the recordings."""
    known = [value for value in axis.numbers.nees.values() if np.isfinite(value)]
    ends = [f"{each:.2g}" for each in known and (min(known), max(known))]
    return " to ".join(dict.fromkeys(ends))
