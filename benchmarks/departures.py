"""Steps, pulses, transients and slow periods: false alarms, and the sizes that are found.

Records of two hours at 1 Hz with the white noise of a gyro of 1e-4 rad/s/sqrt(Hz). Sizes are in
standard deviations of a sample of that noise at 100 Hz (1e-3 rad/s).

    python benchmarks/departures.py false [--runs 400] [--models N+K ...]
    python benchmarks/departures.py power [--runs 20] [--models N+K ...] [--kinds "step at 0.6" ...]
    python benchmarks/departures.py jumps [--runs 20] [--models N+K ...]

"false" counts records of stationary noise in which a departure is found, by least evidence, and in
brackets those in which one has more than 0.19 of the model's wavelet variance. A model is selected
only where white noise and a random walk leave a departure.

"power" fits the true kinds of noise and a random walk to noise with one departure, which the walk
follows. It prints the per cent of records in which one is found, in which one has more than 0.19,
by least evidence, and in brackets those whose fit would be valid without looking for departures.

"jumps" takes departures off records of a bias that jumps between two levels, and of one to three
steps, and prints in how many of them something is taken off, in how many that is noise of the
sensor, so that the fit is not valid, and how many valid fits predict less than 0.8 of the deviation
after 600 s, with and without a warning of what was taken off.
"""

from __future__ import annotations

import argparse
import warnings

import numpy as np
from scipy.stats import beta

import gmwm
from gmwm import BiasInstability, FitWarning, GaussMarkov, RandomWalk, WhiteNoise
from gmwm.calibration import departures

N, SAMPLE = 1e-4, 1e-3
LENGTH, DT = 7200, 1.0
WHITE = WhiteNoise(N)
NOISES = {
    "N": WHITE,
    "N+K": WHITE + RandomWalk(2e-6),
    "N+3K": WHITE + RandomWalk(6e-6),
    "N+GM 60 s": WHITE + GaussMarkov(1.2e-5, 60.0),
    "N+GM 1000 s": WHITE + GaussMarkov(3e-5, 1000.0),
    "N+B": WHITE + BiasInstability(1.5e-5),
    "N+2GM": WHITE + GaussMarkov(3e-5, 5.0) + GaussMarkov(2e-5, 300.0),
    "N+2GM slow": WHITE + GaussMarkov(3e-5, 20.0) + GaussMarkov(4e-5, 1500.0),
    "N+GM 150 s": WHITE + GaussMarkov(3e-5, 150.0),  # as gyros of docs/real-data.md have it
    "B": WhiteNoise(1e-5) + BiasInstability(5e-5),
}
GAPPED = ("N", "N+K", "N+2GM slow")
EVIDENCE = (100.0, 200.0, 500.0, 1000.0, 2000.0)
HARM = 0.19  # share of the wavelet variance above which a departure can make a fit not valid
TIME = DT * np.arange(LENGTH)
KINDS = {
    "step at 0.6": TIME > 0.6 * LENGTH * DT,
    "pulse of 120 s": (TIME > 0.6 * LENGTH * DT) & (TIME < 0.6 * LENGTH * DT + 120.0),
    "exp(-t/600 s)": np.exp(-TIME / 600.0),
    "drift to 900 s": np.maximum(1.0 - TIME / 900.0, 0.0),
    "period 1500 s": np.sin(2.0 * np.pi * TIME / 1500.0 + 1.0),
    "1.5 periods": np.sin(3.0 * np.pi * TIME / (LENGTH * DT)),
    "half a period": np.sin(np.pi * TIME / (LENGTH * DT)),
}
SIZES = np.array([0.03, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0])


def false_alarms(runs: int, models: list[str]) -> None:
    """Departures found in noise that has none."""
    print(f"{'':<22}found (harmful) with evidence of " + ", ".join(f"{e:g}" for e in EVIDENCE))
    labels = [*NOISES, *(f"{name}, gaps" for name in GAPPED)]
    total, records = np.zeros((2, len(EVIDENCE)), int), 0
    free = gmwm.fit(WhiteNoise() + RandomWalk(), WHITE.simulate(LENGTH, DT, seed=1), DT)
    for label in models or labels:
        name, _, gaps = label.partition(", ")
        counts, kinds, invalid = np.zeros_like(total), [], 0
        for seed in range(runs):
            x = gmwm.simulate(NOISES[name], LENGTH, DT, 10_000 + seed)
            if gaps:
                x[np.random.default_rng(seed).random(LENGTH) < 0.005] = np.nan
                x[2000:2400] = np.nan
            if not departures(free, gmwm.wavelet_variance(x, dt=DT)):
                continue
            recording = gmwm.Recording.from_arrays({"gyro_x": x}, 1.0 / DT, {"gyro": "rad/s"})
            fit = gmwm.calibrate(recording, screening=(), still=False)["gyro_x"]
            found = [each for each in fit.notices if "evidence" in each.values]
            kinds += [f"{each.code} {each.values['evidence']:.0f}" for each in found]
            invalid += "stationary" in fit.reasons
            for i, least in enumerate((0.0, HARM)):
                most = max(
                    (e.values["evidence"] for e in found if e.values["share"] > least), default=0.0
                )
                counts[i] += most >= np.array(EVIDENCE)
        total, records = total + counts, records + runs
        print(f"{label:<22}{_counts(counts)}  of {runs}, {invalid} not valid {kinds}", flush=True)
    upper = 100.0 * beta.ppf(0.95, total + 1, records - total)
    limits = "  ".join(f"{some:.2f} ({harmful:.2f})" for some, harmful in upper.T)
    print(f"{'all':<22}{_counts(total)}  of {records}; 95 % limits, per cent: {limits}")


