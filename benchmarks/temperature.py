"""Curves of temperature beside noise: coverage, K^2 over the truth, and least squares beside it.

    python benchmarks/temperature.py [--runs 100] [--seed 5] [--setting NAME ...] [--effects]

White noise and a random walk on a cubic curve, 1,024 s at 1 Hz, in a warm-up, two cycles and three
soaks; with "100 Hz" in its name, one hour at 100 Hz. "coefficients": share of the 95 % intervals of
the coefficients that hold the truth; "curve": that of the curve at eight temperatures against its
centre; "K^2": mean over the truth; "K": share of its intervals. "least squares" is a polynomial by
least squares with white residuals, and noise fitted to what it leaves. ``--effects`` adds a lag of
120 s and settling of 60 s to truth and model.
"""

from __future__ import annotations

import argparse
import time
import warnings

import numpy as np

import gmwm
from gmwm import RandomWalk, WhiteNoise

N, K = 1.0, 0.05  # at 1 s
CURVE = np.array([20.0, 8.0, 6.0])  # of powers of (T - 45) / 20
LAG, LAG_SIZE, SETTLING, SETTLING_SIZE = 120.0, 10.0, 60.0, 10.0
MODEL = WhiteNoise() + RandomWalk()
SETTINGS = {  # temperature at shares of the record; samples, sampling interval (s)
    "warm-up": (lambda s: 25.0 + 40.0 * (1.0 - np.exp(-4.0 * s)), 1024, 1.0),
    "two cycles": (lambda s: 45.0 - 20.0 * np.cos(4.0 * np.pi * s), 1024, 1.0),
    "soaks": (lambda s: 25.0 + 20.0 * np.interp(s % (1 / 3), [0, 0.1], [-1, 0]) * (s > 1 / 3)
              + 20.0 * np.floor(3.0 * s), 1024, 1.0),
    "warm-up, 100 Hz": (lambda s: 25.0 + 40.0 * (1.0 - np.exp(-4.0 * s)), 360_000, 0.01),
    "two cycles, 100 Hz": (lambda s: 45.0 - 20.0 * np.cos(4.0 * np.pi * s), 360_000, 0.01),
}  # fmt: skip


def recording(setting: str, seed: list[int], effects: bool) -> gmwm.Recording:
    shape, n, dt = SETTINGS[setting]
    rng, when = np.random.default_rng(seed), dt * np.arange(n)
    temperature = shape(np.arange(n) / n)
    u = (temperature - 45.0) / 20.0
    x = CURVE @ np.array([u, u**2, u**3])
    if effects:
        late, keep = temperature.copy(), np.exp(-dt / LAG)
        for k in range(1, n):
            late[k] = keep * late[k - 1] + (1.0 - keep) * temperature[k]
        x += LAG_SIZE * (late - temperature) / 20.0 + SETTLING_SIZE * np.exp(-when / SETTLING)
    x += rng.normal(0.0, N / np.sqrt(dt), n) + np.cumsum(rng.normal(0.0, K * np.sqrt(dt), n))
    channels = {"gyro_x": x, "temperature": temperature + rng.normal(0.0, 0.01, n)}
    return gmwm.Recording.from_arrays(channels, 1.0 / dt, {"gyro": "rad/s", "temperature": "degC"})


def truth(x: np.ndarray) -> np.ndarray:
    u = (x - 45.0) / 20.0
    return CURVE @ np.array([u, u**2, u**3])


def calibrated(rec: gmwm.Recording, effects: bool) -> tuple[list[bool], list[bool], gmwm.Fit]:
    words = {"temperature": f"cubic, lag {LAG:g} s"} | {"settling": f"{SETTLING:g} s"}
    given = words if effects else {"temperature": "cubic"}
    cal = gmwm.calibrate(rec, MODEL, screening=(), covariates=given, jobs=1)
    curve = cal.curves["gyro_x"]
    one = curve.main
    # The truth in powers about the covariate's centre.
    power = np.polynomial.Polynomial([0.0, *CURVE])(
        np.polynomial.Polynomial([(one.centre - 45.0) / 20.0, one.half / 20.0])
    ).coef[1:]
    true = [*power, *([LAG_SIZE / 20.0 * one.half, SETTLING_SIZE] if effects else [])]
    held = np.abs(curve.values - true) <= curve.errors(np.eye(len(true)))
    at = np.linspace(one.low, one.high, 8)
    _, value, error = curve.band(at)
    off = value - curve(one.centre) - truth(at) + truth(np.array([one.centre]))
    return held.tolist(), (np.abs(off) <= error).tolist(), cal["gyro_x"]


def least_squares(rec: gmwm.Recording) -> tuple[list[bool], list[bool], gmwm.Fit]:
    x, temperature = rec["gyro_x"].values, rec["temperature"].values
    u = (temperature - 45.0) / 20.0
    design = np.stack([np.ones(u.size), u, u**2, u**3], axis=1)
    found, square = np.linalg.lstsq(design, x, rcond=None)[:2]
    covariance = np.linalg.inv(design.T @ design) * float(square[0]) / (x.size - 4)
    held = np.abs(found[1:] - CURVE) <= 1.96 * np.sqrt(np.diag(covariance))[1:]
    own = np.linspace(np.min(u), np.max(u), 8)
    middle = 0.5 * (own[0] + own[-1])
    contrast = np.stack([own**k - middle**k for k in range(4)], axis=1)
    error = 1.96 * np.sqrt(np.einsum("ki,ij,kj->k", contrast, covariance, contrast))
    off = contrast[:, 1:] @ (found[1:] - CURVE)
    return (
        held.tolist(),
        (np.abs(off) <= error).tolist(),
        gmwm.fit(MODEL, x - design @ found, rec.dt),
    )


def rows(setting: str, runs: int, first: int, effects: bool) -> None:
    found: dict[str, list] = {"least squares": [], "calibrated": []}
    start = time.process_time()
    for seed in range(runs):
        rec = recording(setting, [first, seed], effects)
        if not effects:
            found["least squares"].append(least_squares(rec))
        found["calibrated"].append(calibrated(rec, effects))
    for name, each in found.items():
        if not each:
            continue
        held, covered = (100.0 * np.mean([run[k] for run in each]) for k in (0, 1))
        square = [(fit.params["K"] / K) ** 2 for *_, fit in each]
        ends = [fit.interval()["K"] for *_, fit in each]
        inside = 100.0 * np.mean([low <= K <= high for low, high in ends])
        error = np.std(square) / np.sqrt(len(square))
        print(f"{setting:20}{name:14}{runs:5}{held:10.1f} %{covered:8.1f} %"
              f"{np.mean(square):8.2f} +-{error:.2f}{inside:8.1f} %", flush=True)  # fmt: skip
    print(f"{'':20}{(time.process_time() - start) / runs:.2f} s of CPU a run", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=5)
    usual = [name for name in SETTINGS if "100 Hz" not in name]
    parser.add_argument("--setting", choices=SETTINGS, nargs="*", default=usual)
    parser.add_argument("--effects", action="store_true", help="a lag and settling too")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    print(f"{'':34} runs  coefficients  curve      K^2           K")
    for each in given.setting:
        rows(each, given.runs, given.seed, given.effects)
