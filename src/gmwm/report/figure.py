"""Interactive plots, as the JSON that plotly.js draws."""

from __future__ import annotations

from typing import Any

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm._core.units import field_units
from gmwm.budget import FIELD_UNITS, ErrorBudget, root_sum
from gmwm.estimate.result import Fit
from gmwm.plotting import (
    COMPONENT_COLOURS,
    DATA_COLOUR,
    LINEAR_RESIDUAL,
    SUM_COLOUR,
    deviation_range,
)

_GRID = "#dddddd"
_BESIDE = 1.7  # ratio of averaging times that is left free at both ends
_LAYOUT: dict[str, Any] = {
    "margin": {"l": 75, "r": 15, "t": 36, "b": 50},
    "height": 420,
    "plot_bgcolor": "#ffffff",
    "paper_bgcolor": "#ffffff",
    "hovermode": "closest",
    "font": {"family": "system-ui, sans-serif", "size": 13},
}
_CONFIG = {
    "displaylogo": False,
    "responsive": True,
    "modeBarButtonsToRemove": ["lasso2d", "select2d"],
}


def deviation_figure(fitted: Fit) -> dict[str, Any]:
    """Allan deviation with error bars, model and components, in SI with the field's unit on hover.

    Returns
    -------
    dict
        ``data``, ``layout`` and ``config`` for ``Plotly.newPlot``.
    """
    wv = fitted.wv
    unit, factor = wv.unit, 1.0
    field = field_units("u", wv.quantity)
    if field:
        unit, factor = field[0].unit, field[0].per_si
    tau = wv.tau.tolist()
    value = wv.allan_deviation * factor
    lower, upper = np.sqrt(2.0 * wv.lower) * factor, np.sqrt(2.0 * wv.upper) * factor
    total = np.sqrt(2.0 * fitted.implied) * factor
    traces = [
        _line(tau, np.sqrt(2.0 * curve) * factor, label, colour, "dash", 1.5)
        for (label, curve), colour in zip(
            fitted.components.items(), _colours(len(fitted.components)), strict=True
        )
        if np.any(curve > 0.0)
    ]
    traces.append(_line(tau, total, "model", SUM_COLOUR, "solid", 2.2))
    traces.append(
        {
            "type": "scatter",
            "mode": "markers",
            "name": "data, 95 % interval",
            "x": tau,
            "y": value.tolist(),
            "marker": {"color": DATA_COLOUR, "size": 6},
            "error_y": {
                "type": "data",
                "symmetric": False,
                "array": (upper - value).tolist(),
                "arrayminus": (value - lower).tolist(),
                "color": DATA_COLOUR,
                "thickness": 1.2,
                "width": 3,
            },
        }
    )
    low, high = deviation_range(np.concatenate([total, value]))
    layout = {
        **_LAYOUT,
        "xaxis": _times(wv.tau),
        "yaxis": {
            **_axis(f"Allan deviation [{unit}]"),
            "range": [float(np.log10(low)), float(np.log10(high))],
        },
        "legend": {"bgcolor": "rgba(255,255,255,0.85)", "x": 1, "xanchor": "right", "y": 1},
    }
    return {"data": traces, "layout": layout, "config": _CONFIG}


