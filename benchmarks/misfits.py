"""How often a right model has a level that predictions feel, and is not valid for it.

    python benchmarks/misfits.py [--samples 200000] [--runs 100]

The true kinds of terms are fitted to series at 100 Hz. "poor": a level is missed by more than 10 %
of the deviation and 2.5 standard errors; "not valid": fits that the notice "misfit" makes so.
"""

from __future__ import annotations

import argparse
import warnings

import gmwm
from gmwm import (
    BiasInstability,
    FitWarning,
    GaussMarkov,
    QuantizationNoise,
    RandomWalk,
    WhiteNoise,
)

DT, FIRST_SEED = 0.01, 7000
WHITE = WhiteNoise(1e-4)
TRUTHS = {
    "N": gmwm.Model((WHITE,)),
    "N+K": WHITE + RandomWalk(2e-5),
    "N+B": WHITE + BiasInstability(5e-5),
    "N+2GM": WHITE + GaussMarkov(6e-5, 3.0) + GaussMarkov(5e-5, 70.0),
    "N+Q+GM": WHITE + QuantizationNoise(5e-6) + GaussMarkov(5e-5, 30.0),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=200_000)
    parser.add_argument("--runs", type=int, default=100)
    given = parser.parse_args()
    warnings.simplefilter("ignore", FitWarning)
    for name, truth in TRUTHS.items():
        poor = bad = 0
        for seed in range(FIRST_SEED, FIRST_SEED + given.runs):
            fit = gmwm.fit(truth.opened(), truth.simulate(given.samples, DT, seed), dt=DT)
            poor += fit.goodness.is_poor
            bad += not fit.reasons["describes_data"]
        print(f"{name:8} {given.runs} fits: {poor} poor, {bad} not valid", flush=True)


if __name__ == "__main__":
    main()
