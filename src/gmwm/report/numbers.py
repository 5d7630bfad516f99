"""Filter numbers for outages, the texts to copy, the error budget, and the page of a data sheet."""

import os
from collections.abc import Mapping, Set
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from gmwm._core.files import writable_file
from gmwm._core.pages import page_of
from gmwm._core.text import brief
from gmwm.calibration import Calibration
from gmwm.datasheet import Datasheet
from gmwm.errors import InputError
from gmwm.export import SENSORS, TARGETS, Axis, ImuFile, Triad, axis_of, imu_of
from gmwm.filter_numbers import (
    FIELD_UNITS,
    HORIZON,
    HORIZONTAL,
    QUANTITIES,
    TIMES,
    ErrorBudget,
    FilterNumbers,
    axis,
    error_budget,
    is_steep,
    per_si,
    usable,
)
from gmwm.report.figure import growth_figure
from gmwm.report.page import origin, svg, write_page

SHOWN = HORIZON
"""s: length of outages of all filter numbers on a page."""

_TITLES = {name: each.to_copy for name, each in TARGETS.items() if each.to_copy}
_NOT_VALID = "the fit failed; do not use these numbers"


@dataclass(frozen=True)
class Certified:
    """Filter numbers for outages of `SHOWN`.

    axes: The numbers of each channel for which there are some.
    triads: Gyros and accelerometers, with one value for the axes of each.
    problem: Why a channel has none, if one has none.
    texts: Title -> text for the clipboard: the files that `gmwm.export` writes.
    note: Why there is no text for programs; empty if there is.
    """

    axes: Mapping[str, Axis]
    triads: tuple[Triad, ...]
    problem: str
    texts: Mapping[str, str]
    note: str


def certified(calibration: Calibration) -> Certified:
    """The filter numbers of a calibration."""
    axes: dict[str, Axis] = {}
    problem = ""
    for name, fitted in calibration.items():
        try:
            one = usable(replace(calibration, fits={name: fitted}))[name]
            axes[name] = axis_of(name, one, float("nan"), fitted)
        except InputError as error:
            problem = f"{name}: {error}"
    fits = {name: calibration[name] for name in axes if calibration[name].wv.quantity in SENSORS}
    triads = tuple(
        triad_of(quantity, replace(calibration, fits=own))
        for quantity in SENSORS
        if (own := {name: fit for name, fit in fits.items() if fit.wv.quantity == quantity})
    )
    texts = {}
    try:
        imu = imu_of([replace(calibration, fits=fits)], "N+K", shared=True)
        for name, title in _TITLES.items():
            target = TARGETS[name]
            if isinstance(target, ImuFile):
                texts[title] = target.text(imu if target.shared else imu.by_axis())
        why = ""
    except InputError as error:
        why = str(error)
    texts |= _by_axis(axes, {name for name in axes if not calibration[name].valid})
    return Certified(axes, triads, problem, texts, why)


def triad_of(quantity: str, calibration: Calibration) -> Triad:
    """The axes of a sensor with their numbers, and one value for all of them.

    Raises InputError if an axis has none.
    """
    own, shared = (usable(calibration, shared=each) for each in (False, True))
    axes = tuple(axis_of(name, one, own.rate, calibration[name]) for name, one in own.items())
    return Triad(quantity, axes, next(iter(shared.values())))


def _by_axis(axes: Mapping[str, Axis], invalid: Set[str]) -> dict[str, str]:
    """Plain numbers of each axis, for a filter of one's own; a comment where they are not valid."""
    if not axes:
        return {}
    values = {
        name: {
            key: float(f"{value:.6e}")
            for key, value in (("N", each.N), ("K", each.K), ("initial_sd", each.initial_sd))
        }
        for name, each in axes.items()
    }
    about = (
        f"filter numbers for outages up to {SHOWN:g} s: N [u/sqrt(Hz)], K [u/s/sqrt(Hz)], sd of "
        "the bias state at\n# the start [u] (add your turn-on bias); u: rad/s, m/s^2"
    )
    marks = {name: f"  # {_NOT_VALID}" if name in invalid else "" for name in values}
    lines = [f"    {name!r}: {each!r},{marks[name]}" for name, each in values.items()]
    as_yaml = yaml.safe_dump(values, sort_keys=False, allow_unicode=True)
    blocks = [f"{line}{marks.get(line[:-1], '')}\n" for line in as_yaml.splitlines()]
    return {
        "YAML, axis by axis": f"# {about}\n{''.join(blocks)}",
        "Python, axis by axis": "\n".join([f"# {about}", "imu_noise = {", *lines, "}", ""]),
    }


