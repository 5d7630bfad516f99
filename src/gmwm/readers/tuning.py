"""Thresholds of the readers that decide what a file means, each with its source or its reason."""

FEWEST_SAMPLES = 64
"""Samples below which no variance is worth computing: four levels of sixteen coefficients."""

SLOWEST_RATE, FASTEST_RATE = 1e-6, 1e9
"""Hz: beyond, a rate is in another unit or a slip."""

LINES_OF_LAYOUT = 100
"""Lines from which the delimiter, the decimal mark and the header are inferred."""

GRAVITY_AGREES = 0.1
"""Relative distance from standard gravity of an accelerometer at rest: scale errors of the cheapest
are a few per cent, units differ by a factor of ten."""

GRAVITY_SURE, GRAVITY_NOISE = 0.05, 0.03
"""The same where gravity stands in the columns of a gyro, and its noise: that of an accelerometer
is below 20 mg, while a bias of 1 deg/s has noise of a tenth of it."""

SCALE_AGREES, NO_GRAVITY, NOISE_OF_GRAVITY = 0.3, 1.0, 0.2
"""The same of the usual length, where no unit explains it: biases of the cheapest are a quarter of
gravity, ranges differ by two; m/s^2 below which, and part of it that is noise above which, a record
may be without gravity."""

NOISIEST_GYRO = 8.7e-3
"""rad/s/sqrt(Hz) (0.5 deg/s/sqrt(Hz)): twice that of gyros for 20,000 deg/s, ten times that of the
cheapest usual ones."""

LARGEST_BIAS = 0.7
"""rad/s (40 deg/s): data sheets of the cheapest gyros allow 20 deg/s at rest, seldom more."""

UNITS_APART = 5.0
"""Ratio of two units up to which both are named where they explain the noise: deg/h and mdeg/s."""

LEAST_CONE, LAGS_OF_TURN, FEWEST_TURNING = 0.01, (1, 4, 16), 20
"""rad by which gravity leaves its mean where a sensor turns steadily (at rest by 0.3 deg), seconds
over which its changes are compared, and how many of these a recording has at least."""

ROWS_OF_COUNTS, NOISE_OF_COUNTS = 4096, 2.0
"""First samples that are to be whole numbers before all are looked at, and their noise, above which
these are no steps of a coarse output: no gyro has noise of 2 deg/s, no accelerometer of 2 m/s^2."""

USUAL_BIAS = 0.052
"""rad/s (3 deg/s): biases at rest of most MEMS gyros are smaller by their data sheets; those of the
cheapest are not."""

SURE_MEAN = 5.0
"""Standard errors by which a mean rate exceeds it: one in three million by noise alone."""

LEAST_SPREAD, LARGEST_SPREAD = 1e-60, 1e60
"""u: fourth powers of the data must not overflow."""

BEYOND_SENSORS = 1e6
"""rad/s or m/s^2: beyond the range of any sensor, accelerometers for shocks of 1e5 g included."""

MOST_TURNS = 0.1
"""Of the steps of times of day, hhmmss, that pass a minute: at 0.2 Hz a twelfth do."""

OF_QUARTILES, LEAST_REPEATS, TRANSITIONS = 2.44, 3, 0.1
"""Times the distance of the quartiles, 90 % of Gaussian samples lie in; how often a number comes at
least that is no sample; and the part of these times that something leads to it or lies near."""

MOST_SENSORS, IN_TURNS = 16, 0.1
"""Of one file, and part of the rows at which their number changes: recordings one after another do
so once."""

SAMPLED_FOR_RANGE, FAR_OUTSIDE, MOST_SENTINELS = 10_000, 20.0, 0.1
"""Samples that give the range of most, and by how many times the width of 90 % of them a number is
away that is no sample: ten times as far as one Gaussian sample in 1e9. More than a tenth of all
are bad."""

BYTES_PER_SAMPLE = 20
"""Of memory while a file is read: a column as it is read, the same in SI units, and one of the
others joined from its blocks."""

THINNED = 20.0
"""Hz: an inertial sensor is logged no slower unless most of its samples are left out; PX4 logs its
raw topics at 1 Hz by default, and ArduPilot its IMU at 25 Hz at least."""

# -- the clock ------------------------------------------------------------------------------------

RATES_AGREE = 0.01
"""Relative difference of two rates that are meant to be the same: sensors' clocks are off by less
than one per cent, and stated rates are rounded."""

JITTER_SHOWN = 5e-5
"""Of steps, in sampling intervals: less is the rounding of stamps, and 0.00 % in two decimals."""

