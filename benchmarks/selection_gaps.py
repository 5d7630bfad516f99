"""How often the selected model is the true one, or predicts the same, with missing samples.

Run with ``python benchmarks/selection_gaps.py`` (hours; ``--runs 2`` for a first look). True models
of `gmwm.study.studies` without a rate ramp and a line, or (``--truths imu``) four that set no
constant of the selection, complete, with 0.1 % and 1 % of the samples missing at random, and with
50 masked bursts of 0.2 s at 100 Hz (20 samples); ``--gaps`` takes some of these. Counted are

- right: the very terms;
- equivalent: root mean square of the integral over 60 and over 600 samples within 10 % of that of
  the true model, start of the walks known;
- ramps: models with a rate ramp, of which no truth has one;
- valid: fits of the chosen model that are.
"""

from __future__ import annotations

import argparse
import warnings
from collections import Counter
from collections.abc import Callable

import numpy as np

import gmwm
from gmwm import BiasInstability, GaussMarkov, Model, QuantizationNoise, RandomWalk, WhiteNoise
from gmwm.filter_numbers.propagation import integral_rms
from gmwm.study.studies import TRUTHS

TIMES = (60.0, 600.0)
CLOSE = 0.1
SETS = {
    "study": [m for m in TRUTHS if not any(term.is_drift or term.is_line for term in m.terms)],
    "imu": [
        WhiteNoise(1.0) + RandomWalk(2e-4),
        WhiteNoise(1.0) + BiasInstability(0.02),
        WhiteNoise(1.0) + GaussMarkov(0.3, 40.0) + GaussMarkov(0.1, 2000.0),
        QuantizationNoise(2.0) + WhiteNoise(1.0) + GaussMarkov(0.2, 100.0) + RandomWalk(5e-4),
    ],
}


def bursts(rng: np.random.Generator, n: int) -> np.ndarray:
    """Fifty bursts of twenty samples."""
    lost = np.zeros(n, dtype=bool)
    for start in rng.integers(0, n - 20, 50):
        lost[start : start + 20] = True
    return lost


GAPS: dict[str, Callable[[np.random.Generator, int], np.ndarray]] = {
    "complete": lambda rng, n: np.zeros(n, dtype=bool),
    "0.1 % random": lambda rng, n: rng.random(n) < 0.001,
    "1 % random": lambda rng, n: rng.random(n) < 0.01,
    "50 bursts": bursts,
}


def prediction(model: Model) -> np.ndarray:
    """Root mean square of the integral at each of `TIMES`."""
    parts = [integral_rms(term, TIMES, 1.0, known_start=True)[0] for term in model.terms]
    return np.sqrt(np.sum(np.square(parts), axis=0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--samples", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--truths", choices=list(SETS), default="study")
    parser.add_argument("--gaps", nargs="*", choices=list(GAPS), default=list(GAPS))
    given = parser.parse_args()
    warnings.simplefilter("ignore", gmwm.FitWarning)
    print(f"{given.samples:,} samples, {given.runs} series each\n")
    print(f"{'gaps':>12} {'right':>6} {'right or equivalent':>20} {'ramps':>6} {'valid':>6}  truth")
    for name in given.gaps:
        lost = GAPS[name]
        for index, truth in enumerate(SETS[given.truths]):
            expected = prediction(truth)
            right = good = ramps = valid = 0
            for run in range(given.runs):
                rng = np.random.default_rng([given.seed, index, run])
                series = truth.simulate(given.samples, 1.0, rng)
                series[lost(rng, given.samples)] = np.nan
                fit = gmwm.select(series, dt=1.0).fit
                chosen = fit.model
                valid += fit.valid
                kinds = [Counter(type(term) for term in each.terms) for each in (truth, chosen)]
                same = kinds[0] == kinds[1]
                near = bool(np.all(np.abs(prediction(chosen) / expected - 1.0) < CLOSE))
                right, good = right + same, good + (same or near)
                ramps += any(term.is_drift for term in chosen.terms)
            print(
                f"{name:>12} {right / given.runs:>6.0%} {good / given.runs:>20.0%} {ramps:>6} "
                f"{valid / given.runs:>6.0%}  {truth.title()}",
                flush=True,
            )


if __name__ == "__main__":
    main()
