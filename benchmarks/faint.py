"""Whether intervals of a selected model hold truths whose terms are too faint to be chosen.

    python benchmarks/faint.py [--truths 60] [--runs 5]

Truths are drawn: white noise, quantization noise in three of ten, none to three Gauss-Markov
processes of 0.15 to 3 times the white noise at their peak, a random walk in six of ten, in half an
hour to five and a half at 5 to 20 Hz. At 1, 10, 60 and 600 s, in records 30 times as long: how
often `Fit.deviation_interval` (95 %) of the selected model alone, and with rivals and what the data
leave open, holds the true Allan deviation, and the ratio of the logarithmic widths. Then how often
the deviation of ``bound(fit, "N+K", 60, level=0.95)`` is below the truth from 6 to 60 s.
"""

from __future__ import annotations

import argparse
import warnings

import numpy as np

import gmwm
from gmwm import GaussMarkov, Model, QuantizationNoise, RandomWalk, WhiteNoise

TIMES = np.array([1.0, 10.0, 60.0, 600.0])
WITHIN = np.geomspace(6.0, 60.0, 9)


def drawn(number: int) -> tuple[Model, int, float]:
    """True model, number of samples and sampling interval (s)."""
    rng = np.random.default_rng([4242, number])
    dt = float(rng.choice([0.05, 0.1, 0.2]))
    n = int(float(rng.choice([0.5, 1.0, 2.0, 5.5])) * 3600.0 / dt)
    model = gmwm.process.as_model(WhiteNoise(1.0))
    if rng.random() < 0.3:
        model += QuantizationNoise(float(dt * rng.uniform(1.0, 6.0)))
    for _ in range(rng.integers(0, 4)):
        tau = float(np.exp(rng.uniform(np.log(10.0 * dt), np.log(n * dt / 20.0))))
        relative = np.exp(rng.uniform(np.log(0.15), np.log(3.0)))
        model += GaussMarkov(float(relative / np.sqrt(1.89 * tau * 0.38)), tau)
    if rng.random() < 0.6:
        crossing = float(np.exp(rng.uniform(np.log(30.0 * dt), np.log(n * dt))))
        model += RandomWalk(float(np.sqrt(3.0) / crossing))
    return model, n, dt


def main(truths: int, runs: int) -> None:
    warnings.simplefilter("ignore")
    held = np.zeros((2, TIMES.size))
    growth: list[list[float]] = [[] for _ in TIMES]
    below = rejected = 0
    for number in range(truths):
        truth, n, dt = drawn(number)
        for seed in range(runs):
            wv = gmwm.wavelet_variance(truth.simulate(n, dt, [number, seed]), dt)
            chosen = gmwm.select(wv)
            tau = TIMES[n * dt >= 30.0 * TIMES]
            true = np.sqrt(2.0 * truth.haar_variance(tau, dt))
            rivals = [each.model for each in chosen.rivals]
            ends = [chosen.fit.deviation_interval(tau, rivals=some)[1:] for some in (None, rivals)]
            for row, (low, high) in enumerate(ends):
                held[row, : tau.size] += (low <= true) & (true <= high)
            wide, wider = (np.log(high / low) for low, high in ends)
            for each, more in zip(growth, wider / wide, strict=False):
                each.append(float(more))
            try:
                numbers = gmwm.bound(chosen.fit, "N+K", 60.0, level=0.95).model
            except gmwm.InputError:  # a parameter that the record does not bound
                rejected += 1
                continue
            believed, needed = (m.haar_variance(WITHIN, dt) for m in (numbers, truth))
            below += bool(np.any(believed < needed))
    print("tau, s  records    alone  with the process     width, median")
    for k, tau in enumerate(TIMES):
        count = len(growth[k])
        alone, open_ = 100.0 * held[:, k] / count
        print(f"{tau:6g}{count:9}{alone:7.1f} %{open_:17.1f} %{np.median(growth[k]):15.2f}")
    shares = 100.0 * held.sum(axis=1) / sum(map(len, growth))
    print(f"all{sum(map(len, growth)):12}{shares[0]:7.1f} %{shares[1]:17.1f} %", end="")
    print(f"{np.median(np.concatenate(growth)):15.2f}")
    print(f"bound of level 0.95 below the truth: {below} of {truths * runs}, rejected: {rejected}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--truths", type=int, default=60)
    parser.add_argument("--runs", type=int, default=5)
    arguments = parser.parse_args()
    main(arguments.truths, arguments.runs)