MOST_OFF_GRID = 0.01
"""Of the rows, that come a fraction of a step late: more, and the steps are not those of the
sensor. A logger that restarts does so a few times an hour."""

FEWEST_BURSTS, LONGEST_BURST, BURSTS_ALIKE = 20, 32, 0.9
"""Bursts of rows from which they are one, rows of a burst, and the fraction of them that are alike:
lost rows have no rhythm. Longer ones are a logger that loses a row with each block."""

RATES_OF_SENSORS = (1.0, 2e4)
"""Hz, beyond which a stated unit of time is more likely wrong than right."""

RATES_OF_SECONDS = (10.0, 5e3)
"""Hz, the same of stamps that state no unit and are taken as seconds: 4 Hz are rather 4 kHz."""

LEAST_STEP, LARGEST_STEP = 1e-5, 0.5
"""s: steps of a column without a unit that are taken as seconds. No IMU is faster than 100 kHz, and
a step of 1 is more often a millisecond than a second."""

RATE_PARTS, LEAST_PART = 16, 32
"""Parts of a recording between which the sampling rate is compared, and rows of one at least."""

RATE_ERRORS = 6.0
"""Standard errors beyond which, with the 1 % above, the rates of two parts differ."""

SHARP_CHANGE = 1.5
"""Ratio of two rates in one recording from which rows that come slower look like missing ones."""

SHORTEST_STEP = 0.499
"""Shortest usual step, of the median: rounded stamps come to one half, but for rounding errors."""

USUAL_STEP = 1.75
"""Median steps up to which a step makes the usual one: 2 and 3 ms of a clock of 400 Hz."""

JUMP = 2.25
"""Median steps from which a step is a jump: those of 1 and 2 of rounded stamps are none."""

LONGEST_STEP = 1.5
"""Usual steps beyond which a step may be a jump: half way to a missing row."""

NEIGHBOURS = 5
"""Rows on either side of a jump whose median says where the clock stands: two late ones do no
harm."""

OFF_GRID = 0.25
"""Sampling intervals from the grid beyond which a jump is reported as off it."""

FEWEST_IN_RHYTHM, ALL_IN_RHYTHM = 4, 6
"""Jumps from which a rhythm shows that stamps were rounded, and distances of jumps below which all
are alike, above which half of them: of one of a hundred rows lost at random, 0.4 % of recordings
have as many alike at most."""

ROUNDS_OF_LINE, LINE_SETTLED = 20, 1e-9
"""Steps of the robust line through the stamps, at most, and the relative change that ends them."""

# -- uneven clocks --------------------------------------------------------------------------------

ROWS_OF_ROUGH = 32
"""Rows over which the interval is known to 2 % with jitter of 0.4, and of which most have no loss
where one of a hundred is lost."""

COPIES = 0.8
"""Share of the repeated stamps that have repeated samples too, above which these are copies: by
chance, coarse samples repeat less often."""

UNLIKE_STEPS, MOST_IN_TURNS = 0.25, 0.8
"""Relative distance of the usual step from half of that of two steps, and part of the pairs that
are alike, from which on short and long steps alternate. Steps of 2 and 3 ms at 400 Hz do not."""

STAMPS_BESIDE, FEWEST_BESIDE = 64, 16
"""Different stamps before and after a step by which losses show; a host that stalls for less makes
no loss. Stamps at either end of which a clock that was set back shows."""

ROUNDS_OF_GRID = 3
"""Times that losses are looked for, each with the sampling interval of the one before."""

STAMPS_OF_WANDER = 257
"""Different stamps over which slow changes of the clock are averaged: 1e-3 of an interval at 100
ppm in an hour."""

MOST_UNEVEN = 0.75
"""Intervals from the grid, in the median: more, and the stamps have no even clock."""

ASTRAY = 2.0
"""Intervals from the clock, beyond the rows of a burst, from which stamps are reported as far."""

MOST_OF_ONE_STAMP = 1024
"""Rows with one stamp that a full buffer holds, or a host that stalls writes."""

# -- binary files ---------------------------------------------------------------------------------

LARGEST_OF_BINARY = 60.0
"""s: larger first steps of a binary file are numbers of another layout."""

LONGEST_OF_WRAP = 100.0
"""Steps within which a counter that ran over goes on."""

# -- files beyond memory ---------------------------------------------------------------------------

ROWS_OF_BLOCK = 1 << 16
"""Rows that are read at a time from a file that is kept on disk: half a MB a column."""

GIGABYTES_OF_BLOCK = 1 / 16
"""Memory that such a block may need at least, however little is allowed: that of 48 columns."""

FEWEST_OF_BLOCK = 4096
"""Rows at the start of a file that show whether its rows are of several sensors in turns."""
