"""Do equal recordings agree, and is a change found?

``python benchmarks/comparison.py [--runs 200]`` prints how often the curves of simulated recordings
of one sensor agree at 5 %, and how often changes of it are found. Each recording is fitted with the
structure of its truth; the test knows models by the covariances that they imply only.
"""

import argparse

import numpy as np

from gmwm import GaussMarkov, RandomWalk, Sinusoid, WhiteNoise
from gmwm.estimate import estimate
from gmwm.population import AxisComparison
from gmwm.population.compare import _holm
from gmwm.population.curves import Equality
from gmwm.population.unit import Structure

DT, N = 0.01, 30_000
TRUTHS = {
    "N + K": WhiteNoise(1.0) + RandomWalk(0.3),
    "N + GM": WhiteNoise(1.0) + GaussMarkov(1.0, 5.0),
    "N + K + line": WhiteNoise(1.0) + RandomWalk(0.3) + Sinusoid(3.0, 2.3),
}


def opened(truth):
    """The structure of a truth; a line's frequency is known from its spectrum."""
    return truth.with_params({key: None for key in truth.params if "frequency" not in key})


def fitted(truth, seed, n=N, gaps=0.0):
    x = truth.simulate(n, DT, seed)
    if gaps:
        generator = np.random.default_rng(seed)
        for start in generator.integers(0, n, 20):
            x[start : start + int(gaps * n / 20)] = np.nan
    return estimate(opened(truth), x, DT)


def axis(fits):
    test = Equality.of(fits)
    named = {str(place): fit for place, fit in enumerate(fits)}
    structure = Structure("x", "", "", {}, (), (), {})
    return AxisComparison("x", named, {}, test, test.p_value, structure, {})


def agreement(runs):
    print(f"Equal truths, {N * DT:g} s at {1 / DT:g} Hz: recordings that agree at 5 %")
    print(f"{'truth':<14} {'2 of them':>10} {'4 of them':>10} {'len. x 1/4':>11} {'5 % gaps':>10}")
    families, others = [], {}
    for k, (name, truth) in enumerate(TRUTHS.items()):
        base = 100_000 * (k + 1)
        fits = [fitted(truth, base + i) for i in range(2 * runs)]
        others[name] = fits
        pairs = [axis(fits[i : i + 2]) for i in range(0, 2 * runs, 2)]
        families.append([pair.p_value for pair in pairs])
        fours = [axis(fits[i : i + 4]) for i in range(0, 2 * runs, 4)]
        few = max(runs // 4, 1)
        short = [axis([fits[i], fitted(truth, base + 50_000 + i, n=N // 4)]) for i in range(few)]
        gaps = [axis([fits[i], fitted(truth, base + 60_000 + i, gaps=0.05)]) for i in range(few)]
        cells = "".join(f"{_share(each):>11}" for each in (pairs, fours, short, gaps))
        print(f"{name:<14}{cells}", flush=True)
    together = [
        min(_holm(dict(enumerate(p))).values()) >= 0.05 for p in zip(*families, strict=True)
    ]
    print(f"all three axes of a sensor agree (Holm): {np.mean(together):.1%} of {runs}\n")
    return others


def _share(cases):
    return f"{np.mean([case.state == 'agree' for case in cases]):.1%}"


def power(equal, runs):
    print(f"One of two recordings changed, {runs} runs: found at 5 %, called different, named")
    print(f"{'truth':<14} {'change':<22} {'found':>7} {'differ':>7}  part named first")
    first, _, lined = TRUTHS.values()
    cases = [
        ("N + K", "N + 5 %", WhiteNoise(1.05) + RandomWalk(0.3)),
        ("N + K", "N + 20 %", WhiteNoise(1.2) + RandomWalk(0.3)),
        ("N + GM", "N + 20 %", WhiteNoise(1.2) + GaussMarkov(1.0, 5.0)),
        ("N + K", "K x 2", WhiteNoise(1.0) + RandomWalk(0.6)),
        ("N + K", "GM of 1, 2 s added", first + GaussMarkov(1.0, 2.0)),
        ("N + K + line", "line 2.3 -> 2.5 Hz", lined.with_params({"sinusoid_frequency": 2.5})),
        ("N + K + line", "line twice as large", lined.with_params({"sinusoid_amplitude": 6.0})),
    ]
    for k, (name, change, truth) in enumerate(cases):
        found = [axis([equal[name][i], fitted(truth, 9_000_000 + 1000 * k + i)])
                 for i in range(runs)]  # fmt: skip
        rejected = np.mean([case.state != "agree" for case in found])
        differ = np.mean([case.state == "differ" for case in found])
        parts = [case.main[0].part for case in found if case.main]
        most = max(sorted(set(parts)), key=parts.count) if parts else "-"
        times = f"{most} ({parts.count(most)} of {runs})"
        print(f"{name:<14} {change:<22} {rejected:>7.0%} {differ:>7.0%}  {times}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=200)
    arguments = parser.parse_args()
    equal = agreement(arguments.runs)
    power(equal, max(arguments.runs // 5, 1))


if __name__ == "__main__":
    main()
