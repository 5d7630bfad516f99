"""Pictures of ratios to one, with their intervals, from plain numbers and labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from gmwm._core.typing import FloatArray
from gmwm.plotting.deviation import COMPONENT_COLOURS, DATA_COLOUR

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDE = 8.0  # last over first value of an axis with few marks


def intervals(
    panels: Mapping[
        str, Mapping[str, tuple[Sequence[float] | FloatArray, tuple[float, float, float]]]
    ],
) -> Figure:
    """Values that are 1 where nothing is wrong, on a logarithmic axis.

    panels: Title -> row -> single values, and the one over all of them with its interval.
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
        marked = (1.0, 3.0) if last > _WIDE * first else (1.0, 1.2, 1.5, 2.0, 3.0, 5.0, 7.0, 9.0)
        ax.xaxis.set_major_locator(LogLocator(subs=marked))
        ax.xaxis.set_major_formatter(FormatStrFormatter("%g"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set_title(title, fontsize="medium")
        ax.grid(True, axis="x", which="both", color="#dddddd", linewidth=0.6)
        ax.set_axisbelow(True)
        ax.tick_params(labelsize="small")
    return figure
