"""Thresholds of the diagnosis, each with its source or its reason."""

FALSE_ALARM = 1e-3  # chance of each kind of notice in a channel of clean Gaussian noise

# -- the whole recording --------------------------------------------------------------------------

LONG_RECORD = 3600.0  # s; slow errors of inertial sensors have correlation times of minutes
JITTER, LARGE_JITTER = 0.1, 0.3  # rms of the steps of time stamps in intervals: note, warning

# -- motion ---------------------------------------------------------------------------------------

LARGEST_OF_SENSOR = 1e6  # rad/s or m/s^2; accelerometers for shocks reach 1e5 g
SHARED_FREQUENCY = 0.01  # relative; resonances near 10 Hz of three accelerometers differ by 0.6 %

# Means of 1 s and of 16 samples at least: handling is slower, fast noise averages out. A running
# median of five drops shocks, which ring for less than two; means five apart are compared.
MOTION_BLOCK, FEWEST_OF_MOTION, MEDIAN_BLOCKS = 1.0, 16, 5
FEWEST_BLOCKS = 30  # means below which a recording is too short

# Change of the rate (1 deg/s) and of the direction of gravity (1 deg) within some seconds. Real
# recordings at rest (docs/real-data.md) change by 0.15 deg/s and 0.3 deg in 40 channel hours.
TURNS, TILTS = 0.0175, 0.0175  # rad/s, rad

QUIET = (
    0.2  # quantile of the changes that gives their noise where the sensor moves most of the time
)
BEYOND_NOISE = 2.0  # times the Gaussian quantile: a few dozen blocks give a scale to half of it
SHORTEST_STATIC = 10  # blocks between two changes that show a level
LONGEST_TILT = 30.0  # s from one attitude at rest to another, with five blocks on either side
EXPLAINED = 0.1  # share of specific force changes explained by turning; at rest below 1e-4
AS_PREDICTED = 2.0  # ratio of these changes to what the gyros predict
SLOW_TILT = 0.05  # rad (3 deg): 50 mg, more than any accelerometer drifts
WILD = 0.1  # rad/s between quantiles of the rate of a gyro that is never at rest ...
BEYOND_WHITE = 10.0  # ... and times the fast noise; the cheapest biases wander by 1/50 of that
PARTS_OF_MOTION = 8  # parts of a record of which most must show motion: one shock does not
SWAYS = 1e-3  # rad from block to block below which turning does no harm

# -- missing, stuck and saturated samples ---------------------------------------------------------

MUCH_MISSING, TOO_MUCH_MISSING = 0.1, 0.5  # share missing or stuck: warning, channel of no use
DITHERED = 0.05  # share of differences of two steps at which noise distinguishes samples ...
LONG_RUN = 32  # ... without runs of so many equal samples
FEWEST_AT_END = 8  # samples at the end of the scale that may show saturation
FEWEST_OF_LEVEL = 20  # samples on a level whose neighbours are not empty by chance (2e-9)
FEWEST_WIDE = 0.01  # share of samples on levels farther apart from which their step counts

# A value this many times as frequent as its neighbours is not measured: noise as small as its step
# has 1.6 (Gaussian) to 2.7 (Laplace). So large a share makes the white noise 2.5 % too small.
BESIDE_REPEATED, MUCH_REPEATED = 4.0, 0.05

# Zeros times values two steps off over the square of those one step off: at most 1 of noise, 1.26
# to 2 of Gaussian noise cut in steps up to 0.7 of it.
CUT_TO_ZERO = 1.1

# Share of the samples, and fewest, next to an extreme where the density should fall; fewest in one
# of so many parts of the record.
LAST_OF_END, FEWEST_OF_END, FEWEST_OF_PART, PARTS_OF_END = 1.0 / 32.0, 1024, 8, 16
HARMFUL_END = 0.08  # density times deviation of Gaussian noise cut at 2.1: 10 % too small

# Means that a spike of a thermometer may take: what stays equal for longer and jumps then is stuck.
# Least jump, of its range and of its samples' median step (of so many): cycles have less.
WIDEST_SPIKE, LEAST_JUMP, USUAL_STEPS, SAMPLES_OF_STEP = 5, 0.04, 3.0, 1_000_000

HELD_AT_MOST = 0.05  # share of repeated samples that may stay; the noise is larger by that
CHANCE_OF_HELD = 0.05  # share equal by chance up to which they are masked (noise 1.6 % too small)
BLOCK_OF_HELD, LIKE_SCATTER = 64, 1.5  # samples that give a mean to 9 %, ratio of means alike
NEAR = 0.25  # of the scatter: stands for the step where there is none
FEWEST_BETWEEN_HELD = 16  # samples in a row that show how the noise goes on

