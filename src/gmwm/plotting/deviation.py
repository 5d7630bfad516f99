"""Pictures from plain arrays and labels, in the axes people know.

Every function draws into given axes or new ones and returns them; none knows what it draws.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core.typing import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COMPONENT_COLOURS = (
    *("#0072b2", "#d55e00", "#009e73", "#c06a9a", "#b87a00", "#2f8fc8", "#8c5fa8"),
    *("#6e7f1e", "#a3674c", "#5f7f8c"),
)
"""After Okabe & Ito, distinct to colour-blind people too, darkened to what thin lines need on white
(3:1, WCAG 2.1, 1.4.11); black is the sum."""

_KINDS = (
    *("white noise", "Gauss-Markov", "random walk", "bias instability", "quantization noise"),
    *("low-pass noise", "rate ramp", "resonance", "sinusoid"),
)
_LETTERS = "N-KBQ-R--"  # of their parameters
_COLOURS = dict(zip((*_KINDS, *_LETTERS), 2 * COMPONENT_COLOURS[: len(_KINDS)], strict=True))
_DASHES = ("--", ":", "-.", (0, (8, 3)))  # of the first, second ... term of a kind

DATA_COLOUR = "#444444"
SUM_COLOUR = "#000000"

_WIDE_AXIS = 8.0  # last over first value of an axis of intervals with few marks
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
    ax = allan_axes(unit, title, ax)
    bars = np.stack([np.maximum(value - lower, 0.0), np.maximum(upper - value, 0.0)])
    style: dict[str, Any] = {"color": DATA_COLOUR, "capsize": 2.5, "elinewidth": 1.0, "zorder": 4}
    ax.errorbar(tau, value, bars, fmt="o", ms=4.5, label=f"data, {interval} interval", **style)
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

    kinds: Label -> averaging times (s), deviations and the ends of their intervals, (J,) each.
    places: Of each in the palette, so that a kind keeps its colour; in turn by default.
    interval: What the bars are, for the legend.
    ax: That of `deviation` will do.
    """
    ax = ax or _new_axes(4.6)
    shown = [np.asarray(line.get_ydata(), dtype=float) for line in ax.get_lines()]
    places = range(len(kinds)) if places is None else places
    for i, (place, label) in enumerate(zip(places, kinds, strict=True)):
        tau, value, lower, upper = kinds[label]
        colour = COMPONENT_COLOURS[place % len(COMPONENT_COLOURS)]
        marker = _MARKERS[place % len(_MARKERS)]
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
    ax.set_ylim(np.min(every[every > 0.0]) / _MARGIN, np.max(every) * _MARGIN)
    _label(ax, f"deviation [{unit}]", title)
    ax.legend(fontsize="small", framealpha=0.9, title=f"bars: {interval} intervals")
    return ax


def allan_axes(unit: str, title: str = "", ax: Axes | None = None) -> Axes:
    """Given axes or new ones, for Allan deviations."""
    ax = ax or _new_axes(4.6)
    _label(ax, f"Allan deviation [{unit}]", title)
    return ax


def _new_axes(height: float) -> Axes:
    import matplotlib.pyplot as plt

    return plt.subplots(figsize=(7.0, height), layout="constrained")[1]


def _label(ax: Axes, value: str, title: str) -> None:
    """Logarithmic axes over averaging times, with a grid behind what is drawn."""
    ax.set(xscale="log", yscale="log", xlabel="averaging time [s]", ylabel=value, title=title)
    ax.grid(True, which="major", color="#cccccc", linewidth=0.6)
    ax.grid(True, which="minor", color="#eeeeee", linewidth=0.4)
    ax.set_axisbelow(True)


def styles(labels: Iterable[str]) -> list[tuple[str, int]]:
    """Colour of each label, and how many of its colour came before.

    A kind of term has the same colour in every plot. Other labels take what is left, in turn.

    labels: Titles of terms, numbered where a kind occurs twice, letters, or any names.
    """
    kinds = [re.sub(r"( \d+| [=<≤].*)$", "", label) for label in labels]
    known = [_COLOURS[kind] for kind in kinds if kind in _COLOURS]
    left = [colour for colour in COMPONENT_COLOURS if colour not in known]
    others = cycle(left[::-1] if known else left)
    found: list[tuple[str, int]] = []
    for kind in kinds:
        colour = _COLOURS.get(kind) or next(others)
        found.append((colour, sum(colour == before for before, _ in found) if known else 0))
    return found


