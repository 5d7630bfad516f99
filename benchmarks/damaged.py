"""Sound noise that is called damaged, and damaged noise that is not.

    python benchmarks/damaged.py [--samples 50000] [--seeds 5]

"abrupt-end", "held", "filled" and "value-repeated" of `gmwm.health`: how often sound noise has
them; shares of the seeds in which rectified noise, noise wrapped round, samples written again and
samples put between their neighbours are found, by the step of the samples in standard deviations;
and white noise over its truth where these are fitted.
"""

from __future__ import annotations

import argparse
import warnings
from itertools import product

import numpy as np

import gmwm
from gmwm import FitWarning, WhiteNoise

CODES = {"abrupt-end", "held", "filled", "value-repeated"}
FIRST_SEED, STEPS = 4000, (0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0)


def sound(rng: np.random.Generator, n: int) -> dict[str, np.ndarray]:
    """Noise of standard deviation one and more, by name."""
    time, white = np.arange(n) / 100.0, rng.standard_normal(n)
    kinds = {
        "white": white,
        "t3": rng.standard_t(3, n),
        "Laplace": rng.laplace(size=n),
        "two uniform": rng.random(n) + rng.random(n),
        "Gauss-Markov": gmwm.GaussMarkov(1.0, 1.0).simulate(n, 0.01, rng),
        "resonance": (WhiteNoise(0.01) + gmwm.Resonance(1.0, 10.0, 0.01)).simulate(n, 0.01, rng),
        "quantization": gmwm.QuantizationNoise(0.01).simulate(n, 0.01, rng),
    }
    for size in (0.01, 0.1, 1.0):
        kinds[f"white + walk {size}"] = white + size * np.cumsum(rng.standard_normal(n))
    for size, f in product((1.0, 10.0, 100.0), (0.03, 0.7, 13.0)):
        kinds[f"white + line {size} {f}"] = white + size * np.sin(2.0 * np.pi * f * time)
        kinds[f"white + ramp {size}"] = white + size * time / time[-1]
    return kinds


def held(values: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """Some samples at random replaced by those before them."""
    last = np.where(rng.random(values.size) < share, 0, np.arange(values.size))
    return values[np.maximum.accumulate(last)]


def filled(values: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """Some samples at random replaced by the mean of those beside them."""
    between = 0.5 * (np.roll(values, 1) + np.roll(values, -1))
    return np.where(rng.random(values.size) < share, between, values)


def in_steps(values: np.ndarray, step: float) -> np.ndarray:
    return step * np.rint(values / step) if step else values


def codes(values: np.ndarray) -> set[str]:
    return {notice.code for notice in gmwm.health(recording(values)).notices}


def recording(values: np.ndarray) -> gmwm.Recording:
    return gmwm.Recording.from_arrays({"gyro_x": 1e-3 * values}, 100.0, {"gyro": "rad/s"})


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--samples", type=int, default=50_000)
    parser.add_argument("--seeds", type=int, default=5)
    given = parser.parse_args()
    warnings.simplefilter("ignore", FitWarning)
    seeds = range(FIRST_SEED, FIRST_SEED + given.seeds)
    records, alarms = 0, []
    for seed in seeds:
        for (name, values), step in product(
            sound(np.random.default_rng(seed), given.samples).items(), STEPS[::2]
        ):
            records += 1
            alarms += [(name, step, code) for code in codes(in_steps(values, step)) & CODES]
    print(f"{len(alarms)} of {records} sound records reported {alarms}")
    damages = {
        "rectified": ("abrupt-end", lambda x, rng: np.abs(x)),
        "wrapped at 1.5": ("abrupt-end", lambda x, rng: (x + 1.5) % 3.0 - 1.5),
    }
    for share in (0.01, 0.02, 0.05, 0.1, 0.2):
        damages[f"{share:.0%} held"] = ("held", lambda x, rng, share=share: held(x, share, rng))
    damages["10% between"] = ("filled", lambda x, rng: filled(x, 0.1, rng))
    print(f"{'found at steps of':18}" + "".join(f"{step:>8g}" for step in STEPS))
    for name, (code, damage) in damages.items():
        row = f"{name:18}"
        for step in STEPS:
            draws = [np.random.default_rng(seed) for seed in seeds]
            cases = [damage(in_steps(r.standard_normal(given.samples), step), r) for r in draws]
            row += f"{np.mean([code in codes(values) for values in cases]):8.0%}"
        rec = recording(damage(np.random.default_rng(1).standard_normal(200_000), draws[0]))
        found = [
            gmwm.calibrate(rec, WhiteNoise(), **screening)["gyro_x"].params["N"]
            for screening in ({"screening": ()}, {})
        ]
        print(f"{row}   N {found[0] / 1e-4:.2f}, screened {found[1] / 1e-4:.3f}", flush=True)


if __name__ == "__main__":
    main()
