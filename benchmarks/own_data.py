"""Sensor models compared on a log by outages cut into it: is the better one named?

Run with ``python benchmarks/own_data.py`` (an hour; ``--runs 10`` for a first look). A car's drives
are emulated. The true models are compared with some whose errors are 10 % larger, and two
calibrations of one sensor with each other, which are equally good. For each pair are printed the
mean ratio of the errors over all logs, how often the first model is named, how often the second,
ties, the ratio that such a log resolves on average, and an interval of 95 % (Clopper & Pearson
1934) for how often the first is named, or a tie found of equal models. ``--store FILE`` keeps the
logs that are done, and goes on with them.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

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


def _log(name: str, seed: int, minutes: float) -> dict[str, Any]:
    """What is found in one log."""
    log, _ = emulated_log(seed, duration=60.0 * minutes, rate=20.0)
    first, second = _pair(name, seed)
    found = compare(log, {"first": first, "second": second})
    verdict = found.verdict
    return {
        "pair": name, "seed": seed, "minutes": minutes, "code": verdict.code,
        "named": verdict.where if verdict.code in ("better", "more-honest") else "tie",
        "ratio": found.pairs["first", "second"].ratio, "resolved": found.resolved,
    }  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=5000)
    parser.add_argument("--pair", choices=NAMES, nargs="*", default=NAMES)
    parser.add_argument("--store", type=Path, help="logs that are done, one a line")
    arguments = parser.parse_args()
    store: Path | None = arguments.store
    lines = store.read_text().splitlines() if store is not None and store.exists() else []
    done = {(d["pair"], d["seed"], d["minutes"]): d for d in map(json.loads, lines)}
    print("pair     logs  ratio  first  second  tie  resolved  right, 95 %")
    for name in arguments.pair:
        found = []
        for seed in range(arguments.seed, arguments.seed + arguments.runs):
            each = done.get((name, seed, arguments.minutes))
            if each is None:
                each = _log(name, seed, arguments.minutes)
                if store is not None:
                    with store.open("a") as stream:
                        stream.write(json.dumps(each) + "\n")
            found.append(each)
        named = [each["named"] for each in found]
        count = {each: named.count(each) for each in ("first", "second", "tie")}
        right = count["first" if name == "larger" else "tie"]
        sure = binomtest(right, len(named)).proportion_ci(0.95)
        ratio = np.exp(np.mean([np.log(each["ratio"]) for each in found]))
        print(
            f"{name:8} {len(named):>4} {ratio:>6.3f} {count['first']:>6} {count['second']:>7} "
            f"{count['tie']:>4} {np.mean([each['resolved'] for each in found]):>9.3f}  "
            f"{sure.low:.3f} .. {sure.high:.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
