"""The first screen: sensor numbers, filter numbers, and what to do, as on the terminal."""

from __future__ import annotations

from typing import Any

import numpy as np

from gmwm._core.text import brief
from gmwm.calibration import AxisNumbers, Calibration
from gmwm.datasheet import UNITS, Datasheet
from gmwm.report.health import verdict
from gmwm.report.numbers import SHOWN, Certified
from gmwm.report.page import quantity_text
from gmwm.report.summary import (
    KEYS,
    actions,
    covers,
    curve_lines,
    filter_key,
    filter_values,
    intervals,
    reason,
    state,
    unusable,
    use,
    verdict_line,
)


def first_screen(
    calibration: Calibration, numbers: Certified, sheet: Datasheet | None = None
) -> dict[str, Any]:
    """Content of the first screen, and of the filter numbers axis by axis.

    sheet: Its numbers stand below those of the axes.
    """
    return {
        "state": verdict(calibration)["state"],
        "verdict": verdict_line(calibration),
        "curves": curve_lines(calibration),
        "horizon": f"{SHOWN:g} s",
        "sensors": sensor_tables(calibration, sheet),
        "skipped": calibration.skipped,
        "filter": filter_table(calibration, numbers),
        "actions": actions(calibration),
        "texts": numbers.texts,
        "note": numbers.note,
        "problem": numbers.problem,
        "by_axis": _by_axis(calibration, numbers),
    }


def sensor_tables(calibration: Calibration, sheet: Datasheet | None = None) -> list[dict[str, Any]]:
    """N, B and K with their intervals, a table a sensor; where an axis is not valid, why.

    sheet: Its numbers stand below those of the axes.
    """
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, axis in calibration.numbers.items():
        groups.setdefault((axis.quantity, *(n.usual.unit for n in axis)), []).append(name)
    tables = []
    for (quantity, *_), names in groups.items():
        first = calibration.numbers[names[0]]
        rows = [_row(name, calibration) for name in names]
        stated = {} if sheet is None else sheet.entries
        for name in (each for each in (quantity, *names) if each in stated):
            texts = [
                quantity_text(stated[name][n], unit, calibration[names[0]])
                if n in stated[name]
                else {"field": "", "si": ""}
                for n, unit in UNITS.items()
            ]
            cells = [{key: each.partition(" ")[0] for key, each in one.items()} for one in texts]
            own = {"name": f"data sheet, {name}", "stated": True, "cells": cells}
            rows.append({"mark": "", "why": "", **own})
        heads = [
            (f"{key}, {title}", {"field": number.usual.unit, "si": number.unit})
            for (key, title), number in zip(first.names.items(), first, strict=True)
        ]
        tables.append({"name": quantity or "other", "heads": heads, "rows": rows})
    return tables


def _row(name: str, calibration: Calibration) -> dict[str, Any]:
    axis, fit = calibration.numbers[name], calibration[name]
    cells = [_cell(axis, letter) for letter in axis.names]
    why = "" if fit.valid else reason(name, calibration)
    mark = "*" * (state(fit) == "reserved")
    return {"name": name, "mark": mark, "why": why, "stated": False, "cells": cells}


def _cell(axis: AxisNumbers, letter: str) -> dict[str, str]:
    """A number as the terminal shows it, in both units."""
    time = f" at {brief(axis.tau, 3)}\N{NO-BREAK SPACE}s" if letter == "B" else ""
    texts = {units: axis.text(letter, units=units) for units in ("field", "si")}
    return {
        units: f"{text.replace('+-', '±').replace('<=', '≤')}{time}" if text != "-" else "no limit"
        for units, text in texts.items()
    }


def filter_table(calibration: Calibration, numbers: Certified) -> list[dict[str, Any]]:
    """N, K and start bias of each sensor, SI, with what they cover."""
    rows = []
    for triad in numbers.triads:
        fits = {axis.name: calibration[axis.name] for axis in triad.axes}
        texts = {k: text.replace("<=", "≤") for k, text in filter_values(triad).items()}
        keys = {letter: filter_key(triad.quantity, letter) for letter in KEYS}
        errors = intervals(triad, calibration)
        for key, text in errors.items():  # which does not break in its middle
            error = text.replace("+-", "±").replace(" ", "\N{NO-BREAK SPACE}")
            texts[key] += f" ({error})"
        about = {"covers": covers(triad, calibration.numbers), "warning": unusable(fits)}
        mark = "*" * (use(fits) == "*")
        rows.append({"name": triad.quantity, "mark": mark, **texts, **about, "keys": keys})
    return rows


def _by_axis(calibration: Calibration, numbers: Certified) -> list[dict[str, Any]]:
    """N, K and start bias of each axis in both units, its NEES, and what they cover."""
    rows = []
    for name, axis in numbers.axes.items():
        fit = calibration[name]
        values = {"N": axis.N, "K": axis.K, "start": axis.initial_sd}
        row: dict[str, Any] = {"name": name, "valid": fit.valid}
        for key, value in values.items():
            text = quantity_text(value, UNITS.get(key, "u"), fit)
            limit = "≤ " if key in axis.upper else ""
            row[key] = {units: f"{limit}{each}" for units, each in text.items()}
        nees = axis.nees.get(SHOWN, float("nan"))
        row["nees"] = f"{nees:.2g}" if np.isfinite(nees) else "unknown"
        row["covers"] = axis.covers
        rows.append(row)
    return rows
