"""How often slow noise that changes its size within a record is found.

``python benchmarks/steadiness.py`` selects the model of each record and counts notices of code
"unsteady": of stationary noise, none is right; of noise that is larger in a part of the record, how
many have one, and how many of the fits are not valid for it. 1 h at 100 Hz, N = 1e-4.
"""

import argparse
import warnings

import numpy as np

import gmwm
from gmwm.calibration.steadiness import steadiness_notice

DT, SIZE = 0.01, 360_000
TIME = DT * np.arange(SIZE)
N, K = 1e-4, 2e-6
WHITE = gmwm.WhiteNoise(N)
WALK = gmwm.RandomWalk(K)
FAST, SLOW = gmwm.GaussMarkov(1.5e-4, 5.0), gmwm.GaussMarkov(1.5e-4, 100.0)
STATIONARY = {
    "N + K": WHITE + WALK,
    "N + K, 10 times": WHITE + gmwm.RandomWalk(10.0 * K),
    "N + GM of 5 s": WHITE + FAST,
    "N + GM of 100 s": WHITE + SLOW,
    "N + 2 GM": WHITE + FAST + SLOW,
    "N + B": WHITE + gmwm.BiasInstability(0.5 * N),
}
TIMES = (1.5, 2.0, 3.0, 6.0)
PARTS = {
    "second half": (1800.0, 3600.0),
    "last 30 %": (2520.0, 3600.0),
    "middle 10 %": (1620.0, 1980.0),
}


def walking(seed, times, part):
    """A random walk whose steps are larger in a part."""
    steps = np.diff(WALK.simulate(SIZE, DT, seed=[seed, 1]), prepend=0.0)
    return WHITE.simulate(SIZE, DT, seed=seed) + np.cumsum(steps * _size(times, part))


def growing(process):
    def simulated(seed, times, part):
        """A Gauss-Markov process that is larger in a part."""
        slow = process.simulate(SIZE, DT, seed=[seed, 1])
        return WHITE.simulate(SIZE, DT, seed=seed) + slow * _size(times, part)

    return simulated


CHANGING = {"K": walking, "GM of 5 s": growing(FAST), "GM of 100 s": growing(SLOW)}


def _size(times, part):
    return np.where((part[0] < TIME) & (part[1] > TIME), times, 1.0)


def notices(records):
    """How many records have a notice, and of how many it makes the fit not valid."""
    found = [steadiness_notice(gmwm.select(each, DT).fit) for each in records]
    severities = [notice.severity for notice in found if notice is not None]
    return len(severities), severities.count("bad")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--stationary", type=int, default=200)
    parser.add_argument("--seed", type=int, default=27_000)
    given = parser.parse_args()
    warnings.simplefilter("ignore", gmwm.FitWarning)
    print(f"stationary noise, notices (not valid) of {given.stationary} records:")
    for name, truth in STATIONARY.items():
        seeds = range(given.seed, given.seed + given.stationary)
        some, bad = notices(truth.simulate(SIZE, DT, seed=seed) for seed in seeds)
        print(f"  {name:16} {some} ({bad})", flush=True)
    print(f"larger in a part, notices (not valid) of {given.runs} records:")
    print(f"  {'what':12} {'where':12}" + "".join(f"{f'{t:g} times':>14}" for t in TIMES))
    for what, simulated in CHANGING.items():
        for where, part in PARTS.items():
            cells = []
            for times in TIMES:
                seeds = range(given.seed, given.seed + given.runs)
                some, bad = notices(simulated(seed, times, part) for seed in seeds)
                cells.append(f"{f'{some} ({bad})':>14}")
            print(f"  {what:12} {where:12}" + "".join(cells), flush=True)


if __name__ == "__main__":
    main()
