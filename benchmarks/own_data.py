"""Sensor models compared on a log by outages cut into it: is the better one named?

Run with ``python benchmarks/own_data.py`` (an hour; ``--runs 10`` for a first look). A car's drives
are emulated. The true models are compared with some whose errors are 10 % larger, and two
calibrations of one sensor with each other. Whether those are equal is computed: by covariance
analysis their true errors and scores differ by no more than a comparison takes for a tie, or they
are apart. For each pair are printed the mean ratio of the errors over all logs, how often the model
is named that is better, how often the other, ties, the ratio that such a log resolves on average,
and an interval of 95 % (Clopper & Pearson 1934) for how often the better one is named, or a tie
found of equal models. ``--store FILE`` keeps the logs that are done, and goes on with them.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from gmwm.ins import SensorModels, car_drive, compare, gnss, tuning
from gmwm.ins.covariance import Course
from gmwm.ins.filter import Outage
from gmwm.ins.simulation import Scenario
from gmwm.study.demo import sensors

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from emulated_logs import emulated_log

NAMES = ("larger", "calibrated")

WORSE = 2.3
"""Factor on the slow errors of the model whose errors are some 10 % larger."""

CALIBRATED = 0.12
"""Logarithmic error, 1 sigma, of each number of a model from a recording of some hours."""


def _pair(name: str, seed: int) -> tuple[SensorModels, SensorModels]:
    if name == "larger":
        return sensors(), sensors(slow=WORSE)
    rng = np.random.default_rng([seed, 1])
    gyro, accel, slow, tau = np.exp(CALIBRATED * rng.standard_normal((4, 2)))
    first, second = (
        sensors(gyro=gyro[i], accel=accel[i], slow=slow[i], tau=100.0 * tau[i]) for i in (0, 1)
    )
    return first, second


@cache
def _course() -> tuple[Course, list[float]]:
    """Outages of half a minute every minute of a drive."""
    drive = car_drive(duration=700.0, dt=0.05)
    outages = tuple(Outage(90.0 + 60.0 * i, tuning.OUTAGE) for i in range(10))
    aiding = gnss(drive, velocity_sd=(0.1, 0.1, 0.15))
    return Course.of(Scenario(drive, aiding, outages)), [each.end for each in outages]


def _expected(believed: SensorModels) -> tuple[float, float]:
    """Logarithm of the true errors, and the score, at the ends of outages."""
    course, ends = _course()
    found = course.analyse(sensors(), believed)
    at = [found.index(end) for end in ends]
    return 0.5 * float(np.log(np.mean(found.sd[at, :3] ** 2))), float(np.mean(found.score()[at]))


def _better(name: str, seed: int) -> str:
    """Which of a pair is better by more than a tie; "" if they are equal."""
    first, second = (_expected(each) for each in _pair(name, seed))
    for a, b, tie in zip(first, second, (tuning.TIE_RATIO, tuning.TIE_SCORE), strict=True):
        if abs(a - b) > tie:
            return "first" if a < b else "second"
    return ""


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
    print("pair     logs  ratio better  other  tie  resolved  right, 95 %")
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
        better = [_better(name, each["seed"]) for each in found]
        for row, wanted in ((name if name == "larger" else "apart", True), ("equal", False)):
            part = [(e, b) for e, b in zip(found, better, strict=True) if bool(b) == wanted]
            if part:
                _row(row, *zip(*part, strict=True))


def _row(name: str, found: Sequence[dict[str, Any]], better: Sequence[str]) -> None:
    tie = sum(each["named"] == "tie" for each in found)
    named = sum(each["named"] == one for each, one in zip(found, better, strict=True))
    sure = binomtest(named if any(better) else tie, len(found)).proportion_ci(0.95)
    ratio = np.exp(np.mean([np.log(each["ratio"]) for each in found]))
    print(
        f"{name:8} {len(found):>4} {ratio:>6.3f} {named:>6} {len(found) - named - tie:>6} {tie:>4} "
        f"{np.mean([each['resolved'] for each in found]):>9.3f}  {sure.low:.3f} .. {sure.high:.3f}",
        flush=True,
    )


if __name__ == "__main__":
    main()
