"""Constants of navigation that change answers, each with its source or its reason."""

import math

SAME_TIME = 1e-6  # s: sums of sampling intervals are not exact
COVARIANCE_STEP = 0.1  # s of the covariance: short against a manoeuvre and the time between fixes
# m and m/s north, east and down, of fixes without their own: a good receiver in the open.
POSITION_SD, VELOCITY_SD = (1.0, 1.0, 1.5), (0.1, 0.1, 0.15)
# m and rad: of a lidar in a map; of a relative pose of a good camera or lidar; m/s forward, right
# and down of wheels: 0.3 % of 15 m/s, and a car that hardly slips or jumps.
POSE_SD, ODOMETRY_SD, WHEEL_SD = (0.05, math.radians(0.2)), (0.01, 1e-3), (0.05, 0.1, 0.1)
# Probability of a larger innovation at which a standstill is rejected: at one a second, one in a
# day is rejected falsely.
GATE = 1e-5
# Rejections in a row after which the filter is more likely wrong than the fixes: with 3 % outliers,
# five in a row come once in 40 million.
GATE_PATIENCE = 5
# m and s: drift of a barometric height set at the start, and its correlation time: weather changes
# the pressure by some hPa, 8 m each, in hours.
BAROMETER = (10.0, 3600.0)
CONTRADICTED = 0.001  # probability below which innovations contradict a filter
CONFIDENCE = 0.95  # of bands and intervals
SETTLED = 0.25  # fraction of the trajectory after which the filter with GNSS is judged
BOOTSTRAP_DRAWS = 4000  # for intervals of 95 %: 100 draws lie beyond each end
BIAS_WINDOW = 60.0  # s of averages that show a recording's slow errors: an outage of a minute
SETTLING = 120.0  # s before the first outage and between them, for the filter to settle
WHITE_AT = 1.0  # s, where white noise is read off an Allan plot, as data sheets do
# rad, true attitude errors (1 sigma) at the end of an outage, beyond which covariance analysis
# warns. 40 simulated runs of a loiter with the true model: NEES of the nine navigation errors 0.94
# to 1.20 up to 4.1 and 22 deg, 2.1 at 10 and 45 deg.
LINEAR_TILT, LINEAR_HEADING = math.radians(5.0), math.radians(25.0)

# -- own logs: files ------------------------------------------------------------------------------

BAROMETER_SD = 0.5  # m, of one height: a few Pa of noise and gusts
# rad/s and m/s^2, of a turn-on bias where nobody gives one: a static calibration cannot know it.
TURN_ON_SD = {"gyro": math.radians(0.1), "accel": 0.1}
LONGEST_FILLED = 0.1  # s of missing IMU samples that are interpolated: short against a manoeuvre
# Samples at an end of the range: how many show it, and the share above which no filter is right;
# times as often as others are equal, equal neighbours are chance.
FEWEST_CUT_OFF, MOST_CUT_OFF, EQUAL = 8, 0.01, 3.0
LONGEST_HELD = 5.0  # s of one value, beyond which a channel is stuck: a second of noise has others
SPECIFIC_FORCE = (0.5, 2.0)  # mean over standard gravity, beyond which its unit is wrong
# s between fixes whose distance is compared with their velocities; how many are needed; and the
# ratio of mismatches above which two columns are exchanged or a unit is wrong: right ones never
# reach it.
WAY, FEWEST_WAYS, MIXED_UP = 10.0, 8, 3.0
# m in the time of a repeated position, and how often: the noise of a receiver that stands is less.
REPEATED_WAY, REPEATS = 5.0, 3
# Scatter of an IMU at rest, over where the vehicle stood at the start, and the length looked at, s:
# engines and roads shake it far more.
ZERO_VELOCITY = (2.0, 1.0)
# Standard deviations (and m/s^2 of acceleration) beyond which heights step; fixes of a climb.
STEP, CLIMB = (10.0, 5.0), 7
LEAP_SECONDS = 18.0  # s, by which GPS time is ahead of UTC since 2017

# -- own logs: alignment --------------------------------------------------------------------------

