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

import numpy as np

from gmwm._core.runs import do_runs
from gmwm._core.tables import plain_table
from gmwm._core.typing import FloatArray
from gmwm.estimate import estimate
from gmwm.process import RandomWalk, WhiteNoise
from gmwm.variance import wavelet_variance

TRUTH = WhiteNoise(0.2) + RandomWalk(0.02)
LENGTHS = (1_000, 10_000, 100_000, 1_000_000)
NAMES = ("sigma2_WN", "sigma2_RW")
_TRUE = np.array([0.04, 4e-4])
_SCALES = np.array([2.0**j for j in range(8)])
_FIRST = 4
"""Scales that white noise is read from; the others are the random walk's."""


@dataclass(frozen=True)
class Convergence:
    """Means over the runs at one length.

    allan, allan_error: (2,), of the Allan estimates of sigma2_WN and sigma2_RW: their mean over
        the runs, and its standard error.
    gmwm, gmwm_error: (2,), the same of GMWM.
    """

    n: int
    runs: int
    allan: FloatArray
    allan_error: FloatArray
    gmwm: FloatArray
    gmwm_error: FloatArray


def allan_least_squares(tau: FloatArray, allan_variance: FloatArray, k: int = _FIRST) -> FloatArray:
    """Least-squares lines through the first k scales and the others to 128 s, (2,).

    tau: (J,), averaging times 1, 2, 4, ... s, at least to 128 s.
    allan_variance: (J,).
    k: From 1 to 7.
    """
    lines = (_SCALES[:k], 1.0 / _SCALES[:k]), (_SCALES[k:], _SCALES[k:] / 3.0)
    return np.array(
        [shape @ allan_variance[np.isin(tau, own)] / (shape @ shape) for own, shape in lines]
    )


def expectation(k: int = _FIRST) -> FloatArray:
    """Expected value of `allan_least_squares` under `TRUTH`, whatever the length, (2,)."""
    return allan_least_squares(_SCALES, 2.0 * TRUTH.haar_variance(_SCALES, 1.0), k)


def converge(runs: int, seed: int, jobs: int = 1) -> list[Convergence]:
    """Monte Carlo for growing length, Allan lines and GMWM on the same series."""
    result = []
    for n in LENGTHS:
        found = do_runs(partial(_one_run, n, seed), runs, {}, jobs=jobs)["estimates"]
        means, errors = found.mean(axis=0), found.std(axis=0, ddof=1) / np.sqrt(runs)
        result.append(Convergence(n, runs, means[0], errors[0], means[1], errors[1]))
    return result


def _one_run(n: int, seed: int, run: int) -> dict[str, FloatArray]:
    """Both estimates of both parameters, (2, 2)."""
    series = TRUTH.simulate(n, 1.0, np.random.default_rng([seed, n, run]))
    wv = wavelet_variance(series, 1.0)
    params = estimate(TRUTH.opened(), wv).params
    lines = allan_least_squares(wv.tau, wv.allan_variance)
    return {"estimates": np.array([lines, [params["N"] ** 2, params["K"] ** 2]])}


def convergence_table(rows: list[Convergence]) -> str:
    """The table, 80 columns wide."""
    parts = [
        "Appendix A: least squares on the Allan variance of white noise + random walk\n"
        f"lines over 1-8 s and 16-128 s; means of {rows[0].runs} runs with standard errors",
    ]
    for k, name in enumerate(NAMES):
        cells = []
        for row in rows:
            both = (row.allan, row.allan_error), (row.gmwm, row.gmwm_error)
            means = [f"{mean[k]:.5g} +- {error[k]:.2g}" for mean, error in both]
            cells.append([f"{row.n:,}", f"{expectation()[k]:.5g}", *means])
        table = plain_table(("n", "Allan, expected", "Allan, mean", "GMWM, mean"), cells)
        parts.append(f"{name}, truth {_TRUE[k]:g}\n{table}")
    ratios = [(k, *(expectation(k) / _TRUE)) for k in range(1, _SCALES.size)]
    table = plain_table(("k", *NAMES), [[f"{value:.4g}" for value in row] for row in ratios])
    parts.append(f"Expected over true value; white noise from the first k scales\n{table}")
    return "\n\n".join(parts)
