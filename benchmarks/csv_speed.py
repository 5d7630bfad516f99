"""Speed of reading CSV, beside pyarrow's own parse of the same bytes, and the memory of it.

``python benchmarks/csv_speed.py`` prints MB of text per second and core for seven columns at
200 Hz, the ratio to pyarrow with one thread, and the peak of the memory over that of the arrays.
"""

from __future__ import annotations

import argparse
import os
import resource
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow.csv

import gmwm

HEAD = "time_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n"


def main():
    rng = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "imu.csv"
        for minutes in (30, 120):
            n = minutes * 60 * 200
            rows = np.column_stack([np.arange(n) / 200.0, rng.normal(size=(n, 6))])
            rows[:, 6] += 9.8
            with path.open("w") as file:
                file.write(HEAD)
                np.savetxt(file, rows, fmt="%.7f", delimiter=",")
            size = os.path.getsize(path) / 1e6
            options = pyarrow.csv.ReadOptions(use_threads=False)
            began = time.process_time()
            pyarrow.csv.read_csv(path, read_options=options)
            arrow = time.process_time() - began
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            began = time.process_time()
            found = gmwm.read(path, units={"gyro": "rad/s", "accel": "m/s^2"})
            spent = time.process_time() - began
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 - before
            arrays = sum(channel.values.nbytes for channel in found.values()) / 2**20
            print(
                f"{minutes} min, {size:.0f} MB: {size / spent:.0f} MB/s of processor time, "
                f"{spent / arrow:.2f} times pyarrow; peak {peak:.0f} MiB more, "
                f"arrays {arrays:.0f} MiB"
            )


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    main()
