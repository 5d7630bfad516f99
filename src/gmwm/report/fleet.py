"""Pages of several units: a fleet with its data sheet and limits, and a comparison of few."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.files import writable_file
from gmwm._core.pages import page_of
from gmwm._core.text import brief, per_cent, with_error
from gmwm._core.units import customary_unit, shown_unit
from gmwm.datasheet import Datasheet, read_datasheet
from gmwm.estimate import Fit
from gmwm.issues import worst_first
from gmwm.plotting import COMPONENT_COLOURS, DATA_COLOUR, SUM_COLOUR, literal
from gmwm.population import (
    CONFIDENCE,
    CONTENT,
    LETTERS,
    PASS,
    STATES,
    AxisComparison,
    Fleet,
    Number,
    SensorComparison,
    Spread,
    in_words,
    needed_units,
    outlier_distance,
)
from gmwm.report.page import duration_text, origin, svg, write_page

_TITLES = {"N": "N, random walk", "B": "B, bias instability", "K": "K, rate random walk"}
_MARKS = {"pass": "good", "FAIL": "bad", "?": "care", "none": "bad"}
_MOSTLY = 0.5  # of the variance between units, which longer recordings would make less
_WIDE = 0.05  # spread from which that is worth it
_SIZE = (4.4, 3.6)  # in, of a picture; several stand side by side
_APART = "#b3261e"
_FARTHEST = 3.0  # a limit beyond so many times the largest value is not drawn
_NAMED = 3  # points of a row that stand apart and have their names beside them
_MOST_ROWS = 300  # of a table on the page: 3,000 units would take a browser 20 s


@page_of(Fleet)
def write_fleet_report(fleet: Fleet, path: str | os.PathLike[str]) -> Path:
    """Write the report of a fleet as one HTML file that needs no network."""
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
                numbers.append({**head, "picture": _strip(own), "rows": rows})
        is_free = any(row["free"] for number in numbers for row in number["rows"])
        title = quantity or "other channels"
        groups.append({"quantity": title, "numbers": numbers, "is_free": is_free})
    return groups


def _strip(spreads: Sequence[Spread]) -> str:
    """A row an axis, a point a unit; those that stand apart farthest have their names."""
    import matplotlib.pyplot as plt
    from matplotlib.ticker import LogLocator, NullLocator

    size = (_SIZE[0], 0.5 + 0.35 * len(spreads))
    figure, ax = plt.subplots(figsize=size, layout="constrained")
    scale = spreads[0].field_unit[1]
    values = scale * np.concatenate([each.values for each in spreads])
    low, high = values.min(), values.max()
    for row, each in enumerate(spreads):
        # Points that touch are spread a little, the same way each time.
        y = row + 0.5 * ((np.arange(each.n) * 0.618034) % 1.0 - 0.5)
        is_apart = np.isin(each.devices, [unit.device for unit in each.outliers])
        for chosen, colour in ((~is_apart, COMPONENT_COLOURS[0]), (is_apart, _APART)):
            ax.plot(scale * each.values[chosen], y[chosen], "o", color=colour, alpha=0.6, ms=4.0)
        for unit in each.outliers[:_NAMED]:
            place = (scale * unit.value, y[each.devices.index(unit.device)])
            away, side = (-5, "right") if place[0] > np.sqrt(low * high) else (5, "left")
            name = ax.annotate(literal(unit.device), place, (away, 0), textcoords="offset points")
            name.set(ha=side, va="center", color=_APART, fontsize="small")
        ends = (row - 0.35, row + 0.35)
        ax.vlines(scale * each.median, *ends, color=SUM_COLOUR)
        if scale * each.normal_limit < _FARTHEST * high:
            ax.vlines(scale * each.normal_limit, *ends, color=COMPONENT_COLOURS[1], linestyle="--")
    if high > 10.0 * low:
        subs = (1.0,) if high > 100.0 * low else (1.0, 2.0, 5.0)
        ax.set_xscale("log")
        ax.xaxis.set_major_locator(LogLocator(subs=subs))
        ax.xaxis.set_major_formatter("{x:g}")
        ax.xaxis.set_minor_locator(NullLocator())
    ax.set_yticks(range(len(spreads)), [literal(each.channel) for each in spreads])
    ax.set_ylim(len(spreads) - 0.5, -0.5)
    ax.grid(True, axis="x", color="#dddddd", linewidth=0.6)
    return svg(figure)


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


_SIDE_BY_SIDE = 6  # recordings with columns of their own; of more the range is shown
_ASIDE = ("not-noise", "channel-missing", "channel-skipped")  # the verdicts have them in a word
_REPEATED = ("curves-differ", "curves-close")  # the verdicts repeat them
_VERDICTS = {"agree": "good", "close": "good", "differ": "care", "untested": "bad"}
_LETTERS = ("N", "K")
_COLOURS = COMPONENT_COLOURS[:8]  # of recordings; further ones begin anew
_SHEET = "#9a5b00"
_DODGE = 0.05  # decades between the first and the last recording at a level
_SURE = 0.1  # relative error of a ratio that counts for the limits of its axis


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
        colours=_COLOURS,
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
        "state": _VERDICTS[axis.state],
        "word": STATES[axis.state],
        "figure": _curves(axis, labels, others, sheet) if axis.fits or others else None,
        "rows": [_compared_row(axis, letter, labels) for letter in LETTERS if axis.fits],
        "numbers": [_numbers(axis, letter, sheet) for letter in _LETTERS],
        "nees": _nees(axis, comparison.horizon),
    }


def _curves(
    axis: AxisComparison, labels: Sequence[str], out: Sequence[Fit], sheet: Datasheet | None
) -> str:
    """Allan deviations with their intervals, and below them their ratios to the common curve.

    out: Of recordings that are not compared.
    """
    import matplotlib.pyplot as plt

    margins = {"left": 0.16, "right": 0.98, "bottom": 0.15, "top": 0.98, "hspace": 0.08}
    figure, (top, bottom) = plt.subplots(
        2, figsize=_SIZE, sharex=True, height_ratios=(5, 2), gridspec_kw=margins
    )
    wvs = [fit.wv for fit in (*axis.fits.values(), *out)]
    first = wvs[0]
    unit, scale = shown_unit(first.quantity, first.unit, "field")
    for wv in wvs[len(axis.fits) :]:
        top.plot(wv.tau, scale * wv.allan_deviation, ":", color=DATA_COLOUR, linewidth=1.0)
    stated = None
    if sheet is not None:
        stated = sheet.deviation(axis.name, first.quantity, first.tau, first.dt)
    if stated is not None:
        top.plot(first.tau, scale * stated, "--", color=_SHEET, linewidth=1.3)
    shifts = 10.0 ** (_DODGE * np.linspace(-0.5, 0.5, max(len(axis.fits), 2)))
    style: dict[str, Any] = {"markersize": 3.0, "linewidth": 0.8, "elinewidth": 1.2}
    for i, (label, wv) in enumerate(zip(axis.fits, wvs, strict=False)):
        style["color"] = _COLOURS[labels.index(label) % len(_COLOURS)]
        variances = np.maximum([wv.lower, wv.variance, wv.upper], 0.0)
        low, value, high = scale * np.sqrt(2.0 * variances)
        bars = np.maximum([value - low, high - value], 0.0)
        top.errorbar(shifts[i] * wv.tau, value, bars, fmt="o-", **style)
        if axis.equality is not None:
            away = 100.0 * (axis.equality.ratios[i] - 1.0)
            at, bars = shifts[i] * axis.equality.tau, 196.0 * axis.equality.errors[i]
            bottom.errorbar(at, away, bars, fmt="o", **style)
    seen = scale * np.concatenate([wv.allan_deviation for wv in wvs])
    top.set(xscale="log", yscale="log", ylabel=f"Allan deviation [{unit}]")
    top.set_ylim(np.min(seen[seen > 0.0]) / 1.8, 1.4 * np.max(seen))
    if axis.equality is None:
        bottom.annotate("nothing to compare", (0.5, 0.5), xycoords="axes fraction", ha="center")
    else:
        sure = axis.equality.ratios[axis.equality.errors < _SURE]
        reach = 120.0 * np.max(np.abs(sure - 1.0), initial=0.0) or 100.0
        bottom.set_ylim(-reach, reach)
        bottom.axhline(0.0, color=DATA_COLOUR, linewidth=0.8)
    bottom.set(xlabel="averaging time [s]", ylabel="ratio - 1 [%]")
    bottom.xaxis.minorticks_off()  # which take most of the time
    for ax in (top, bottom):
        ax.grid(True, color="#dddddd", linewidth=0.6)
    return svg(figure)


def _compared_row(axis: AxisComparison, letter: str, labels: tuple[str, ...]) -> dict[str, Any]:
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
