"""Whether an hour tells what slow noise does at ten minutes, where several models tie.

``python benchmarks/flicker.py`` counts how often the 95 % interval of the Allan deviation at 60 and
600 s misses the truth, that of the chosen model alone and that which reaches over its rivals, and
prints how wide they are. 1 h at 100 Hz, other seeds than any test has.
"""

import argparse
import warnings

import numpy as np

import gmwm

DT, SIZE = 0.01, 360_000
TAU = np.array([60.0, 600.0])
N = 1e-4
TRUTHS = {
    **{
        f"N + B of {b:g} N": gmwm.WhiteNoise(N) + gmwm.BiasInstability(b * N)
        for b in (0.1, 0.2, 0.5, 2.0)
    },
    "N + K": gmwm.WhiteNoise(N) + gmwm.RandomWalk(0.03 * N),
    "N + GM of 100 s": gmwm.WhiteNoise(N) + gmwm.GaussMarkov(0.3 * N, 100.0),
    "N + 2 GM": gmwm.WhiteNoise(N) + gmwm.GaussMarkov(N, 1.0) + gmwm.GaussMarkov(0.5 * N, 50.0),
}


def found(truth, seed):
    """Ends over the truth: alone and with rivals, (2, 2 ends, 2 times); None of a fit not valid."""
    chosen = gmwm.select(truth.simulate(SIZE, DT, seed=seed), DT)
    if not chosen.fit.valid:
        return None
    true = np.sqrt(2.0 * truth.haar_variance(TAU, DT))
    rivals = [fit.model for fit in chosen.rivals]
    ends = [chosen.fit.deviation_interval(TAU, rivals=some)[1:] for some in (None, rivals)]
    return np.array(ends) / true


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--seed", type=int, default=26_000)
    given = parser.parse_args()
    warnings.simplefilter("ignore", gmwm.FitWarning)
    print(f"{'':16} {'valid':>5}  {'missed at 60 / 600 s':>22}  {'high / low end, median':>24}")
    print(f"{'truth':16} {'':>5}  {'alone':>11} {'rivals':>10}  {'alone':>12} {'rivals':>11}")
    for name, truth in TRUTHS.items():
        each = [found(truth, given.seed + k) for k in range(given.runs)]
        ends = np.array([some for some in each if some is not None])
        missed = np.sum((ends[:, :, 0] > 1.0) | (ends[:, :, 1] < 1.0), axis=0)
        width = np.median(ends[:, :, 1] / ends[:, :, 0], axis=0)
        print(
            f"{name:16} {len(ends):5}  "
            + " ".join(f"{f'{a} / {b}':>{w}}" for (a, b), w in zip(missed, (11, 10), strict=True))
            + "  "
            + " ".join(
                f"{f'{a:.2f} / {b:.2f}':>{w}}" for (a, b), w in zip(width, (12, 11), strict=True)
            ),
            flush=True,
        )


if __name__ == "__main__":
    main()
