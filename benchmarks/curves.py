"""Allan curves without samples against the samples, against their own -1/2 lines, and the truth.

    python benchmarks/curves.py line calibration_1.json [...]
    python benchmarks/curves.py samples a.csv.gz b.csv.gz --rate 100 --gyro deg/s --accel g
    python benchmarks/curves.py stored curves.json
    python benchmarks/curves.py coverage --runs 200 --seed 21

``line``: N of each axis over N of the -1/2 line of its Allan curve in per cent. That is the median
of sigma sqrt(tau) at the octaves where the log slope of the curve, over an octave each way, is
within 0.05 of -1/2. In the second column the curve is without what the model's periodic lines and
resonances add, whose humps cross that slope by chance.

``samples``: a model of the structure of each axis, evident departures subtracted, is fitted to the
curve at octaves without the first two and the last and at 92 log-spaced averaging times. Printed
are N and K of the sensor and of a filter for 60 s, and the error of angle or velocity that these
predict at its end, over those of the fit to samples, in per cent; a star is before those of a fit
that is marked not valid.

``stored``: the -1/2 line of curves of imu_utils, or of R's packages wv and avar, by sensor and
axis, what is selected, and whether larger models fit worse than their parts.

``coverage``: how often 95 % intervals of fits to curves hold the truth, 20,000 samples at 20 Hz.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import gmwm
from gmwm import (
    BiasInstability,
    GaussMarkov,
    Model,
    QuantizationNoise,
    RandomWalk,
    Resonance,
    WhiteNoise,
)
from gmwm.calibration import axis_numbers
from gmwm.errors import InputError
from gmwm.filter_numbers import AxisFilterNumbers

SLOPE, MANY, HORIZON = 0.05, 92, 60.0
LADDER = ("N", "N + K", "N + GM", "N + GM + K", "N + GM + GM", "N + GM + GM + K")
LADDER += ("Q + N + GM + GM + K",)
DT, SAMPLES = 0.05, 20_000
WHITE = WhiteNoise(1e-4)
TRUTHS = {
    "N + K": WHITE + RandomWalk(3e-6),
    "N + B": WHITE + BiasInstability(2e-5),
    "N + GM": WHITE + GaussMarkov(5e-5, 30.0),
    "Q + N + K": QuantizationNoise(1e-5) + WHITE + RandomWalk(3e-6),
}


def line(tau: np.ndarray, deviation: np.ndarray) -> tuple[float, int]:
    """N of the -1/2 line, and at how many averaging times there is one."""
    x, y = np.log(tau), np.log(deviation)
    lower, upper = (np.interp(x + step, x, y) for step in (-np.log(2.0), np.log(2.0)))
    inside = (x - np.log(2.0) >= x[0]) & (x + np.log(2.0) <= x[-1])
    slope = (upper - lower) / (2.0 * np.log(2.0))
    there = inside & (np.abs(slope + 0.5) <= SLOPE)
    if not there.any():
        return float("nan"), 0
    return float(np.median(deviation[there] * np.sqrt(tau[there]))), int(there.sum())


def change(value: float, other: float) -> str:
    """Per cent above another."""
    return f"{100.0 * (value / other - 1.0):+9.1f}" if value > 0.0 < other else f"{'-':>9}"


def predicted(numbers: AxisFilterNumbers) -> float:
    """Error of angle or velocity that a filter predicts at the end of the horizon."""
    return math.sqrt(numbers.N**2 * HORIZON + numbers.K**2 * HORIZON**3 / 3.0)


def of_lines(options: argparse.Namespace) -> None:
    """A row for each axis of calibrations: N over that of the -1/2 line, and octaves on it."""
    print("N over that of the -1/2 line, octaves on it    as measured   without vibration")
    for file in options.files:
        calibration = gmwm.load(file)
        for name, fit in calibration.items():
            wv, cells = fit.wv, ""
            bent = [t for t in fit.model.terms if t.is_line or isinstance(t, Resonance)]
            added = Model(tuple(bent)).haar_variance(wv.tau, wv.dt) if bent else 0.0
            for part in (0.0, added):
                left = np.maximum(wv.variance - part, np.finfo(float).tiny)
                N, many = line(wv.tau, np.sqrt(2.0 * left))
                cells += f"  {change(calibration.numbers[name].N.value, N)} % {many:3}"
            state = "valid" if fit.valid else "not valid"
            print(f"{calibration.source:24}{name:9}{state:10}{cells}", flush=True)


def without(recording: gmwm.Recording, sensor: str) -> gmwm.Recording:
    """A recording of one sensor ("" for all), less the departures that a calibration finds."""
    there = tuple(each for each in recording.channels if each.name.startswith(sensor))
    recording = replace(recording, channels=there)
    return gmwm.without_departures(recording, gmwm.calibrate(recording))


def of_samples(options: argparse.Namespace) -> None:
    """A row for each axis, of curves and of what was found of the samples."""
    warnings.simplefilter("ignore", gmwm.FitWarning)
    heads = ("sensor N", "K", "filter N", "K", "error")
    print("per cent: at octaves [2:-1], then at 92 times")
    print(f"{'axis':8}" + 2 * ("  " + "".join(f"{head:>9}" for head in heads)))
    for file in options.files:
        recording = gmwm.read(
            file, rate=options.rate, units={"gyro": options.gyro, "accel": options.accel}
        )
        recording = without(recording, options.sensor)
        print(Path(file).name)
        for name, fit in gmwm.calibrate(recording).items():
            wv, cells = fit.wv, ""
            known = {"rate": 1.0 / wv.dt, "duration": wv.n * wv.dt, "unit": wv.unit, "name": name}
            x = np.asarray(recording[name].values, dtype=float)
            times = np.geomspace(wv.dt, wv.n * wv.dt / 6.0, MANY)
            found = gmwm.deviations(x[np.isfinite(x)], wv.dt, ["overlapping"], times)
            tau, deviation = (getattr(found, k)["overlapping"] for k in ("tau", "deviation"))
            curves = [
                gmwm.curve(wv.tau[2:-1], wv.variance[2:-1], kind="wavelet", **known),
                gmwm.curve(tau, deviation, **known),
            ]
            free = fit.model.with_params(dict.fromkeys(fit.keys))
            own, bound = axis_numbers(fit), gmwm.bound(fit, horizon=HORIZON)
            for curve in curves:
                try:
                    other = gmwm.fit(free, curve)
                except InputError as error:
                    cells += f"   {error}"[:36]
                    continue
                new, filters = axis_numbers(other), gmwm.bound(other, horizon=HORIZON)
                cells += " " + (" " if other.valid else "*")
                cells += change(new.N.value, own.N.value) + change(new.K.value, own.K.value)
                cells += change(filters.N, bound.N) + change(filters.K, bound.K)
                cells += change(predicted(filters), predicted(bound))
            print(f"{name:8}{cells}", flush=True)


def stored(file: str) -> Iterator[tuple[str, str, gmwm.Curve]]:
    """Sensor, axis and curve of imu_utils, or of R: octaves from one or two samples on."""
    for sensor, content in json.loads(Path(file).read_text()).items():
        if "gyr" in content:
            for kind, axis in itertools.product(("gyr", "acc"), "xyz"):
                own, name = content[kind], f"{kind}_{axis}"
                yield (
                    sensor,
                    name,
                    gmwm.curve(own["tau"], own[axis], unit=own["unit_adev"], name=name),
                )
            continue
        rate = content.get("rate", 1.0)
        for name, own in content.get("axes", {"": content}).items():
            kind = "wavelet" if "wavelet_variance" in own else "variance"
            values = own["wavelet_variance" if kind == "wavelet" else "allan_variance"]
            tau = 2.0 ** (np.arange(len(values)) + (kind == "variance")) / rate
            yield (
                sensor,
                name,
                gmwm.curve(tau, values, kind=kind, rate=rate, duration=content["n"] / rate),
            )


def worst_rise(curve: gmwm.Curve) -> float:
    """Largest rise of the discrepancy from a model to one that has it as a part, in per cent."""
    parts = [Counter(label.split(" + ")) for label in LADDER]
    found = [100.0 * gmwm.fit(label, curve).discrepancy for label in LADDER]
    return max(
        found[large] - found[small]
        for small, large in itertools.permutations(range(len(LADDER)), 2)
        if parts[small] < parts[large]
    )


def of_stored(options: argparse.Namespace) -> None:
    """A row for each axis of stored curves."""
    warnings.simplefilter("ignore", gmwm.FitWarning)
    print("at: times on the -1/2 line; N: of the sensor over that of the line, %; larger: rise of")
    print("the discrepancy from a model to a larger one, at most, % (<= 0: never worse)")
    print("sensor, axis              at         N   larger  fit, and what is selected")
    for sensor, name, curve in stored(options.files[0]):
        N, many = line(curve.tau, np.sqrt(2.0 * curve.variance))
        fit = gmwm.select(curve).fit
        found, rise = axis_numbers(fit).N.value, worst_rise(curve)
        state = "valid" if fit.valid else f"not valid ({', '.join(fit.reasons)})"
        kinds = " + ".join(term.short_name for term in fit.model.terms)
        print(
            f"{sensor:19}{name:9}{many:3}{change(found, N):>10}{rise:9.2f}  {state}: {kinds}",
            flush=True,
        )


def coverage(options: argparse.Namespace) -> None:
    """A row for each truth."""
    print(f"{options.runs} curves each, seed {options.seed}: per cent of 95 % intervals that hold")
    for place, (name, truth) in enumerate(TRUTHS.items()):
        held = dict.fromkeys(truth.params, 0)
        times = np.geomspace(DT, SAMPLES * DT / 6.0, MANY)
        for run in range(options.runs):
            x = truth.simulate(SAMPLES, DT, np.random.default_rng([options.seed, place, run]))
            found = gmwm.deviations(x, DT, ["overlapping"], times)
            tau, deviation = (getattr(found, key)["overlapping"] for key in ("tau", "deviation"))
            curve = gmwm.curve(tau, deviation, rate=1.0 / DT, duration=SAMPLES * DT)
            for key, (low, high) in gmwm.fit(name, curve).interval(0.95).items():
                held[key] += bool(low <= truth.params[key] <= high)
        cells = ", ".join(f"{key} {100.0 * n / options.runs:.1f}" for key, n in held.items())
        print(f"{name:10} {cells}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("line", "samples", "stored", "coverage"))
    parser.add_argument("files", nargs="*")
    parser.add_argument("--rate", type=float, default=100.0)
    parser.add_argument("--gyro", default="rad/s")
    parser.add_argument("--accel", default="m/s^2")
    parser.add_argument("--sensor", default="", help="gyro or accel; both if left out")
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=21)
    options = parser.parse_args()
    {"line": of_lines, "samples": of_samples, "stored": of_stored, "coverage": coverage}[
        options.what
    ](options)


if __name__ == "__main__":
    main()
