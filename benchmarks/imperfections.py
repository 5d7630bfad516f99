"""Attitude errors from errors that motion brings: a strapdown against the terms of a certificate.

Run with ``python benchmarks/imperfections.py``; the table of docs/filter-numbers.md.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.spatial.transform import Rotation

from gmwm import GaussMarkov, Imperfections, Motion
from gmwm.filter_numbers import tuning

DT, RUNS, TIMES = 0.0025, 400, (0.2, 1.0, 10.0)
MOTION = Motion(*tuning.MOTIONS["drone"])
KNOWN = Imperfections(
    scale_error=0.005, misalignment=np.radians(0.5), g_sensitivity=1e-4, time_offset=0.005
)


def _moved(sd: float, steps: int, rng: np.random.Generator) -> np.ndarray:
    """Motion of three axes in all runs, (steps, runs, 3)."""
    series = GaussMarkov(sd, MOTION.memory).simulate((steps + 1000) * RUNS * 3, DT, rng)
    return series.reshape(RUNS * 3, steps + 1000)[:, 1000:].T.reshape(steps, RUNS, 3)


def main() -> None:
    """Root mean square of the attitude errors over that predicted by the terms."""
    rng = np.random.default_rng(0)
    late, steps = round(KNOWN.time_offset / DT), round(TIMES[-1] / DT)
    rate, accel = (_moved(sd, steps + late, rng) for sd in (MOTION.rate, MOTION.accel))
    others = np.ones((3, 3)) - np.eye(3)
    measured = {
        "scale error": rate[late:] * (1.0 + KNOWN.scale_error),
        "misalignment": rate[late:] + KNOWN.misalignment * rate[late:] @ others,
        "g-sensitivity": rate[late:] + KNOWN.g_sensitivity * accel[late:],
        "time offset": rate[:-late],
    }
    terms = KNOWN.terms("gyro", MOTION)
    attitude = {name: Rotation.identity(RUNS) for name in ("", *measured)}
    print(f"drone, {RUNS} runs: attitude error of a strapdown integration over the integral of the")
    print("process in gmwm.certify. bounded: the time offset's over s d sqrt(2 (1 - exp(-T/tau)))")
    print(f"{'T [s]':<8}" + "".join(f"{name:>15}" for name in measured) + f"{'bounded':>10}")
    for k in range(steps):
        for name, turned in attitude.items():
            step = (measured[name] if name else rate[late:])[k] * DT
            attitude[name] = turned * Rotation.from_rotvec(step)
        time = (k + 1) * DT
        if min(abs(time - each) for each in TIMES) > 0.5 * DT:
            continue
        cells = []
        for name in measured:
            error = (attitude[""].inv() * attitude[name]).as_rotvec()
            size = np.sqrt(np.mean(error**2))
            variance = 2.0 * terms[name].haar_variance(np.array([time]), DT)[0] * time**2
            x = time / MOTION.memory
            if name != "time offset":
                variance = 2.0 * (terms[name].sigma * MOTION.memory) ** 2 * (x - 1.0 + np.exp(-x))
            cells.append(f"{size / np.sqrt(variance):>15.2f}")
        own = MOTION.rate * KNOWN.time_offset * np.sqrt(-2.0 * np.expm1(-x))
        print(f"{time:<8g}" + "".join(cells) + f"{size / own:>10.2f}", flush=True)


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    main()
