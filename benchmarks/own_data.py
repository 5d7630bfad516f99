"""Sensor models compared on a log by outages cut into it: is the better one named?

Run with ``python benchmarks/own_data.py`` (an hour; ``--runs 10`` for a first look). A car's drives
are emulated. The true models are compared with some whose errors are 10 % larger, and two
calibrations of one sensor with each other, which are equally good. For each pair are printed the
mean ratio of the errors over all logs, how often the first model is named, how often the second,
ties, and the ratio that such a log resolves on average.
"""

from __future__ import annotations

import argparse

import numpy as np

from gmwm.ins import SensorModels, compare
from gmwm.study import emulated_log, sensors

NAMES = ("larger", "equal")

WORSE = 2.3
"""Factor on the slow errors of the model whose errors are some 10 % larger."""

CALIBRATED = 0.12
"""Logarithmic error, 1 sigma, of each number of a model from a recording of some hours: two such
calibrations of one sensor are as good as each other."""


def _pair(name: str, seed: int) -> tuple[SensorModels, SensorModels]:
    if name == "larger":
        return sensors(), sensors(slow=WORSE)
    rng = np.random.default_rng([seed, 1])
    gyro, accel, slow, tau = np.exp(CALIBRATED * rng.standard_normal((4, 2)))
    first, second = (
        sensors(gyro=gyro[i], accel=accel[i], slow=slow[i], tau=100.0 * tau[i]) for i in (0, 1)
    )
    return first, second


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=5000)
    parser.add_argument("--pair", choices=NAMES, nargs="*", default=NAMES)
    arguments = parser.parse_args()
    print("pair                 ratio  first  second  tie  resolved")
    for name in arguments.pair:
        codes, ratios, resolved = [], [], []
        for seed in range(arguments.seed, arguments.seed + arguments.runs):
            log, _ = emulated_log(seed, duration=60.0 * arguments.minutes, rate=20.0)
            first, second = _pair(name, seed)
            found = compare(log, {"first": first, "second": second})
            verdict = found.verdict
            codes.append(verdict.where if verdict.code in ("better", "more-honest") else "tie")
            ratios.append(np.log(found.pairs["first", "second"].ratio))
            resolved.append(found.resolved)
        count = {each: codes.count(each) for each in ("first", "second", "tie")}
        print(
            f"{name:19} {np.exp(np.mean(ratios)):>6.3f} {count['first']:>6} {count['second']:>7} "
            f"{count['tie']:>4} {np.mean(resolved):>9.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
