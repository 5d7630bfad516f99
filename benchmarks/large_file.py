"""Memory of the calibration of a long file, whose samples are kept on disk.

    python benchmarks/large_file.py [--gigabytes 2] [--folder FOLDER]

Writes an NPY file of six channels (white noise and a slow walk) into the folder, gives it to
``gmwm calibrate``, and removes it. Prints the seconds, and in each tenth of the time the most
memory of the process, beyond that before it begins, in multiples of one channel. Pages of mapped
files are counted apart: the system takes them back whenever it needs memory. ``psutil`` comes with
the extra "test".
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


def watched(command: list[str]) -> tuple[np.ndarray, float]:
    """Time (s), own memory and mapped pages (bytes) of a command, and its seconds."""
    begin, seen = time.monotonic(), []
    with subprocess.Popen(command) as running:
        process = psutil.Process(running.pid)
        while running.poll() is None:
            with suppress(psutil.NoSuchProcess):
                memory = process.memory_info()
                own = memory.rss - memory.shared
                seen.append((time.monotonic() - begin, own, memory.shared))
            time.sleep(0.05)
    if running.returncode not in (0, 1):
        sys.exit(running.returncode)
    return np.array(seen), time.monotonic() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--gigabytes", type=float, default=2.0)
    parser.add_argument("--folder", type=Path)
    given = parser.parse_args()
    units = ("--gyro-unit", "rad/s", "--accel-unit", "m/s^2")
    options = ["--rate", f"{RATE:g}", "--channels", "gyro,accel", *units, "--memory", "0.1", "-q"]
    with tempfile.TemporaryDirectory(dir=given.folder) as folder:
        path, results = Path(folder) / "large.npy", Path(folder) / "out"
        rows = int(given.gigabytes * 1e9 / 8 / CHANNELS)
        gmwm_calibrate = [sys.executable, "-m", "gmwm", "calibrate", str(path), *options]
        write(path, 10_000)  # what any file takes
        base = np.max(watched([*gmwm_calibrate, "-o", str(results)])[0][:, 1])
        write(path, rows)
        seen, seconds = watched([*gmwm_calibrate, "-o", str(results)])
        found = gmwm.load(results / "calibration.json")
    channel = 8.0 * rows
    print(
        f"{given.gigabytes:g} GB, {rows:,} rows, {channel / 1e6:.0f} MB a channel: {seconds:.0f} s"
    )
    print(f"a short file takes {base / 1e6:.0f} MB; beyond that, in channels:")
    for part in np.array_split(seen, 10):
        own, mapped = (part[:, 1].max() - base) / channel, part[:, 2].max() / channel
        print(f"to {part[-1, 0]:6.0f} s: {own:5.2f}, mapped pages {mapped:5.2f}")
    for name, fit in found.items():
        print(f"{name}: {fit.model.title()}, N {fit.params['N'] / N:.4f} of the truth")


if __name__ == "__main__":
    main()
