"""Curves of temperature beside noise that grows: coverage, bias and errors against the bound.

    python benchmarks/temperature.py [--runs 150] [--seed 5] [--hours 1] [--setting NAME ...]
        [--walk 0.02] [--select]

White noise whose deviation grows by 30 % over 40 degC and a random walk, on a cubic curve with a
lag of 120 s and settling of 60 s at switch-on, at 100 Hz, in a warm-up, two cycles and three soaks.
"beta": share of the 95 % intervals of the coefficients that hold the truth; "curve": that of the
curve at eight temperatures against its centre; "gamma", "N", "K": that of the growth and the
parameters; "K^2": mean over the truth. The last columns are root mean square errors over those of
the bound: of K, and of the curve. "least squares" is a regression with white residuals, and noise
fitted to what it leaves.

The bound is the inverse of the Fisher information of the exact Gaussian likelihood, of variances
that change with time. That of the parameters is of the restricted likelihood (Harville 1974,
*Biometrika* 61, 383-385): what the unknown coefficients take tells nothing of the noise.
"""

from __future__ import annotations

import argparse
import time
import warnings
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

import gmwm
from gmwm import RandomWalk, WhiteNoise

N, DT = 1.0, 0.01  # at 1 s
GAMMA = np.log(1.3) / 40.0
CURVE = np.array([20.0, 8.0, 6.0])  # of powers of (T - 45) / 20
LAG, LAG_SIZE, SETTLING, SETTLING_SIZE = 120.0, 10.0, 60.0, 10.0
MODEL = WhiteNoise() + RandomWalk()
GIVEN = {"temperature": f"cubic, lag {LAG:g} s", "settling": f"{SETTLING:g} s"}
SETTINGS = {  # temperature at shares of the record
    "warm-up": lambda s: 25.0 + 40.0 * (1.0 - np.exp(-4.0 * s)),
    "two cycles": lambda s: 45.0 - 20.0 * np.cos(4.0 * np.pi * s),
    "soaks": lambda s: 25.0 + 20.0 * np.interp(3.0 * s, [1.0, 1.3, 2.0, 2.3], [0.0, 1.0, 1.0, 2.0]),
}
BLOCK = 300  # samples; smaller ones change the bound by less than 1 %