# -- prediction errors ----------------------------------------------------------------------------

FEWEST_KNOWN = 64  # samples in a row for prediction errors: four coefficients
ORDER = 16  # of the autoregression: whitens resonances and first differences
SAMPLES_PER_COEFFICIENT = 16  # at least: a coefficient then has an error of a quarter
SCALE_BLOCK = 2048  # samples that give the scale to 2 %
CLIP = 4.0  # standard deviations: Gaussian noise clipped there loses 0.1 % of its variance

# -- shocks and outliers --------------------------------------------------------------------------

RINGING = 4.0  # standard deviations that belong to a shock (1 of 16,000 samples of noise)
JOINED = 24  # samples between large errors of one event: a little more than `ORDER`
GUARD = 8  # samples before and at least as many after an event that are left out with it
BESIDE_EVENT = 200  # samples on both sides that give the level to 7 % of the noise
FAR = 4.0  # standard deviations beyond which a sample is an outlier
HARMFUL_OUTLIERS = 1e-3  # share of outliers; they add 16 times as much to the variance
CHAIN_FLOOR = 8.0  # a large sample leaves up to 1/16 of itself in later predictions
MUCH_LEFT_OUT = 0.05  # share taken by events and guards from which outliers go one by one
NEIGHBOURS = 49  # fewest samples of a block whose median is a level: two events of `JOINED` apart
AS_CLOSE = 1.02  # ratio of distances up to which the level of longer blocks is taken
PREDICTED = 0.9  # prediction errors over distances from the level; below, noise is not white

# -- drift and changes of the noise ---------------------------------------------------------------

PARTS = 64  # parts of the record whose means show the wander
SHORT_MEAN = 64  # samples whose means give the fast noise
RAMP = 20.0  # change over rms of the wander: 1 of 1000 random walks has more (200,000 simulated)
TENTHS = 10  # parts of the record among which the loudest is looked for
CHANGE, LARGE_CHANGE = 0.05, 0.2  # of the standard deviation between halves: note, warning
STEADY_MEAN = 16  # samples whose means give the scatter of stationary noise
STEADY_OF_TAILS = 4  # times as many of heavy tails: a large sample marks `ORDER` predictions
FEWEST_STEADY = 8  # parts that are compared
UNSTEADY = 0.1  # deviation of all above the quiet quarter; at rest it is 0.04 (docs/health.md)

# -- two channels ---------------------------------------------------------------------------------

CORRELATED, STRONGLY_CORRELATED = 0.05, 0.3  # a filter with independent channels is as wrong
PARTS_OF_TEMPERATURE = (16, 32, 64)  # parts of the record whose changes are correlated ...
FEWEST_PARTS = 12  # ... changes from part to part ...
SHORTEST_PART = 32  # ... and samples of each part

# -- the step of the samples ----------------------------------------------------------------------

COARSE = 3.0  # standard deviations of the noise: a larger step hides it (Widrow & Kollar 2008, 5)
BLOCK_OF_LEVELS = 100  # samples with one mean: a wander within adds levels and hides the step
LEVELS_SAMPLED = 65_536  # samples that show a lattice
ONE_STEP = 1.5  # times the smallest difference that count as one step
DIVISORS = range(1, 7)  # the smallest difference may be so many steps
OFF_LATTICE = 0.1  # rms distance from the lattice in steps; random numbers have 0.29
FEWEST_LEVELS = 8  # levels that prove a lattice by their places alone

# -- the spectrum ---------------------------------------------------------------------------------

FEWEST_OF_SPECTRUM = 512  # samples
FIRST_BIN = 20  # slower than 1/20 of the record is drift, not a line
BANDS_PER_OCTAVE = 24  # narrower than the narrowest resonance
FEWEST_IN_BAND = 8  # bins: the level has an error of a third

# -- lines ----------------------------------------------------------------------------------------

NARROW = 0.01  # largest width of a line over its frequency: wider ones are resonances
UNRESOLVED = 6  # bins of a pure line under the Hann window with its foot
LEAST_LINE = 1e-8  # amplitude over deviation; double precision filters leave peaks of 5e-9
BESIDE_LINE, BESIDE_LINE_FRACTION = 64, 0.015  # bins of the background, or share of the frequency
MOST_LINES = 40  # lines of one channel ...
NAMED_LINES = 4  # ... and those with a notice of their own
FOOT_RATIO = 1.5  # ratio to the background that ends the foot of a line ...
FOOT = 0.05  # ... which is no wider than this share of the frequency

# -- resonances -----------------------------------------------------------------------------------

