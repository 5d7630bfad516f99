"""Thresholds of the diagnosis, each with its source or its reason."""

FALSE_ALARM = 1e-3
"""Chance of each kind of notice in a channel of clean Gaussian noise, however long."""

# -- the whole recording --------------------------------------------------------------------------

LONG_RECORD = 3600.0
"""s: slow errors of inertial sensors have correlation times of minutes."""

JITTER, LARGE_JITTER = 0.1, 0.3
"""Root mean square of the steps of time stamps, in sampling intervals, for a note and a warning."""

# -- motion ---------------------------------------------------------------------------------------

LARGEST_OF_SENSOR = 1e6
"""rad/s or m/s^2: beyond the range of any sensor, accelerometers for shocks of 1e5 g included."""

SHARED_FREQUENCY = 0.01
"""Relative difference of the frequencies of one vibration as several sensors show it: resonances
near 10 Hz of three accelerometers of one unit differ by 0.6 %."""

MOTION_BLOCK, FEWEST_OF_MOTION = 1.0, 16
"""s, and samples at least, of the means in which motion is looked for: handling is slower, fast
noise averages out."""

MEDIAN_BLOCKS = 5
"""Means of a running median, and between two that are compared: shocks ring for less than two."""

FEWEST_BLOCKS = 30
"""Means below which a recording is too short for it."""

TURNS = 0.0175
"""rad/s (1 deg/s) by which the rate of a sensor at rest does not change within some seconds; that
of the real recordings of docs/real-data.md does by 0.15 deg/s at most in 40 channel hours."""

TILTS = 0.0175
"""rad (1 deg), the same of the direction of gravity: 0.3 deg at most in those recordings."""

QUIET = 0.2
"""Quantile of the changes that gives their noise where the sensor moves most of the time."""

BEYOND_NOISE = 2.0
"""Times the quantile of Gaussian noise: a scale from a few dozen blocks is known to half of it."""

SHORTEST_STATIC = 10
"""Blocks between two changes that show a level."""

LONGEST_TILT = 30.0
"""s that a change from one attitude at rest to another may take, five blocks on either side
included."""

EXPLAINED, AS_PREDICTED = 0.1, 2.0
"""Share of the changes of the specific force that turning explains, and the ratio to what it should
explain: recordings at rest have a share below 1e-4 (docs/health.md)."""

SLOW_TILT = 0.05
"""rad (3 deg) by which gravity may turn while nothing is seen to move: 50 mg, more than any
accelerometer drifts."""

WILD, BEYOND_WHITE = 0.1, 10.0
"""rad/s between quantiles of the rate, and times what fast noise leaves, of a gyro alone that is
never at rest: biases of the cheapest wander by a fiftieth."""

PARTS_OF_MOTION = 8
"""Parts of a record, of which most must show that: one shock does not."""

SWAYS = 1e-3
"""rad from block to block below which turning does no harm."""

# -- missing, stuck and saturated samples ---------------------------------------------------------

MUCH_MISSING, TOO_MUCH_MISSING = 0.1, 0.5
"""Fraction of samples missing (or stuck) for a warning, and above which a channel is of no use."""

DITHERED = 0.05
"""Fraction of differences of two steps and more at which noise distinguishes samples."""

LONG_RUN = 32
"""Equal samples in a row that are left out of that fraction."""

FEWEST_AT_END = 8
"""Samples at the end of the scale from which saturation is looked for."""

FEWEST_OF_LEVEL, FEWEST_WIDE = 20, 0.01
"""Samples on a level whose neighbours do not stay empty by chance (2e-9); part of the samples on
levels that are further apart than others, from which their step counts."""

BESIDE_REPEATED, MUCH_REPEATED = 4.0, 0.05
"""Times as often as the values next to it comes one that is no sample: noise as small as its step
has a ratio of 1.6 (Gaussian) to 2.7 (Laplace). Part of the samples that make the white noise 2.5 %
too small."""

CUT_TO_ZERO = 1.1
"""Zeros times those two steps off over the square of those one step off: at most one of noise; 2 to
1.26 of Gaussian noise cut in steps up to 0.7 of it."""

