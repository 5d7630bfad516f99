"""What a calibration makes of white noise that is not Gaussian, and of contaminated noise.

One hour at 100 Hz of white noise 1e-4 rad/s/sqrt(Hz) and a random walk of 2e-6 rad/s/s/sqrt(Hz),
the white noise from a heavy-tailed law, or Gaussian with a fraction of samples, or of bursts of
ten, that are larger. Prints the models that were selected and N and K over the truth (N of the
Gaussian part where there are outliers).

    python benchmarks/heavy_tails.py [--seeds 5] [--laws t3 ...]
"""

from __future__ import annotations

import argparse
import warnings
from collections import Counter
from collections.abc import Callable

import numpy as np

import gmwm
from gmwm import FitWarning, RandomWalk

LENGTH, DT, N, K = 360_000, 0.01, 1e-4, 2e-6
Law = Callable[[np.random.Generator, int], np.ndarray]


def _student(freedom: float) -> Law:
    return lambda rng, n: rng.standard_t(freedom, n) / np.sqrt(freedom / (freedom - 2.0))


def _outliers(share: float, size: float) -> Law:
    return lambda rng, n: rng.standard_normal(n) * np.where(rng.random(n) < share, size, 1.0)


def _bursts(share: float, size: float) -> Law:
    def draw(rng: np.random.Generator, n: int) -> np.ndarray:
        larger = np.ones(n)
        for start in rng.integers(0, n - 10, round(share * n / 10)):
            larger[start : start + 10] = size
        return rng.standard_normal(n) * larger

    return draw


LAWS: dict[str, Law] = {
    "Gaussian": lambda rng, n: rng.standard_normal(n),
    "uniform": lambda rng, n: rng.uniform(-1.0, 1.0, n) * np.sqrt(3.0),
    "logistic": lambda rng, n: rng.logistic(size=n) / (np.pi / np.sqrt(3.0)),
    "Laplace": lambda rng, n: rng.laplace(size=n) / np.sqrt(2.0),
    "t5": _student(5.0),
    "t4": _student(4.0),
    "t3": _student(3.0),
    "0.1 % x 10": _outliers(0.001, 10.0),
    "1 % x 3": _outliers(0.01, 3.0),
    "1 % x 10": _outliers(0.01, 10.0),
    "5 % x 5": _outliers(0.05, 5.0),
    "5 % x 100": _outliers(0.05, 100.0),
    "10 % x 10": _outliers(0.1, 10.0),
    "bursts 1 % x 10": _bursts(0.01, 10.0),
    "bursts 5 % x 10": _bursts(0.05, 10.0),
}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--laws", nargs="*", default=list(LAWS))
    given = parser.parse_args()
    warnings.simplefilter("ignore", FitWarning)
    for name in given.laws:
        models: Counter[str] = Counter()
        found, robust, valid = [], 0, 0
        for seed in range(given.seeds):
            rng = np.random.default_rng(seed)
            walk = RandomWalk(K).simulate(LENGTH, DT, rng)
            values = walk + N / np.sqrt(DT) * LAWS[name](rng, LENGTH)
            recording = gmwm.Recording.from_arrays({"gyro_x": values}, 1.0 / DT, {"gyro": "rad/s"})
            fit = gmwm.calibrate(recording)["gyro_x"]
            models[fit.model.title()] += 1
            valid += fit.valid
            robust += fit.wv.efficiency < 1.0
            found.append([fit.params.get("N", 0.0) / N, fit.params.get("K", 0.0) / K])
        n, k = np.median(found, axis=0)
        kinds = "; ".join(f"{count} {title}" for title, count in models.most_common())
        print(
            f"{name:<16} N {n:.3f}  K {k:.2f}  valid {valid}, robust {robust} of {given.seeds}: "
            f"{kinds}",
            flush=True,
        )


if __name__ == "__main__":
    main()