FEWEST_BANDS = 24  # an octave
LEAST_PEAK = 1.5  # ratio to the background that matters to a filter: 22 % of the amplitude
SLOWEST_BIN = 64  # below it bands are wider than a peak
FITTED_OCTAVES = 2.0  # frequencies from f/2 to 2 f are fitted ...
FITTED_POINTS = 300  # ... by so many means of the periodogram
NARROWEST, WIDEST = 0.003, 0.3  # damping: narrower is found as a line, wider has no peak
RESOLVED, FEET = 200.0, 8.0  # bins of a line with a shape; widths on either side that show it
MISFIT = 1.5  # chi-square of a degree of freedom up to which a line has the shape of a resonance
MOST_RESONANCES = 4  # resonances of one channel
DAMPING_STARTS = (0.01, 0.05, 0.15)  # where the fit starts

# -- the tails of the noise -----------------------------------------------------------------------

BIN_OF_BODY = 0.25  # standard deviations up to `FAR`: finer rounding does not show
OCTAVES_OF_TAIL = 8  # beyond `FAR`: up to a thousand standard deviations
ROUNDING_OF_BODY = 1.0  # standard deviations that rounding may add to a prediction error
LEAST_SHAPE = {"student": 2.0, "power": 0.5}  # finite variance; excess kurtosis below 22

# Errors beyond 2 standard deviations and the eight after them: their mean correlation is 0.10 where
# bursts of ten are 1 % of the record, below 0.03 of 5,000 independent samples of heavy tails.
LARGE, LAGS, CLUSTERED = 2.0, 8, 0.05

# -- stretches at rest ----------------------------------------------------------------------------

STILL_BLOCK, FEWEST_STILL = 0.25, 8  # s of a block, fewest blocks: ends are found to half a second
SHORTEST_STILL = 10.0  # s; 1,000 samples at 100 Hz show the white noise to 3 %
BLOCKS_OF_FLOOR, ROUNDS_OF_FLOOR = 20, 3  # blocks (5 s) of the quietest seconds; rounds

# Scatter of a block over that of the noise, of all axes and of one: 16 samples of white noise in
# six axes exceed 1.8, in one axis 3.5, in 1 of 100,000 blocks. Fewer axes have a larger limit.
MOST_OF_FLOOR, MOST_OF_AXIS, CHANCE_OF_BLOCK = 1.8, 3.5, 1e-5

NOW_AND_THEN = 0.1  # share of loud blocks of a vibrating stretch; Student's t (3) has a twentieth
BLOCKS_OF_SHOCK = 4  # blocks (1 s) of a shock within a stretch, which screening masks
LOUDER_THAN_REST = 1.5  # scatter over that of the quietest stretch: white noise 22 % larger
BLOCKS_OF_LEVEL = 4  # blocks (1 s) of a mean of log scatter whose sudden changes are found
FEW_SECONDS = 3.0  # over the root of their number: a minute needs changes 1.4 times as large
HARMFUL_SCATTER = 0.05  # share of loud stretches in the variance: 2.5 % of the white noise
LEAST_SHAKEN = 0.02  # share of loud stretches below ten seconds: fewer are shocks
SWAYING_RATE = 3.5e-3  # rad/s (0.2 deg/s) from second to second, half of the time

# Points of a spectrum, its peak over the median within an octave, and the share of the variance in
# it, of a stretch that vibrates. A sensor at rest has lines, but most of its noise is broad.
POINTS_OF_BAND, PEAK_OF_BAND, SHARE_OF_BAND = 512, 20.0, 0.3

# -- interpolated samples -------------------------------------------------------------------------

BENT = 0.9  # quantile of the second differences that gives their size
STRAIGHT = 3e-5  # share of it that counts as zero: single precision leaves 1e-5 beside gravity
STRAIGHT_AT_MOST = 0.02  # the same for rounding: above it nothing is seen
LEAST_STRAIGHT = 0.15  # share of zeros of an interpolation to 2.4 times the rate and more
FEWEST_STRAIGHT = 0.02  # share from which some samples were put between others
NEARLY_STRAIGHT = 0.05  # size of second differences that noise has as often as smaller ones ...
BESIDE_STRAIGHT = 0.25  # ... and the share of these that rounding makes zero at most

# -- copies ---------------------------------------------------------------------------------------

SPARSE = 8  # one of so many windows is compared, a power of two

# Lags in shares of the record, and largest share of equal rows followed by another in fine samples:
# 32 equal rows then have a chance of 1e-32.
LAGS_OF_ROWS, MOST_OF_FINE = (0.2137, 0.4112, 0.618), 0.1
FEWEST_COPIED, FEWEST_COARSE_COPIED = 32, 1024  # rows of a copy of fine and of coarse samples
CHANGES_IN_COPY = 24  # changes from row to row: which 24 of 1,024 rows change has 160 bits
