"""Bias of classical and robust wavelet variances where one per cent of the samples are outliers."""

import argparse

import numpy as np

import gmwm

N = 1_000_000
SEEDS = 4
LEVELS = 8


def main() -> None:
    """Print the bias of both, and their ratio, level by level."""
    for size in (3.0, 10.0):
        biases = []
        for seed in range(SEEDS):
            rng = np.random.default_rng(seed)
            clean = rng.standard_normal(N)
            hit = rng.random(N) < 0.01
            dirty = np.where(hit, size * rng.standard_normal(N), clean)
            biases.append(
                [
                    gmwm.wavelet_variance(dirty, dt=1.0, robust=robust).variance[:LEVELS]
                    / gmwm.wavelet_variance(clean, dt=1.0, robust=robust).variance[:LEVELS]
                    - 1.0
                    for robust in (False, True)
                ]
            )
        classical, robust = np.mean(biases, axis=0)
        print(f"1 % of N(0, {size**2:g} sigma^2), bias of the variance at levels 1 to {LEVELS}")
        for name, row in (("classical", classical), ("robust", robust)):
            print(f"  {name:<10}" + "".join(f"{value:8.4f}" for value in row))
        print(f"  {'ratio':<10}" + "".join(f"{ratio:8.2f}" for ratio in robust / classical))


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    main()
