"""Boxplots of the estimates, as in Figures 2 to 4 of the paper."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa

from gmwm import plotting
from gmwm._core.files import moved_into_place
from gmwm._core.typing import FloatArray
from gmwm.study.studies import Study


def boxplots(study: Study, table: pa.Table, stem: Path) -> list[Path]:
    """Draw one panel a quantity, one box a method; returns the PNG and the SVG.

    Parameters
    ----------
    study : Study
    table : pyarrow.Table
        As `gmwm.study.runs.run_study` gives it.
    stem : Path
        Where to, without suffix.
    """
    import matplotlib.pyplot as plt

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
    written = []
    for suffix in (".png", ".svg"):
        target = stem.with_suffix(suffix)
        with moved_into_place(target) as temporary:
            figure.savefig(temporary, format=suffix[1:], dpi=150)
        written.append(target)
    plt.close(figure)
    return written


def _finite(values: FloatArray) -> FloatArray:
    return values[np.isfinite(values)]
