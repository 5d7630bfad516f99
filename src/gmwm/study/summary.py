"""The summary of a study's runs: errors against the truth, the bound and the paper; boxplots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from gmwm import plotting
from gmwm._core.files import moved_into_place
from gmwm._core.tables import plain_table
from gmwm._core.text import bullets
from gmwm.estimate import cramer_rao
from gmwm.study.studies import Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Score:
    """One method on one quantity.

    rmse: Root mean square error of the runs with an estimate.
    relative: The same over the true value.
    bias: Mean error over the true value.
    ratio: ``relative`` over the Cramer-Rao bound.
    moment_ratio: ``relative`` over the bound of estimators by wavelet variances.
    coverage: Fraction of the runs whose 95 % interval holds the truth.
    missing: Runs without an estimate.
    published: Relative error in the paper, NaN where there is none.
    """

    rmse: float
    relative: float
    bias: float
    ratio: float
    moment_ratio: float
    coverage: float
    missing: int
    published: float


@dataclass(frozen=True)
class Summary:
    """All methods on all quantities of a study.

    scores: (quantity, method) -> Score.
    bounds: Quantity -> relative Cramer-Rao bound.
    moment_bounds: Quantity -> that of estimates by the wavelet variances only.
    invalid: Method -> runs that the method itself calls not valid.
    from_grid: Method -> runs in which the starting values did not lead to the minimum.
    seconds: Method -> median time of an estimate, s.
    """

    study: Study
    runs: int
    seed: int
    scores: Mapping[tuple[str, str], Score]
    bounds: Mapping[str, float]
    moment_bounds: Mapping[str, float]
    invalid: Mapping[str, int]
    from_grid: Mapping[str, int]
    seconds: Mapping[str, float]

    @property
    def methods(self) -> list[str]:
        """Methods in the order of the study."""
        return [m for m in self.study.methods if m in self.invalid]

    def __str__(self) -> str:
        s, rows = self.study, []
        for quantity in s.quantities:
            name = quantity.name
            rows += [_cells(name, method, self.scores[name, method]) for method in self.methods]
            for label, bounds in (("bound", self.bounds), ("moments", self.moment_bounds)):
                bound, absolute = bounds[name], bounds[name] * abs(s.true_value(quantity))
                ratio = f"{bound / self.bounds[name]:.2f}"
                rows.append([name, label, f"{absolute:.3g}", f"{bound:.3g}", ratio, *[""] * 4])
        columns = ["RMSE", "relative", "/ bound", "bias", "covers", "paper", "without"]
        legend = "; without: runs\nthat have no estimate"
        if not any(row[-1] for row in rows):
            columns, rows, legend = columns[:-1], [row[:-1] for row in rows], ""
        heads, counts = ["not valid"], [self.invalid]
        if any(self.from_grid.values()):
            heads, counts = [*heads, "from grid"], [*counts, self.from_grid]
        times = [
            [m, *(f"{count[m]:,}" for count in counts), f"{self.seconds[m]:.2g} s"]
            for m in self.methods
        ]
        parts = [
            f"{s.title}\n{self.runs:,} runs of {s.n:,} samples at {1.0 / s.dt:g} Hz, "
            f"seed {self.seed}",
            plain_table(("quantity", "method", *columns), rows),
            plain_table(("method", *heads, "median time"), times),
            "relative, bias: over the true value; bound: Cramer-Rao; moments: the same for\n"
            f"estimates by Haar wavelet variances only; covers: 95 % intervals{legend}",
        ]
        return "\n".join(["\n\n".join(parts), *bullets(s.notes)])

    def markdown(self) -> str:
        """The table in the layout of the paper: RMSE (relative RMSE), methods side by side."""
        rows = []
        for quantity in self.study.quantities:
            name, truth = quantity.name, abs(self.study.true_value(quantity))
            scores = [self.scores[name, method] for method in self.methods]
            bound = _cell(truth, self.bounds[name])
            rows.append([name, *(_cell(truth, x.relative) for x in scores), bound])
            if quantity.published:
                paper = [_cell(truth, x.published) for x in scores]
                rows.append([f"{name}, paper", *paper, ""])
        return markdown_table(["", *self.methods, "Cramer-Rao bound"], rows)


def summarise(study: Study, table: pa.Table, seed: int) -> Summary:
    """Scores of all methods in ``table``, as `run_study` gives it."""
    bound = cramer_rao(study.truth, study.n, study.dt)
    names = np.array(table["method"].to_pylist())
    methods = [m for m in study.methods if m in set(names)]
    scores, bounds, moment_bounds = {}, {}, {}
    for quantity in study.quantities:
        name, value = quantity.name, study.true_value(quantity)
        factor = abs(quantity.power / (study.truth.params[quantity.key] or 1.0))
        bounds[name] = bound.stderr[quantity.key] * factor
        moment_bounds[name] = bound.wavelet_stderr[quantity.key] * factor
        estimate, low, high = (table[name + end].to_numpy() for end in ("", "_lower", "_upper"))
        for method in methods:
            own = names == method
            there = own & np.isfinite(estimate)
            error = estimate[there] / value - 1.0
            inside = (low[there] <= value) & (value <= high[there])
            inside = inside[~np.isnan(low[there])]
            with np.errstate(invalid="ignore"):  # no run has an estimate, or an interval
                relative, bias, coverage = (
                    float(np.divide(np.sum(each), each.size)) for each in (error**2, error, inside)
                )
            relative **= 0.5
            scores[name, method] = Score(
                rmse=relative * abs(value),
                relative=relative,
                bias=bias,
                ratio=relative / bounds[name],
                moment_ratio=relative / moment_bounds[name],
                coverage=coverage,
                missing=int(np.sum(own) - np.sum(there)),
                published=quantity.published.get(method, float("nan")),
            )
    valid, from_grid = (np.array(table[name].to_pylist()) for name in ("valid", "from_grid"))
    seconds = table["seconds"].to_numpy()
    return Summary(
        study=study,
        runs=len(set(table["run"].to_pylist())),
        seed=seed,
        scores=scores,
        bounds=bounds,
        moment_bounds=moment_bounds,
        invalid={m: int(np.sum(~valid[names == m])) for m in methods},
        from_grid={m: int(np.sum(from_grid[names == m])) for m in methods},
        seconds={m: float(np.median(seconds[names == m])) for m in methods},
    )


def _cells(name: str, method: str, x: Score) -> list[str]:
    paper = "" if np.isnan(x.published) else f"{x.published:.3g}"
    bias = round(x.bias, 3) + 0.0  # no minus before a zero
    errors = [f"{x.rmse:.3g}", f"{x.relative:.3g}", f"{x.ratio:.2f}"]
    shares = [f"{bias:.1%}", "" if np.isnan(x.coverage) else f"{x.coverage:.1%}"]
    return [name, method, *errors, *shares, paper, str(x.missing or "")]


def _cell(truth: float, relative: float) -> str:
    return "-" if np.isnan(relative) else f"{relative * truth:.3g} ({relative:.3g})"


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table for a page in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def boxplots(study: Study, table: pa.Table, stem: Path) -> list[Path]:
    """Draw one panel a quantity, one box a method; returns the PNG and the SVG.

    table: As `run_study` gives it.
    stem: Where to, without suffix.
    """
    names = np.array(table["method"].to_pylist())
    methods = [m for m in study.methods if m in set(names)]
    panels = {}
    for quantity in study.quantities:
        values = table[quantity.name].to_numpy()
        known = np.isfinite(values)
        panels[quantity.name] = {each: values[known & (names == each)] for each in methods}
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
