"""The summary of a study's runs, and the paper's appendix A.

Straight lines in the Allan plot are inconsistent for sums: the Allan variance of white noise plus
random walk is ``sigma2_WN / tau + sigma2_RW (2 tau^2 + 1) / (6 tau)`` at dt = 1 s, but the method
fits a line to the first scales for the one and a line to the last for the other. Least squares on
fixed scales is linear in the unbiased Allan variances, so its expectation is exact and the same for
every length of record: more data do not bring the estimates closer to the truth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from gmwm import plotting
from gmwm._core.files import moved_into_place
from gmwm._core.runs import do_runs
from gmwm._core.text import bullets, plain_table
from gmwm._core.typing import FloatArray
from gmwm.estimate import cramer_rao, estimate
from gmwm.process import RandomWalk, WhiteNoise
from gmwm.study.studies import Study
from gmwm.variance import wavelet_variance

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
        legend = "; without: runs that have\nno estimate"
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
            "relative, bias: over the true value; bound: Cramer-Rao; moments: Cramer-Rao for\n"
            "estimates from Haar wavelet variances only; covers: share of the 95 % intervals\n"
            f"that hold the true value{legend}",
        ]
        return "\n".join(["\n\n".join(parts), *bullets(s.notes)])


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


def boxplots(study: Study, table: pa.Table, stem: Path) -> list[Path]:
    """Draw one panel a quantity, one box a method; returns the PNG and the SVG."""
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


TRUTH = WhiteNoise(0.2) + RandomWalk(0.02)
LENGTHS = (1_000, 10_000, 100_000, 1_000_000)
NAMES = ("sigma2_WN", "sigma2_RW")
METHODS = ("OLS", "IRLS", "GMWM")
"""Lines by least squares, the same reweighted by the covariance of the levels, and GMWM."""
_TRUE = np.array([0.04, 4e-4])
_SCALES = np.array([2.0**j for j in range(8)])
_ROUNDS = 3  # of reweighting
_FIRST = 4
"""Scales that white noise is read from; the others are the random walk's."""


@dataclass(frozen=True)
class Convergence:
    """What the runs at one length gave.

    estimates: (runs, 3, 2), by `METHODS`, of sigma2_WN and sigma2_RW.
    """

    n: int
    estimates: FloatArray

    @property
    def means(self) -> FloatArray:
        """Over the runs, (3, 2)."""
        return self.estimates.mean(axis=0)

    @property
    def errors(self) -> FloatArray:
        """Standard errors of the means, (3, 2)."""
        return self.estimates.std(axis=0, ddof=1) / np.sqrt(len(self.estimates))


def allan_least_squares(
    tau: FloatArray,
    allan_variance: FloatArray,
    k: int = _FIRST,
    covariance: FloatArray | None = None,
) -> FloatArray:
    """Least-squares lines through the first k scales and the others to 128 s, (2,).

    tau: (J,), averaging times 1, 2, 4, ... s, at least to 128 s.
    allan_variance: (J,).
    k: From 1 to 7.
    covariance: (J, J), of the levels, up to a factor, to weight them by; by default all are equal.
    """
    lines = (_SCALES[:k], 1.0 / _SCALES[:k]), (_SCALES[k:], _SCALES[k:] / 3.0)
    found = []
    for own, shape in lines:
        there, weighted = np.isin(tau, own), shape
        if covariance is not None:
            weighted = np.asarray(np.linalg.solve(covariance[np.ix_(there, there)], shape))
        found.append(weighted @ allan_variance[there] / (weighted @ shape))
    return np.array(found)


def expectation(k: int = _FIRST) -> FloatArray:
    """Expected value of `allan_least_squares` under `TRUTH`, whatever the length, (2,)."""
    return allan_least_squares(_SCALES, 2.0 * TRUTH.haar_variance(_SCALES, 1.0), k)


def converge(runs: int, seed: int, jobs: int = 1) -> list[Convergence]:
    """Monte Carlo for growing length, Allan lines and GMWM on the same series."""
    return [
        Convergence(n, do_runs(partial(_one_run, n, seed), runs, {}, jobs=jobs)["estimates"])
        for n in LENGTHS
    ]


def raw_estimates(rows: list[Convergence]) -> pa.Table:
    """A row for each length, run and method."""
    index = [
        (row.n, run, method, *row.estimates[run, k].tolist())
        for row in rows
        for run in range(len(row.estimates))
        for k, method in enumerate(METHODS)
    ]
    columns = zip(*index, strict=True)
    return pa.table(dict(zip(("n", "run", "method", *NAMES), map(list, columns), strict=True)))


def convergence_boxes(rows: list[Convergence]) -> Figure:
    """The estimates of growing length, a box each; the truth is dashed."""
    panels = {
        f"{name}: {method}": {f"{row.n:,}": row.estimates[:, m, k] for row in rows}
        for k, name in enumerate(NAMES)
        for m, method in enumerate(METHODS)
    }
    truths = {title: _TRUE[NAMES.index(title.partition(":")[0])] for title in panels}
    title = "Appendix A: white noise + random walk, by length (dashed: truth)"
    return plotting.boxes(panels, truths, title=title)


def _one_run(n: int, seed: int, run: int) -> dict[str, FloatArray]:
    """All estimates of both parameters, (3, 2)."""
    series = TRUTH.simulate(n, 1.0, np.random.default_rng([seed, n, run]))
    wv = wavelet_variance(series, 1.0)
    params = estimate(TRUTH.opened(), wv).params
    lines = irls = allan_least_squares(wv.tau, wv.allan_variance)
    for _ in range(_ROUNDS):  # weights of the model that the lines give
        white, walk = np.sqrt(np.maximum(irls, np.finfo(float).tiny))
        model = WhiteNoise(float(white)) + RandomWalk(float(walk))
        covariance = wv.covariance_under(model.psd)
        irls = allan_least_squares(wv.tau, wv.allan_variance, covariance=covariance)
    return {"estimates": np.array([lines, irls, [params["N"] ** 2, params["K"] ** 2]])}


def convergence_table(rows: list[Convergence]) -> str:
    """The table, 80 columns wide."""
    parts = [
        "Appendix A: least squares on the Allan variance of white noise + random walk\n"
        "lines over 1-8 s and 16-128 s, equal weights (OLS) or reweighted (IRLS)\n"
        f"means of {len(rows[0].estimates)} runs with standard errors",
    ]
    for k, name in enumerate(NAMES):
        cells = [
            [
                f"{row.n:,}",
                *(
                    f"{m:.5g} +- {e:.2g}"
                    for m, e in zip(row.means[:, k], row.errors[:, k], strict=True)
                ),
            ]
            for row in rows
        ]
        table = plain_table(("n", *(f"{method}, mean" for method in METHODS)), cells)
        parts.append(f"{name}, truth {_TRUE[k]:g}, OLS expectation {expectation()[k]:.5g}\n{table}")
    ratios = [(k, *(expectation(k) / _TRUE)) for k in range(1, _SCALES.size)]
    table = plain_table(("k", *NAMES), [[f"{value:.4g}" for value in row] for row in ratios])
    parts.append(f"Expected over true value; white noise from the first k scales\n{table}")
    return "\n\n".join(parts)
