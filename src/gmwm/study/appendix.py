"""Appendix A of the paper: straight lines in the Allan plot are inconsistent for sums.

The Allan variance of white noise plus random walk is ``sigma2_WN / tau + sigma2_RW (2 tau^2 + 1) /
(6 tau)`` at dt = 1 s. The classical method fits a line of slope -1 (in the variance) to the first
scales for the one and a line of slope +1 to the last for the other, as if each had its scales to
itself. Least squares on fixed scales is linear in the unbiased Allan variances, so its expectation
is exact and the same for every length of record: more data bring the estimates closer to it, not
to the truth.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from gmwm import plotting
from gmwm._core.runs import do_runs
from gmwm._core.tables import plain_table
from gmwm._core.typing import FloatArray
from gmwm.estimate import estimate
from gmwm.process import RandomWalk, WhiteNoise
from gmwm.variance import wavelet_variance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
        "lines over 1-8 s and 16-128 s, all levels alike (OLS) or reweighted (IRLS)\n"
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
        parts.append(f"{name}, truth {_TRUE[k]:g}, expected of OLS {expectation()[k]:.5g}\n{table}")
    ratios = [(k, *(expectation(k) / _TRUE)) for k in range(1, _SCALES.size)]
    table = plain_table(("k", *NAMES), [[f"{value:.4g}" for value in row] for row in ratios])
    parts.append(f"Expected over true value; white noise from the first k scales\n{table}")
    return "\n\n".join(parts)
