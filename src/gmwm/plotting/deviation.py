"""Pictures from plain arrays and labels, in the axes people know.

Every function draws into given axes or new ones and returns them; none knows what it draws.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core.typing import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COMPONENT_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#c06a9a", "#b87a00", "#2f8fc8", "#8c5fa8")
"""After Okabe & Ito, distinct to colour-blind people too, darkened to what thin lines need on white
(3:1, WCAG 2.1, 1.4.11); black is the sum."""

DATA_COLOUR = "#444444"
SUM_COLOUR = "#000000"

_SPREAD_SHOWN = 8.0  # boxes up to this many times as wide as usual are kept in view
_MARKERS = ("o", "^", "D", "s")
_BESIDE = 1.07  # ratio of the averaging times at which bars of different kinds are drawn
_MARGIN = 2.5  # above and below the deviations of several kinds
_DECADES_SHOWN_BELOW = 0.7  # of a component, below the lowest data point

LINEAR_RESIDUAL = 5.0
"""Standard errors up to which the axis of residuals is linear; beyond, it is logarithmic."""


def deviation(
    tau: FloatArray,
    value: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    *,
    unit: str,
    interval: str = "95 %",
    title: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Allan deviation with error bars against averaging time, log-log.

    tau: (J,), averaging times, s.
    value, lower, upper: (J,), deviations and the ends of their intervals, in ``unit``.
    interval: Level of the intervals, for the legend.
    """
    ax = ax or _new_axes(4.6)
    bars = np.stack([np.maximum(value - lower, 0.0), np.maximum(upper - value, 0.0)])
    style: dict[str, Any] = {
        "color": DATA_COLOUR,
        "markersize": 4.5,
        "capsize": 2.5,
        "elinewidth": 1.0,
    }
    ax.errorbar(tau, value, bars, fmt="o", label=f"data, {interval} interval", zorder=4, **style)
    _label(ax, f"Allan deviation [{unit}]", title)
    return ax