_COASTING = 60.0  # s, the coasting time of the sentence
_NAMES = {
    (HORIZONTAL, "attitude"): "tilt",
    (HORIZONTAL, "velocity"): "horizontal velocity",
    (HORIZONTAL, "position"): "horizontal position",
    ("z", "attitude"): "heading",
    ("z", "velocity"): "vertical velocity",
    ("z", "position"): "vertical position",
}


def navigation(calibration: Calibration) -> dict[str, Any] | None:
    """Content of the section; ``None`` without inertial sensors, ``problem`` without a budget."""
    intervals = [fit.wv.dt for fit in calibration.fits.values() if fit.wv.quantity is not None]
    times = [t for t in TIMES if intervals and t >= max(intervals)]
    if not times:
        return None
    try:
        known = error_budget(calibration, times)
        unknown = error_budget(calibration, times, calibrated=False)
    except InputError as error:
        return {"problem": str(error)}
    of = known.groups[-1]
    figure = growth_figure(known, unknown, of, known.quantities(of)[-1])
    invalid = {name for name in known.channels if not calibration[name].valid}
    return {
        "problem": "",
        "times": [f"{t:g} s" for t in times],
        "sentence": _sentence(known, unknown),
        "starts": [
            ("Slow errors known at the start, as after aiding", _rows(known, invalid)),
            ("Slow errors unknown at the start", _rows(unknown, invalid)),
        ],
        "parts": [row for row in known.rows if any(row.values)],
        "units": {quantity: (FIELD_UNITS[quantity], per_si(quantity)) for quantity in QUANTITIES},
        "invalid": invalid,
        "notes": known.notes,
        "rough": any(is_steep(each)[-1] for each in (known, unknown)),
        "figure": figure,
    }


def _rows(budget: ErrorBudget, invalid: Set[str]) -> list[dict[str, Any]]:
    """The totals of the platform: tilt and horizontal errors, then what else there is."""
    together = [HORIZONTAL] if HORIZONTAL in budget.groups else []
    apart = [name for name in budget.channels if axis(name) not in ("x", "y")]
    rows, steep = [], is_steep(budget)
    for of in together + apart:
        for quantity, values in budget.total(of).items():
            rough = steep & (quantity != "attitude")
            row, share = budget.largest(quantity, of)
            mostly = f"{row.channel} {row.component}, {100.0 * share:.0f} %"
            rows.append(
                {
                    "name": _NAMES.get((axis(of) or of, quantity), f"{of} {quantity}"),
                    "quantity": quantity,
                    "unit": FIELD_UNITS[quantity],
                    "values": [
                        f"{'≈ ' if is_rough else ''}{brief(value, 3)}"
                        for value, is_rough in zip(values * per_si(quantity), rough, strict=True)
                    ],
                    "mostly": mostly if share > 0.0 else "",
                    "invalid": bool(invalid & {of, *budget.curves(of, quantity)}),
                }
            )
    # By quantity, the horizontal before the others; the sort keeps that order within each.
    return sorted(rows, key=lambda row: list(QUANTITIES).index(row["quantity"]))


def _sentence(known: ErrorBudget, unknown: ErrorBudget) -> str:
    """The headline: errors after a minute without aiding."""
    if HORIZONTAL not in known.groups or _COASTING not in known.times:
        return ""
    at = known.times.index(_COASTING)

    def lost(budget: ErrorBudget) -> str:
        total = budget.total()
        return " and ".join(
            f"{brief(total[quantity][at] * per_si(quantity), 3)} {FIELD_UNITS[quantity]} of {name}"
            for quantity, name in (("attitude", "tilt"), ("position", "horizontal position"))
            if quantity in total
        )

    return (
        "After a 60 s outage from exact attitude, velocity and position the errors are "
        f"{lost(known)} (1 sigma) if the slow errors are known at its start, and {lost(unknown)} "
        "if they are unknown. After fixes they are larger: use gmwm certify."
    )


@page_of(Datasheet)
def write_sheet_report(
    sheet: Datasheet, path: str | os.PathLike[str], numbers: FilterNumbers, answer: str = ""
) -> Path:
    """Write what a data sheet says as one HTML file that needs no network."""
    import matplotlib.pyplot as plt

    path = writable_file(path)
    pictures = {}
    for sensor in numbers:
        figure, axes = plt.subplots(figsize=(7.0, 4.6), layout="constrained")
        sheet.plot(sensor, numbers, ax=axes)
        pictures[sensor] = svg(figure)
    known = {"data sheet": sheet.document or sheet.name}
    text = sheet.text(form=numbers.form, horizon=numbers.horizon)
    return write_page(
        path,
        "sheet.html",
        sheet=sheet,
        pictures=pictures,
        text=f"{answer or numbers.text()}\n\n{text}",
        provenance=origin(known, "page of", None),
    )