def curves(
    ax: Axes,
    tau: FloatArray,
    total: FloatArray,
    components: Mapping[str, FloatArray],
    data: FloatArray | None = None,
    band: Sequence[FloatArray] = (),
) -> None:
    """Fitted curve, its band and its components over the data of `deviation`.

    tau: (J,), averaging times, s.
    total: (J,), deviation of the sum.
    components: Deviations of the terms by label.
    data: (J,), deviations of the data, to keep in view.
    band: Ends of the 95 % interval of the sum, (J,) each, if it is drawn.
    """
    for (colour, turn), (label, value) in zip(styles(components), components.items(), strict=True):
        dash = _DASHES[turn % len(_DASHES)]
        ax.plot(tau, value, color=colour, linewidth=1.3, linestyle=dash, label=label, zorder=2)
    ax.plot(tau, total, color=SUM_COLOUR, linewidth=1.8, label="model", zorder=3)
    if band:
        ax.fill_between(tau, band[0], band[1], color="#808080", alpha=0.25, lw=0, label="95 % band")
    shown = total if data is None else np.concatenate([total, data])
    ax.set_ylim(*deviation_range(shown))
    ax.legend(fontsize="small", framealpha=0.9)


def model_set(
    tau: FloatArray,
    models: FloatArray,
    lines: Mapping[str, FloatArray],
    lowest: float,
    *,
    unit: str,
    title: str = "",
    ax: Axes | None = None,
) -> Axes:
    """The Allan deviations of models that agree, as a band, and straight or curved lines over it.

    tau: (J,), averaging times, s.
    models: (M, J), deviations of the models, in ``unit``.
    lines: Label -> deviations, (J,).
    lowest: Deviation at which all of them are flat.
    """
    ax = allan_axes(unit, title, ax)
    ax.fill_between(tau, models.min(0), models.max(0), color="#808080", alpha=0.3, lw=0,
                    label="models that agree")  # fmt: skip
    ax.plot(tau, models.T, color="#808080", linewidth=0.5)
    for (colour, turn), (label, value) in zip(styles(lines), lines.items(), strict=True):
        ax.plot(tau, value, _DASHES[turn % len(_DASHES)], color=colour, linewidth=1.8, label=label)
    ax.axhline(lowest, color=DATA_COLOUR, linewidth=1.0, linestyle=":", label="lowest deviation")
    ax.set_ylim(lowest / 3.0, 1.5 * float(models.max(0)[0]))
    ax.legend(fontsize="small", framealpha=0.9)
    return ax


def sensor_lines(
    numbers: Mapping[str, tuple[str, float]], tau: float
) -> dict[str, tuple[float, float, float, float]]:
    """Where N, B and K are read (IEEE Std 952), for `straight_lines`.

    numbers: Letter -> label and value, in units of the deviation and s.
    tau: Averaging time of the lowest deviation, s.
    """
    plateau = (2.0 * np.log(2.0) / np.pi) ** 0.5
    reading = {"N": (-0.5, 1.0, 1.0), "B": (0.0, plateau, tau), "K": (0.5, 3.0**-0.5, 3.0)}
    found = {}
    for (label, value), (slope, share, at) in ((numbers[key], reading[key]) for key in numbers):
        if 0.0 < value < np.inf:
            found[label] = (slope, share * value, at, at)
    return found


def straight_lines(ax: Axes, lines: Mapping[str, tuple[float, float, float, float]]) -> None:
    """Straight lines across the log-log axes of `deviation`, thick over a region of each.

    ax: With its limits set, which are widened only where a number is read beyond them.
    lines: Label -> the line ``coefficient * tau^slope`` and the averaging times (s) of its region;
        both the same where its number is read.
    """
    ends, (low, high) = np.array(ax.get_xlim()), ax.get_ylim()
    for (colour, _), (label, line) in zip(styles(lines), lines.items(), strict=True):
        slope, coefficient, first, last = line
        region, dash = np.array([first, last]), ":" if first == last else "--"
        height = coefficient * region**slope
        ax.plot(ends, coefficient * ends**slope, dash, color=colour, linewidth=1.0, zorder=2)
        (bar,) = ax.plot(region, height, color=colour, linewidth=4.5, label=label, zorder=3.5)
        bar.set(alpha=0.8, solid_capstyle="round")
        if first == last:
            bar.set(marker="D", markersize=7, linestyle="none", markerfacecolor="w", zorder=5)
            ax.annotate(label[0], (first, height[0]), (6, 5), textcoords="offset points")
            low, high = min(low, 0.6 * height[0]), max(high, 1.6 * height[0])
    ax.set_xlim(*ends)
    ax.set_ylim(low, high)
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
    reach = 1.25 * max(*np.abs(residual[shown]), 2.5, 2.5)
    if reach > 1.25 * LINEAR_RESIDUAL:
        # Beside a residual of 50 at the finest level those at long times would be flat.
        ax.set_yscale("symlog", linthresh=LINEAR_RESIDUAL, linscale=2.0)
        reach *= 1.6
    ax.set(xscale="log", ylim=(-reach, reach))
    ax.set(xlabel="averaging time [s]", ylabel="residual [standard errors]")
    heading = f"{title}: misfit of the deviation in %" if title else "misfit in %"
    ax.set_title(heading, fontsize="medium")
    return ax


