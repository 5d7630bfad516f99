"""Covariance analysis against Monte Carlo: its time in runs of Monte Carlo, and the agreement.

Run with ``python benchmarks/covariance_analysis.py``. A helicopter's flight of 15 minutes at 100 Hz
with a GNSS position a second and an outage of a minute; the truth has two Gauss-Markov processes on
each axis, the filter believes in the slow one only. Both are timed in one process, one after the
other, in processor time, after a first call that loads or compiles the kernels. A run of Monte
Carlo draws the errors, filters them and compares with the truth, as a study does.
"""

from __future__ import annotations

import argparse
from time import process_time

import numpy as np

from gmwm import GaussMarkov, WhiteNoise
from gmwm.ins.covariance import covariance_analysis
from gmwm.ins.filter.aiding import Outage, gnss
from gmwm.ins.sensors import SensorModels
from gmwm.ins.simulation.trials import Scenario, Simulated, monte_carlo
from gmwm.ins.trajectory.missions import helicopter_mapping

RUNS = 50
REPEATS = 5
BAR = 10.0  # runs of Monte Carlo
TRUTH = SensorModels.of(
    {
        "gyro": WhiteNoise(5e-5) + GaussMarkov(2e-4, 30.0) + GaussMarkov(1e-4, 500.0),
        "accel": WhiteNoise(1e-3) + GaussMarkov(2e-3, 10.0) + GaussMarkov(2e-3, 300.0),
    }
)
BELIEVED = SensorModels.of(
    {
        "gyro": WhiteNoise(5e-5) + GaussMarkov(1e-4, 500.0),
        "accel": WhiteNoise(1e-3) + GaussMarkov(2e-3, 300.0),
    }
)


def main() -> None:
    """Print both times and how the errors at the end of the outage compare."""
    flight = helicopter_mapping(duration=900.0)
    scenario = Scenario(flight, gnss(flight), (Outage(700.0, 60.0),))
    source, filters = Simulated(TRUTH), {"believed": BELIEVED}
    monte_carlo(scenario, source, filters, 1)
    covariance_analysis(scenario, TRUTH, BELIEVED)

    times = []
    for _ in range(REPEATS):
        start = process_time()
        analysis = covariance_analysis(scenario, TRUTH, BELIEVED)
        times.append(process_time() - start)
    one = min(times)
    # A study emulates the IMU once and flies its first run again; a long one less a short one
    # leaves what a run takes.
    start = process_time()
    monte_carlo(scenario, source, filters, 1)
    middle = process_time()
    runs = monte_carlo(scenario, source, filters, RUNS + 1)["believed"]
    run = (process_time() - middle - (middle - start)) / RUNS

    end = scenario.outages[0].end
    at, place = analysis.index(end), runs.index(end)
    observed = np.sqrt(np.mean(runs.error[:, place] ** 2, axis=0))
    print(f"covariance analysis   {one:8.3f} s, best of {REPEATS}")
    print(f"one Monte Carlo run   {run:8.3f} s, mean of {RUNS}")
    print(f"ratio                 {one / run:8.2f}   (bar: less than {BAR:g})")
    print()
    print("at the end of the outage        analysis   Monte Carlo   predicted by the filter")
    for i, name in enumerate(("north [m]", "east [m]", "down [m]")):
        print(
            f"{name:30} {analysis.sd[at, i]:9.2f} {observed[i]:13.2f} "
            f"{analysis.predicted_sd[at, i]:25.2f}"
        )
    nees = np.mean(runs.nees[:, place, 0]) / 3.0
    print(f"{'NEES/dof of the position':30} {analysis.nees()[at]:9.2f} {nees:13.2f}")
    error = 1.0 / np.sqrt(2.0 * runs.runs)
    print(f"(relative standard error of a Monte Carlo figure of {runs.runs} runs: {error:.2f})")


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    main()
