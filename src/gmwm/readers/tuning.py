"""Thresholds of the readers that decide what a file means, each with its source or its reason."""

FEWEST_SAMPLES = 64  # no variance is worth computing from less: four levels of sixteen coefficients
SLOWEST_RATE, FASTEST_RATE = 1e-6, 1e9  # Hz: beyond, a rate is in another unit or a slip
LINES_OF_LAYOUT = 100  # from which the delimiter, the decimal mark and the header are inferred
LEAST_SPREAD, LARGEST_SPREAD = 1e-60, 1e60  # u: fourth powers of the data must not overflow
MOST_TURNS = 0.1  # of the steps of times of day, hhmmss, pass a minute: at 0.2 Hz a twelfth do
LARGEST_OF_BINARY = 60.0  # s: larger first steps of a binary file are numbers of another layout

# Sensors of one file, and part of the rows at which their number changes: recordings one after
# another do so once. Rows at the start of a file that show it.
MOST_SENSORS, IN_TURNS, FEWEST_OF_BLOCK = 16, 0.1, 4096

# Hz: an inertial sensor is logged no slower unless most of its samples are left out; PX4 logs its
# raw topics at 1 Hz by default, and ArduPilot its IMU at 25 Hz at least.
THINNED = 20.0

# Times the time that a sample covers from which nearly all steps show that others were left out: of
# every second, two.
APART = 1.5

# -- sensors at rest ------------------------------------------------------------------------------

# Relative distance from standard gravity of an accelerometer at rest: scale errors of the cheapest
# are a few per cent, units differ by a factor of ten.
GRAVITY_AGREES = 0.1

# The same where gravity stands in the columns of a gyro, and its noise: that of an accelerometer
# is below 20 mg, while a bias of 1 deg/s has noise of a tenth of it.
GRAVITY_SURE, GRAVITY_NOISE = 0.05, 0.03

# The same of the usual length, where no unit explains it: biases of the cheapest are a quarter of
# gravity, ranges differ by two; m/s^2 below which, and part of it that is noise above which, a
# record may be without gravity.
SCALE_AGREES, NO_GRAVITY, NOISE_OF_GRAVITY = 0.3, 1.0, 0.2

# rad/s/sqrt(Hz) (0.5 deg/s/sqrt(Hz)): twice that of gyros for 20,000 deg/s, ten times that of the
# cheapest usual ones.
NOISIEST_GYRO = 8.7e-3

LARGEST_BIAS = 0.7  # rad/s (40 deg/s): the cheapest gyros may have 20 deg/s at rest, seldom more
USUAL_BIAS = 0.052  # rad/s (3 deg/s): most MEMS gyros have less by their data sheets
SURE_MEAN = 5.0  # standard errors by which a mean exceeds it: one in three million by noise alone
UNITS_APART = 5.0  # ratio of two units up to which both are named: deg/h and mdeg/s

# First samples that are to be whole numbers before all are looked at, and their noise, above which
# these are no steps of a coarse output: no gyro has noise of 2 deg/s, no accelerometer of 2 m/s^2.
ROWS_OF_COUNTS, NOISE_OF_COUNTS = 4096, 2.0

# -- numbers that stand for a missing sample ------------------------------------------------------

BEYOND_SENSORS = 1e6  # rad/s or m/s^2: beyond any sensor, accelerometers for shocks of 1e5 g too

# Times the distance of the quartiles, 90 % of Gaussian samples lie in; how often a number comes at
# least that is no sample; and the part of these times that something leads to it or lies near.
OF_QUARTILES, LEAST_REPEATS, TRANSITIONS = 2.44, 3, 0.1

# Samples that give the range of most, and by how many times the width of 90 % of them a number is
# away that is no sample: ten times as far as one Gaussian sample in 1e9. More than a tenth is bad.
SAMPLED_FOR_RANGE, FAR_OUTSIDE, MOST_SENTINELS = 10_000, 20.0, 0.1

# -- the clock ------------------------------------------------------------------------------------

RATES_AGREE = 0.01  # relative: clocks of sensors are off by less, and stated rates are rounded
JITTER_SHOWN = 5e-5  # of a step: less is the rounding of stamps, and 0.00 % in two decimals

# Of the rows, that come a fraction of a step late: more, and the steps are not those of the sensor.
# A logger that restarts does so a few times an hour.
MOST_OFF_GRID = 0.01

# Bursts of rows from which they are one, rows of a burst, and the fraction of them that are alike:
# lost rows have no rhythm. Longer ones are a logger that loses a row with each block.
FEWEST_BURSTS, LONGEST_BURST, BURSTS_ALIKE = 20, 32, 0.9

RATES_OF_SENSORS = (1.0, 2e4)  # Hz, beyond which a stated unit of time is more likely wrong
RATES_OF_SECONDS = (10.0, 5e3)  # Hz, the same without a stated unit: 4 Hz are rather 4 kHz