LAST_OF_END, FEWEST_OF_END, FEWEST_OF_PART, PARTS_OF_END = 1.0 / 32.0, 1024, 8, 16
"""Part of the samples, and samples at least, next to an extreme in which the fall of the density is
looked for; samples of one of so many parts of the record that show it."""

HARMFUL_END = 0.08
"""Density at the ends times the standard deviation: of Gaussian noise whose samples beyond 2.1
standard deviations were sorted out, which makes its density 10 % too small."""

HELD_AT_MOST, CHANCE_OF_HELD, LAST_RISE, NEAR = 0.05, 0.05, 0.75, 0.25
"""Part of the samples that repeat the one before, and stay, which makes the noise larger by
that; part that may equal it by chance where such samples are made missing (which makes the noise
1.6 % smaller). Largest power of a law (t with 2.5 degrees of freedom, rounded to two deviations;
Laplace's walk 0.65). Of the scatter, a step to compare with where there is none."""

FEWEST_BETWEEN_HELD = 16
"""Samples in a row, of which something is known of how the noise goes on."""

# -- prediction errors ----------------------------------------------------------------------------

FEWEST_KNOWN = 64
"""Samples in a row from which prediction errors are made: four coefficients."""

ORDER = 16
"""Order of the autoregression; enough to whiten resonances and first differences."""

SAMPLES_PER_COEFFICIENT = 16
"""Fewest: a coefficient then has an error of a quarter."""

SCALE_BLOCK = 2048
"""Samples from which the scale is estimated: 2 % of error."""

CLIP = 4.0
"""Standard deviations beyond which an error counts as one of four: Gaussian noise loses 0.1 % of
its variance."""

# -- shocks and outliers --------------------------------------------------------------------------

RINGING = 4.0
"""Standard deviations of what belongs to a shock, once there is one: 1 of 16,000 samples of
noise."""

JOINED = 24
"""Samples between large errors of one event: a little more than the order of the prediction."""

GUARD = 8
"""Samples before, and at least as many after, that are left out with an event."""

BESIDE_EVENT = 200
"""Samples on both sides that give the level without the event, to 7 % of the noise."""

FAR = 4.0
"""Standard deviations beyond which a sample is an outlier."""

HARMFUL_OUTLIERS = 1e-3
"""Fraction of outliers; they add 16 times as much to the variance, or more."""

# -- drift and changes of the noise ---------------------------------------------------------------

PARTS = 64
"""Parts of the record whose means show the wander."""

SHORT_MEAN = 64
"""Samples whose means give the fast noise."""

RAMP = 20.0
"""Change over the record, in rms of the wander: 1 of 1000 random walks has more (200,000
simulated)."""

TENTHS = 10
"""Parts of the record among which the loudest is looked for."""

CHANGE, LARGE_CHANGE = 0.05, 0.2
"""Relative change of the standard deviation between halves for a note and a warning."""

STEADY_MEAN, STEADY_OF_TAILS, FEWEST_STEADY = 16, 4, 8
"""Samples whose means give what stationary noise leaves, times as many of heavy tails (a large
sample leaves its trace in the predictions of `ORDER` more), and parts of four times as many and
more that are compared with it at least."""

UNSTEADY = 0.1
"""Of the deviation of all above that of the quiet quarter: as much as a valid fit may miss. Real
recordings at rest have 0.04 (docs/health.md)."""

# -- two channels ---------------------------------------------------------------------------------

CORRELATED, STRONGLY_CORRELATED = 0.05, 0.3
"""Correlation of prediction errors for a note and a warning: a filter that takes the channels as
independent is wrong by as much."""

FEWEST_PARTS = 16
"""Changes from part to part from which a correlation with the temperature is computed."""

SHORTEST_PART = 32
"""Samples of a part for that."""

# -- the step of the samples ----------------------------------------------------------------------

COARSE = 3.0
"""Standard deviations of the noise from which on a step hides it (Widrow & Kollar 2008, sec. 5)."""

BLOCK_OF_LEVELS = 100
"""Samples over which the mean is taken for constant: a wander within adds levels, and hides a step
that is coarse."""

LEVELS_SAMPLED = 65_536
"""Samples in which a lattice shows; more are not looked at."""