@dataclass(frozen=True)
class Truth:
    """A record without noise.

    columns: (5, n), of the coefficients ``sizes``.
    walk: K of the noise.
    """

    walk: float
    temperature: np.ndarray
    columns: np.ndarray
    sizes: np.ndarray

    @classmethod
    def of(cls, setting: str, hours: float, walk: float) -> Truth:
        n = round(3600.0 * hours / DT)
        temperature = SETTINGS[setting](np.arange(n) / n)
        keep = np.exp(-DT / LAG)
        start = temperature[0]
        late = start + lfilter([1.0 - keep], [1.0, -keep], temperature - start)
        u = (temperature - 45.0) / 20.0
        columns = [u, u**2, u**3, (late - temperature) / 20.0]
        columns.append(np.exp(-DT * np.arange(n) / SETTLING))
        return cls(
            walk, temperature, np.array(columns), np.array([*CURVE, LAG_SIZE, SETTLING_SIZE])
        )

    @property
    def growth(self) -> np.ndarray:
        return np.exp(GAMMA * (self.temperature - 45.0))

    def recording(self, seed: list[int]) -> gmwm.Recording:
        rng, n = np.random.default_rng(seed), self.temperature.size
        x = self.sizes @ self.columns + N / np.sqrt(DT) * self.growth * rng.normal(size=n)
        x += np.cumsum(self.walk * np.sqrt(DT) * rng.normal(size=n))
        channels = {"gyro_x": x, "temperature": self.temperature + rng.normal(0.0, 0.01, n)}
        return gmwm.Recording.from_arrays(
            channels, 1.0 / DT, {"gyro": "rad/s", "temperature": "degC"}
        )

    def bound(self) -> tuple[float, float]:
        """Standard error of K, and root mean square of those of the curve's contrasts."""
        rows = np.vstack([self.columns, self.growth**2, self.temperature - 45.0])
        rows = rows[:, : rows.shape[1] // BLOCK * BLOCK].reshape(len(rows), -1, BLOCK).mean(axis=2)
        x, white, centred = np.diff(rows[:5]).T, rows[5] * N**2 / (BLOCK * DT), rows[6]

        def tridiagonal(of_block: np.ndarray, walk: float = 0.0) -> np.ndarray:
            """Covariance of differences of block means by white noise of each and a walk."""
            step = walk**2 * BLOCK * DT
            near = np.diag(step / 6.0 - of_block[1:-1], 1)
            return near + near.T + np.diag(of_block[1:] + of_block[:-1] + step * 2.0 / 3.0)

        inverse = np.linalg.inv(tridiagonal(white, self.walk))
        covariance = np.linalg.inv(x.T @ inverse @ x)
        project = inverse - inverse @ x @ covariance @ x.T @ inverse
        slopes = [tridiagonal(white * two) for two in (2.0 + 0.0 * white, 2.0 * centred)]
        slopes.append(2.0 * tridiagonal(0.0 * white, self.walk))
        parts = [project @ slope for slope in slopes]
        information = np.array([[0.5 * np.sum(a * b.T) for b in parts] for a in parts])
        # Samples within a block know the white noise.
        within = np.stack([2.0 + 0.0 * centred, 2.0 * centred])
        information[:2, :2] += 0.5 * (BLOCK - 1.0) * within @ within.T
        contrast = powers(eight(self.temperature))
        variance = np.einsum("ki,ij,kj->k", contrast, covariance[:3, :3], contrast)
        return self.walk * float(np.linalg.inv(information)[2, 2] ** 0.5), float(
            np.mean(variance) ** 0.5
        )


def eight(temperature: np.ndarray) -> np.ndarray:
    return np.linspace(np.min(temperature), np.max(temperature), 8)


def powers(at: np.ndarray) -> np.ndarray:
    """Powers against those at the centre of the range."""
    u, centre = (at - 45.0) / 20.0, (0.5 * (at[0] + at[-1]) - 45.0) / 20.0
    return np.stack([u**k - centre**k for k in (1, 2, 3)], axis=1)


@dataclass(frozen=True)
class Run:
    held: list[bool]
    covered: list[bool]
    gamma: bool
    fit: gmwm.Fit
    off: np.ndarray


def calibrated(rec: gmwm.Recording, model: gmwm.Model | None) -> Run:
    cal = gmwm.calibrate(rec, model, screening=(), covariates=GIVEN, jobs=1)
    curve = cal.curves["gyro_x"]
    one = curve.main
    # The truth in powers about the covariate's centre.
    power = np.polynomial.Polynomial([0.0, *CURVE])(
        np.polynomial.Polynomial([(one.centre - 45.0) / 20.0, one.half / 20.0])
    ).coef[1:]
    true = [*power, LAG_SIZE / 20.0 * one.half, SETTLING_SIZE]
    held = np.abs(curve.values - true) <= curve.errors(np.eye(len(true)))
    at = np.linspace(one.low, one.high, 8)
    _, value, error = curve.band(at)
    off = value - curve(one.centre) - powers(at) @ CURVE
    gamma = abs(curve.scaling.gamma - GAMMA) <= curve.scaling.error
    return Run(held.tolist(), (np.abs(off) <= error).tolist(), gamma, cal["gyro_x"], off)


def least_squares(rec: gmwm.Recording, truth: Truth) -> Run:
    x = rec["gyro_x"].values
    design = np.vstack([np.ones(x.size), truth.columns])
    covariance = np.linalg.inv(design @ design.T)
    found = covariance @ (design @ x)
    left = x - found @ design
    covariance *= float(left @ left) / (x.size - len(design))
    held = np.abs(found[1:] - truth.sizes) <= 1.96 * np.sqrt(np.diag(covariance))[1:]
    contrast = powers(eight(truth.temperature))
    error = 1.96 * np.sqrt(np.einsum("ki,ij,kj->k", contrast, covariance[1:4, 1:4], contrast))
    off = contrast @ (found[1:4] - CURVE)
    covered = (np.abs(off) <= error).tolist()
    return Run(held.tolist(), covered, False, gmwm.fit(MODEL, left, rec.dt), off)


def row(runs: list[Run], truth: Truth, bound: tuple[float, float], *, grows: bool) -> str:
    true = {"N": N * float(np.mean(truth.growth**2)) ** 0.5, "K": truth.walk}
    inside = {
        key: [
            low <= value <= high
            for low, high in (run.fit.interval()[key] for run in runs if key in run.fit.params)
        ]
        for key, value in true.items()
    }
    held, covered = (np.mean([getattr(run, key) for run in runs]) for key in ("held", "covered"))
    shares = [held, covered, np.mean([run.gamma for run in runs]) if grows else np.nan]
    shares += [np.mean(inside[key]) for key in "NK"]
    found = np.array([run.fit.params.get("K", 0.0) for run in runs])
    square = (found / truth.walk) ** 2
    errors = [
        np.mean((found - truth.walk) ** 2) ** 0.5,
        np.mean([run.off**2 for run in runs]) ** 0.5,
    ]
    return (
        "".join(f"{100.0 * share:7.1f}" for share in shares)
        + f"{np.mean(square):7.2f} +-{np.std(square) / np.sqrt(len(runs)):.2f}"
        + "".join(f"{error / least:7.2f}" for error, least in zip(errors, bound, strict=True))
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=150)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--setting", choices=SETTINGS, nargs="*", default=[*SETTINGS])
    parser.add_argument("--walk", type=float, default=0.02, help="K of the noise")
    parser.add_argument("--select", action="store_true", help="select models")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    print(f"{'':24} runs   beta  curve  gamma      N      K    K^2         K  curve")
    for setting in given.setting:
        truth, start = Truth.of(setting, given.hours, given.walk), time.process_time()
        bound = truth.bound()
        found: dict[str, list[Run]] = {"least squares": [], "calibrated": []}
        for seed in range(given.runs):
            rec = truth.recording([given.seed, seed])
            found["least squares"].append(least_squares(rec, truth))
            found["calibrated"].append(calibrated(rec, None if given.select else MODEL))
        for name, runs in found.items():
            shown = row(runs, truth, bound, grows=name == "calibrated")
            print(f"{setting:11}{name:13}{given.runs:5}{shown}", flush=True)
        print(f"{'':24}{(time.process_time() - start) / given.runs:.2f} s of CPU a run", flush=True)


if __name__ == "__main__":
    main()