# s: steps of a column without a unit that are taken as seconds. No IMU is faster than 100 kHz, and
# a step of 1 is more often a millisecond than a second.
LEAST_STEP, LARGEST_STEP = 1e-5, 0.5

RATE_PARTS, LEAST_PART = 16, 32  # parts whose sampling rates are compared, and rows of one at least
RATE_ERRORS = 6.0  # standard errors beyond which, with the 1 % above, two rates differ
SHARP_CHANGE = 1.5  # ratio of two rates from which rows that come slower look like missing ones
SHORTEST_STEP = 0.499  # of the median: rounded stamps come to one half, but for rounding errors
USUAL_STEP = 1.75  # median steps up to which a step is a usual one: 2 and 3 ms at 400 Hz
JUMP = 2.25  # median steps from which a step is a jump: those of 1 and 2 of rounded stamps are none
LONGEST_STEP = 1.5  # usual steps beyond which a step may be a jump: half way to a missing row
NEIGHBOURS = 5  # rows beside a jump whose median is the clock's: two late ones do no harm
OFF_GRID = 0.25  # sampling intervals from the grid beyond which a jump is reported as off it
LONGEST_OF_WRAP = 100.0  # steps within which a counter that ran over goes on

# Jumps from which a rhythm shows that stamps were rounded, and distances of jumps below which all
# are alike, above which half of them: of one of a hundred rows lost at random, 0.4 % of recordings
# have as many alike at most.
FEWEST_IN_RHYTHM, ALL_IN_RHYTHM = 4, 6
ROUNDED = 1.2  # steps between the earliest and the latest rounded stamp: one, and a line's error

# Intervals from a whole number beyond which a step may as well have the next one: where the unit of
# stamps is half of the interval, each slip of the rounding is such a step.
HALF_WAY = 0.4

# Rows lost at random: share of the steps that are the shortest (one in twenty if 95 % are lost),
# times the rows that a recording may be longer, and share of longer steps that is worth a look.
SHARE_OF_SHORTEST, MOST_LOST, MANY_LOST = 0.005, 25.0, 0.01

# Parts of the grid, places of each and bins beside a line from which a rhythm shows, and its height
# above their median: of rows lost at random, simulated, 26 was the highest in 240 parts.
PARTS_OF_RHYTHM, PLACES_OF_RHYTHM, BINS_OF_RHYTHM, RHYTHM = 8, 1 << 16, 101, 50.0

# Rows (of uneven ones, stamps) after which, and intervals by which in the median, a clock without a
# grid strays from an even one: jitter of 12 % does if each step adds its own to those before.
ROWS_OF_STRAYING, STAMPS_OF_STRAYING, MOST_STRAYING = 64, 512, 0.75

ROUNDS_OF_LINE, LINE_SETTLED = 20, 1e-9  # of the robust line; relative change that ends them

# Relative difference of the mean rates of parts that are alike, at least and at most: what rounding
# and jitter cause, by these quantiles of the steps. Share of the steps that are none from which the
# usual one is not the interval.
PARTS_AGREE, TAILS_OF_STEPS, MANY_ALIKE = (2e-3, 0.2), (0.01, 0.99), 0.05

# -- uneven clocks --------------------------------------------------------------------------------

# Rows over which the interval is known to 2 % with jitter of 0.4, and of which most have no loss
# where one of a hundred is lost.
ROWS_OF_ROUGH = 32

# Share of the repeated stamps that have repeated samples too, above which these are copies: by
# chance, coarse samples repeat less often.
COPIES = 0.8

# Relative distance of the usual step from half of that of two steps, and part of the pairs that
# are alike, from which on short and long steps alternate. Steps of 2 and 3 ms at 400 Hz do not.
UNLIKE_STEPS, MOST_IN_TURNS = 0.25, 0.8

# Different stamps before and after a step by which losses show; a host that stalls for less makes
# no loss. Stamps at either end of which a clock that was set back shows.
STAMPS_BESIDE, FEWEST_BESIDE = 64, 16

ROUNDS_OF_GRID = 3  # times that losses are looked for, each with the interval of the one before
STAMPS_OF_WANDER = 257  # over which slow changes are averaged: 1e-3 of a step at 100 ppm an hour
MOST_UNEVEN = 0.75  # intervals from the grid, in the median: more, and there is no even clock
ASTRAY = 2.0  # intervals from the clock, beyond a burst, from which stamps are reported as far
MOST_OF_ONE_STAMP = 1024  # rows that a full buffer holds, or a host that stalls writes

# -- files beyond memory --------------------------------------------------------------------------

# Of memory while a file is read: a column as it is read, the same in SI units, and one of the
# others joined from its blocks.
BYTES_PER_SAMPLE = 20
ROWS_OF_BLOCK = 1 << 16  # read at a time from a file that is kept on disk: half a MB a column
GIGABYTES_OF_BLOCK = 1 / 16  # that such a block may need, however little is allowed: 48 columns
