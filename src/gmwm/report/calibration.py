"""The page of a calibration: its content, in order, from the first screen on."""

import os
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from operator import call
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.files import writable_file, write_text
from gmwm._core.jobs import shared
from gmwm._core.pages import page_of
from gmwm._core.text import brief, per_cent
from gmwm._core.typing import FloatArray
from gmwm.calibration import AxisNumbers, Calibration
from gmwm.datasheet import UNITS, Datasheet, read_datasheet
from gmwm.estimate import Estimate, Fit
from gmwm.estimate.result import confidence_interval
from gmwm.issues import worst_first
from gmwm.process import Model, WhiteNoise
from gmwm.readers import Channel, Recording
from gmwm.report.figure import (
    Spans,
    curve_figure,
    density_figure,
    deviation_figure,
    leftover_figures,
    overview_figure,
    residual_figure,
    series_figure,
)
from gmwm.report.health import ambiguity, health, trust, verdict
from gmwm.report.numbers import SHOWN, Certified, certified, navigation
from gmwm.report.page import duration_text, origin, quantity_text, rendered, resource, units_of
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

_AIM = 0.1  # relative standard error


@page_of(Calibration)
def write_report(
    calibration: Calibration,
    path: str | os.PathLike[str],
    recording: Recording | None = None,
    *,
    datasheet: str | os.PathLike[str] | None = None,
    provenance: Mapping[str, str] | None = None,
) -> Path:
    """Write the report of a calibration as one HTML file that needs no network.

    Parameters
    ----------
    calibration : Calibration
    path : path-like
    recording : Recording, optional
        What was calibrated: its time series and spectra are shown too.
    datasheet : path-like, optional
        YAML of N, B and K by sensor or channel, such as ``gyro: {N: 0.15 deg/sqrt(h)}``: drawn
        over the curves.
    provenance : mapping of str to str, optional
        What else is known of where the numbers come from: commands, hashes of files.

    Raises InputError if the file cannot be written, or the data sheet not be read.
    """
    path = writable_file(path)
    text = page(calibration, recording, datasheet=datasheet, provenance=provenance)
    return write_text(path, text)


def page(
    calibration: Calibration,
    recording: Recording | None = None,
    *,
    datasheet: str | os.PathLike[str] | None = None,
    provenance: Mapping[str, str] | None = None,
) -> str:
    """The report as HTML text; see `write_report`."""
    from plotly.offline import get_plotlyjs

    quantities = {name: fit.wv.quantity or "" for name, fit in calibration.items()}
    sheet = None if datasheet is None else read_datasheet(datasheet, quantities)
    numbers, of_samples = _side_by_side(calibration, recording)
    source = {"recording": calibration.source or "not named"}
    return rendered(
        "template.html",
        scripts=(get_plotlyjs(), resource("report.js")),
        calibration=calibration,
        answer=first_screen(calibration, numbers, sheet),
        overview=[
            (f"{quantity or 'other channels'}", overview_figure(calibration, quantity))
            for quantity in dict.fromkeys(fit.wv.quantity for fit in calibration.values())
        ],
        health=health(calibration),
        channels=[
            _channel(name, calibration, numbers, sheet) | of_samples[name] for name in calibration
        ],
        navigation=navigation(calibration),
        provenance=origin(source | dict(provenance or {}), "report of", sheet),
    )


@page_of(Calibration, "fragment")
def fragment(calibration: Calibration) -> str:
    """The first screen for a notebook: the sensor table, and the filter numbers."""
    return rendered(
        "fragment.html",
        verdict=verdict_line(calibration),
        sensors=sensor_tables(calibration),
        skipped=calibration.skipped,
        filter=filter_table(calibration, certified(calibration)),
        horizon=f"{SHOWN:g} s",
    )


def _side_by_side(
    calibration: Calibration, recording: Recording | None
) -> tuple[Certified, dict[str, dict[str, Any]]]:
    """Filter numbers and figures of the samples, which take longest."""
    believed = partial(certified, calibration)
    samples = {} if recording is None else recording
    drawn = {
        name: partial(_of_samples, fit, samples.get(name), calibration.left_out.get(name, ()))
        for name, fit in calibration.items()
    }
    # The first is sent to another process, and the next done in this one, whose exports ask for
    # some of the numbers again.
    work: list[partial[Any]] = list(drawn.values())
    work.insert(1, believed)
    found = dict(shared(call, work))
    return found[believed], {name: found[each] for name, each in drawn.items()}


def _of_samples(fit: Fit, channel: Channel | None, spans: Spans) -> dict[str, Any]:
    draw = {"density": density_figure, "series": series_figure}
    return {
        name: None if channel is None else make(fit, channel, spans) for name, make in draw.items()
    }


def _channel(
    name: str, calibration: Calibration, numbers: Certified, sheet: Datasheet | None
) -> dict[str, Any]:
    fit, curve = calibration[name], calibration.curves.get(name)
    own = numbers.axes.get(name)
    pair = (own.N, own.K) if own is not None else None
    is_valid, why = trust(name, fit, calibration)
    rivals, sensor = calibration.rivals.get(name, ()), calibration.numbers[name]
    # A small misfit is in the line below the title already.
    shown = [n for n in fit.notices if (n.code, n.severity) != ("misfit", "note")]
    return {
        "name": name,
        "notices": worst_first(shown),
        "model": fit.model.title(),
        "valid": is_valid,
        "why": why,
        "ambiguity": ambiguity(calibration, name),
        "stated": _stated(name, sensor, fit, sheet),
        "rows": _with_lengths(fit),
        "figure": deviation_figure(fit, sensor, filter_numbers=pair, rivals=rivals, sheet=sheet),
        "sliders": _sliders(fit, pair),
        "residuals": residual_figure(fit),
        "curve": [curve_figure(fit, curve, one) for one in curve.mains] if curve else [],
        "leftovers": [] if curve is None else leftover_figures(fit, curve),
        "coefficients": [] if curve is None else curve.estimates,
        "left_out": sum(stop - start for start, stop in calibration.left_out.get(name, ())),
        "fitness": _fitness(fit),
    }