ONE_STEP = 1.5
"""Times the smallest difference up to which a difference counts as one step."""

DIVISORS = range(1, 7)
"""The smallest difference seen may be so many steps."""

OFF_LATTICE = 0.1
"""Root mean square distance from the lattice, in steps; numbers at random have 0.29."""

FEWEST_LEVELS = 8
"""Levels that prove a lattice by their places alone."""

# -- the spectrum ---------------------------------------------------------------------------------

FEWEST_OF_SPECTRUM = 512
"""Samples below which there is no useful spectrum."""

FIRST_BIN = 20
"""First bin that is looked at: slower than a twentieth of the record is drift, not a line."""

BANDS_PER_OCTAVE = 24
"""Bands of the smooth background, narrower than the narrowest resonance that is looked for."""

FEWEST_IN_BAND = 8
"""Bins of a band: its level then has an error of a third."""

# -- lines ----------------------------------------------------------------------------------------

NARROW = 0.01
"""Part of its frequency that a line may be wide: wider ones are resonances."""

UNRESOLVED = 6
"""Bins that a pure line takes under the Hann window, its foot included."""

LEAST_LINE = 1e-8
"""Amplitude over the deviation of the samples, about: what filters of double precision leave beyond
their band has peaks of 5e-9, and no level of a wavelet variance sees them."""

BESIDE_LINE, BESIDE_LINE_FRACTION = 64, 0.015
"""Bins on both sides that give the local background, or this part of the frequency."""

MOST_LINES = 40
"""Lines of one channel."""

NAMED_LINES = 4
"""Lines with a notice of their own."""

FOOT_RATIO = 1.5
"""Ratio to the background that ends the foot of a line."""

FOOT = 0.05
"""Part of the frequency beyond which no foot reaches."""

# -- resonances -----------------------------------------------------------------------------------

FEWEST_BANDS = 24
"""Bands of a spectrum in which a resonance can be seen: an octave."""

LEAST_PEAK = 1.5
"""Ratio to the background from which a peak matters to a filter: 22 % of the amplitude."""

SLOWEST_BIN = 64
"""Bin below which bands are wider than a peak."""

FITTED_OCTAVES = 2.0
"""Frequencies from f/2 to 2 f are fitted."""

FITTED_POINTS = 300
"""Means of the periodogram in that range."""

NARROWEST, WIDEST = 0.005, 0.3
"""Damping ratios: what is narrower than a hundredth of its frequency is a line, what is wider has
no peak above a smooth background."""

MOST_RESONANCES = 4
"""Resonances of one channel."""

DAMPING_STARTS = (0.01, 0.05, 0.15)
"""Damping ratios from which the fit starts."""

# -- the tails of the noise -----------------------------------------------------------------------

BIN_OF_BODY = 0.25
"""Standard deviations, up to `FAR`: sixteen bins show a shape, and finer rounding does not."""

OCTAVES_OF_TAIL = 8
"""Beyond `FAR`, in quarters of an octave: up to a thousand standard deviations."""

ROUNDING_OF_BODY = 1.0
"""Standard deviations that rounding may add to a prediction error; the bins are no longer those of
the noise beyond (a step of an eighth of the noise, with an autoregression of order 16)."""

LEAST_SHAPE = {"student": 2.0, "power": 0.5}
"""Shapes of the laws above which they are those of noise: Student's t has a variance, and the
exponential power law an excess kurtosis below 22."""

CHAIN_FLOOR = 8.0
"""A large sample leaves up to 1/16 of itself in the predictions of those after it: smaller errors
beside it than this part of it are no evidence of a shock."""

MUCH_LEFT_OUT = 0.05
"""Fraction of the samples that events may take with their guards, above which outliers are left out
one by one."""

NEIGHBOURS = 49
"""Fewest samples of a block whose median is a level: two events of `JOINED` apart."""

AS_CLOSE = 1.02
"""Ratio of the distances from two levels up to which the one of longer blocks is taken."""

PREDICTED = 0.9
"""Ratio of prediction errors to distances from the level, below which the noise is not white."""

