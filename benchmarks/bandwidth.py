"""Which models a sensor's own low-pass leaves valid, and what they are named.

Run with ``python benchmarks/bandwidth.py`` (about half an hour; ``--samples 100000`` for a first
look). White noise of N = 1e-3, alone or with a slow process, is filtered by the filters of
scipy.signal at several ratios of cutoff to sampling rate, and a model is selected: whether its fit
is valid, whether a sensor bandwidth is named, and the density it acts as over N. At the end: how
often plain white noise is taken for filtered.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator

import numpy as np
from scipy import signal

import gmwm
from gmwm import GaussMarkov, Process, RandomWalk, WhiteNoise
from gmwm.calibration import axis_numbers

DT, DENSITY = 0.005, 1e-3
RATIOS = (0.02, 0.05, 0.08, 0.15, 0.25, 0.4)
SLOW: dict[str, Process | None] = {
    "N": None,
    "N + K": RandomWalk(5e-5),
    "N + GM": GaussMarkov(1e-4, 100.0),
}
SETTLED = 4000  # samples after which a filter has forgotten its start


def filters(ratio: float) -> Iterator[tuple[str, tuple[np.ndarray, np.ndarray]]]:
    """Ordinary low-passes of a cutoff in cycles per sample."""
    for order in (1, 2, 3, 4):
        yield f"Butterworth {order}", signal.butter(order, 2.0 * ratio)
    for order in (2, 4):
        yield f"Bessel {order}", signal.bessel(order, 2.0 * ratio, norm="mag")
    for order in (2, 3):
        yield f"Chebyshev {order}", signal.cheby1(order, 0.5, 2.0 * ratio)
    left = np.exp(-2.0 * np.pi * ratio)
    yield "single pole", (np.array([1.0 - left]), np.array([1.0, -left]))
    window = max(round(0.443 / ratio), 2)
    yield f"mean of {window}", (np.ones(window) / window, np.ones(1))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=360_000)
    parser.add_argument("--ratios", type=float, nargs="+", default=RATIOS)
    parser.add_argument("--beside", nargs="*", choices=SLOW, default=list(SLOW))
    parser.add_argument("--white", type=int, default=200, help="series of plain white noise")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    warnings.simplefilter("ignore", gmwm.FitWarning)
    for slow in given.beside:
        process = SLOW[slow]
        valid = named = total = 0
        density, wrong = [], []
        for ratio in given.ratios:
            for name, (b, a) in filters(ratio):
                rng = np.random.default_rng([given.seed, total])
                noise = rng.standard_normal(given.samples + SETTLED) * DENSITY / np.sqrt(DT)
                series = signal.lfilter(b, a, noise)[SETTLED:]
                if process is not None:
                    series = series + process.simulate(given.samples, DT, rng)
                fit = gmwm.select(series, dt=DT).fit
                codes = {notice.code for notice in fit.notices}
                total += 1
                valid += fit.valid
                named += "sensor-bandwidth" in codes
                density.append(axis_numbers(fit).N.value / DENSITY)
                if not fit.valid:
                    wrong.append(f"{name} at {ratio:g}")
        low, high = np.quantile(density, [0.05, 0.95])
        print(
            f"{slow:7} filtered: valid {valid} of {total}, bandwidth named in {named}, density "
            f"{low:.2f} to {high:.2f} of N (5 and 95 %)",
            *(f"  not valid: {each}" for each in wrong), sep="\n", flush=True,
        )  # fmt: skip
    taken = 0
    for run in range(given.white):
        white = WhiteNoise(DENSITY).simulate(
            given.samples, DT, np.random.default_rng([given.seed, 1, run])
        )
        fit = gmwm.select(white, dt=DT).fit
        taken += any(notice.code == "sensor-bandwidth" for notice in fit.notices)
    print(f"plain white noise taken for filtered: {taken} of {given.white}")


if __name__ == "__main__":
    main()
