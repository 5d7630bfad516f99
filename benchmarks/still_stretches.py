"""Stretches at rest: found to a second, N within its interval; vibration; what is static.

``python benchmarks/still_stretches.py logs`` prints, for 100 emulated flights and drives, how many
stretches were found, how far their ends are off, and how often the interval of N holds the truth.
``tails`` does so for noise of heavy tails, with how its deviation in what was found is from that in
all of the rest. ``vibration`` prints how many recordings that vibrate for a part of their time are
not taken as static, and ``static`` how many are that only have noise of some kind. ``--logs 10``
does fewer.
"""

from __future__ import annotations

import argparse

import numpy as np

import gmwm
from gmwm.diagnosis import rest_of

RATE = 100.0
GYRO, ACCEL = 1e-4, 1e-3  # N, u/sqrt(Hz)
SHORTEST = 12.0  # s, of a stretch that is used


def noise(rng, n, density, freedom=None):
    """White, Gaussian or of Student's t with some degrees of freedom."""
    if freedom is None:
        return density * np.sqrt(RATE) * rng.normal(size=(n, 3))
    x = rng.standard_t(freedom, size=(n, 3))
    return density * np.sqrt(RATE * (freedom - 2.0) / freedom) * x


def log(kind, seed, freedom=None):
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
    gyro += noise(rng, len(gyro), GYRO, freedom)
    accel += noise(rng, len(accel), ACCEL, freedom)
    arrays = {f"{s}_{a}": v[:, i] for s, v in (("gyro", gyro), ("accel", accel))
              for i, a in enumerate("xyz")}  # fmt: skip
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    return gmwm.Recording.from_arrays(arrays, RATE, units, kind), rest


STATIC = (
    "white", "Student t3", "Laplace", "walk", "flicker", "Gauss-Markov", "quantization",
    "rounding", "line", "beats", "resonance", "warm-up", "noise that swells", "steps", "periods",
    "shocks", "outliers", "1 % lost",
)  # fmt: skip


