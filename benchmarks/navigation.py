"""Speed of the navigation filter: IMU samples per second of processor time, and a Monte Carlo.

Run with ``python benchmarks/navigation.py [--runs 500]``. A helicopter's flight of 30 minutes at
100 Hz with a GNSS position a second; every axis has white noise and two, three or five
Gauss-Markov processes. The first call, which loads or compiles the kernels, is not counted. A row
is the filter of pyins on the first minute of the same record, with a bias that walks for each
sensor, if pyins is installed. The last line is the wall-clock time of Monte Carlo runs on all
cores, from the drawing of sensor errors to their judgement, workers' start included.
"""

from __future__ import annotations

import argparse
import os
import warnings
from time import perf_counter, process_time

import numpy as np

from gmwm import GaussMarkov, WhiteNoise
from gmwm.ins.filter.aiding import Aiding, gnss
from gmwm.ins.filter.filter import Filter, InitialSd, Outputs
from gmwm.ins.increments import Imu, emulate
from gmwm.ins.sensors import AXES, SensorModels
from gmwm.ins.simulation.trials import Scenario, Simulated, monte_carlo
from gmwm.ins.trajectory.missions import helicopter_mapping
from gmwm.ins.trajectory.trajectory import Trajectory

TAUS = (0.5, 5.0, 30.0, 300.0, 1000.0)
REPEATS = 5
PEER = 60.0  # s of the record
CASES = ((3, 2, 0.1), (3, 2, 0.01), (5, 5, 0.1), (5, 5, 0.01))
"""Gauss-Markov processes of a gyro and of an accelerometer, step of the covariance (s)."""


def _sensors(gyro: int, accel: int) -> SensorModels:
    """Models with some Gauss-Markov processes on every axis."""
    models = {}
    for axis in AXES:
        is_gyro = axis.startswith("gyro")
        white, sigma = (5e-5, 2e-4) if is_gyro else (1e-3, 1e-3)
        terms = [GaussMarkov(sigma, tau) for tau in TAUS[: gyro if is_gyro else accel]]
        models[axis] = sum(terms, start=WhiteNoise(white))
    return SensorModels.of(models)


def _peer(imu: Imu, truth: Trajectory, aiding: Aiding) -> None:
    """Time the filter of pyins."""
    try:
        import pandas as pd
        import pyins
    except ImportError:
        print("pyins is not installed")
        return
    warnings.simplefilter("ignore")
    n = round(PEER / imu.dt)
    first = truth.state(0)
    pva = pd.Series(
        [*np.degrees(first.lla[:2]), first.lla[2], *first.velocity, *np.degrees(first.rpy)],
        index=pyins.util.TRAJECTORY_COLS, name=0.0,
    )  # fmt: skip
    rows = np.hstack([imu.rotation, imu.velocity])[:n]
    readings = pd.DataFrame(
        np.vstack([rows[:1], rows]), index=imu.dt * np.arange(n + 1),
        columns=pyins.util.GYRO_COLS + pyins.util.ACCEL_COLS,
    )  # fmt: skip
    (position,) = (each for each in aiding.fixes if each.kind == "position")
    seen = position.time < PEER
    lla = position.value[seen] * [180.0 / np.pi, 180.0 / np.pi, 1.0]
    fixes = pd.DataFrame(lla, index=position.time[seen], columns=pyins.util.LLA_COLS)
    increments = pyins.strapdown.compute_increments_from_imu(readings, "increment")
    times = []
    for _ in range(2):
        gyro, accel = (
            pyins.inertial_sensor.EstimationModel(bias_sd=bias, noise=noise, bias_walk=walk)
            for bias, noise, walk in ((2e-4, 5e-5, 2e-6), (1e-3, 1e-3, 5e-5))
        )
        start = process_time()
        pyins.filters.run_feedback_filter(
            pva, 1.0, 0.1, 0.1, 0.5, increments, gyro, accel,
            [pyins.measurements.Position(fixes, 1.0)], time_step=0.1,
        )  # fmt: skip
        times.append(process_time() - start)
    best = min(times)
    print(f"{15:6} {0.1:9g} {10:8} {best:9.3f} {n / best / 1e6:10.4f}  pyins, {PEER:g} s")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=500, help="0 for none")
    runs = parser.parse_args().runs
    truth = helicopter_mapping()
    imu = emulate(truth)
    rng = np.random.default_rng(1)
    aiding = gnss(truth)
    events = aiding.noisy(rng).events(imu.dt, imu.n)
    outputs = Outputs.every(1.0, imu.dt, imu.n)
    print(f"{imu.n:,} samples, {events.epoch.size:,} fixes, best of {REPEATS}")
    print(f"{'states':>6} {'step [s]':>9} {'samples':>8} {'time [s]':>9} {'million/s':>10}")
    for gyro, accel, step in CASES:
        sensors = _sensors(gyro, accel)
        error = sensors.simulate(imu.n, imu.dt, rng).total
        noisy = imu.with_errors(error[:, :3], error[:, 3:])
        ready = Filter.of(sensors, aiding, imu.dt, step)
        times = []
        for _ in range(1 + REPEATS):
            start = process_time()
            ready.run(noisy, truth.state(0), InitialSd(), events, outputs)
            times.append(process_time() - start)
        best = min(times[1:])
        stride = ready.settings.stride
        print(f"{ready.size:6} {step:9g} {stride:8} {best:9.3f} {imu.n / best / 1e6:10.2f}")
    _peer(noisy, truth, aiding.noisy(rng))
    sensors, cores = _sensors(3, 2), os.cpu_count() or 1
    if runs == 0:
        return
    start = perf_counter()
    monte_carlo(Scenario(truth, aiding), Simulated(sensors), {"truth": sensors}, runs, jobs=cores)
    spent = perf_counter() - start
    print(f"{runs} runs of {truth.duration:g} s, 24 states, {cores} cores: {spent:.1f} s")


if __name__ == "__main__":
    main()
