"""Constants of navigation on own logs that change answers, each with its source or its reason."""

import math

from gmwm.ins.tuning import (
    BAROMETER as BAROMETER,
    CONFIDENCE as CONFIDENCE,
    CONTRADICTED as CONTRADICTED,
    POSITION_SD as POSITION_SD,
    VELOCITY_SD as VELOCITY_SD,
)

# -- files ----------------------------------------------------------------------------------------

BAROMETER_SD = 0.5
"""m, of one height of a barometer: a few Pa of noise and gusts."""

TURN_ON_SD = {"gyro": math.radians(0.1), "accel": 0.1}
"""Turn-on bias (1 sigma), which a static calibration cannot know, where nobody specifies a better
one: rad/s, m/s^2."""

LONGEST_FILLED = 0.1
"""s of missing IMU samples that are interpolated: short against a manoeuvre."""

LONGEST_HELD = 5.0
"""s of one value in a channel, beyond which it is stuck: a second of noise has others."""

SPECIFIC_FORCE = (0.5, 2.0)
"""Mean specific force of a record over standard gravity, beyond which its unit is wrong."""

WAY, FEWEST_WAYS, MIXED_UP = 20.0, 8, 3.0
"""s between fixes whose distance is compared with their velocities; how many are needed; and the
ratio of mismatches above which two columns are exchanged or a unit is wrong: right ones never reach
it."""

ZERO_VELOCITY = (2.0, 1.0)
"""Scatter of an IMU at rest, over where the vehicle stood at the start, and the length looked at,
s: engines and roads shake it far more."""

LEAP_SECONDS = 18.0
"""s, by which GPS time is ahead of UTC since 2017."""

# -- alignment ------------------------------------------------------------------------------------

STEADY_WINDOW = 0.5
"""s, over which samples are averaged to see whether a vehicle is steady: longer than a vibration,
shorter than a manoeuvre."""

STEADY_LEAST, STEADY_MOST = 2.0, 30.0
"""s of steady motion to level by: fewer are noise, more let the biases drift."""

STEADY = (0.01, 0.15)
"""rad/s and m/s^2: largest change of such a mean of a steady vehicle; 0.6 deg/s, 1 deg of tilt."""

SEARCHED = 300.0
"""s from the start in which steady motion and a course are looked for."""

MOTION_LEAST, MOTION_MOST = 10.0, 120.0
"""s of motion to find an attitude by: less has little change of velocity, more lets gyros drift."""

MOTION_SD = math.radians(10.0)
"""rad of heading, beyond which it is not found: a filter is linear up to some 10 deg."""

ATTITUDE_SD = math.radians(1.0)
"""rad, of a given attitude without one."""

SIGMAS = 5.0
"""Standard deviations within which a mean or velocity counts as zero: one false in two million."""

TILT_FLOOR, TILT_MOVING = math.radians(0.05), math.radians(1.0)
"""rad, of levelling: mounting and uneven ground; accelerations of steady motion."""

STILL_VELOCITY_SD = 0.02
"""m/s, least standard deviation of the velocity of a vehicle at rest."""

COURSE_RATIO = 20.0
"""Speed over its standard deviation from which a course is used: it is then known to 3 deg."""

CRAB_SD = math.radians(2.0)
"""rad between the course and the forward axis."""

HEADING_SD = math.radians(2.0)
"""rad, of a given heading without one."""

CHORD = 5.0
"""s between two fixes whose line is taken for a course: a turn is slower."""

CHORD_ASIDE = 0.3
"""Distance from the line, over its length, of fixes between and of the next one: starting from rest
leaves a quarter, an outlier at one end two fifths or more."""

COMPASS_SD = math.radians(5.0)
"""rad, beyond which the Earth's rotation gives no heading: a filter is linear up to some 10 deg."""

# -- verdicts -------------------------------------------------------------------------------------

LOST = 5.0
"""Innovations over their expected size above which a filter is lost."""

MOSTLY_FINE = 1.5
"""NIS by the median, below which a few outliers make the mean large."""

