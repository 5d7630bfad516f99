"""The main job and its parts beside what pip installs, and beside one read of the data.

``python benchmarks/run.py`` prints one table and writes it to its part of docs/performance.md.
Whatever is compared is done in turns in one process; times are medians of seconds of the
processor, so that what else the machine does matters little, and are given as ratios too.
``--samples`` takes shorter series.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is imported

import argparse
import platform
import resource
import time
import warnings
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import allantools
import numpy as np
import pandas as pd
import pyins
from statsmodels.tsa.arima.model import ARIMA

import gmwm
from gmwm import ins

PAGE = Path(__file__).parents[1] / "docs" / "performance.md"
BEGIN, END = "<!-- begin: benchmarks/run.py -->", "<!-- end: benchmarks/run.py -->"
TRUTH = gmwm.WhiteNoise(0.2) + gmwm.GaussMarkov(0.05, 40.0)
FIVE = (
    gmwm.WhiteNoise(1e-3)
    + gmwm.RandomWalk(3e-5)
    + gmwm.QuantizationNoise(3e-5)
    + gmwm.GaussMarkov(1e-3, 1.0)
    + gmwm.GaussMarkov(5e-4, 50.0)
)
DT, ROUNDS, SHORT = 0.01, 3, 3_000


def medians(cases):
    """Processor time of each case, in rounds; the first round is not counted."""
    times = {name: [] for name in cases}
    for turn in range(ROUNDS + 1):
        for name, work in cases.items():
            begin = time.process_time()
            work()
            if turn:
                times[name].append(time.process_time() - begin)
    return {name: float(np.median(each)) for name, each in times.items()}


def table(title, cases, against):
    """Rows of markdown, with the ratio to one of the cases."""
    found = medians(cases)
    rows = [f"| {title} | s | ratio |", "| --- | ---: | ---: |"]
    rows += [f"| {name} | {s:.4g} | {s / found[against]:.3g} |" for name, s in found.items()]
    return [*rows, ""]


def of_variance(x):
    taus = DT * 2.0 ** np.arange(x.size.bit_length() - 2)
    return table(
        f"variances of {x.size:,} samples, all octaves",
        {
            "one read of the data, numpy.sum": lambda: np.sum(x),
            "gmwm.wavelet_variance": lambda: gmwm.wavelet_variance(x, DT),
            "allantools.oadev": lambda: allantools.oadev(
                x, rate=1.0 / DT, data_type="freq", taus=taus
            ),
        },
        "gmwm.wavelet_variance",
    )


def of_fits(x, short):
    wv = gmwm.wavelet_variance(x, DT)
    with_five = gmwm.wavelet_variance(FIVE.simulate(x.size, DT, seed=4), DT)
    model, five = TRUTH.opened(), FIVE.opened()
    rows = table(
        f"from the variances of {x.size:,} samples",
        {
            # A copy each time: what one fit finds of the series serves the next.
            "gmwm.fit of two terms": lambda: gmwm.fit(model, replace(wv)),
            "gmwm.fit of five terms": lambda: gmwm.fit(five, replace(with_five)),
            "gmwm.fit of five terms, three too many": lambda: gmwm.fit(five, replace(wv)),
            "gmwm.select": lambda: gmwm.select(replace(wv)),
        },
        "gmwm.fit of two terms",
    )
    # White noise and a Gauss-Markov process are an ARMA(1, 1).
    return rows + table(
        f"the same model of {short.size:,} samples",
        {
            "gmwm.fit": lambda: gmwm.fit(model, short, 1.0),
            "gmwm.fit, exact likelihood": lambda: gmwm.fit(model, short, 1.0, method="mle"),
            "statsmodels ARIMA(1, 0, 1)": lambda: ARIMA(short, order=(1, 0, 1), trend="n").fit(),
        },
        "gmwm.fit",
    )


def of_navigation(seconds=10.0, dt=0.01, step=0.1):
    """Nine navigation states and six biases that walk, GNSS position once a second."""
    truth = ins.helicopter_mapping(duration=80.0 + seconds, dt=dt).segment(80.0, 80.0 + seconds)
    noise = {"gyro": (5e-5, 2e-6, 5e-5), "accel": (1e-3, 5e-5, 2e-3)}
    sensors = ins.SensorModels.of(
        {name: gmwm.WhiteNoise(n) + gmwm.RandomWalk(k) for name, (n, k, _) in noise.items()},
        bias_sd={name: sd for name, (_, _, sd) in noise.items()},
    )
    rng = np.random.default_rng(3)
    errors = sensors.simulate(truth.n, dt, rng).total
    imu = ins.emulate(truth).with_errors(errors[:, :3], errors[:, 3:])
    aiding = ins.gnss(truth, position_sd=1.0).noisy(rng)
    first, start = truth.state(0), ins.InitialSd(2.0, 0.1, np.radians(0.1), np.radians(0.5))
    pva = pd.Series(
        [*np.degrees(first.lla[:2]), first.lla[2], *first.velocity, *np.degrees(first.rpy)],
        index=pyins.util.TRAJECTORY_COLS, name=0.0,
    )  # fmt: skip
    rows = np.hstack([imu.rotation, imu.velocity])
    readings = pd.DataFrame(
        np.vstack([rows[:1], rows]), index=dt * np.arange(truth.n + 1),
        columns=pyins.util.GYRO_COLS + pyins.util.ACCEL_COLS,
    )  # fmt: skip
    fixes = aiding.fixes[0]
    lla = pd.DataFrame(
        fixes.value * [180.0 / np.pi, 180.0 / np.pi, 1.0], fixes.time, pyins.util.LLA_COLS
    )

    def peer():
        models = [
            pyins.inertial_sensor.EstimationModel(bias_sd=sd, noise=n, bias_walk=k)
            for n, k, sd in noise.values()
        ]
        pyins.filters.run_feedback_filter(
            pva, start.position, start.velocity, np.degrees(start.tilt), np.degrees(start.heading),
            pyins.strapdown.compute_increments_from_imu(readings, "increment"),
            *models, [pyins.measurements.Position(lla, 1.0)], time_step=step,
        )  # fmt: skip

    def ours():
        ins.navigate(imu, first, sensors, aiding, initial_sd=start, step=step, second_order=False)

    return table(
        f"filter of 15 states over {truth.n:,} samples",
        {"gmwm.ins.navigate": ours, "pyins.filters.run_feedback_filter": peer},
        "gmwm.ins.navigate",
    )


def of_main_job(recording, folder):
    floor = min(medians({"sum": lambda: [np.sum(c.values) for c in recording.channels]}).values())
    times = [time.process_time()]
    found = gmwm.calibrate(recording, jobs=1)
    times.append(time.process_time())
    found.report(folder / "report.html", recording)
    times.append(time.process_time())
    found.save(folder / "calibration.json")
    gmwm.export(found, "kalibr", path=folder / "imu.yaml")
    times.append(time.process_time())
    stages = dict(zip(("calibration", "report", "exports"), np.diff(times), strict=True))
    stages["all"] = times[-1] - times[0]
    head = f"main job, {len(recording.channels)} channels of {recording.n:,}: stage"
    rows = [f"| {head} | s | times one read of the data |", "| --- | ---: | ---: |"]
    rows += [f"| {name} | {s:.2f} | {s / floor:,.0f} |" for name, s in stages.items()]
    return [*rows, ""]


def simulated(n):
    """A recording of six channels of different noise."""
    channels = {}
    for place, name in enumerate(f"{kind}_{axis}" for kind in ("gyro", "accel") for axis in "xyz"):
        model = gmwm.WhiteNoise(1e-4) + gmwm.GaussMarkov(5e-5, 20.0 * (place + 1))
        if place % 2:
            model += gmwm.RandomWalk(1e-6)
        channels[name] = model.simulate(n, DT, seed=place)
    channels["accel_z"] += 9.8
    return gmwm.Recording.from_arrays(channels, 1.0 / DT, {"gyro": "rad/s", "accel": "m/s^2"})


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=1_000_000)
    parser.add_argument("--only-print", action="store_true", help="Leave the page as it is.")
    given = parser.parse_args()
    warnings.simplefilter("ignore")  # statsmodels' own about convergence
    x = TRUTH.simulate(given.samples, DT, seed=1)
    short = TRUTH.simulate(SHORT, 1.0, seed=2)
    with TemporaryDirectory() as folder:
        lines = of_main_job(simulated(given.samples), Path(folder))
    lines += of_variance(x)
    lines += [*of_fits(x, short), *of_navigation()]
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    packages = ", ".join(f"{p} {version(p)}" for p in ("numpy", "numba", "allantools",
                                                       "statsmodels", "python-ins"))  # fmt: skip
    lines += [
        f"Processor time, medians of {ROUNDS} rounds, one thread. Peak memory {memory:.0f} MB, "
        f"including the compared packages. gmwm {gmwm.__version__}, {packages}, Python "
        f"{platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores, "
        f"{datetime.now(UTC):%Y-%m-%d}."
    ]
    text = "\n".join(lines)
    print(text)
    if not given.only_print:
        write(text)


def write(text):
    """Put it into its part of the page; the rest is others'."""
    page = PAGE.read_text() if PAGE.exists() else "# Performance\n"
    if BEGIN not in page:
        page += (
            f"\n## The main job and its parts\n\n`python benchmarks/run.py`:\n\n{BEGIN}\n{END}\n"
        )
    before, rest = page.split(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()
