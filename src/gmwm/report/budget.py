"""The error budget in words, tables and a figure."""

from __future__ import annotations

from collections.abc import Set
from typing import Any

from gmwm._core.text import brief
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.filter_numbers import (
    FIELD_UNITS,
    HORIZONTAL,
    QUANTITIES,
    TIMES,
    ErrorBudget,
    axis,
    error_budget,
    is_steep,
    per_si,
)
from gmwm.report.figure import growth_figure

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
