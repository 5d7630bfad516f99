"""White noise, a random walk and a rate ramp: errors and coverage beside exact likelihood.

    python benchmarks/ramps.py [--runs 400] [--sigmas 0 30] [--seed 777] [--setting NAME ...]

Six settings, from a walk that the record hardly resolves to one that is plain, each with ramps of
some standard errors: that of a slope in the walk alone, K sqrt(6 / (5 T)). GMWM has all runs,
likelihood half of them and the first ramp alone, since no ramp changes its errors. "low": K below
a fifth of the truth. "below": upper limits, where K comes out as zero, that lie below the truth.
"""

from __future__ import annotations

import argparse
import warnings

import numpy as np

import gmwm
from gmwm import RandomWalk, RateRamp, WhiteNoise

N = 1e-4
SETTINGS = {  # samples, sampling interval (s), K
    "1,000 s, K 2e-6": (20_000, 0.05, 2e-6),
    "1,000 s, K 4e-6": (20_000, 0.05, 4e-6),
    "1,000 s, K 1e-5": (20_000, 0.05, 1e-5),
    "1,000 s, 10 Hz, K 3e-6": (10_000, 0.1, 3e-6),
    "3,000 s, K 1e-6": (3_000, 1.0, 1e-6),
    "3,000 s, K 4e-6": (3_000, 1.0, 4e-6),
}
MODEL = WhiteNoise() + RandomWalk() + RateRamp()


def row(setting: str, method: str, runs: int, sigmas: float, first: int) -> str:
    size, dt, walk = SETTINGS[setting]
    slope = sigmas * walk * np.sqrt(1.2 / (size * dt))
    estimates, covered, limits = [], np.zeros(2), []
    for seed in range(runs):
        rng = np.random.default_rng([first, seed])
        x = rng.normal(0.0, N / np.sqrt(dt), size)
        x += np.cumsum(rng.normal(0.0, walk * np.sqrt(dt), size)) + slope * dt * np.arange(size)
        fit = gmwm.fit(MODEL, x, dt, method=method)
        ends = [fit.interval()[key] for key in ("K", "R")]
        covered += [
            low <= true <= high for (low, high), true in zip(ends, (walk, slope), strict=True)
        ]
        estimates.append(fit.params["K"] / walk)
        limits.append(fit.upper_bounds.get("K", np.inf))
    found = np.array(estimates)
    error = np.sqrt(np.mean((found - 1.0) ** 2))
    k, r = 100.0 * covered / runs
    below = int(np.sum(np.array(limits) < walk))
    few = int(np.sum(found < 0.2))
    name = f"{setting:24}{sigmas:4g} {method:6}"
    return f"{name}{runs:5}{error:8.3f}{k:8.1f} %{r:8.1f} %{few:6}{below:7}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=400)
    parser.add_argument("--sigmas", type=float, nargs="*", default=(0.0, 30.0))
    parser.add_argument("--seed", type=int, default=777)
    parser.add_argument("--setting", choices=SETTINGS, nargs="*", default=SETTINGS)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    print(f"{'':24}ramp {'':6} runs  RMSE K  covers K  covers R   low  below")
    for each in given.setting:
        for sigmas in given.sigmas:
            print(row(each, "gmwm", given.runs, sigmas, given.seed), flush=True)
        print(row(each, "mle", given.runs // 2, given.sigmas[0], given.seed), flush=True)