LARGE, LAGS, CLUSTERED = 2.0, 8, 0.05
"""Errors beyond so many standard deviations are independent of so many after them: their mean
correlation is 0.10 where bursts of ten samples are a hundredth of the record, and below 0.03 for
independent noise of heavy tails of 5,000 samples."""

# -- stretches at rest ----------------------------------------------------------------------------

STILL_BLOCK, FEWEST_STILL = 0.25, 8
"""s of a block, and blocks of a log that is examined: ends are found to half a second."""

SHORTEST_STILL = 10.0
"""s of a stretch that is used: a thousand samples at 100 Hz show the white noise to 3 %."""

BLOCKS_OF_FLOOR, ROUNDS_OF_FLOOR = 20, 3
"""Blocks (5 s) of the quietest seconds, and rounds in which all quiet ones replace them."""

MOST_OF_FLOOR, MOST_OF_AXIS, CHANCE_OF_BLOCK = 1.8, 3.5, 1e-5
"""Scatter of a block over that of the noise, of all axes and of one: that of 16 samples of white
noise in six axes is above 1.8 in 1 of 100,000 blocks, in one axis above 3.5 in as many. Where fewer
axes have a larger one as often, that counts."""

NOW_AND_THEN = 0.1
"""Of its blocks in which most axes scatter more than noise, from which a stretch vibrates; of six
axes of Student's t with 3 degrees of freedom a twentieth do."""

BLOCKS_OF_SHOCK = 4
"""Blocks (1 s) of a shock within a stretch, which screening masks."""

LOUDER_THAN_REST = 1.5
"""Scatter of an axis over that of the quietest stretch, from which the stretch vibrates: white
noise that is 22 % larger."""

BLOCKS_OF_LEVEL = 4
"""Blocks (1 s) of a mean of the logarithms of the scatter, whose sudden changes are found."""

FEW_SECONDS = 3.0
"""Over the root of their number: how much larger a change must be (a minute: 1.4 times, for noise
with resonances and outliers that is static: benchmarks/still_stretches.py)."""

HARMFUL_SCATTER = 0.05
"""Share that loud stretches add to the variance of an axis: 2.5 % of its white noise."""

LEAST_SHAKEN = 0.02
"""Of the recording that is loud in stretches of less than ten seconds: fewer are shocks."""

POINTS_OF_BAND, PEAK_OF_BAND, SHARE_OF_BAND = 512, 20.0, 0.3
"""Points of a spectrum; its peak over the median within an octave, and the share of the variance in
it, of a stretch that vibrates: a sensor at rest has lines, but most of its noise is none."""

SWAYING_RATE = 3.5e-3
"""rad/s (0.2 deg/s) by which the mean rate of a sensor at rest does not change from second to
second, half of the time; for gravity that is `SWAYS`."""

# -- interpolated samples -------------------------------------------------------------------------

BENT, STRAIGHT, STRAIGHT_AT_MOST = 0.9, 3e-5, 0.02
"""Quantile of the second differences that gives their size, and the share of it that counts as
none (single precision leaves 1e-5 beside gravity); where rounding leaves more than the last,
nothing is seen."""

LEAST_STRAIGHT = 0.15
"""Share of second differences that vanish: of noise there are ten times the threshold over its
size, at most; of an interpolation to 2.4 times the rate and more there are as many."""

FEWEST_STRAIGHT, NEARLY_STRAIGHT, BESIDE_STRAIGHT = 0.02, 0.05, 0.25
"""Share from which some samples were put between others; second differences, in those of their
size, that noise has as often as it has smaller ones; and of these the share that vanishes by
rounding at most, in two steps of it."""

# -- copies ---------------------------------------------------------------------------------------

SPARSE = 8
"""One of so many windows is looked at, a power of two."""

LAGS_OF_ROWS, MOST_OF_FINE = (0.2137, 0.4112, 0.618), 0.1
"""Shares of the record between rows that are compared, and of those that are the same so many are
followed by such at most, of fine samples: 32 in a row are then the same by a chance of 1e-32."""

FEWEST_COPIED, FEWEST_COARSE_COPIED, CHANGES_IN_COPY = 32, 1024, 24
"""Rows of a copy at least, fine and coarse, and changes from row to row in it: which 24 of 1,024
rows change has 160 bits."""