STEADY_WINDOW = 0.5  # s, of averages: longer than a vibration, shorter than a manoeuvre
STEADY_LEAST, STEADY_MOST = 2.0, 30.0  # s to level by: fewer are noise, more let biases drift
STEADY = (0.01, 0.15)  # rad/s (0.6 deg/s), m/s^2 (1 deg of tilt): change of a steady average
SEARCHED = 300.0  # s from the start in which steady motion and a course are looked for
ATTITUDE_SD = math.radians(1.0)  # of a given attitude without one
SIGMAS = 5.0  # within which a mean or velocity counts as zero: one false in two million
TILT_FLOOR = math.radians(0.05)  # mounting and uneven ground
TILT_MOVING = math.radians(1.0)  # accelerations of steady motion that GNSS does not show
TILT_MOST = math.radians(3.0)  # tilt error by acceleration, beyond which a stretch is not used
STILL_VELOCITY_SD = 0.02  # m/s, the least of a vehicle at rest
COURSE_RATIO = 20.0  # speed over its standard deviation: a course is then known to 3 deg
CRAB_SD = math.radians(2.0)  # between the course and the forward axis
HEADING_SD = math.radians(2.0)  # of a given heading without one
CHORD = 5.0  # s between two fixes whose line is taken for a course: a turn is slower
# Distance from the line, over its length, of fixes between and of the next one: starting from rest
# leaves a quarter, an outlier at one end two fifths or more.
CHORD_ASIDE = 0.3
COMPASS_SD = math.radians(5.0)  # beyond which the Earth's rotation gives no heading

# -- own logs: verdicts ---------------------------------------------------------------------------

LOST = 5.0  # innovations over their expected size above which a filter is lost
MILD = 1.5  # factor on assumed deviations of fixes up to which the solution may still be used

# -- own logs: faults of a log --------------------------------------------------------------------

SUSPECTED = 0.01  # p-value below which wrong axes are looked for; a fault has to earn its own level
TRACK_STEP = 1.0  # s, of a track between whose points only noise of the IMU is expected
LARGEST_OFFSET = 1.5  # s, of a time offset found from the innovations: with more, no fix is near
OFFSET_MARGIN = 0.1  # s beside it, for fixes left out at both ends
USUAL_RATE = 0.01  # error of a clock that only counts samples, 1 sigma
# Scale error of an IMU that was not calibrated, 1 sigma; and one that no sensor has.
USUAL_SCALE, LARGEST_SCALE = 0.03, 0.15
# Largest error of its rate that is looked for, over 3, and s at first: a step is then 0.6 s.
RATE_STEP, RATE_SPAN = 0.012, 50.0
LARGEST_ARM = 5.0  # m, usual length of a lever arm that was left out, 1 sigma
HEADINGS = 8  # directions that are tried where the filter is lost: 45 deg apart
ROUGH_HEADING = math.radians(15.0)  # 1 sigma of each: the nearest is up to 22.5 deg off
FINE_HEADING = math.radians(0.5)  # of the estimated one: the data and not the start decide
DIAGNOSED = 3600.0  # s from the start in which faults are looked for, by tens of runs
# NIS above which faults that were found leave too much to be the cause; nor may half of it be left.
MOST_LEFT = 1.5
MOST_FAULTS = 4  # at once: with more, nothing can be known
ROUNDS, SETTLED_GAIN = 6, 0.05  # Gauss-Newton steps; the gain in log-likelihood that ends them
# Shares of LARGEST_OFFSET and times LARGEST_ARM from which more of a time offset may be behind it.
FAR_OFFSET, FAR_ARM = 0.9, 2.0
AMBIGUOUS = 3.0  # of log-likelihood, within which two signs explain a log equally well
MOST_OUTLIERS = 0.1  # fraction of the fixes, above which the filter and not the fixes is wrong
# m, 1 sigma of a start whose fix is an outlier: farther ones count as outliers too, and more would
# make the filter allow for products of errors.
ANYWHERE = 100.0
SEEN = 5.0  # standard errors of a constant error that is found at the level of the tests
UNSEEN = 3.0  # m of a lever arm that a motion must show, or it is reported not to

# -- own logs: comparisons on a log ---------------------------------------------------------------

SMOOTHER_STEP = 0.5  # s between steps of the smoother: a turn of 6 deg/s makes 3 deg of it
# s without fixes, and as long with them before the next: what a tunnel or a street of houses takes,
# and long enough that errors of sensors are larger than those of the fixes.
OUTAGE, LONGEST_OUTAGE = 30.0, 600.0
OUTAGES_FROM = 60.0  # s from the start of the filter, in which it settles
FEWEST_OUTAGES = 8  # with fewer the interval of a ratio is a guess
LEAST_SHARE = 0.01  # least difference of two covariances, over the predicted variance
ACCURACY_LEVEL, SCORE_LEVEL = 0.04, 0.01  # by errors and by scores: 5 % that equal models differ
# Logarithm of a ratio of errors, and difference of scores, up to which models tie however surely
# they differ: for scores, standard deviations that are 13 % off.
TIE_RATIO, TIE_SCORE = 0.02, 0.05
POWER, WORTH = 0.95, 0.9  # probability to find a difference; the ratio of errors that matters
