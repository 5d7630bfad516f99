"""Time of the robust against the classical wavelet variance, and of their covariances.

Run with ``python benchmarks/robust.py``. All figures are of one run and the same white noise, so
that their ratios hold on any machine; "cold" includes loading or compiling the kernels and setting
up tables, as the first call in a process does.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from time import perf_counter

import numpy as np

from gmwm import WhiteNoise
from gmwm.variance.covariance.haar import dyadic_levels, haar_covariance
from gmwm.variance.kernels import cumulative
from gmwm.variance.levels import haar_coefficients, haar_moments
from gmwm.variance.robust import EFFICIENCY, robust_covariance, robust_variance

SAMPLES = 1_000_000
REPEATS = 7


def _seconds(task: Callable[[], object]) -> tuple[float, float]:
    """Time of the first call, and the least of the later ones."""
    times = []
    for _ in range(1 + REPEATS):
        start = perf_counter()
        task()
        times.append(perf_counter() - start)
    return times[0], min(times[1:])


def main() -> None:
    """Print the table."""
    x = np.random.default_rng(1).normal(size=SAMPLES)
    runs = np.array([[0, SAMPLES]])
    levels = [int(m) for m in dyadic_levels(SAMPLES)]
    white = WhiteNoise(1.0)

    def classical() -> list[float]:
        integral = cumulative(x, 0.0)
        return haar_moments(integral, runs, np.array(levels, dtype=float))[:, 1].tolist()

    def robust() -> list[float]:
        integral = cumulative(x, 0.0)
        return [robust_variance(haar_coefficients(integral, 0, SAMPLES, m)) for m in levels]

    def classical_covariance() -> np.ndarray:
        return haar_covariance(white.psd, SAMPLES, 0.01)

    print(f"{SAMPLES:,} samples, {len(levels)} levels, efficiency {EFFICIENCY:g}")
    print(f"{'':24} {'cold [s]':>10} {'warm [s]':>10} {'ratio, cold':>12} {'ratio, warm':>12}")
    _report("classical variance", _seconds(classical), "robust variance", _seconds(robust))
    before = _seconds(classical_covariance)
    given = classical_covariance()

    def added_covariance() -> np.ndarray:
        return robust_covariance(white.psd, SAMPLES, 0.01, EFFICIENCY, given)

    _report("classical covariance", before, "robust, added to it", _seconds(added_covariance))


def _report(base: str, before: tuple[float, float], name: str, after: tuple[float, float]) -> None:
    """Print two lines: absolute times, and their ratio to the first."""
    for label, times in ((base, before), (name, after)):
        ratio = times[0] / before[0], times[1] / before[1]
        print(f"{label:24} {times[0]:10.4f} {times[1]:10.4f} {ratio[0]:12.2f} {ratio[1]:12.2f}")


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    main()
