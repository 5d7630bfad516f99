"""A file that is many times longer than memory, calibrated a stretch at a time.

    python benchmarks/large_file.py [--gigabytes 20] [--folder FOLDER]

Writes an NPY file of six channels (white noise and a slow walk) into the folder, gives it to
``gmwm calibrate --memory 1``, and removes it. Printed are the seconds, the most memory of the
process and of those that it starts in each tenth of the time, and what was found. ``psutil`` comes
with the extra "test".
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil
from numpy.lib.format import open_memmap

import gmwm

ROWS, CHANNELS = 1_000_000, 6
N, K, RATE = 1e-4, 2e-7, 100.0


def write(path: Path, rows: int) -> None:
    """White noise of N, and a walk of K in steps of a block."""
    table = open_memmap(path, mode="w+", dtype="f8", shape=(rows, CHANNELS))
    rng, level = np.random.default_rng(1), np.zeros(CHANNELS)
    for begin in range(0, rows, ROWS):
        part = table[begin : begin + ROWS]
        part[...] = level + N * np.sqrt(RATE) * rng.standard_normal(part.shape)
        level += K * np.sqrt(ROWS / RATE) * rng.standard_normal(CHANNELS)
    table.flush()


def watched(command: list[str]) -> tuple[list[tuple[float, float, float]], float]:
    """Time and memory of a command and of the processes it starts, in MB, and its seconds."""
    begin, seen = time.monotonic(), []
    with subprocess.Popen(command) as running:
        process = psutil.Process(running.pid)
        while running.poll() is None:
            with suppress(psutil.NoSuchProcess):
                own = process.memory_info().rss
                others = sum(each.memory_info().rss for each in process.children(recursive=True))
                seen.append((time.monotonic() - begin, own / 1e6, others / 1e6))
            time.sleep(0.1)
    if running.returncode not in (0, 1):
        sys.exit(running.returncode)
    return seen, time.monotonic() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gigabytes", type=float, default=20.0)
    parser.add_argument("--folder", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=given.folder) as folder:
        path, results = Path(folder) / "large.npy", Path(folder) / "out"
        rows = int(given.gigabytes * 1e9 / 8 / CHANNELS)
        write(path, rows)
        units = ("--gyro-unit", "rad/s", "--accel-unit", "m/s^2")
        command = [sys.executable, "-m", "gmwm", "calibrate", str(path), "--rate", f"{RATE:g}"]
        command += ["--channels", "gyro,accel", *units, "--memory", "1", "-q", "-o", str(results)]
        seen, seconds = watched(command)
        found = gmwm.load(results / "calibration.json")
    print(f"{given.gigabytes:g} GB, {rows:,} rows: {seconds:.0f} s")
    for part in np.array_split(np.array(seen), 10):
        print(
            f"to {part[-1, 0]:6.0f} s: {part[:, 1].max():4.0f} MB, others {part[:, 2].max():4.0f}"
        )
    for name, fit in found.items():
        print(f"{name}: {fit.model.title()}, N {fit.params['N'] / N:.4f} of the truth")


if __name__ == "__main__":
    main()