def deviation_range(shown: FloatArray) -> tuple[float, float]:
    """Limits of the deviation axis that show these and hide components far below them."""
    low, high = float(np.min(shown[shown > 0.0])), float(np.max(shown))
    return low / 10**_DECADES_SHOWN_BELOW, high * 10**0.4


def boxes(
    panels: Mapping[str, Mapping[str, FloatArray]], truths: Mapping[str, float], *, title: str = ""
) -> Figure:
    """Boxplots side by side: one panel a quantity, one box a method, the truth as a line.

    Methods whose spread would flatten the others do not count for the axis of a panel; what lies
    outside is counted at its edge.
    """
    import matplotlib.pyplot as plt

    columns = min(len(panels), 4) if len(panels) != 6 else 3
    rows, methods = -(-len(panels) // columns), len(next(iter(panels.values())))
    size = columns * max(2.2, 0.62 * methods + 1.0), 3.1 * rows + 0.3
    figure, axes = plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False)
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
                side = "above" if align == "top" else "below"
                text = ax.annotate(
                    f"{count} of {values[place - 1].size}\n{side} {arrow}",
                    (place, y),
                    xycoords=("data", "axes fraction"),
                )
                text.set(ha="center", va=align, fontsize="small", color=COMPONENT_COLOURS[1])
    ax.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3), useMathText=True)
    ax.grid(True, axis="y", color="#dddddd", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.tick_params(axis="x", labelsize="small" if len(labels) > 3 else "medium")


def intervals(
    panels: Mapping[
        str, Mapping[str, tuple[Sequence[float] | FloatArray, tuple[float, float, float]]]
    ],
) -> Figure:
    """Values that are 1 where nothing is wrong, on a logarithmic axis.

    panels: Label of the axis -> row -> single values, and the one over all of them with its
        interval.
    """
    import matplotlib.pyplot as plt
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

    names = max((list(rows) for rows in panels.values()), key=len)
    size = 4.4 * len(panels), 1.2 + 0.38 * len(names)
    figure, axes = plt.subplots(
        1, len(panels), figsize=size, layout="constrained", squeeze=False, sharey=True
    )
    axes[0, 0].set_yticks(range(len(names)), names)
    axes[0, 0].set_ylim(len(names) - 0.5, -0.5)
    for ax, (title, rows) in zip(axes[0], panels.items(), strict=True):
        for name, (values, (value, lower, upper)) in rows.items():
            place = names.index(name)
            ax.plot([lower, upper], [place, place], color=COMPONENT_COLOURS[0], linewidth=2.0)
            ax.plot(value, place, "o", color=COMPONENT_COLOURS[0], markersize=7)
            ax.plot(values, [place] * len(values), "|", color=DATA_COLOUR, markersize=11)
        ax.axvline(1.0, color=DATA_COLOUR, linewidth=0.8, linestyle=":")
        ax.set_xscale("log")
        first, last = ax.get_xlim()
        marked = (
            (1.0, 3.0) if last > _WIDE_AXIS * first else (1.0, 1.2, 1.5, 2.0, 3.0, 5.0, 7.0, 9.0)
        )
        ax.xaxis.set_major_locator(LogLocator(subs=marked))
        ax.xaxis.set_major_formatter(FormatStrFormatter("%g"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set_xlabel(title)
        ax.grid(True, axis="x", which="both", color="#dddddd", linewidth=0.6)
        ax.set_axisbelow(True)
        ax.tick_params(labelsize="small")
    return figure