def _counts(counts: np.ndarray) -> str:
    return "  ".join(f"{some} ({harmful})" for some, harmful in counts.T)


def power(runs: int, models: list[str], kinds: list[str]) -> None:
    """Sizes found in half and in 95 % of the records, and those that make a fit not valid."""
    print("size: found, harmful with evidence of " + ", ".join(f"{e:g}" for e in EVIDENCE), end="")
    print(" (valid without looking), per cent")
    for name in models or ("N", "N+K", "N+2GM"):
        fitted = gmwm.process.as_model(NOISES[name]).opened()
        fitted = fitted if "K" in fitted.params else fitted + RandomWalk()
        for kind in kinds or KINDS:
            shares, rows = [], []
            for size in SIZES:
                found = right = 0
                harmful = np.zeros(len(EVIDENCE), int)
                for seed in range(runs):
                    x = gmwm.simulate(NOISES[name], LENGTH, DT, 20_000 + seed)
                    fit = gmwm.fit(fitted, x + size * SAMPLE * KINDS[kind], DT)
                    each = departures(fit)
                    found += bool(each)
                    right += fit.valid
                    evidence = max((e.evidence for e in each if e.share > HARM), default=0.0)
                    harmful += evidence >= np.array(EVIDENCE)
                shares.append(found / runs)
                parts = " ".join(f"{100 * part / runs:.0f}" for part in harmful)
                rows.append(f"{size:g}: {100 * shares[-1]:.0f}, {parts} ({100 * right / runs:.0f})")
                if len(shares) > 1 and min(shares[-2:]) == 1.0 and harmful[-1] == runs:
                    break
            sizes = SIZES[: len(shares)]
            half, most = (_reached(sizes, np.array(shares), part) for part in (0.5, 0.95))
            print(f"{name:<6} {kind:<15} 50 % {half:.2g}  95 % {most:.2g}", flush=True)
            print("  " + "\n  ".join(rows), flush=True)


def jumps(runs: int, models: list[str]) -> None:
    """Fits that are not valid for the departures that were taken off, and those that are wrong."""
    for name in models or ("N", "N+K", "N+GM 60 s"):
        noise = gmwm.process.as_model(NOISES[name])
        for size in (0.15, 0.4):
            for dwell in (2400.0, 1200.0, 700.0, 400.0):
                draws = [np.random.default_rng(40_000 + seed) for seed in range(runs)]
                flips = [np.cumsum(draw.random(LENGTH) < DT / dwell) % 2 for draw in draws]
                truth = noise + GaussMarkov(0.5 * size * SAMPLE, 0.5 * dwell)
                _print_jumps(f"{name}, {size:g}, every {dwell:g} s", name, size, flips, truth)
            for count in (1, 2, 3):
                draws = [np.random.default_rng(50_000 + seed) for seed in range(runs)]
                steps = [
                    np.sum(
                        draw.choice([-1.0, 1.0], (count, 1))
                        * draw.uniform(0.5, 1.5, (count, 1))
                        * (draw.uniform(0.05, 0.95, (count, 1)) * LENGTH * DT < TIME),
                        axis=0,
                    )
                    for draw in draws
                ]
                _print_jumps(f"{name}, {size:g}, {count} steps", name, size, steps, noise)


def _print_jumps(
    label: str, name: str, size: float, curves: list[np.ndarray], truth: gmwm.Model
) -> None:
    flagged = some = valid = low = silent = 0
    for seed, curve in enumerate(curves):
        x = gmwm.simulate(NOISES[name], LENGTH, DT, 30_000 + seed) + size * SAMPLE * curve
        recording = gmwm.Recording.from_arrays({"gyro_x": x}, 1.0 / DT, {"gyro": "rad/s"})
        fit = gmwm.calibrate(recording, still=False, remove_departures=True)["gyro_x"]
        codes = {notice.code for notice in fit.notices}
        is_low = fit.model.haar_variance(600.0, DT) < 0.8**2 * truth.haar_variance(600.0, DT)
        flagged += "departures-many" in codes
        some += any(notice.values.get("removed") is True for notice in fit.notices)
        valid += fit.valid
        low += fit.valid and is_low
        silent += fit.valid and is_low and "departures-removed" not in codes
    print(
        f"{label:<28} of {len(curves)}: taken off from {some}, noise of the sensor {flagged}, "
        f"valid {valid}, of these below 0.8 after 600 s {low}, without a warning {silent}",
        flush=True,
    )


def _reached(sizes: np.ndarray, shares: np.ndarray, part: float) -> float:
    """Size at which a fraction is reached, between sizes along straight lines in the logarithm."""
    above = np.flatnonzero(shares >= part)
    if above.size == 0:
        return float("inf")
    i = int(above[0])
    if i == 0:
        return float(sizes[0])
    weight = (part - shares[i - 1]) / (shares[i] - shares[i - 1])
    return float(sizes[i - 1] * (sizes[i] / sizes[i - 1]) ** weight)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("study", choices=["false", "power", "jumps"])
    parser.add_argument("--runs", type=int, default=0)
    parser.add_argument("--models", nargs="*", default=[])
    parser.add_argument("--kinds", nargs="*", default=[], help="departures of power")
    given = parser.parse_args()
    warnings.simplefilter("ignore", FitWarning)
    if given.study == "false":
        false_alarms(given.runs or 400, given.models)
    elif given.study == "power":
        power(given.runs or 20, given.models, given.kinds)
    else:
        jumps(given.runs or 20, given.models)


if __name__ == "__main__":
    main()
