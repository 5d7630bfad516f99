"""A fleet by one and two processes, with a worker that is killed, and on a cluster.

Run with ``python benchmarks/fleet.py`` (100 recordings of 1e5 x 6; ``--samples 1000000`` for an
hour each, ``--files 10`` for a first look). Printed are the seconds of each way, how many times
faster two processes are than one, by the clock and by the processor time that they take (which
other programs on the machine do not change), and whether the numbers are the same. A worker is
killed when half of the units are done; the cluster is Dask's own, of two processes.
"""

from __future__ import annotations

import argparse
import os
import signal
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is loaded, as the command does

import numpy as np

import gmwm
from gmwm import Fleet, GaussMarkov, WhiteNoise

AXES = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
READING = {"rate": 100.0, "units": {"gyro": "rad/s", "accel": "m/s^2"}}
SPREAD = 0.1
"""Standard deviation of the logarithm of each parameter from unit to unit."""


def record(path: Path, samples: int, seed: int) -> str:
    """A unit: white noise and a slow process on each axis."""
    rng = np.random.default_rng([17, seed])
    columns = {}
    for axis in AXES:
        size = 1e-4 if axis.startswith("gyro") else 1e-3
        N, sigma, tau = np.exp(SPREAD * rng.standard_normal(3)) * (size, size, 10.0)
        columns[axis] = (WhiteNoise(N) + GaussMarkov(sigma, tau)).simulate(samples, 0.01, rng)
    np.savez(path, **columns)
    return str(path)


def children(pid: int) -> list[int]:
    """Processes that a process started."""
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for task in tasks for child in task.read_text().split()]


def workers() -> list[int]:
    """Processes that do work for this one, without a cluster."""
    return [pid for pid in children(os.getpid())
            if b"popen_loky" in Path(f"/proc/{pid}/cmdline").read_bytes()]  # fmt: skip


def processor_seconds(pid: int) -> float:
    """Of a process and all that it started."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    own = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return own + sum(map(processor_seconds, children(pid)))


def kill_half_way() -> Callable[[int, int, str], None]:
    """A progress that kills a worker when half is done."""
    killed: list[int] = []

    def progress(done: int, total: int, _: str) -> None:
        if not killed and 2 * done >= total:
            killed.append(workers()[0])
            os.kill(killed[0], signal.SIGKILL)

    return progress


def same(one: Fleet, other: Fleet) -> bool:
    return one.to_dict() == other.to_dict()


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", type=int, default=100)
    parser.add_argument("--samples", type=int, default=100_000)
    parser.add_argument("--record", type=Path, help="only write the recordings into this folder")
    arguments = parser.parse_args()
    if arguments.record is not None:
        arguments.record.mkdir(parents=True, exist_ok=True)
        for seed in range(arguments.files):
            record(arguments.record / f"unit-{seed:03d}.npz", arguments.samples, seed)
        return
    with tempfile.TemporaryDirectory() as name:
        lot = [
            record(Path(name) / f"unit-{seed:03d}.npz", arguments.samples, seed)
            for seed in range(arguments.files)
        ]
        print(f"{arguments.files} recordings of {arguments.samples:,} x {len(AXES)}; "
              f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} before")  # fmt: skip
        print(f"{'':<28} {'s':>8} {'processor s':>12} {'ratio':>6} {'by processor':>13}  numbers")
        # What is compiled and imported once is no part of the comparison.
        warm = [record(Path(name) / f"warm-{i}.npz", 10_000, i) for i in range(4)]
        gmwm.fleet(warm, **READING)
        first: Fleet | None = None
        base = (0.0, 0.0)

        def row(title: str, run: Callable[[Path], Fleet], is_counted: bool) -> None:
            nonlocal first, base
            start, used = perf_counter(), processor_seconds(os.getpid())
            found = run(Path(name) / title)
            seconds, used = perf_counter() - start, processor_seconds(os.getpid()) - used
            if first is None:
                first, base = found, (seconds, used)
            count = 1 if found is first else 2
            by_processor = f"{count * base[1] / used:13.2f}" if is_counted else " " * 13
            processor = f"{used:12.1f}" if is_counted else " " * 12
            print(f"{title:<28} {seconds:8.1f} {processor} {base[0] / seconds:6.2f} {by_processor}"
                  f"  {'same' if same(found, first) else 'DIFFERENT'}", flush=True)  # fmt: skip

        row("one process", lambda out: gmwm.fleet(lot, folder=out, **READING), True)
        gmwm.fleet(warm, jobs=2, **READING)  # now: workers without work end after five minutes
        row("two processes", lambda out: gmwm.fleet(lot, folder=out, jobs=2, **READING), True)
        row("two, a worker killed", lambda out: gmwm.fleet(
            lot, folder=out, jobs=2, progress=kill_half_way(), **READING), False)  # fmt: skip
        from distributed import LocalCluster

        with LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster:
            address = cluster.scheduler_address
            # Its workers import and compile once, too.
            gmwm.fleet(warm, cluster=address, **READING)
            row("cluster of two processes", lambda out: gmwm.fleet(
                lot, folder=out, cluster=address, **READING), True)  # fmt: skip
        print(f"load {os.getloadavg()[0]:.1f} after")


if __name__ == "__main__":
    main()
