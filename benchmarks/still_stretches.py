"""Stretches at rest of emulated flights and drives: found to a second, N within its interval.

``python benchmarks/still_stretches.py`` prints, for 100 logs, how many stretches were found, how
far their ends are off, and how often the interval of N holds the truth. ``--logs 10`` does fewer.
"""

from __future__ import annotations

import argparse

import numpy as np

import gmwm

RATE = 100.0
GYRO, ACCEL = 1e-4, 1e-3  # N, u/sqrt(Hz)


def noise(rng, n, density):
    return density * np.sqrt(RATE) * rng.normal(size=(n, 3))


def log(kind, seed):
    """A recording, and begin and end of each stretch at rest, s."""
    rng = np.random.default_rng(seed)
    if kind == "flight":
        phases = [("rest", rng.uniform(30, 120)), ("idle", 15.0), ("move", rng.uniform(60, 120)),
                  ("idle", 10.0), ("rest", rng.uniform(30, 120))]  # fmt: skip
    else:
        phases = [("rest", rng.uniform(30, 60)), ("idle", 12.0)]
        for _ in range(3):
            phases += [("move", rng.uniform(20, 60)), ("rest", rng.uniform(20, 60))]
        phases += [("move", 20.0), ("idle", 15.0)]
    gyro, accel, rest, begin = [], [], [], 0.0
    force = np.array([0.1, -0.2, 9.79])
    bias = rng.normal(0.0, 2e-3, 3)
    for what, length in phases:
        n = round(length * RATE)
        t = np.arange(n)[:, None] / RATE
        rate, specific = np.zeros((n, 3)), np.zeros((n, 3))
        if what != "rest":  # an engine: a line and its harmonics, and broad vibration
            spin = rng.uniform(18.0, 30.0)
            phase = rng.uniform(0.0, 6.0, (2, 3))
            size = 0.1 if what == "idle" else 0.6
            specific += size * (np.sin(6.28 * spin * t + phase[0]) + 0.3 * rng.normal(size=(n, 3)))
            rate += 0.05 * size * np.sin(6.28 * spin * t + phase[1])
        if what == "move":
            wave = rng.uniform(0.05, 0.5, (2, 3))
            ramp = np.minimum(1.0, np.minimum(t, length - t))
            rate += 0.3 * ramp * np.sin(6.28 * wave[0] * t)
            specific += 1.5 * ramp * np.sin(6.28 * wave[1] * t)
        gyro.append(rate + bias)
        accel.append(specific + force)
        if what == "rest":
            rest.append((begin, begin + length))
        begin += length
    gyro, accel = np.concatenate(gyro), np.concatenate(accel)
    gyro += noise(rng, len(gyro), GYRO)
    accel += noise(rng, len(accel), ACCEL)
    arrays = {f"{s}_{a}": v[:, i] for s, v in (("gyro", gyro), ("accel", accel))
              for i, a in enumerate("xyz")}  # fmt: skip
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    return gmwm.Recording.from_arrays(arrays, RATE, units, kind), rest


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--logs", type=int, default=100)
    logs = parser.parse_args().logs
    for kind in ("flight", "drive"):
        right, off, inside, channels = 0, [], 0, 0
        for seed in range(logs):
            recording, rest = log(kind, seed)
            found = gmwm.find_still(recording)
            same = len(found.stretches) == len(rest)
            right += same
            if same:
                off.append(np.max(np.abs(np.array(found.stretches) - np.array(rest))))
            calibration = gmwm.calibrate(recording, gmwm.WhiteNoise())
            for name, fit in calibration.items():
                low, high = fit.interval(0.95)["N"]
                inside += low <= (GYRO if name.startswith("gyro") else ACCEL) <= high
                channels += 1
        print(
            f"{kind}: every stretch found in {right} of {logs} logs, ends off by {max(off):.2f} s "
            f"at most; N in its 95 % interval in {inside} of {channels} channels "
            f"({100 * inside / channels:.1f} %)"
        )


if __name__ == "__main__":
    main()
