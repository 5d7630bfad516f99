"""The page of a comparison: verdicts, sensor numbers, filter numbers and curves."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.files import writable_file
from gmwm._core.pages import page_of
from gmwm._core.text import brief, with_error
from gmwm._core.units import customary_unit
from gmwm.datasheet import Datasheet, read_datasheet
from gmwm.issues import worst_first
from gmwm.population import LETTERS, STATES, AxisComparison, Number, SensorComparison
from gmwm.report.page import origin, write_page
from gmwm.report.pictures import multiple

_SIDE_BY_SIDE = 6  # recordings with columns of their own; of more the range is shown
_ASIDE = ("not-noise", "channel-missing", "channel-skipped")  # the verdicts have them in a word
_REPEATED = ("curves-differ", "curves-close")  # the verdicts repeat them
_MARKS = {"agree": "good", "close": "good", "differ": "care", "untested": "bad"}
_LETTERS = ("N", "K")


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
        "rows": [_row(axis, letter, labels) for letter in LETTERS if axis.fits],
        "numbers": [_numbers(axis, letter, sheet) for letter in _LETTERS],
        "nees": _nees(axis, comparison.horizon),
    }


def _row(axis: AxisComparison, letter: str, labels: tuple[str, ...]) -> dict[str, Any]:
    """N, B or K in every recording."""
    usable = axis.structure.usable
    cells = [_cell(axis, letter, usable[x][letter]) if x in usable else "–" for x in labels]
    text, unit = axis.range_of(letter)
    return {"key": letter, "unit": unit, "cells": cells if len(labels) <= _SIDE_BY_SIDE else [text]}


def _cell(axis: AxisComparison, letter: str, number: Number) -> str:
    scale = customary_unit(LETTERS[letter], axis.quantity, "u")[1]
    if number.value is None:
        return f"≤ {brief(number.upper * scale, 3)}" if np.isfinite(number.upper) else "–"
    return with_error(number.value * scale, number.lower * scale, number.upper * scale)


def _numbers(axis: AxisComparison, letter: str, sheet: Datasheet | None) -> dict[str, str]:
    covering, is_limit = axis.for_filter(letter)
    if not np.isfinite(covering):
        return {"covering": "none", "unit": "", "details": "", "stated": ""}
    text, unit = axis.number_text(letter, covering)
    stated = sheet.of(axis.name, axis.quantity).get(letter) if sheet is not None else None
    return {
        "covering": f"{'≤ ' if is_limit else ''}{text}",
        "unit": unit,
        "details": f"{covering:.3e} SI",
        "stated": f"{brief(covering / stated, 3)} times" if stated else "",
    }


def _nees(axis: AxisComparison, horizon: float) -> str:
    """NEES of the covering numbers in the recordings."""
    known = [x for each in axis.covering.values() if np.isfinite(x := each.nees[horizon])]
    ends = [f"{each:.2g}" for each in known and (min(known), max(known))]
    return " to ".join(dict.fromkeys(ends))
