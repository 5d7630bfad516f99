"""Thresholds of the calibration, each with its source or its reason."""

import numpy as np

SAME_RATE = 1e-3  # relative: averaging times of recordings then agree to less than a level's width
WORTH_PROCESSES = 1_000_000  # samples; a process takes 1.2 s to start, as two channels' models
MOST_STRETCHES = 20  # longest stretches at rest of one log that are fitted jointly

# -- screening ------------------------------------------------------------------------------------

MOST_LEFT_OUT = 0.1  # share of outliers; gaps move no level by 0.2 errors (docs/moments.md)

# So many shocks and spikes may be the sensor's own noise, if the deviation without them is smaller
# by a tenth at an averaging time of which the record has enough windows to know it as well.
MANY_EVENTS, TAKEN, FEWEST_WINDOWS = 20, 1.1, 30

MOST_TERMS = 2  # lines and resonances offered to a model; each doubles the candidate models
SAME_FREQUENCY = 0.02  # relative; lines of engines wander by about as much (docs/real-data.md)

# -- sensor numbers -------------------------------------------------------------------------------

REFERENCE_TIME = 1.0  # s at which white noise is read from an Allan plot (IEEE Std 952)
FAST = 0.1  # s: correlation times up to this average out before a filter corrects its bias
LOW, FLAT = 0.01, 0.8  # of the corner frequency; share of the density there at half of that
WHITE_RATIO = 0.6  # of wavelet variances at an averaging time and half of it; white noise has 0.5
NO_OTHER = 1e-9  # of N^2 beside a white noise: rounding errors

# A random walk that the record leaves open is reported if the deviation at the longest outage of
# the report grows by as much as a valid fit may miss.
OPEN_AT, OPEN = 600.0, 1.1  # s, ratio

# -- departures from stationary noise -------------------------------------------------------------

EVIDENT = 100.0  # stationary noise has one in about one of so many records (see below)
# Evidence from which a harmful departure makes a fit not valid: the least of 100, 200, 500, 1,000
# and 2,000 at which no stationary noise contradicts a level of one record in 200 (5 %). Of 5,200
# records of 13 kinds 51, 27, 13, 7 and 5 had as much, which is 0.13 % at 1,000 (95 %: at most
# 0.25 % if independent); of 400 of the worst, N + Gauss-Markov of 60 s, 13, 9, 7, 4 and 3
# (`python benchmarks/departures.py false`). A step must be 10 % larger than for 100, a transient
# 16 %: the gain grows with the square. Of 20 steps of 0.1 deviations of a sample at 100 Hz in N + K
# 30 % spoil the fit, at 100 55 % (`... power`). 1,000 stood here before that study, set when a real
# axis had a step of evidence 190; that step is real, and remains a warning (docs/real-data.md).
SPOILING = 1000.0

# Twice the gain in log likelihood that each kind has by chance in one of 400 records. In one of
# 100, 150 simulated records each of white noise, random walk and both (24, 64, 256 blocks) have
# at most 18, 9, 12, 20 and 9.
LIMITS = {
    "step": 21.0,
    "transient": 13.0,
    "drift-at-start": 14.0,
    "slow-period": 23.0,
    "drift": 12.0,
}
WALKS = tuple(np.geomspace(1e-6, 1e2, 28).tolist())  # walk per block over white, in variance
LARGEST_LOG = 700.0  # whose exponential is a number
MOST_MEANS = 256  # block means in which departures are looked for
MOST_REMOVED = 4  # departures that may be accidents; real recordings of 2 h 46 min have four
HARMFUL_SHARE = 0.19  # of the wavelet variance: the deviation is 10 % lower without it
MOST_DEPARTURES = 5  # of one channel
REMOVALS = 3  # rounds: without the first departures more may show
FEWEST_DIFFERENCES = 16  # of block means
RATIO_OF_TIMES = 1.2  # of neighbouring time constants and ends
FEWEST_CYCLES, MOST_CYCLES = 0.5, 24.0  # of slow periods; `gmwm.health` finds lines from 20 on
SHARE_POINTS = 512  # places of a coefficient at which the share of a level is computed
NO_INFORMATION = 1e-9  # share of the largest information, or variance, that rounding errors leave
NEAR = 2  # neighbours of a departure that are known with it: its time is between them
SPANNED = 1e-6  # of the largest singular value: smaller ones are not independent

# -- covariates -----------------------------------------------------------------------------------

NODES, SHORTEST_NODE = 2048, 8  # means of a recording that hold its covariates; samples of one
MOST_DEGREE = 3  # chosen automatically: autopilots hold no more
LAGS, LAG_STEPS, LONGEST_LAG = (20.0, 3000.0), 10, 0.33  # s; a slower one looks like a drift
# Least gain in the criterion by a lag that was not asked for, "strong" (Kass and Raftery 1995,
# J. Am. Stat. Assoc. 90). Curves without one had at most -1 in 180 records, a lag of 30 s had 27.
EVIDENT_LAG = 6.0
NODE_STEP = 10.0  # s between them in longer recordings: faster than a thermometer follows
LONGEST_BRIDGE = 0.01  # of a record, without a covariate: a line is 2e-4 of a warm-up off
# Correlation of two covariates, or of a chosen lag or settling with the rest of a curve: beyond,
# errors are seven times those alone. If time constants are given, errors of 1,000 times are left.
INSEPARABLE, INSEPARABLE_IF_GIVEN = 0.99, 1.0 - 5e-7
MARGIN = 0.02  # of its range, by which a curve is known beyond: means of a warm-up miss 1 %
MOST_HELD = 0.1  # of a record beyond that: more is taken for the reason why a filter fails
SCALED_PARTS, STEPS_OF_PART = 64, 16  # of a recording, and differences of short means in one
FEWEST_SCALED = 16  # parts from which a growth of the noise is estimated
SLOW_LOG, USUAL_RATE = 10.0, 100.0  # Hz: a log of at most the first may pick samples of the second
LEAST_RANGE = 1e-6  # of the values of a covariate: less is rounding

# -- noise that changes its size ------------------------------------------------------------------

FREQUENCIES = 64  # at which the floor of the spectrum is looked for
NO_SLOW_PART = 1e-12  # of the floor: smaller parts above it are rounding errors
DIVISIONS = (8, 4, 2)  # parts of a record that are compared
MEANS_OF_PART, LEAST_OF_PART = 128, 0.5  # block means of a part, and share that must be there
POWERS = (1.0, 4.0)  # of the share of slow noise, as weights: for small and for large changes
FEWEST_FREEDOM = 3.0  # degrees of freedom of a part for which Bartlett's test has its level
FALSE_ALARM = 1e-3  # chance of a notice for a channel of stationary Gaussian noise
UNSTEADY = 0.1  # deviation of all above the quiet quarter: as much as a valid fit may miss
HARMFUL_UNSTEADY = 2.0  # loudest over quietest part; real recordings have 1.6 to 2.1

# -- what channels share --------------------------------------------------------------------------

SLOW = 1.0  # s, shortest correlation time of slow errors
BLOCKS_OF_SLOW = 8  # blocks of that time, whose means are compared
SLOW_SHARE = 0.6  # of slow terms in a channel's wavelet variance at levels that are compared
LARGEST_ERROR = 0.5  # of a correlation that is tested: four degrees of freedom
SHARED_LEVEL = 0.01  # of the tests of all pairs of a recording (Bonferroni)
SHARED_LISTED = 3  # pairs that are named
