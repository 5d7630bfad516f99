"""Whether ARMA(3,2) by wavelet moments ends where it does from the likelihood's optimum.

    python benchmarks/arma_starts.py [--runs 40] [--seed 0] [-n 200000]

Series of three Gauss-Markov processes (Table IV) are fitted by ``gmwm.fit("ARMA")`` without a
start, and with that of Whittle's likelihood as the start. Printed are, by run, both objectives, the
largest difference of a parameter in its standard errors, and at the end how many agree to 2 %.
"""

import argparse
import time
import warnings

import gmwm
from gmwm import ARMA, GMWM
from gmwm.study import STUDIES


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-n", type=int, default=200_000)
    given = parser.parse_args()
    warnings.simplefilter("ignore", gmwm.FitWarning)
    agree = 0
    for seed in range(given.seed, given.seed + given.runs):
        x = STUDIES["table4"].truth.simulate(given.n, 1.0, seed)
        begun = time.perf_counter()
        own = gmwm.fit(ARMA(3, 2), x, dt=1.0)
        seconds = time.perf_counter() - begun
        likely = gmwm.fit(ARMA(3, 2), x, dt=1.0, method="whittle")
        other = gmwm.fit(ARMA(3, 2), x, dt=1.0, method=GMWM(start=likely.model))
        apart = max(
            abs(own[name].value - other[name].value) / own[name].stderr for name in own.params
        )
        agree += apart < 0.02
        whittle = max(
            abs(own[name].value - likely[name].value) / own[name].stderr for name in own.params
        )
        print(
            f"{seed:>5} {own.objective:10.4g} {other.objective:10.4g}  apart {apart:8.2g}  from "
            f"Whittle's {whittle:6.2f}  {seconds:.1f} s  {'valid' if own.valid else 'not valid'}",
            flush=True,
        )
    print(f"{agree} of {given.runs} agree to 2 % of their standard errors")


if __name__ == "__main__":
    main()
