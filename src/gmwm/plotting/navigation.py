"""Pictures of navigation from plain arrays: tracks, true errors with what a filter predicted.

Every function draws a figure of its own and returns it; none knows what it draws.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.plotting.deviation import COMPONENT_COLOURS, DATA_COLOUR, SUM_COLOUR

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (3, 1, 1, 1)), (0, (1, 1)))
_MARKERS = "osD^vX"
_MARKS = 6  # along a line
_PREDICTED = (0, (4, 2))
_PANEL = (3.4, 2.1)  # inches, of one panel among several
_BESIDE = 4  # panels in a row
_COMPONENTS = ("north", "east", "down")
_BAND = "#9ecae1"
_TRUE = "true track"
_IN_LEGEND = 24
_LEGEND_HANDLE, _LEGEND_LETTER = 0.45, 0.065  # inches, of an entry and of a character
_DENSE = 3000  # points, beyond which an image of them is smaller than they are
_PREDICTED_SHOWN = 2.0  # of the largest true error: a prediction far above it leaves the view
_T = TypeVar("_T")


def track(
    truth: FloatArray,
    outages: Mapping[str, FloatArray],
    solutions: Mapping[str, Sequence[FloatArray]],
) -> Figure:
    """A track with its outages, and what filters made of it.

    truth: (n, 2), east and north, m.
    outages: Title -> part of the track without GNSS.
    solutions: Name -> estimated positions during each outage.
    """
    count = 1 + len(outages)
    columns = min(count, _BESIDE)
    rows = -(-count // columns)
    figure, axes = _panels(rows, columns, (4.2 * columns, 4.0 * rows + 0.4))
    whole, *parts = axes.flat
    (line,) = whole.plot(*truth.T, color=DATA_COLOUR, linewidth=0.9)
    for part in outages.values():
        whole.plot(*part.T, color=COMPONENT_COLOURS[1], linewidth=2.5, label="without GNSS")
    whole.set_title("whole track", fontsize="medium")
    shown = [line, *whole.get_lines()[1:2]]
    names = [_TRUE, "without GNSS"][: len(shown)]
    for i, (ax, (title, part)) in enumerate(zip(parts, outages.items(), strict=False)):
        (band,) = ax.plot(*part.T, color=_BAND, linewidth=5.0)
        lines = []
        for style, (_, paths) in _styles(solutions):
            lines += ax.plot(*paths[i].T, **style, linewidth=1.4, markevery=slice(-1, None))
        ax.set_title(title, fontsize="medium")
        if i == 0:
            shown += [band, *lines]
            names += [f"{_TRUE} of an outage", *(literal(name, _IN_LEGEND) for name in solutions)]
    for ax in (whole, *parts[: len(outages)]):
        _map(ax)
    for ax in parts[len(outages) :]:
        ax.set_axis_off()
    _legend_above(figure, shown, names)
    return figure


def errors(
    panels: Mapping[str, tuple[FloatArray, FloatArray, FloatArray]],
    spans: Sequence[tuple[float, float]] = (),
    *,
    title: str = "",
    labels: Sequence[str] = ("east error [m]", "north error [m]", "vertical error [m]"),
) -> Figure:
    """True errors of one run beside what each filter predicted, a panel a component.

    panels: Name -> times (K,), s; errors and predicted standard deviations (K, d).
    """
    figure, axes = _panels(len(labels), 1, (7.6, 2.6 * len(labels) + 0.5), sharex=True)
    for row, (ax, label) in enumerate(zip(axes[:, 0], labels, strict=True)):
        for style, (name, (time, error, sd)) in _styles(panels):
            every = _marked(time.size)
            shown = literal(name, _IN_LEGEND)
            ax.plot(time, error[:, row], **style, linewidth=1.7, markevery=every, label=shown)
            for sign in (-1.0, 1.0):
                predicted = ax.plot(time, sign * sd[:, row], **style, linewidth=0.9)[0]
                predicted.set(markerfacecolor="w", markevery=every, linestyle=_PREDICTED)
        for end in (end for span in spans for end in span):
            ax.axvline(end, color=DATA_COLOUR, linewidth=0.8, linestyle=":")
        _plain(ax)
        peaks = [float(np.max(np.abs(e[:, row]), initial=0.0)) for _, e, _ in panels.values()]
        sds = [float(np.max(sd[:, row], initial=0.0)) for _, _, sd in panels.values()]
        top = 1.1 * max(*peaks, min(sds), _PREDICTED_SHOWN * min(peaks))
        if 0.0 < top < np.inf:
            ax.set_ylim(-top, top)
        ax.set_ylabel(label)
    axes[0, 0].set_title(title, fontsize="medium")
    axes[-1, 0].set_xlabel("time [s]")
    _legend_of_errors(figure, axes[0, 0], "1 sigma predicted")
    return figure


def _draw_bands(
    ax: Axes, time: FloatArray, sd: FloatArray, what: str, rasterized: bool = False
) -> None:
    for factor, alpha in ((3.0, 0.45), (1.0, 0.9)):
        band = ax.fill_between(time, -factor * sd, factor * sd, color=_BAND, linewidth=0)
        band.set(alpha=alpha, label=f"{factor:g} sigma {what}", rasterized=rasterized)


def growth(
    panels: Mapping[str, Mapping[str, tuple[FloatArray, FloatArray, FloatArray]]],
    runs: int,
    labels: Sequence[str] = ("horizontal", "vertical"),
) -> Figure:
    """Growth of errors in outages: root mean square over the runs, and what filters predicted.

    panels: Outage -> filter -> times since the outage began (K,), s; root mean squares of the true
        errors and of the predicted ones, (K, d).
    """
    rows, columns = len(labels), len(panels)
    size = max(4.6 * columns, 7.0), 2.9 * rows + 0.3
    figure, axes = _panels(rows, columns, size, sharex="col")
    what = f"RMS of {runs} runs" if runs > 1 else "error of one run"
    for column, (title, filters) in enumerate(panels.items()):
        for row, quantity in enumerate(labels):
            ax = axes[row, column]
            for style, (name, (time, rms, predicted)) in _styles(filters):
                every, label = _marked(time.size), literal(name, _IN_LEGEND)
                ax.plot(time, rms[:, row], **style, linewidth=1.7, markevery=every, label=label)
                dashed = ax.plot(time, predicted[:, row], **style, linewidth=0.9)[0]
                dashed.set(markerfacecolor="w", markevery=every, linestyle=_PREDICTED)
            _plain(ax)
            true = [each[1][:, row] for each in filters.values()]
            most = max((float(np.nanmax(each, initial=0.0)) for each in true), default=0.0)
            ax.set_ylim(bottom=0.0)
            if most > 0.0:
                ax.set_ylim(top=min(ax.get_ylim()[1], 1.1 * _PREDICTED_SHOWN * most))
            if column == 0:
                ax.set_ylabel(f"{quantity} [m], {what}")
        axes[0, column].set_title(title, fontsize="medium")
        axes[-1, column].set_xlabel("time since the outage began [s]")
    _legend_of_errors(figure, axes[0, 0], "predicted")
    return figure


def _marked(size: int) -> slice:
    """A few markers along a line, the last one at its end."""
    return slice(None, None, -max(size // _MARKS, 1))


def _panels(rows: int, columns: int, size: tuple[float, float], **options: Any) -> Any:
    """A figure of a size in inches and its axes, (rows, columns)."""
    import matplotlib.pyplot as plt

    return plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False, **options)


def literal(text: str, longest: int = 200) -> str:
    """A name as a figure shows it: not as a formula, not too long, and not left out of legends."""
    shown = text if len(text) <= longest else text[: longest - 1] + "\N{HORIZONTAL ELLIPSIS}"
    # Matplotlib takes what is between dollars for a formula, and hides labels that begin with _.
    return (" " if shown.startswith("_") else "") + shown.replace("$", r"\$")


def _styles(named: Mapping[str, _T]) -> list[tuple[dict[str, Any], tuple[str, _T]]]:
    """Colour, marker and marker size of each, distinct in grey too: the later the smaller."""
    colours = [SUM_COLOUR if name == "truth" else "" for name in named]
    palette = iter(COMPONENT_COLOURS * (1 + len(named) // len(COMPONENT_COLOURS)))
    styles = [
        {
            "color": colour or next(palette),
            "marker": _MARKERS[i % len(_MARKERS)],
            "markersize": max(7.0 - 1.2 * i, 3.0),
        }
        for i, colour in enumerate(colours)
    ]
    return list(zip(styles, named.items(), strict=True))


def _map(ax: Axes) -> None:
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("east [m]")
    ax.set_ylabel("north [m]")
    _plain(ax)


def _legend_above(
    figure: Figure, handles: Sequence[Any], labels: Sequence[str], title: str | None = None
) -> None:
    """In one row where it hides no panel; in more where it is wider than the figure."""
    width = sum(_LEGEND_HANDLE + _LEGEND_LETTER * len(label) for label in labels)
    rows = -(-width // figure.get_figwidth())
    style: dict[str, Any] = {"fontsize": "x-small", "title_fontsize": "x-small"}
    style["ncols"] = max(-(-len(labels) // int(rows or 1)), 1)
    figure.legend(handles, labels, title=title, loc="outside upper center", **style)


def _legend_of_errors(figure: Figure, ax: Axes, predicted: str) -> None:
    """Legend of the errors, and of the dashed predictions."""
    style: dict[str, Any] = {"color": DATA_COLOUR, "marker": "o", "markerfacecolor": "w"}
    ax.plot([], [], linestyle=_PREDICTED, linewidth=0.9, label=predicted, **style)
    _legend_above(figure, *ax.get_legend_handles_labels())


def _plain(ax: Axes) -> None:
    ax.grid(True, color="#dddddd", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.tick_params(labelsize="small")


def measured_track(track: FloatArray, fixes: FloatArray, without: FloatArray) -> Figure:
    """An estimated track, the fixes that it rests on, and its part without fixes.

    track: (n, 2), east and north, m.
    fixes: (k, 2).
    without: (j, 2), part of the track.
    """
    figure, axes = _panels(1, 1, (6.4, 5.2))
    ax = axes[0, 0]
    (points,) = ax.plot(*fixes.T, ".", color=DATA_COLOUR, markersize=3, label="fixes")
    label = "longest time without fixes"
    ax.plot(*without.T, color=COMPONENT_COLOURS[1], linewidth=3.5, label=label)
    (line,) = ax.plot(*track.T, color=COMPONENT_COLOURS[0], linewidth=1.1, label="solution")
    points.set_rasterized(len(fixes) > _DENSE)
    line.set_rasterized(len(track) > _DENSE)
    _map(ax)
    _legend_above(figure, *ax.get_legend_handles_labels())
    return figure


def innovations(panels: Mapping[str, tuple[FloatArray, FloatArray, FloatArray]]) -> Figure:
    """Innovations of three components with the bands of 1 and 3 sigma that a filter expected.

    panels: Kind with its unit -> times (K,), s; innovations and expected standard deviations (K,
        3).
    """
    size = 1.4 * _PANEL[0] * len(panels) + 0.6, 3.0 * _PANEL[1]
    figure, axes = _panels(3, len(panels), size, sharex=True)
    dots = {"color": COMPONENT_COLOURS[1], "markersize": 3, "label": "innovation"}
    for column, (title, (time, value, sd)) in enumerate(panels.items()):
        for row, label in enumerate(_COMPONENTS):
            ax = axes[row, column]
            _draw_bands(ax, time, sd[:, row], "expected", rasterized=time.size > _DENSE)
            ax.plot(time, value[:, row], ".", rasterized=time.size > _DENSE, **dots)
            _plain(ax)
            if column == 0:
                ax.set_ylabel(label)
        axes[0, column].set_title(title, fontsize="medium")
        axes[2, column].set_xlabel("time [s]")
    _legend_above(figure, *axes[0, 0].get_legend_handles_labels())
    return figure


def outages_compared(
    time: FloatArray,
    panels: Mapping[str, Mapping[str, tuple[FloatArray, float]]],
    ratios: Mapping[str, tuple[float, float, float]],
) -> Figure:
    """Errors at the end of each outage, model by model, and their ratios.

    time: (K,), ends of the outages, s.
    panels: Quantity with its unit -> name -> errors, and their root mean square as predicted.
    ratios: What is compared with what -> ratio of the errors, lower and upper end of its interval.
    """
    count, last = len(panels), 0.4 + 0.25 * len(ratios)
    size = 7.4, 2.1 * count + 0.5 + last
    figure, grid = _panels(count + 1, 1, size, height_ratios=[2.0] * count + [last])
    axes = grid[:, 0]
    for ax, (title, solutions) in zip(axes, panels.items(), strict=False):
        for i, (name, (error, predicted)) in enumerate(solutions.items()):
            colour = COMPONENT_COLOURS[i % len(COMPONENT_COLOURS)]
            marker = "osD^"[i % 4]
            ax.plot(time / 60.0, error, marker, color=colour, markersize=3.5, label=literal(name))
            ax.axhline(predicted, color=colour, linestyle=_DASHES[i % len(_DASHES)], linewidth=1.1)
        ax.set_ylim(bottom=0.0)
        ax.set_ylabel(title)
        _plain(ax)
    handles, names = axes[0].get_legend_handles_labels()
    _legend_above(figure, handles, names, "points: errors; lines: RMS as predicted")
    axes[count - 1].set_xlabel("end of the outage [min]")
    ax = axes[count]
    for row, (ratio, lower, upper) in enumerate(ratios.values()):
        ax.plot([lower, upper], [row, row], color=DATA_COLOUR, linewidth=1.6)
        ax.plot([ratio], [row], "o", color=DATA_COLOUR, markersize=5)
    ax.axvline(1.0, color=SUM_COLOUR, linewidth=0.9)
    ax.set_yticks(range(len(ratios)), [literal(name) for name in ratios])
    ax.set_ylim(len(ratios) - 0.5, -0.5)
    ax.set_xlabel("ratio of errors, 95 %")
    _plain(ax)
    return figure
