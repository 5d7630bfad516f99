"""Boxplots of the estimates, as in Figures 2 to 4 of the paper."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from gmwm import plotting
from gmwm._core.files import moved_into_place
from gmwm._core.typing import FloatArray
from gmwm.study.studies import Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def boxplots(study: Study, table: pa.Table, stem: Path) -> list[Path]:
    """Draw one panel a quantity, one box a method; returns the PNG and the SVG.

    table: As `gmwm.study.runs.run_study` gives it.
    stem: Where to, without suffix.
    """
    names = np.array(table["method"].to_pylist())
    methods = [m for m in study.methods if m in set(names)]
    panels = {
        quantity.name: {
            method: _finite(table[quantity.name].to_numpy()[names == method]) for method in methods
        }
        for quantity in study.quantities
    }
    truths = {quantity.name: study.true_value(quantity) for quantity in study.quantities}
    figure = plotting.boxes(panels, truths, title=f"{study.title} (dashed: truth)")
    return saved(figure, stem)


def saved(figure: Figure, stem: Path) -> list[Path]:
    """Write a figure as PNG and SVG; it is closed."""
    import matplotlib.pyplot as plt

    paths = [stem.with_suffix(suffix) for suffix in (".png", ".svg")]
    for path in paths:
        with moved_into_place(path) as temporary:
            figure.savefig(temporary, format=path.suffix[1:], dpi=150)
    plt.close(figure)
    return paths


def _finite(values: FloatArray) -> FloatArray:
    return values[np.isfinite(values)]