def residual_figure(fitted: Fit) -> dict[str, Any]:
    """Standardised residuals by averaging time, with the misfit of the deviation on hover.

    Returns
    -------
    dict
        ``data``, ``layout`` and ``config`` for ``Plotly.newPlot``.
    """
    at = fitted.goodness
    shown = np.flatnonzero(np.isfinite(at.residual) & np.isfinite(at.misfit))
    residual = at.residual[shown]
    tau, height = at.tau[shown].tolist(), _compressed(residual).tolist()
    stems: dict[str, list[float | None]] = {"x": [], "y": []}
    for time, value in zip(tau, height, strict=True):
        stems["x"] += [time, time, None]
        stems["y"] += [0.0, value, None]
    colour = COMPONENT_COLOURS[0]
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            **stems,
            "line": {"color": colour, "width": 2},
            "hoverinfo": "skip",
        },
        {
            "type": "scatter",
            "mode": "markers",
            "x": tau,
            "y": height,
            "marker": {"color": colour, "size": 7},
            "customdata": [
                [100.0 * misfit, dof, value]
                for misfit, dof, value in zip(
                    at.misfit[shown], at.dof[shown], residual, strict=True
                )
            ],
            "hovertemplate": "%{x:.4g} s: deviation %{customdata[0]:+.2g} % off the model, "
            "%{customdata[2]:+.2f} standard errors, %{customdata[1]:.3g} degrees of freedom"
            "<extra></extra>",
        },
    ]
    band = {"type": "rect", "xref": "paper", "x0": 0, "x1": 1, "y0": -2, "y1": 2}
    largest = max([2.5, *map(abs, height)])
    ticks = np.array([-100.0, -10.0, -5.0, -2.0, 0.0, 2.0, 5.0, 10.0, 100.0])
    layout = {
        **_LAYOUT,
        "margin": {"l": 75, "r": 15, "t": 30, "b": 42},  # the toolbar is above the points
        "height": 212,
        "showlegend": False,
        "shapes": [{**band, "fillcolor": "#e8eef4", "line": {"width": 0}, "layer": "below"}],
        "xaxis": _times(at.tau),
        "yaxis": {
            "title": {"text": "residual [sigma]"},
            "range": [-1.15 * largest, 1.15 * largest],
            "tickvals": _compressed(ticks).tolist(),
            "ticktext": [f"{value:g}" for value in ticks],
            "gridcolor": _GRID,
            "linecolor": "#888888",
            "mirror": True,
            "zerolinecolor": SUM_COLOUR,
        },
    }
    return {"data": traces, "layout": layout, "config": _CONFIG}


def _compressed(residual: FloatArray) -> FloatArray:
    """Heights of residuals: linear near zero, logarithmic beyond, so that one flattens no other."""
    size = np.abs(residual)
    beyond = LINEAR_RESIDUAL * (1.0 + np.log10(np.maximum(size, LINEAR_RESIDUAL) / LINEAR_RESIDUAL))
    return np.asarray(np.sign(residual) * np.where(size > LINEAR_RESIDUAL, beyond, size))


def growth_figure(
    known: ErrorBudget, unknown: ErrorBudget, of: str, quantity: str
) -> dict[str, Any]:
    """Growth of an error with coasting time: its parts, their total, and that of unknown starts.

    Returns
    -------
    dict
        ``data``, ``layout`` and ``config`` for ``Plotly.newPlot``.
    """
    unit, times = FIELD_UNITS[quantity], list(known.grid)
    curves = known.curves(of, quantity)
    traces = [
        _line(times, curve, label, colour, "dash", 1.5)
        for (label, curve), colour in zip(curves.items(), _colours(len(curves)), strict=True)
    ]
    for budget, label, dash, width in (
        (known, "total, slow errors known", "solid", 3.0),
        (unknown, "total, nothing known", "dot", 2.0),
    ):
        parts = list(budget.curves(of, quantity).values())
        if parts:
            traces.append(_line(times, root_sum(parts), label, SUM_COLOUR, dash, width))
    title = f"{of} {quantity} error, 1 sigma [{unit}]"
    layout = {
        **_LAYOUT,
        "xaxis": _axis("coasting time [s]"),
        "yaxis": _axis(title[0].upper() + title[1:]),
        "legend": {"bgcolor": "rgba(255,255,255,0.85)", "x": 0, "y": 1},
    }
    return {"data": traces, "layout": layout, "config": _CONFIG}


def _line(
    tau: list[float],
    value: FloatArray,
    label: str,
    colour: str,
    dash: str,
    width: float,
) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": label,
        "x": tau,
        "y": value.tolist(),
        "line": {"color": colour, "dash": dash, "width": width},
        "hovertemplate": "%{y:.4g} at %{x:.4g} s",
    }


def _times(tau: FloatArray) -> dict[str, Any]:
    """The axis of averaging times, the same for all figures of a channel."""
    ends = np.log10([tau[0] / _BESIDE, tau[-1] * _BESIDE])
    return {**_axis("averaging time [s]"), "range": ends.tolist()}


def _axis(title: str) -> dict[str, Any]:
    return {
        "type": "log",
        "title": {"text": title},
        "exponentformat": "power",
        "dtick": 1,
        "gridcolor": _GRID,
        "linecolor": "#888888",
        "mirror": True,
        "ticks": "outside",
        "minor": {"ticks": "outside", "ticklen": 3},
    }


def _colours(count: int) -> list[str]:
    return [COMPONENT_COLOURS[i % len(COMPONENT_COLOURS)] for i in range(count)]
