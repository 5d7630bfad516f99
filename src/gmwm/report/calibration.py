"""The page: what is shown, and in which words."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import gmwm
from gmwm._core.files import written
from gmwm._core.units import field_units
from gmwm.calibration import Calibration, floor, sentence, white_density
from gmwm.estimate import Estimate, Fit
from gmwm.report.budget import navigation
from gmwm.report.figure import deviation_figure, residual_figure
from gmwm.report.health import ambiguity, health
from gmwm.report.page import DRAW, rendered

_DAY, _YEAR = 86400.0, 365.25 * 86400.0
_DAYS, _YEARS = 5.0, 2.0  # from which on durations are given so
_AIM = 0.1  # relative standard error
_MANY_YEARS = 100.0


def write_report(calibration: Calibration, path: str | os.PathLike[str]) -> Path:
    """Write the report of a calibration as one HTML file that needs no network.

    Parameters
    ----------
    calibration : Calibration
    path : path-like

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    text = page(calibration)
    with written(path) as stream:
        stream.write(text)
    return Path(path)


def page(calibration: Calibration) -> str:
    """The report as HTML text."""
    from plotly.offline import get_plotlyjs

    return rendered(
        "template.html",
        scripts=(get_plotlyjs(), DRAW),
        calibration=calibration,
        version=gmwm.__version__,
        length=duration_text(calibration.duration),
        health=health(calibration),
        channels=[_channel(name, fit, calibration) for name, fit in calibration.fits.items()],
        navigation=navigation(calibration),
    )


def duration_text(seconds: float) -> str:
    """A duration as people say it: ``40 s``, ``35 min``, ``2 h 46 min``, ``12 days``."""
    if seconds >= _YEARS * _YEAR:
        return f"{seconds / _YEAR:.2g} years"
    if seconds >= _DAYS * _DAY:
        return f"{seconds / _DAY:.3g} days"
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    minutes = round(seconds / 60.0)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


def number(value: float) -> str:
    """Four significant digits, without an exponent where a person would write none."""
    text = f"{value:.4g}"
    return text if "e" not in text else f"{value:.3e}"


def _in_field_unit(value: float, parameter_unit: str, fit: Fit) -> str:
    units = field_units(parameter_unit, fit.wv.quantity)
    if not units:
        return f"{number(value)} {fit.wv.unit}"
    return f"{number(value * units[0].per_si)} {units[0].unit}"


def _channel(name: str, fit: Fit, calibration: Calibration) -> dict[str, Any]:
    low = floor(fit)
    lengths, duration = fit.needed_length(_AIM), fit.wv.n_all * fit.wv.dt
    return {
        "name": name,
        "fit": fit,
        "model": fit.model.title(),
        "density": _in_field_unit(white_density(fit), "u/sqrt(Hz)", fit),
        "floor": _in_field_unit(low.deviation, "u", fit),
        "floor_tau": number(low.tau),
        "sentence": sentence(fit),
        "ambiguity": ambiguity(calibration, name),
        "rows": [_row(each, lengths.get(each.key), duration) for each in fit.estimates],
        "figure": deviation_figure(fit),
        "residuals": residual_figure(fit),
        "fitness": _fitness(fit),
    }


def _fitness(fit: Fit) -> str:
    text = f"objective {fit.objective:.4g} on {fit.dof} degrees of freedom"
    if fit.p_value == fit.p_value:
        text += f", p = {fit.p_value:.2g}"
        if fit.discrepancy > 0.0:
            text += f" ({fit.p_value_allowed:.2g} with the discrepancy)"
    if fit.discrepancy > 0.0:
        text += f", with a discrepancy of {100.0 * fit.discrepancy:.2g} % of the variance"
    return "; ".join(part for part in (text, fit.goodness.sentence) if part)


def needed(seconds: float | None, duration: float) -> str:
    """Length of record that a parameter needs, in words; empty if it was not estimated."""
    if seconds is None:
        return ""
    if seconds <= duration:
        return "long enough"
    if seconds == float("inf"):
        return "not identified"
    if seconds > _MANY_YEARS * _YEAR:
        return "centuries"
    return f"needs {duration_text(seconds)}"


def _row(estimate: Estimate, length: float | None, duration: float) -> dict[str, Any]:
    """A parameter for the table: SI, then each of the field's units."""

    def cell(value: float, low: float, high: float, unit: str) -> dict[str, str]:
        if estimate.kind == "bound":
            return {"value": f"< {number(high)}", "interval": "upper bound, 95 %", "unit": unit}
        if estimate.kind == "estimated":
            interval = f"{number(low)} to {number(high)}"
            return {"value": number(value), "interval": interval, "unit": unit}
        return {"value": number(value), "interval": estimate.kind, "unit": unit}

    si = (estimate.value, estimate.lower, estimate.upper, estimate.unit)
    cells = [cell(*si), *(cell(f.value, f.lower, f.upper, f.unit) for f in estimate.field)]
    error = ""
    if estimate.kind == "estimated" and estimate.value and estimate.stderr is not None:
        error = f"{100.0 * estimate.stderr / abs(estimate.value):.2g} %"
    return {
        "key": estimate.key,
        "meaning": estimate.meaning,
        "cells": cells,
        "error": error,
        "needed": needed(length, duration),
    }
