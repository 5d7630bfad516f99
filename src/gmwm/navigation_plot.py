"""Pictures of navigation from plain arrays: tracks, true errors with what a filter predicted.

Every function draws a figure of its own and returns it; none knows what it draws.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

from gmwm._typing import FloatArray
from gmwm.plot import COMPONENT_COLOURS, DATA_COLOUR, SUM_COLOUR

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DASHES: tuple[str | tuple[int, tuple[float, ...]], ...] = ("-", (0, (5, 1.5)), (0, (3, 1, 1, 1)),
                                                          (0, (1, 1)))  # fmt: skip
_PANEL = (3.4, 2.1)  # inches, of one panel among several
_BAND = "#9ecae1"
_T = TypeVar("_T")


def track(
    truth: FloatArray,
    outages: Sequence[FloatArray],
    solutions: Mapping[str, Sequence[FloatArray]],
) -> Figure:
    """A track with its outages, and what filters made of it.

    Parameters
    ----------
    truth : (n, 2) ndarray
        East and north, m.
    outages : sequence of (k, 2) ndarray
        The parts of the track without GNSS.
    solutions : mapping of str to sequence of (k, 2) ndarray
        Name -> estimated positions during each outage.
    """
    import matplotlib.pyplot as plt

    columns = 1 + min(len(outages), 2)
    figure, axes = plt.subplots(
        1, columns, figsize=(4.2 * columns, 4.2), layout="constrained", squeeze=False
    )
    whole = axes[0, 0]
    whole.plot(truth[:, 0], truth[:, 1], color=DATA_COLOUR, linewidth=0.9, label="truth")
    for i, part in enumerate(outages):
        label = "without GNSS" if i == 0 else None
        whole.plot(part[:, 0], part[:, 1], color=COMPONENT_COLOURS[1], linewidth=2.5, label=label)
    whole.set_title("whole track", fontsize="medium")
    for i, ax in enumerate(axes[0, 1:]):
        part = outages[i]
        ax.plot(part[:, 0], part[:, 1], color=SUM_COLOUR, linewidth=2.2, label="truth")
        for colour, dash, (name, paths) in _styles(solutions):
            path = paths[i]
            ax.plot(path[:, 0], path[:, 1], color=colour, linestyle=dash, linewidth=1.4, label=name)
            ax.plot(*path[-1], marker="o", color=colour, markersize=4)
        ax.set_title(f"outage {i + 1}" if len(outages) > 1 else "outage", fontsize="medium")
    for ax in axes[0]:
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel("east [m]")
        ax.set_ylabel("north [m]")
        _plain(ax)
        ax.legend(fontsize="small")
    return figure


def errors(
    panels: Mapping[str, tuple[FloatArray, FloatArray, FloatArray]],
    spans: Sequence[tuple[float, float]] = (),
    *,
    labels: Sequence[str] = ("east [m]", "north [m]", "vertical [m]"),
) -> Figure:
    """True errors of one run with the bands of 1 and 3 sigma that each filter predicted.

    Parameters
    ----------
    panels : mapping of str to (time, error, sd)
        Name -> times (K,), s; errors and predicted standard deviations (K, d).
    spans : sequence of (start, end)
        Outages, s.
    labels : sequence of str, optional
        Of the d components.
    """
    import matplotlib.pyplot as plt

    rows, columns = len(labels), len(panels)
    figure, axes = plt.subplots(
        rows, columns, figsize=(_PANEL[0] * columns + 0.6, _PANEL[1] * rows), sharex=True,
        sharey="row", layout="constrained", squeeze=False,
    )  # fmt: skip
    for column, (name, (time, error, sd)) in enumerate(panels.items()):
        for row, label in enumerate(labels):
            ax = axes[row, column]
            one, three = sd[:, row], 3.0 * sd[:, row]
            ax.fill_between(time, -three, three, color=_BAND, alpha=0.45, linewidth=0,
                            label="3 sigma predicted")  # fmt: skip
            ax.fill_between(time, -one, one, color=_BAND, alpha=0.9, linewidth=0,
                            label="1 sigma predicted")  # fmt: skip
            ax.plot(time, error[:, row], color=COMPONENT_COLOURS[1], linewidth=1.4, label="error")
            for start, end in spans:
                ax.axvline(start, color=DATA_COLOUR, linewidth=0.8, linestyle=":")
                ax.axvline(end, color=DATA_COLOUR, linewidth=0.8, linestyle=":")
            _plain(ax)
            if column == 0:
                ax.set_ylabel(label)
            if row == 0:
                ax.set_title(name, fontsize="medium")
            if row == rows - 1:
                ax.set_xlabel("time [s]")
    axes[0, 0].legend(fontsize="x-small", loc="upper left")
    return figure


def growth(
    panels: Mapping[str, Mapping[str, tuple[FloatArray, FloatArray, FloatArray]]],
    labels: Sequence[str] = ("horizontal [m]", "vertical [m]"),
) -> Figure:
    """Growth of errors in outages: root mean square over the runs, and what filters predicted.

    Parameters
    ----------
    panels : mapping of str to mapping of str to (time, rms, predicted)
        Outage -> filter -> times since the outage began (K,), s; root mean squares of the true
        errors and of the predicted ones, (K, d).
    labels : sequence of str, optional
        Of the d components.
    """
    import matplotlib.pyplot as plt

    rows, columns = len(labels), len(panels)
    figure, axes = plt.subplots(
        rows, columns, figsize=(max(4.6 * columns, 5.6), 2.9 * rows), layout="constrained",
        squeeze=False, sharex="col",
    )  # fmt: skip
    for column, (title, filters) in enumerate(panels.items()):
        for row, label in enumerate(labels):
            ax = axes[row, column]
            for colour, _, (name, (time, rms, predicted)) in _styles(filters):
                ax.plot(time, rms[:, row], color=colour, linewidth=1.7, label=name)
                ax.plot(time, predicted[:, row], color=colour, linewidth=1.2, linestyle=":")
            _plain(ax)
            ax.set_ylim(bottom=0.0)
            if column == 0:
                ax.set_ylabel(label)
            if row == 0:
                ax.set_title(title, fontsize="medium")
            if row == rows - 1:
                ax.set_xlabel("time since the outage began [s]")
    axes[0, 0].plot([], [], color=DATA_COLOUR, linestyle=":", label="predicted")
    axes[0, 0].legend(fontsize="small")
    return figure


def _styles(
    named: Mapping[str, _T],
) -> list[tuple[str, str | tuple[int, tuple[float, ...]], tuple[str, _T]]]:
    colours = [SUM_COLOUR if name == "truth" else "" for name in named]
    palette = iter(COMPONENT_COLOURS * (1 + len(named) // len(COMPONENT_COLOURS)))
    colours = [colour or next(palette) for colour in colours]
    dashes = [_DASHES[i % len(_DASHES)] for i in range(len(named))]
    return list(zip(colours, dashes, named.items(), strict=True))


def _plain(ax: Axes) -> None:
    ax.grid(True, color="#dddddd", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.tick_params(labelsize="small")
