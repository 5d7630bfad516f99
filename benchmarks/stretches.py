"""Models of a recording that is read a stretch at a time, beside those of the whole.

    python benchmarks/stretches.py static.csv ... [--rate 100] [--gyro-unit deg/s] [--accel-unit g]

Prints for each channel the ratio of the two predicted deviations at 1, 60 and 600 s.
"""

from __future__ import annotations

import argparse
import time
import warnings

import numpy as np

import gmwm
from gmwm import FitWarning

TAUS = np.array([1.0, 60.0, 600.0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+")
    parser.add_argument("--rate", type=float, default=100.0)
    parser.add_argument("--gyro-unit", default="deg/s")
    parser.add_argument("--accel-unit", default="g")
    given = parser.parse_args()
    warnings.simplefilter("ignore", FitWarning)
    units = {"gyro": given.gyro_unit, "accel": given.accel_unit}
    print(f"{'file':24} {'channel':8} {'1 s':>7} {'60 s':>7} {'600 s':>7}  valid: whole, stretches")
    for file in given.files:
        start = time.process_time()
        whole = gmwm.calibrate(gmwm.read(file, rate=given.rate, units=units), jobs=1)
        between = time.process_time()
        parts = gmwm.calibrate_stream(file, rate=given.rate, units=units)
        end = time.process_time()
        for name, fit in whole.items():
            dt = fit.wv.dt
            ratio = np.sqrt(
                parts[name].model.wavelet_variance(TAUS, dt) / fit.model.wavelet_variance(TAUS, dt)
            )
            columns = " ".join(f"{each:7.4f}" for each in ratio)
            print(f"{whole.source:24} {name:8} {columns}  {fit.valid!s:5} {parts[name].valid}")
        print(f"processor time: {between - start:.1f} s whole, {end - between:.1f} s in stretches")


if __name__ == "__main__":
    main()