def deviations(
    kinds: Mapping[str, tuple[FloatArray, FloatArray, FloatArray, FloatArray]],
    *,
    unit: str,
    places: Sequence[int] | None = None,
    interval: str = "95 %",
    title: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Several deviations with error bars against averaging time, log-log; returns the axes.

    Parameters
    ----------
    kinds : mapping of str to (tau, value, lower, upper)
        Label -> averaging times (s), deviations and the ends of their intervals, (J,) each.
    unit : str
    places : sequence of int, optional
        Place of each in the palette, so that a kind keeps its colour; in turn by default.
    interval : str, optional
        What the bars are, for the legend.
    title : str, optional
    ax : matplotlib.axes.Axes, optional
        That of `deviation` will do.
    """
    ax = ax or _new_axes(4.6)
    shown = [np.asarray(line.get_ydata(), dtype=float) for line in ax.get_lines()]
    places = range(len(kinds)) if places is None else places
    palette = _cycle(max(places) + 1)
    for i, (place, label) in enumerate(zip(places, kinds, strict=True)):
        tau, value, lower, upper = kinds[label]
        colour, marker = palette[place], _MARKERS[place % len(_MARKERS)]
        # Kinds may coincide: open markers and lines, the later the smaller, leave all in view, and
        # bars stand side by side.
        behind = len(kinds) - 1 - i
        (line,) = ax.plot(tau, value, color=colour, label=label, zorder=3 + 0.1 * i)
        line.set(linewidth=1.2 + 0.6 * behind, marker=marker, markersize=4.0 + 1.8 * behind)
        line.set(markerfacecolor="none", markeredgewidth=1.2)
        beside = tau * _BESIDE ** (i - 0.5 * (len(kinds) - 1))
        ax.vlines(beside, lower, upper, color=colour, linewidth=1.0, zorder=2)
        shown.append(value)
    every = np.concatenate(shown)
    every = every[every > 0.0]
    ax.set_ylim(np.min(every) / _MARGIN, np.max(every) * _MARGIN)
    _label(ax, f"deviation [{unit}]", title)
    ax.legend(fontsize="small", framealpha=0.9, title=f"bars: {interval} intervals")
    return ax


def _new_axes(height: float) -> Axes:
    import matplotlib.pyplot as plt

    return plt.subplots(figsize=(7.0, height), layout="constrained")[1]


def _label(ax: Axes, value: str, title: str) -> None:
    """Logarithmic axes over averaging times, with a grid behind what is drawn."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel("averaging time [s]")
    ax.set_ylabel(value)
    if title:
        ax.set_title(title)
    ax.grid(True, which="major", color="#cccccc", linewidth=0.6)
    ax.grid(True, which="minor", color="#eeeeee", linewidth=0.4)
    ax.set_axisbelow(True)


def curves(
    ax: Axes,
    tau: FloatArray,
    total: FloatArray,
    components: Mapping[str, FloatArray],
    data: FloatArray | None = None,
) -> None:
    """Fitted curve and its components over the data of `deviation`.

    tau: (J,), averaging times, s.
    total: (J,), deviation of the sum.
    components: Deviations of the terms by label.
    data: (J,), deviations of the data, to keep in view.
    """
    for colour, (label, value) in zip(_cycle(len(components)), components.items(), strict=True):
        ax.plot(tau, value, color=colour, linewidth=1.3, linestyle="--", label=label, zorder=2)
    ax.plot(tau, total, color=SUM_COLOUR, linewidth=1.8, label="model", zorder=3)
    shown = total if data is None else np.concatenate([total, data])
    ax.set_ylim(*deviation_range(shown))
    ax.legend(fontsize="small", framealpha=0.9)


def straight_lines(ax: Axes, lines: Mapping[str, tuple[float, float, float, float]]) -> None:
    """Straight lines across the log-log axes of `deviation`, thick over a region of each.

    ax: With its limits set; they stay as they are.
    lines: Label -> the line ``coefficient * tau^slope`` and the averaging times (s) of its region.
    """
    ends = np.array(ax.get_xlim())
    limits = ax.get_ylim()
    for colour, (label, line) in zip(_cycle(len(lines)), lines.items(), strict=True):
        slope, coefficient, first, last = line
        region = np.array([first, last])
        whole, thick = coefficient * ends**slope, coefficient * region**slope
        ax.plot(ends, whole, "--", color=colour, linewidth=1.0, zorder=2)
        (bar,) = ax.plot(region, thick, color=colour, linewidth=4.5, label=label, zorder=3.5)
        bar.set(alpha=0.8, solid_capstyle="round")
    ax.set_xlim(*ends)
    ax.set_ylim(*limits)
    ax.legend(fontsize="small", framealpha=0.9)


def residuals(
    tau: FloatArray,
    residual: FloatArray,
    misfit: FloatArray,
    *,
    title: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Standardised residuals as stems with the band of two standard errors; returns the axes.

    tau: (J,), averaging times, s.
    residual: (J,), in standard errors; NaN where there is none.
    misfit: (J,), relative difference of the deviations, written in per cent at each stem.
    """
    ax = ax or _new_axes(3.2)
    shown = np.isfinite(residual)
    ax.axhspan(-2.0, 2.0, color="#e8eef4", zorder=0)
    ax.axhline(0.0, color=SUM_COLOUR, linewidth=0.8, zorder=1)
    ax.vlines(tau[shown], 0.0, residual[shown], color=COMPONENT_COLOURS[0], linewidth=1.6)
    ax.plot(tau[shown], residual[shown], "o", color=COMPONENT_COLOURS[0], markersize=4.5)
    for time, height, share in zip(tau[shown], residual[shown], misfit[shown], strict=True):
        away, side = (5.0, "bottom") if height >= 0.0 else (-5.0, "top")
        text = ax.annotate(
            f"{100.0 * share:+.2g}", (time, height), (0.0, away), textcoords="offset points"
        )
        text.set(ha="center", va=side, fontsize="x-small", color=DATA_COLOUR)
    largest = max(float(np.max(np.abs(residual[shown]), initial=0.0)), 2.5)
    if largest > LINEAR_RESIDUAL:
        # Beside a residual of 50 at the finest level those at long times would be flat.
        ax.set_yscale("symlog", linthresh=LINEAR_RESIDUAL, linscale=2.0)
        ax.set_ylim(-2.0 * largest, 2.0 * largest)
    else:
        ax.set_ylim(-1.25 * largest, 1.25 * largest)
    ax.set_xscale("log")
    ax.set_xlabel("averaging time [s]")
    ax.set_ylabel("residual [standard errors]")
    heading = f"{title}: misfit of the deviation in %" if title else "misfit in %"
    ax.set_title(heading, fontsize="medium")
    return ax


def deviation_range(shown: FloatArray) -> tuple[float, float]:
    """Limits of the deviation axis that show these and hide components far below them."""
    shown = shown[shown > 0.0]
    low, high = float(np.min(shown)), float(np.max(shown))
    return low / 10**_DECADES_SHOWN_BELOW, high * 10**0.4


def _cycle(count: int) -> list[str]:
    palette = COMPONENT_COLOURS
    return [palette[i % len(palette)] for i in range(count)]


def boxes(
    panels: Mapping[str, Mapping[str, FloatArray]], truths: Mapping[str, float], *, title: str = ""
) -> Figure:
    """Boxplots side by side: one panel a quantity, one box a method, the truth as a line.

    The axis of a panel shows the boxes and whiskers of all methods but those whose spread would
    flatten the others; what lies outside is counted at the edge.

    panels: Quantity -> method -> estimates.
    truths: Quantity -> true value.
    """
    import matplotlib.pyplot as plt

    columns = min(len(panels), 4) if len(panels) != 6 else 3
    rows = -(-len(panels) // columns)
    methods = len(next(iter(panels.values())))
    width = columns * max(2.2, 0.62 * methods + 1.0)
    figure, axes = plt.subplots(
        rows, columns, figsize=(width, 3.1 * rows + 0.3), layout="constrained", squeeze=False
    )
    for ax in axes.ravel()[len(panels) :]:
        ax.set_visible(False)
    for ax, (name, samples) in zip(axes.ravel(), panels.items(), strict=False):
        _panel(ax, samples, truths[name])
        ax.set_title(name, fontsize="medium")
    if title:
        figure.suptitle(title)
    return figure


def _panel(ax: Axes, samples: Mapping[str, FloatArray], truth: float) -> None:
    labels, values = list(samples), list(samples.values())
    far = {"marker": ".", "markersize": 3, "markeredgecolor": DATA_COLOUR}
    middle = {"color": COMPONENT_COLOURS[0], "linewidth": 1.6}
    ax.boxplot(values, tick_labels=labels, widths=0.6, flierprops=far, medianprops=middle)
    ax.axhline(truth, color=COMPONENT_COLOURS[1], linewidth=1.2, linestyle="--", zorder=0)
    spans = [np.quantile(v, [0.001, 0.25, 0.75, 0.999]) for v in values if v.size]
    usual = float(np.median([span[2] - span[1] for span in spans]))
    shown = [s for s in spans if s[2] - s[1] <= _SPREAD_SHOWN * usual]
    low, high = min(s[0] for s in shown), max(s[3] for s in shown)
    low, high = min(low, truth), max(high, truth)
    margin = 0.08 * (high - low)
    ax.set_ylim(low - margin, high + margin)
    for place, value in enumerate(values, start=1):
        outside = np.sum(value > high + margin), np.sum(value < low - margin)
        for count, y, align in ((outside[0], 1.0, "top"), (outside[1], 0.0, "bottom")):
            if count:
                arrow = "\u2191" if align == "top" else "\u2193"
                text = ax.annotate(
                    f"{count}{arrow}", (place, y), xycoords=("data", "axes fraction")
                )
                text.set(ha="center", va=align, fontsize="small", color=COMPONENT_COLOURS[1])
    ax.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True)
    ax.grid(True, axis="y", color="#dddddd", linewidth=0.6)
    ax.set_axisbelow(True)
    if len(labels) > 3:
        ax.tick_params(axis="x", labelsize="small")