def static(kind, rng):
    """A recording at rest of one to thirty minutes, of noise of a kind."""
    rate, seconds = (
        rng.choice([50.0, 100.0, 200.0, 400.0]),
        rng.choice([60.0, 200.0, 600.0, 1800.0]),
    )
    n = round(seconds * min(rate, 100.0))  # faster ones are shorter
    t, dt = np.arange(n) / rate, 1.0 / rate
    shocks = [(rng.integers(n), rng.uniform(0.05, 1.0)) for _ in range(1 + n // round(60 * rate))]
    arrays = {}
    for sensor, density in (("gyro", GYRO), ("accel", ACCEL)):
        deviation = density * np.sqrt(rate)
        for axis in "xyz":
            x = rng.normal(size=n)
            if kind == "Student t3":
                x = rng.standard_t(3, size=n)
            elif kind == "Laplace":
                x = rng.laplace(size=n)
            elif kind == "walk":
                x += 10.0 ** rng.uniform(-3.0, -0.5) * np.cumsum(rng.normal(size=n))
                x -= np.linspace(0.0, x[-1], n)
            elif kind == "flicker":
                x += gmwm.simulate(gmwm.BiasInstability(3.0), n=n, dt=dt, seed=rng)
            elif kind == "Gauss-Markov":
                slow = gmwm.GaussMarkov(5.0, 10.0 ** rng.uniform(-2.0, 2.0))
                x += gmwm.simulate(slow, n=n, dt=dt, seed=rng)
            elif kind == "quantization":
                x = 3.0 * np.diff(rng.uniform(size=n + 1))
            elif kind == "rounding":
                step = rng.choice([1.0, 3.0, 6.0])
                x += 0.01 * np.cumsum(rng.normal(size=n)) + rng.uniform(0.0, step)
                x = step * np.round(x / step)
            elif kind == "line":
                x += rng.uniform(1.0, 10.0) * np.sin(6.28 * rng.uniform(0.2, 0.45 * rate) * t)
            elif kind == "beats":
                f, apart = rng.uniform(1.0, 0.4 * rate), 10.0 ** rng.uniform(-2.5, 0.0)
                x += 2.0 * (np.sin(6.28 * f * t) + np.sin(6.28 * (f + apart) * t))
            elif kind == "resonance":
                damping = 10.0 ** rng.uniform(-2.3, -0.5)
                bump = gmwm.Resonance(rng.uniform(1.0, 6.0), rng.uniform(0.05, 0.4) * rate, damping)
                x += gmwm.simulate(bump, n=n, dt=dt, seed=rng)
            elif kind == "warm-up":
                x *= 1.0 + rng.uniform(0.2, 2.0) * np.exp(-t / rng.uniform(60.0, 600.0))
            elif kind == "noise that swells":
                x *= 1.0 + rng.uniform(0.0, 0.6) * np.sin(6.28 * t / rng.uniform(100.0, 1000.0))
            elif kind == "steps":
                for at in rng.integers(n, size=5):
                    x[at:] += 3.0 * rng.normal()
            elif kind == "periods":
                x += 5.0 * np.sin(6.28 * t / rng.uniform(20.0, 500.0))
            elif kind == "shocks":
                for at, length in shocks:
                    part = x[at : at + round(length * rate)]
                    part += 10.0 ** rng.uniform(1.0, 3.0) * rng.normal(size=part.size)
            elif kind == "outliers":
                x += 20.0 * rng.normal(size=n) * (rng.random(n) < 0.01)
            elif kind == "1 % lost":
                x[rng.random(n) < 0.01] = np.nan
            arrays[f"{sensor}_{axis}"] = deviation * x + (9.79 if axis == "z" else 0.0) * (
                sensor == "accel"
            )
    return gmwm.Recording.from_arrays(arrays, rate, {"gyro": "rad/s", "accel": "m/s^2"}, kind)


def vibrating(seed, size, share, axes, is_line):
    """Ten minutes at rest that vibrate for a share of their time, and begin and end of that, s."""
    rng = np.random.default_rng([seed, 5])
    n = round(600.0 * RATE)
    t = np.arange(n) / RATE
    begin = rng.uniform(0.0, 600.0 * (1.0 - share))
    on = (t >= begin) & (t < begin + 600.0 * share)
    spin, arrays = rng.uniform(8.0, 45.0), {}
    for sensor, density in (("gyro", GYRO), ("accel", ACCEL)):
        for axis in "xyz":
            x = rng.normal(size=n)
            wave = np.sqrt(2.0) * np.sin(6.28 * spin * t + rng.uniform(0.0, 6.28))
            wave = wave if is_line else rng.normal(size=n)
            if f"{sensor}_{axis}".startswith(axes):
                x += size * on * wave
            arrays[f"{sensor}_{axis}"] = density * np.sqrt(RATE) * x
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    return gmwm.Recording.from_arrays(arrays, RATE, units), (begin, begin + 600.0 * share)


def print_static(runs):
    for kind in STATIC:
        fired = [
            seed
            for seed in range(runs)
            if rest_of(static(kind, np.random.default_rng([seed, STATIC.index(kind), 9])))
        ]
        print(f"{kind:18} {len(fired):3} of {runs} not taken as static")


def print_vibration(runs):
    print("vibration, standard deviations of the noise; found, of which ends to 1 s")
    for axes in ("", "accel", "accel_z"):
        for size in (1.0, 1.5, 2.0, 3.0, 10.0):
            row = []
            for share in (0.05, 0.1, 0.33, 0.6):
                found = near = 0
                for seed in range(runs):
                    recording, ends = vibrating(seed, size, share, axes, seed % 2 == 0)
                    rest = rest_of(recording)
                    if rest is not None:
                        found += 1
                        gaps = np.array([*rest.stretches]).ravel()
                        wanted = [e for e in ends if SHORTEST < e < 600.0 - SHORTEST]
                        near += all(np.min(np.abs(gaps - e), initial=9.0) < 1.0 for e in wanted)
                row.append(f"{share:4.0%}: {found:3} {near:3}")
            print(f"{axes or 'all axes':8} x{size:<4g} {'  '.join(row)}")


def print_logs(logs):
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


def print_tails(logs):
    for freedom in (3.0, 4.0, 5.0):
        right, off, ratio = 0, [0.0], []
        for kind, seed in ((kind, seed) for kind in ("flight", "drive") for seed in range(logs)):
            recording, rest = log(kind, seed, freedom)
            found = gmwm.find_still(recording).stretches
            if same := len(found) == len(rest):
                off.append(np.max(np.abs(np.array(found) - np.array(rest))))
            right += same
            for channel in recording.inertial if found else ():
                near, all_of = (
                    np.concatenate(
                        [np.diff(channel.values[round(a * RATE) + 20 : round(b * RATE) - 20])
                         for a, b in some]
                    )
                    for some in (found, rest)
                )  # fmt: skip
                ratio.append(np.std(near) / np.std(all_of))
        print(
            f"t{freedom:.0f}: every stretch found in {right} of {2 * logs} logs, ends off by "
            f"{max(off):.2f} s at most; deviation {np.mean(ratio or np.nan):.4f} of all of the rest"
        )


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument(
        "what", choices=("logs", "tails", "vibration", "static"), default="logs", nargs="?"
    )
    parser.add_argument("--logs", type=int, default=100)
    given = parser.parse_args()
    {"logs": print_logs, "tails": print_tails, "vibration": print_vibration,
     "static": print_static}[given.what](given.logs)  # fmt: skip


if __name__ == "__main__":
    main()
