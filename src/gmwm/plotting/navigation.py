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
_PANEL = (3.4, 2.1)  # inches, of one panel among several
_BESIDE = 3  # panels in a row
_COMPONENTS = ("north", "east", "down")
_BAND = "#9ecae1"
_TRUE = "true track"
_WIDEST_TITLE = 30  # characters over a panel
_IN_LEGEND = 24
_DENSE = 3000  # points, beyond which an image of them is smaller than they are
_PREDICTED_SHOWN = 2.0  # of the largest true error: a prediction far above it leaves the view
_T = TypeVar("_T")


def track(
    truth: FloatArray, outages: Sequence[FloatArray], solutions: Mapping[str, Sequence[FloatArray]]
) -> Figure:
    """A track with its outages, and what filters made of it.

    truth: (n, 2), east and north, m.
    outages: The parts of the track without GNSS.
    solutions: Name -> estimated positions during each outage.
    """
    columns = 1 + min(len(outages), 2)
    figure, axes = _panels(1, columns, (4.2 * columns, 4.2))
    whole = axes[0, 0]
    whole.plot(*truth.T, color=DATA_COLOUR, linewidth=0.9, label=_TRUE)
    for i, part in enumerate(outages):
        label = "without GNSS" if i == 0 else None
        whole.plot(*part.T, color=COMPONENT_COLOURS[1], linewidth=2.5, label=label)
    whole.set_title("whole track", fontsize="medium")
    for i, ax in enumerate(axes[0, 1:]):
        part = outages[i]
        ax.plot(*part.T, color=_BAND, linewidth=5.0, label=_TRUE)
        for colour, dash, (name, paths) in _styles(solutions):
            path = paths[i]
            label = literal(name, _IN_LEGEND)
            ax.plot(*path.T, color=colour, linestyle=dash, linewidth=1.4, label=label)
            ax.plot(*path[-1:].T, marker="o", color=colour, markersize=4)
        ax.set_title(f"outage {i + 1}" if len(outages) > 1 else "outage", fontsize="medium")
    for ax in axes[0]:
        _map(ax)
        # Below: solutions run from corner to corner.
        ax.legend(fontsize="x-small", loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3)
    return figure