def error_model(fit: Fit) -> list[tuple[str, Estimate]]:
    """The parameters, each with what its term is called.

    White noise is one row with what the sensor's low-pass lets through of it.
    """
    terms, labels = fit.model.terms, fit.model.term_labels()
    noise = [i for i, term in enumerate(terms) if term.is_white or term.is_band_limited]
    total = _noise(fit.model)[0]
    rows, merged = list[tuple[str, Estimate]](), set()
    if total > 0.0 and any(terms[i].is_band_limited for i in noise):
        merged = {item.key for item in fit.model.parameters if item.term in noise}
        error = 0.5 * float(fit.logarithmic_error(_noise)[0]) * total**0.5
        interval = confidence_interval(WhiteNoise.parameters[0], total**0.5, error, 0.95)
        row = Estimate.of(WhiteNoise(), "estimated", total**0.5, error, interval, fit.wv)
        parts = []
        for term in (terms[i] for i in noise if terms[i].is_band_limited):
            shape, share = term.shape_parameters[0], (term.values["N"] or 0.0) ** 2 / total
            size = f"a {shape.name} of {brief(term.values[shape.name] or 0.0, 3)} {shape.unit}"
            parts.append(f"{per_cent(share)} of its power has {size}" if noise[1:] else size)
        meaning = f"white noise: {', '.join(parts)}"
        rows.append(("white noise", replace(row, key="N, bandwidth", meaning=meaning)))
    places = {item.key: item.term for item in fit.model.parameters}
    return rows + [(labels[places[e.key]], e) for e in fit.estimates if e.key not in merged]


def _with_lengths(fit: Fit) -> list[tuple[Estimate, str]]:
    """The error model, each parameter with the length of record that it needs."""
    lengths, duration = fit.needed_length(_AIM), fit.wv.n_all * fit.wv.dt
    rows = [each for _, each in error_model(fit)]
    merged = lengths.keys() - {each.key for each in rows}
    longest = max((lengths[key] for key in merged), default=np.inf)
    return [(e, _needed(longest if "," in e.key else lengths.get(e.key), duration)) for e in rows]


def _noise(model: Model) -> FloatArray:
    """Density of white noise and low-pass noise at low frequencies, u^2/Hz, (1,)."""
    terms = (term for term in model.terms if term.is_white or term.is_band_limited)
    return np.array([sum((term.values["N"] or 0.0) ** 2 for term in terms)])


def _sliders(fit: Fit, numbers: tuple[float, float] | None) -> list[dict[str, str]]:
    """Where the sliders of N and K stand at first, and what the page needs to write their value."""
    if numbers is None:
        return []
    shown = []
    for letter, value, unit in zip("NK", numbers, ("u/sqrt(Hz)", "u/s/sqrt(Hz)"), strict=True):
        field, scale, si = units_of(unit, fit.wv)
        own = {"letter": letter, "value": f"{value:.6e}", "per_si": f"{scale:.9e}"}
        shown.append(own | {"field": field, "si": si})
    return shown


def _stated(name: str, sensor: AxisNumbers, fit: Fit, sheet: Datasheet | None) -> str:
    """The data sheet's numbers beside the sensor numbers."""
    values = sheet.of(name, fit.wv.quantity) if sheet is not None else {}
    parts = []
    for number in sensor:
        if (value := values.get(number.key)) is not None:
            sign, own = ("≤ ", number.upper) if number.kind == "bound" else ("", number.value)
            text = quantity_text(value, UNITS[number.key], fit)["field"]
            parts.append(f"{number.key} {text} (measured: {sign}{brief(own / value, 3)} times)")
    return f"Data sheet: {', '.join(parts)}." if parts else ""


def _fitness(fit: Fit) -> str:
    text = f"objective {fit.objective:.4g} on {fit.dof} degrees of freedom"
    if fit.p_value == fit.p_value:
        text += f", p = {fit.p_value_allowed:.2g}"
    if fit.discrepancy > 0.0:
        text += f" with a model error of {per_cent(fit.discrepancy)} of the variance"
    return "; ".join(part for part in (text, fit.goodness.sentence) if part)


def _needed(seconds: float | None, duration: float) -> str:
    """Length of record that a parameter needs, in words; empty if it was not estimated."""
    if seconds is None:
        return ""
    if seconds <= duration or seconds == float("inf"):
        return "long enough" if seconds <= duration else "not identified"
    text = duration_text(seconds)
    return text if text == "centuries" else f"needs {text}"


def first_screen(
    calibration: Calibration, numbers: Certified, sheet: Datasheet | None = None
) -> dict[str, Any]:
    """Content of the first screen, and of the filter numbers axis by axis."""
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
    """N, B and K with their intervals, a table a sensor; where an axis is not valid, why."""
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
