"""The page of a calibration: its content, in order."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import partial
from operator import call
from pathlib import Path
from typing import Any

from gmwm._core.files import writable_file, written
from gmwm._core.jobs import shared
from gmwm._core.pages import page_of
from gmwm._core.text import brief, per_cent
from gmwm.calibration import Calibration, axis_numbers
from gmwm.estimate import Fit
from gmwm.issues import worst_first
from gmwm.readers import Channel, Recording
from gmwm.report.answer import (
    answer,
    bias_instability,
    filter_sentence,
    quantity_text,
    slow_terms,
    trust,
    verdict,
)
from gmwm.report.budget import navigation
from gmwm.report.datasheet import Datasheet, read_datasheet
from gmwm.report.figure import (
    Spans,
    density_figure,
    deviation_figure,
    overview_figure,
    residual_figure,
    series_figure,
)
from gmwm.report.health import ambiguity, health, length_sentence, parameters_sentence
from gmwm.report.numbers import SHOWN, Certified, certified
from gmwm.report.page import duration_text, origin, rendered, resource, units_of

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
    with written(path) as stream:
        stream.write(text)
    return path


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
        length=duration_text(calibration.duration),
        answer=answer(calibration, numbers),
        overview=[
            (f"{quantity or 'other channels'}", overview_figure(calibration, quantity))
            for quantity in dict.fromkeys(fit.wv.quantity for fit in calibration.values())
        ],
        health=health(calibration),
        channels=[
            _channel(name, calibration, numbers[SHOWN], sheet) | of_samples[name]
            for name in calibration
        ],
        navigation=navigation(calibration),
        provenance=origin(source | dict(provenance or {}), "report of", sheet),
    )


@page_of(Calibration, "fragment")
def fragment(calibration: Calibration) -> str:
    """The answer for a notebook: health, a filter's numbers, length, and the axes as a table."""
    found = verdict(calibration)
    believed = filter_sentence(calibration)
    rows = []
    for name, fit in calibration.items():
        is_valid, why = trust(name, fit, calibration)
        rows.append(
            [
                name,
                fit.model.title(),
                calibration.numbers[name].text("N"),
                bias_instability(fit)["field"],
                "; ".join(term["field"] for term in slow_terms(fit)) or "none found",
                f"{'valid' if is_valid else 'not valid'}: {why}",
            ]
        )
    title = (
        f"{calibration.source or 'a recording'}: {duration_text(calibration.duration)} at "
        f"{calibration.rate:g} Hz. {found['word']}: {found['text']}."
    )
    lengths = [length_sentence(calibration, SHOWN), parameters_sentence(calibration)]
    lines = [title, believed, "Length: " + ". ".join(filter(None, lengths)) + "."]
    return rendered("fragment.html", lines=list(filter(None, lines)), rows=rows)


def _side_by_side(
    calibration: Calibration, recording: Recording | None
) -> tuple[dict[float, Certified], dict[str, dict[str, Any]]]:
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
    fit = calibration[name]
    lengths, duration = fit.needed_length(_AIM), fit.wv.n_all * fit.wv.dt
    own = numbers.axes.get(name)
    believed = (own.N, own.K) if own is not None else None
    is_valid, why = trust(name, fit, calibration)
    rivals = calibration.rivals.get(name, ())
    # A small misfit is in the line below the title already.
    shown = [n for n in fit.notices if (n.code, n.severity) != ("misfit", "note")]
    return {
        "name": name,
        "notices": worst_first(shown),
        "model": fit.model.title(),
        "valid": is_valid,
        "why": why,
        "noise": "" if own is None else _noise(fit, own.N),
        "ambiguity": ambiguity(calibration, name),
        "stated": _stated(name, fit, sheet),
        "rows": [(e, _needed(lengths.get(e.key), duration)) for e in fit.estimates],
        "figure": deviation_figure(fit, filter_numbers=believed, rivals=rivals, sheet=sheet),
        "sliders": _sliders(fit, believed),
        "residuals": residual_figure(fit),
        "left_out": sum(stop - start for start, stop in calibration.left_out.get(name, ())),
        "fitness": _fitness(fit),
    }


def _noise(fit: Fit, number: float) -> str:
    """Which of the values of white noise is which, where they differ."""
    density = axis_numbers(fit).N.value
    if not abs(number - density) > 0.01 * density > 0.0:
        return ""
    text = quantity_text(number, "u/sqrt(Hz)", fit)["field"]
    return (
        f"Filter N for {SHOWN:g} s is {text}: it covers slower terms too. N in the table below "
        "belongs to one term."
    )


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


def _stated(name: str, fit: Fit, sheet: Datasheet | None) -> str:
    """The data sheet's numbers beside what was measured."""
    values = sheet.of(name, fit.wv.quantity) if sheet is not None else {}
    if not values:
        return ""
    units = {"N": "u/sqrt(Hz)", "B": "u", "K": "u/s/sqrt(Hz)"}
    measured = {number.key: number.value for number in axis_numbers(fit)}
    parts = []
    for key, value in values.items():
        text = f"{key} {quantity_text(value, units[key], fit)['field']}"
        if measured[key] > 0.0:
            text += f" (measured: {brief(measured[key] / value, 3)} times)"
        parts.append(text)
    return f"Data sheet: {', '.join(parts)}."


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
    if seconds <= duration:
        return "long enough"
    if seconds == float("inf"):
        return "not identified"
    text = duration_text(seconds)
    return text if text == "centuries" else f"needs {text}"
