"""Constants of `compare` and `fleet` that change answers, each with its source or its reason."""

SAME_RATE = 1e-3  # relative difference of rates that count as one: clocks of units differ by less

# -- compare --------------------------------------------------------------------------------------

LEVEL = 0.05  # of the tests of all channels together (Holm 1979, *Scand. J. Stat.* 6, 65-70)
# Degrees of freedom from which a level of the wavelet variance is compared. With 2 the test found
# 7 % of equal recordings different, with 8 it is 4 to 5 % of 200 pairs of three kinds
# (benchmarks/comparison.py); the deviation of such a level is known to 25 %.
LEAST_DOF = 8.0
NOTABLE = 0.10  # difference of Allan deviations that matters, as in the goodness of fits
EVIDENT = 2.5  # standard errors from which a part of the curve differs, as there
# s and samples: shorter averaging times show the sensor's filter and rounding, as there.
FINEST_TIME, FINEST_SAMPLES = 0.1, 10.0
POWER = 3.24  # standard errors that are found at 5 % with a probability of 90 %: 1.96 + 1.28
SPREAD = 0.95  # level of the interval of a standard deviation between recordings

# -- fleet ----------------------------------------------------------------------------------------

CONTENT = 0.95  # fraction of the units that a limit holds for
CONFIDENCE = 0.95  # of a limit; both are the usual ones of ISO 16269-6
# Probability that a lot of equal units has a finding: one in N, B or K of any axis, or a unit that
# rejects the structure of the lot.
FALSE_ALARMS, REJECTED = 0.04, 0.01
LEAST_FOR_OUTLIERS = 5  # units; with fewer, half of them may be the odd ones
# Fleets simulated for the distance of an outlier, whose level is then known to a fifth; and the
# most numbers drawn, which takes 0.2 s.
SIMULATED, MOST_SIMULATED = 40_000, 8_000_000

LIKELY = 4  # structures tried for a lot of those selected for its units, beside the simple ones
# Of the criterion, from which a unit is taken to contradict a structure: it does not outvote three
# units that do not need a term (5 to 8 a parameter).
CONTRADICTION = 30.0

# -- array ----------------------------------------------------------------------------------------

BLOCKS_OF_HORIZON = 32  # whose means are compared: faster errors are white over the horizon
FEWEST_BLOCKS = 8  # of a horizon
FEWEST_OF_BLOCK = 4  # samples, where rates differ: blocks have a sample more or less
LEAST_HORIZONS = 16  # of the recordings, for a covariance over one of them
WITH_INTERVALS = 5  # IMUs, in a table of 80 columns
