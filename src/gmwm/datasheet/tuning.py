"""Constants of models from data sheets, each with its reason or the study that set it."""

# Least and greatest averaging time, over that at which white noise alone has the lowest deviation,
# and how many between them; 100 a decade show a flat place to 0.1 %:
AVERAGING_TIMES = (1e-2, 1e4, 601)
FLAT = 0.04  # Slope of log Allan variance from which on a curve counts as flat: flicker at 96 %
ALIKE = 0.01  # Relative difference of lowest deviations that counts as none
# Correlation times of Gauss-Markov processes, over the same time; from 100 times on they are walks:
TAU = (2.0, 60.0, 9)
# Of Gauss-Markov processes that make no flat place: their largest Allan deviation over that of
# white noise there. In a trial of 61 sensors the largest NEES was 1.19 with 0.3 and 0.98 with this;
# the median after 10 s was 0.67 and 0.50, and 0.35 with 1:
SHOULDER = 0.7
SHOULDER_TAU = (0.02, 2.0, 5)
FASTEST_SHOULDER = 1.0  # s, below which it counts as white noise, which is read at 1 s
# Standard deviations of a unit over the typical ones of a sheet. The gyros of one ADIS16405 in four
# recordings: N 1.08 to 1.24 times, lowest deviation 0.95 to 1.33 times its sheet's. Of 200
# simulated sensors, K of recordings lies between the ends in 96 %: benchmarks/sheets.py
UNIT_SPREAD = 1.25

# Densities of white noise that sensors have, SI: from hemispherical resonator gyros (1e-5
# deg/sqrt(h)) to 0.5 deg/s/sqrt(Hz), as for recordings; from seismic accelerometers (2 ng/sqrt(Hz))
# to 10 mg/sqrt(Hz):
DENSITIES = {"gyro": (3e-9, 8.7e-3), "accel": (2e-8, 0.1)}
# s, averaging time at which white noise alone reaches the lowest deviation: 0.8 to 400 s for the
# sheets installed. The ends are a factor of 1,000 in N apart:
CROSSINGS = (0.1, 1e5)
