"""How often a right model has a level that predictions feel, and is not valid for it.

    python benchmarks/misfits.py [--samples 200000] [--runs 100] [--held-out]

The true kinds of terms are fitted to series at 100 Hz. "poor": a level is missed by more than 10 %
of the deviation and 2.5 standard errors; "not valid": fits that the notice "misfit" makes so.
--held-out: kinds, sizes and seeds that no threshold was tuned with.
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

DT, FIRST_SEED, HELD_OUT_SEED = 0.01, 7000, 90_000
WHITE = WhiteNoise(1e-4)
TRUTHS = {
    "N": gmwm.Model((WHITE,)),
    "N+K": WHITE + RandomWalk(2e-5),
    "N+B": WHITE + BiasInstability(5e-5),
    "N+2GM": WHITE + GaussMarkov(6e-5, 3.0) + GaussMarkov(5e-5, 70.0),
    "N+Q+GM": WHITE + QuantizationNoise(5e-6) + GaussMarkov(5e-5, 30.0),
}
HELD_OUT = {
    "N": gmwm.Model((WhiteNoise(3e-3),)),
    "N+GM": WHITE + GaussMarkov(2e-5, 10.0),
    "N+K": WHITE + RandomWalk(3e-6),
    "N+K+B": WHITE + RandomWalk(1e-5) + BiasInstability(3e-5),
    "N+GM+K": WHITE + GaussMarkov(8e-5, 1.0) + RandomWalk(2e-5),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=200_000)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--held-out", action="store_true")
    given = parser.parse_args()
    first = HELD_OUT_SEED if given.held_out else FIRST_SEED
    warnings.simplefilter("ignore", FitWarning)
    for name, truth in (HELD_OUT if given.held_out else TRUTHS).items():
        poor = bad = 0
        for seed in range(first, first + given.runs):
            fit = gmwm.fit(truth.opened(), truth.simulate(given.samples, DT, seed), dt=DT)
            poor += fit.goodness.is_poor
            bad += "describes_data" in fit.reasons
        print(f"{name:8} {given.runs} fits: {poor} poor, {bad} not valid", flush=True)


if __name__ == "__main__":
    main()