def errors(
    panels: Mapping[str, tuple[FloatArray, FloatArray, FloatArray]],
    spans: Sequence[tuple[float, float]] = (),
    *,
    labels: Sequence[str] = ("east [m]", "north [m]", "vertical [m]"),
) -> Figure:
    """True errors of one run with the bands of 1 and 3 sigma that each filter predicted.

    panels: Name -> times (K,), s; errors and predicted standard deviations (K, d).
    spans: Outages, s.
    labels: Of the d components.
    """
    d = len(labels)
    blocks = -(-len(panels) // _BESIDE)
    columns = -(-len(panels) // blocks)
    size = _PANEL[0] * columns + 0.6, _PANEL[1] * blocks * d
    figure, axes = _panels(blocks * d, columns, size, sharex=True)
    top = _largest(panels)
    for place, (name, (time, error, sd)) in enumerate(panels.items()):
        first, column = d * (place // columns), place % columns
        for row, label in enumerate(labels):
            ax = axes[first + row, column]
            _draw_bands(ax, time, sd[:, row], "predicted")
            ax.plot(time, error[:, row], color=COMPONENT_COLOURS[1], linewidth=1.4, label="error")
            for end in (end for span in spans for end in span):
                ax.axvline(end, color=DATA_COLOUR, linewidth=0.8, linestyle=":")
            _plain(ax)
            if np.isfinite(top[row]) and top[row] > 0.0:
                ax.set_ylim(-top[row], top[row])
            if column == 0:
                ax.set_ylabel(label)
        axes[first, column].set_title(literal(name, _WIDEST_TITLE), fontsize="medium")
        axes[first + d - 1, column].set_xlabel("time [s]")
        axes[first + d - 1, column].tick_params(labelbottom=True)
    for ax in axes[-d:, (len(panels) - 1) % columns + 1 :].flat:
        ax.set_axis_off()
    _legend_above(figure, axes[0, 0])
    return figure


def _draw_bands(
    ax: Axes, time: FloatArray, sd: FloatArray, what: str, rasterized: bool = False
) -> None:
    for factor, alpha in ((3.0, 0.45), (1.0, 0.9)):
        band = ax.fill_between(time, -factor * sd, factor * sd, color=_BAND, linewidth=0)
        band.set(alpha=alpha, label=f"{factor:g} sigma {what}", rasterized=rasterized)


def growth(
    panels: Mapping[str, Mapping[str, tuple[FloatArray, FloatArray, FloatArray]]],
    labels: Sequence[str] = ("horizontal [m]", "vertical [m]"),
) -> Figure:
    """Growth of errors in outages: root mean square over the runs, and what filters predicted.

    panels: Outage -> filter -> times since the outage began (K,), s; root mean squares of the true
        errors and of the predicted ones, (K, d).
    labels: Of the d components.
    """
    rows, columns = len(labels), len(panels)
    size = max(4.6 * columns, 5.6), 2.9 * rows
    figure, axes = _panels(rows, columns, size, sharex="col")
    for column, (title, filters) in enumerate(panels.items()):
        for row, quantity in enumerate(labels):
            ax = axes[row, column]
            for behind, (colour, _, (name, (time, rms, predicted))) in zip(
                reversed(range(len(filters))), _styles(filters), strict=True
            ):
                # Wider the farther behind: filters that err alike are all seen.
                width, label = 1.4 + 0.9 * behind, literal(name, _IN_LEGEND)
                ax.plot(time, rms[:, row], color=colour, linewidth=width, label=label)
                ax.plot(time, predicted[:, row], color=colour, linewidth=1.2, linestyle=":")
            _plain(ax)
            true = [each[1][:, row] for each in filters.values()]
            most = max((float(np.nanmax(each, initial=0.0)) for each in true), default=0.0)
            ax.set_ylim(bottom=0.0)
            if most > 0.0:
                ax.set_ylim(top=min(ax.get_ylim()[1], 1.1 * _PREDICTED_SHOWN * most))
            if column == 0:
                ax.set_ylabel(quantity)
        axes[0, column].set_title(title, fontsize="medium")
        axes[-1, column].set_xlabel("time since the outage began [s]")
    axes[0, 0].plot([], [], color=DATA_COLOUR, linestyle=":", label="predicted")
    _legend_above(figure, axes[0, 0])
    return figure


def _panels(rows: int, columns: int, size: tuple[float, float], **options: Any) -> Any:
    """A figure of a size in inches and its axes, (rows, columns)."""
    import matplotlib.pyplot as plt

    return plt.subplots(rows, columns, figsize=size, layout="constrained", squeeze=False, **options)


def literal(text: str, longest: int = 200) -> str:
    """A name as a figure shows it: not as a formula, not too long, and not left out of legends."""
    shown = text if len(text) <= longest else text[: longest - 1] + "\N{HORIZONTAL ELLIPSIS}"
    # Matplotlib takes what is between dollars for a formula, and hides labels that begin with _.
    return (" " if shown.startswith("_") else "") + shown.replace("$", r"\$")


def _largest(panels: Mapping[str, tuple[FloatArray, FloatArray, FloatArray]]) -> FloatArray:
    """Ends of the axes of errors: all errors, and the narrowest of the bands, are in view."""
    peaks = [np.max(np.abs(e), axis=0, initial=0.0) for _, e, _ in panels.values()]
    bands = [np.max(3.0 * sd, axis=0, initial=0.0) for _, _, sd in panels.values()]
    top = np.maximum(np.max(peaks, axis=0), np.min(bands, axis=0))
    return np.asarray(1.1 * top, dtype=float)


def _styles(
    named: Mapping[str, _T],
) -> list[tuple[str, str | tuple[int, tuple[float, ...]], tuple[str, _T]]]:
    colours = [SUM_COLOUR if name == "truth" else "" for name in named]
    palette = iter(COMPONENT_COLOURS * (1 + len(named) // len(COMPONENT_COLOURS)))
    colours = [colour or next(palette) for colour in colours]
    dashes = [_DASHES[i % len(_DASHES)] for i in range(len(named))]
    return list(zip(colours, dashes, named.items(), strict=True))


def _map(ax: Axes) -> None:
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("east [m]")
    ax.set_ylabel("north [m]")
    _plain(ax)


def _legend_above(figure: Figure, ax: Axes, title: str | None = None) -> None:
    """Of one panel, where it hides none."""
    handles, labels = ax.get_legend_handles_labels()
    style: dict[str, Any] = {"fontsize": "x-small", "title_fontsize": "x-small", "ncols": 4}
    figure.legend(handles, labels, title=title, loc="outside upper center", **style)


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
    _legend_above(figure, ax)
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
    _legend_above(figure, axes[0, 0])
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
    _legend_above(figure, axes[0], "points: errors; lines: RMS as predicted")
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
