"""Faults of IMU and GNSS logs: are they named, and are right models left in peace?

Run with ``python benchmarks/faults.py`` (ten minutes; ``--clean 20`` for a first look). Logs are
emulated, five minutes at 20 Hz with a fix a second:

- each fault of `emulated_logs.FAULTS`, some together, and wrong sensor models; printed is what the
  verdict names, with values and standard errors;
- logs without a fault: how many are blamed, out of how many. The thresholds follow from the
  probability of a false alarm; none was adjusted to these seeds.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from gmwm.errors import InputError
from gmwm.ins import Navigated, SensorModels
from gmwm.study.demo import sensors

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from emulated_logs import FAULTS, emulated_log

TOGETHER = (("stamps", "lever arm"), ("one far", "coloured"), ("outliers", "stamps"))
COARSE = {"gyro": 30.0, "accel": 100.0}
"""Factors on white noise of a sensor so poor, or so shaken, that it shows between two fixes."""

WRONG: dict[str, SensorModels] = {
    f"{kind} N x {factor:g}": sensors(**{**COARSE, kind: factor * COARSE[kind]})
    for kind in COARSE
    for factor in (0.1, 10.0)
}
DRIVE = {"duration": 300.0, "rate": 20.0}
CLEAN = 2000  # first seed of the logs without a fault
VEHICLES = ("car", "helicopter", "loiter")


def _shown(found: Navigated) -> str:
    parts = []
    for fault in found.faults.found:
        numbers = ", ".join(
            f"{name} {value:.3g}" + (f" ({fault.errors[name]:.1g})" if name in fault.errors else "")
            for name, value in fault.values.items()
        )
        parts.append(f"{' or '.join((fault.name, *fault.rivals))}: {numbers}")
    rest = "" if found.faults.explained else "; not all is explained"
    return ("; ".join(parts) or found.verdict.code) + rest


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clean", type=int, default=100, help="logs without a fault")
    parser.add_argument("--seed", type=int, default=1000, help="the first")
    arguments = parser.parse_args()
    for vehicle in VEHICLES:
        print(f"{vehicle}, one fault or several, seed {arguments.seed}")
        for faults in (*((each,) for each in FAULTS), *TOGETHER):
            log, _ = emulated_log(arguments.seed, vehicle, **DRIVE, faults=faults)
            print(f"  {' + '.join(faults):22} {_shown(Navigated.of(log))}", flush=True)
        for name, believed in WRONG.items():
            log, _ = emulated_log(
                arguments.seed, vehicle, **DRIVE, truth=sensors(**COARSE), believed=believed
            )
            print(f"  {name:22} {_shown(Navigated.of(log))}", flush=True)
    for title, truth in (("", sensors()), (", noisy sensors", sensors(**COARSE))):
        blamed, tried = [], 0
        for i in range(arguments.clean):
            vehicle = VEHICLES[i % len(VEHICLES)]
            log, _ = emulated_log(
                CLEAN + i, vehicle, duration=160.0, rate=10.0, velocity=i % 2 == 0, truth=truth
            )
            try:
                found = Navigated.of(log)
            except InputError:  # no attitude can be known
                continue
            tried += 1
            if found.verdict.code != "consistent":
                blamed.append(f"{CLEAN + i} {vehicle}: {_shown(found)}")
        print(f"without a fault{title}: {len(blamed)} of {tried} blamed", *blamed,
              sep="\n  ")  # fmt: skip


if __name__ == "__main__":
    main()
