"""The README's picture: four hours of a simulated MEMS gyro with N, B and K, and its error model.

Run with ``python examples/gyro_figure.py FILE.png``.
"""

import sys

import matplotlib

matplotlib.use("Agg")

import gmwm
from gmwm.study.demo import simulated_imu
from gmwm.study.navigation import TABLE_6

recording, truth = simulated_imu(4 * 3600.0, seed=1, sensors=TABLE_6)
found = gmwm.calibrate(gmwm.Recording((recording["gyro_x"],)))
print(found)
print()
print(found["gyro_x"])
print()
print("truth:", truth["gyro_x"])
found.plot().savefig(sys.argv[1], dpi=110)
