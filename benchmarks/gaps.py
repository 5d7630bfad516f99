"""What missing samples do to wavelet variances, their covariance and fits.

Run with ``python benchmarks/gaps.py`` (about twenty minutes; ``--runs 20`` for a first look).
Series of 100,000 samples at 100 Hz, the same with and without gaps:

- bias: of the wavelet variances, in standard errors of the complete record, at the worst level
  (beside it how well that is known);
- variance: predicted over observed sampling variance against that of the complete record, the
  lowest and highest level of those with ten degrees of freedom or more;
- time: of the variance, of its covariance under a model and of a fit, against the complete record,
  side by side;
- coverage: of the 95 % intervals of fits of two models, with 10 % missing.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from time import perf_counter

import numpy as np

import gmwm
from gmwm import (
    GaussMarkov,
    Model,
    QuantizationNoise,
    RandomWalk,
    Resonance,
    WhiteNoise,
)

SAMPLES, DT = 100_000, 0.01
WELL_KNOWN = 10.0
REPEATS = 5
MODELS: dict[str, Model] = {
    "N": Model((WhiteNoise(1e-4),)),
    "N + K": WhiteNoise(1e-4) + RandomWalk(2e-5),
    "K": Model((RandomWalk(1e-4),)),
    "N + GM": WhiteNoise(1e-4) + GaussMarkov(2e-4, 2.0),
    "resonance": WhiteNoise(1e-5) + Resonance(1e-3, 10.0, 0.05),
    "Q + N": QuantizationNoise(1e-5) + WhiteNoise(1e-4),
}


def singles(share: float) -> Callable[[np.random.Generator, int], np.ndarray]:
    """Single samples lost at random."""
    return lambda rng, n: rng.random(n) < share


def shocks(number: int) -> Callable[[np.random.Generator, int], np.ndarray]:
    """Masked shocks of 17 to 20 samples."""

    def lost(rng: np.random.Generator, n: int) -> np.ndarray:
        mask = np.zeros(n, dtype=bool)
        for start in rng.integers(100, n - 100, number):
            mask[start : start + rng.integers(17, 21)] = True
        return mask

    return lost


PATTERNS = {
    "0.1 % single": singles(0.001),
    "1 % single": singles(0.01),
    "3 % single": singles(0.03),
    "10 % single": singles(0.1),
    "30 % single": singles(0.3),
    "50 shocks": shocks(50),
    "400 shocks": shocks(400),
}


def study(model: Model, lost: Callable, runs: int, seed: int) -> tuple[float, float, float, float]:
    """Worst bias in standard errors, how well that is known, lowest and highest variance ratio."""
    rng = np.random.default_rng(seed)
    whole, part, grown = [], [], []
    dof = np.zeros(0)
    for _ in range(runs):
        x = model.simulate(SAMPLES, DT, rng)
        complete = gmwm.wavelet_variance(x, DT)
        gappy = gmwm.wavelet_variance(np.where(lost(rng, x.size), np.nan, x), DT)
        assert gappy.tau.size == complete.tau.size
        dof = complete.dof
        whole.append(complete.variance)
        part.append(gappy.variance)
        grown.append(np.diag(gappy.gaps.inflation))
    deviation = np.std(whole, axis=0, ddof=1)
    added = np.array(part) - np.array(whole)
    bias = np.mean(added, axis=0) / deviation
    known = np.std(added, axis=0, ddof=1) / deviation / np.sqrt(runs)
    worst = int(np.argmax(np.abs(bias)))
    ratio = np.mean(grown, axis=0) * deviation**2 / np.var(part, axis=0, ddof=1)
    ratio = ratio[dof >= WELL_KNOWN]
    return float(bias[worst]), float(known[worst]), float(ratio.min()), float(ratio.max())


def side_by_side(task: Callable[[object], object], gappy: object, whole: object) -> float:
    """Time of a task on one over that on the other: the least of five calls of each, in turns."""
    times = np.empty((REPEATS, 2))
    task(gappy), task(whole)  # nothing is compiled or set up later
    for row in times:
        for k, given in enumerate((gappy, whole)):
            start = perf_counter()
            task(given)
            row[k] = perf_counter() - start
    least = times.min(axis=0)
    return float(least[0] / least[1])


def times(model: Model, lost: Callable) -> tuple[float, float, float]:
    """Of the variance, its covariance and a fit, against the complete record."""
    rng = np.random.default_rng(1)
    x = model.simulate(SAMPLES, DT, rng)
    y = np.where(lost(rng, x.size), np.nan, x)
    series = y, x
    variances = [gmwm.wavelet_variance(values, DT) for values in series]
    return (
        side_by_side(lambda values: gmwm.wavelet_variance(values, DT), *series),
        side_by_side(lambda wv: wv.covariance_under(model.psd), *variances),
        side_by_side(lambda wv: gmwm.fit(model.opened(), wv), *variances),
    )


def coverage(model: Model, lost: Callable, runs: int) -> dict[str, float]:
    """Share of runs in which the 95 % intervals of fits contain the truth."""
    inside = dict.fromkeys(model.params, 0)
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        x = model.simulate(SAMPLES, DT, rng)
        fit = gmwm.fit(model.opened(), np.where(lost(rng, x.size), np.nan, x), dt=DT)
        for name, (low, high) in fit.interval(0.95).items():
            inside[name] += low <= model.params[name] <= high
    return {name: count / runs for name, count in inside.items()}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=200)
    runs = parser.parse_args().runs
    print(f"{runs} runs of {SAMPLES:,} samples at {1.0 / DT:g} Hz")
    print(f"{'':10} {'':13} {'bias':>15} {'variance':>13} {'time: variance':>16} cov.  fit")
    for name, model in MODELS.items():
        for pattern, lost in PATTERNS.items():
            bias, known, low, high = study(model, lost, runs, 1)
            variance, covariance, fit = times(model, lost)
            print(
                f"{name:10} {pattern:13} {bias:+7.2f} +- {known:.2f} {low:7.2f}-{high:.2f} "
                f"{variance:15.1f} {covariance:5.1f} {fit:4.1f}",
                flush=True,
            )
    for name in ("Q + N", "N + K"):
        print(f"{name:10} 10 % single: coverage", coverage(MODELS[name], singles(0.1), runs))


if __name__ == "__main__":
    main()
