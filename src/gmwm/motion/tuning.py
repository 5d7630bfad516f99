"""Constants of the comparison of IMUs in motion, each with its reason or the study that set it."""

MEAN_OVER = 0.1  # s: means on which clocks and mappings are fitted, where bodies are still rigid
EDGE = 3  # samples at each end, where a cubic spline has neighbours on one side only

# -- clocks ---------------------------------------------------------------------------------------

CORRELATED = 0.5  # of the lengths of the rates: flights have 0.998 and more, noise up to 0.24
LEAST_SHARED = 0.2  # of the shorter recording
MOVING = 0.01  # rad/s rms of means over 0.1 s; noise of the same IMUs at rest has 0.0004
PART = 5.0  # s: parts whose own delays tell a clock that wanders from a steady one
# Share of the variance of residuals that delays of the parts explain beyond a steady clock: 14
# flights have at most 0.04, steady simulated clocks on their motions 0.014.
WANDER = 0.1
PASSES, CLOSE = 12, 1e-7  # of the delay, s

# -- mapping --------------------------------------------------------------------------------------

# Spread of what a mapping may correct after the rotation that gyros have in common. What the motion
# does not determine stays at its usual value: hovering turns forces little, and scale is then open.
SCALE_SPREAD, LAG_SPREAD, ARM_SPREAD = 0.03, 0.003, 0.3  # share, s, m
# Share in rates (14 flights have up to 0.023), and m/s^2 of mean forces: more are wrong axes.
MOST_CORRECTED, MOST_APART = 0.1, 3.0
# Of the free matrix of mean forces: entries beside the identity that are wrong axes or scales, if
# they are so many standard errors and noise is at most a fifth of the variance.
MOST_TURNED, SURE, NOISE_LEFT = 0.35, 5.0, 0.2
MOST_TILT = (
    0.07  # rad: standard error of a rotation; 0.05 where other axes have a hundredth of the rates
)
STUCK = 5.0  # s at one value: rounded noise at rest changes sooner
# Share of samples at an end, if there are many levels; 14 flights have at most 0.0004. Robust
# deviations of a sample from its neighbours that make it a spike; they have at most 12.
CLIPPED, FEWEST_LEVELS, SPIKE = 0.005, 100, 30.0
COPY = 0.01  # of the largest difference: neighbours that share all vibration have a tenth
MOST_LEFT = 0.3  # share of the variance of rates that a mapping may leave: flights have 0.001
# Residuals of means are correlated: their variance counts so often against the spread.
CORRELATION = 3.0
MOST_ABSORBED = 0.5  # share of a variance that a fit may have taken and that is given back
REWEIGHTED = 3  # times the spread of the residuals is found again
ERROR_PART = 2.0  # s: parts whose sums give the errors of a mapping

# -- curves ---------------------------------------------------------------------------------------

WINDOWS = 10  # averaging times that a flight needs to hold
# Averaging times, and s, of a block whose mean is independent: vibration comes and goes.
BLOCK_LEVELS, BLOCK_LEAST = 4.0, 1.0
FEWEST_BLOCKS = 20  # that show how a deviation depends on vibration
FEWEST_FLIGHTS = 5  # from so many on, flights are the unit, of which blocks are not independent
SHOWN_AT = (0.008, 0.03, 0.13, 0.5, 1.0, 2.0, 4.0)  # s, averaging times that are printed
# Instants of a flight at which clocks are compared, and share of a sampling interval within which
# IMUs sample together: second-order aliases then correlate by 0.8 and more.
INSTANTS, TOGETHER = 50, 0.05
CONTRADICT = 1e-4  # p-value of one curve and octave; a result has some 200 of them
MOST_FILLED = 0.02  # share of missing samples that lines may replace
BESIDE_LOST = 0.1  # s: samples beside a lost packet are up to 24 deg/s off in a flight
# Robust deviations of a mean over 0.1 s that make it an event, and the largest share of events: in
# 14 flights three instants are.
FAR_OUT, MOST_EVENTS = 10.0, 0.01
LEAST_WALK = 0.01  # share of the variance at the horizon that the walk of a filter has at least
INTERVAL, HORIZON = 0.1, 1.0  # s: keyframes of visual and scans of lidar odometry, and their losses
USES = ((0.1, 1.0), (1.0, 2.0))  # intervals and horizons that are printed; fixes come once a second
# Hz: vibration of rotors and engines that IMUs of 100 Hz and more see; s, over which it is rms.
VIBRATION, VIBRATION_OVER = (20.0, 60.0), 1.0
SHORTEST_CLASS = 5.0  # s
CLASSES = ("low", "middle", "high")  # of vibration, by default a third of the time each
FEWEST_OCTAVES = 2  # at which a reference lets the noise of a gyro be seen
UNIT_LENGTH = 0.01  # by which lengths of quaternions may be off, as of rounding
LEVEL_OVER = 2.0  # s, whose mean stands for what is left out