MILD = 1.5
"""Factor on assumed standard deviations of fixes up to which the solution may be used all the
same."""

OUTAGES_SHOWN = 6
"""Times without fixes that a report draws, the longest ones: more make it long."""

# -- faults of a log ------------------------------------------------------------------------------

SUSPECTED = 0.01
"""p-value below which wrong axes are looked for; a fault has to earn its own level."""

TRACK_STEP = 1.0
"""s, of a track between whose points nothing but noise of the IMU is expected."""

LARGEST_OFFSET, OFFSET_MARGIN = 1.5, 0.1
"""s, of a time offset that is found from the innovations: with more, no fix is near; and of the
fixes left out at both ends beside it."""

FARTHEST_OFFSET, FAR_STEP, FAR_NEAR = 60.0, 2.0, 0.0625
"""s, of larger time offsets, which are tried where the filter is lost: the farthest (TAI is ahead
of UTC by 37 s), the steps in which all are tried (a vehicle does not turn much faster), and the
last step: a start that is as much off must not make the heading a fault."""

FAR_BETTER = 0.5
"""Square of the innovations over the one with the stamps as they are, below which another offset is
worth a closer look."""

FAR_LEFT = 0.75
"""Share of the fixes that must be in the time of the IMU with another offset."""

LARGEST_ARM = 5.0
"""m, usual length of a lever arm that was left out: 1 sigma."""

HEADINGS = 8
"""Directions that are tried where the filter is lost: 45 deg apart."""

ROUGH_HEADING, FINE_HEADING = math.radians(15.0), math.radians(0.5)
"""rad, 1 sigma of each direction when it is tried (the nearest is up to 22.5 deg off), and when the
error is estimated: small, so that the data and not the start decide."""

DIAGNOSED = 3600.0
"""s from the start in which faults are looked for, by tens of runs of the filter."""

MOST_FAULTS = 4
"""At once: with more, nothing can be known."""

ROUNDS, SETTLED_GAIN = 6, 0.05
"""Gauss-Newton steps, and the gain of the log-likelihood below which they end."""

AMBIGUOUS = 3.0
"""Difference of log-likelihoods below which two faults explain a log equally well: a factor of 20
in probability."""

MOST_OUTLIERS = 0.1
"""Fraction of the fixes above which rejected ones are no outliers: the filter is wrong."""

ANYWHERE = 100.0
"""m, 1 sigma of a start whose fix is an outlier: farther ones count as outliers too, and more would
make the filter allow for products of errors."""

SEEN = 5.0
"""Standard errors of a constant error that is found at the level of the tests."""

UNSEEN = {"s": 0.5, "m": 3.0, "heading": math.radians(10.0)}
"""Smallest constant error that a motion must show, or it is reported not to: larger ones are
rare."""

# -- comparisons on a log -------------------------------------------------------------------------

SMOOTHER_STEP = 0.5
"""s between steps of the smoother's covariance: a turn of 6 deg/s makes 3 deg of it."""

OUTAGE, LONGEST_OUTAGE = 30.0, 600.0
"""s without fixes, and as long with them before the next: what a tunnel or a street of houses
takes, and long enough that errors of sensors are larger than those of the fixes."""

OUTAGES_FROM = 60.0
"""s from the start of the filter, in which it settles, to the first outage."""

FEWEST_OUTAGES = 8
"""Outages of a comparison: with fewer the interval of a ratio is a guess."""

LEAST_SHARE = 0.01
"""Least difference of two covariances, over the predicted variance."""

ACCURACY_LEVEL, SCORE_LEVEL = 0.04, 0.01
"""Probability that equal models do not tie, by their errors and by what they predict: 5 % in
all."""

TIE_RATIO, TIE_SCORE = 0.02, 0.05
"""Logarithm of a ratio of errors, and difference of scores, up to which models tie however surely
they differ: for scores, standard deviations that are 13 % off."""

POWER, WORTH = 0.95, 0.9
"""Probability with which a difference is found, and the ratio of errors that matters."""
