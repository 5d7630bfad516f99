"""Constants of navigation that change answers, each with its source or its reason.

Constants of the Earth stand in `gmwm.ins.geometry`; those that only keep arithmetic safe, and words
of file formats, stand where they are used.
"""

import math

# -- the filter -----------------------------------------------------------------------------------

COVARIANCE_STEP = 0.1
"""s between steps of the covariance: short against a manoeuvre and the time between fixes."""

STANDSTILL = 1e-3
"""m/s, below which the vehicle of a simulated trajectory stands."""

POSITION_SD = (1.0, 1.0, 1.5)
"""Of fixes that state none, to the north, east and down, m: of a good receiver in the open."""

VELOCITY_SD = (0.1, 0.1, 0.15)
"""The same of velocities, m/s."""

GATE = 1e-5
"""Probability of a larger innovation beyond which a standstill is not believed: one in a day of one
a second is rejected falsely."""

GATE_PATIENCE = 5
"""Rejections in a row after which the filter is more likely wrong than the fixes: of 3 % outliers,
five in a row come once in 40 million."""

BAROMETER_SD = 0.5
"""m, of one height of a barometer: a few Pa of noise and gusts."""

BAROMETER = (10.0, 3600.0)
"""m and s: how far the height of a pressure is off once it is set at the start, and for how long;
weather changes it by some hPa, 8 m each, in hours."""

TURN_ON_SD = {"gyro": math.radians(0.1), "accel": 0.1}
"""Of a bias from one switching on to the next, which a static calibration cannot know, where nobody
specifies better: rad/s, m/s^2."""

LONGEST_FILLED = 0.1
"""s of missing IMU samples that are filled along a straight line: short against a manoeuvre."""

SPECIFIC_FORCE = (0.5, 2.0)
"""Of standard gravity: mean specific force of a record, beyond which its unit is wrong."""

ZERO_VELOCITY = (2.0, 1.0)
"""How many times as much an IMU may scatter as where the vehicle stood at the start to count as at
rest, and the length that is looked at, s: engines and roads shake it by far more."""

WAY, FEWEST_WAYS, MIXED_UP = 20.0, 8, 3.0
"""s between fixes whose way is compared with their velocities, one begun in the middle of another;
how many are needed; and how many times as far off they must be as with two columns exchanged or
another unit: right ones are never farther off."""

LONGEST_HELD = 5.0
"""s of one value in a channel, beyond which it is stuck: a second of noise has others."""

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
"""rad, of an attitude that is given without one."""

SIGMAS = 5.0
"""Standard deviations within which a mean or velocity counts as zero: one false in two million."""

TILT_FLOOR, TILT_MOVING = math.radians(0.05), math.radians(1.0)
"""rad, of levelling: mounting and uneven ground; accelerations of steady motion."""

STILL_VELOCITY_SD = 0.02
"""m/s, least standard deviation of the velocity of a vehicle at rest."""

COURSE_RATIO = 20.0
"""Speed over its standard deviation at which a course is taken: it is then known to 3 deg."""

CRAB_SD = math.radians(2.0)
"""rad between the course and the forward axis."""

HEADING_SD = math.radians(2.0)
"""rad, of a heading that is given without one."""

CHORD = 5.0
"""s between two fixes whose line is taken for a course: a turn is slower."""

CHORD_ASIDE = 0.3
"""Of its length, within which the fixes between lie, and the next one: starting from rest leaves a
quarter, an outlier at one end two fifths or more."""

COMPASS_SD = math.radians(5.0)
"""rad, beyond which the Earth's rotation gives no heading: a filter is linear up to some 10 deg."""

# -- verdicts -------------------------------------------------------------------------------------

CONTRADICTED = 0.001
"""Probability below which a filter is called inconsistent, or its innovations contradict it."""

CONFIDENCE = 0.95
"""Of bands and intervals."""

LOST = 5.0
"""Times the expected size, beyond which innovations say that a filter is lost."""

MOSTLY_FINE = 1.5
"""NIS by the median, below which a few outliers make the mean large."""

OUTAGES_SHOWN = 6
"""Times without fixes that a report draws, the longest ones: more make it long."""

# -- faults of a log -------------------------------------------------------------------------------

SUSPECTED = 0.01
"""p-value below which explanations are looked for that cost many runs of the filter; what is found
has to earn its own level."""

TRACK_STEP = 1.0
"""s, of a track between whose points nothing but noise of the IMU is expected."""

LARGEST_OFFSET, OFFSET_MARGIN = 1.5, 0.1
"""s, of a constant error of the fixes' stamps that is looked for: leap seconds are more, and leave
no fix near; and of the fixes left out at both ends beside it."""

FAR_BETTER = 0.5
"""Square of the innovations, of that with the stamps as they are, below which another offset
is worth a closer look."""

FAR_LEFT = 0.75
"""Of the fixes, which have to be in the time of the IMU with another offset."""

LEAP_SECONDS = 18.0
"""s, by which GPS time is ahead of UTC since 2017."""

FARTHEST_OFFSET, FAR_STEP, FAR_NEAR = 60.0, 2.0, 0.0625
"""s, of larger errors of the stamps, which are looked for where the filter is lost: the farthest
(TAI is ahead of UTC by 37 s), the steps in which all are tried (a vehicle does not turn much
faster), and the last step: a start that is as much off must not make the heading a fault."""

STEP_PARTS = 16
"""Parts of a log between which a step of a clock is looked for before the best is refined."""

STEP_NEAR = 4
"""Fixes to both sides among which it is looked for again once its size is known."""

LARGEST_ARM = 5.0
"""m, usual length of a lever arm that was left out: 1 sigma."""

LARGEST_SCALE_ERROR = 0.05
"""Usual scale error of a sensor, 1 sigma: data sheets of MEMS allow 1 to 3 %."""

HEADINGS = 8
"""Directions that are tried where the filter is lost: 45 deg apart."""

ROUGH_HEADING, FINE_HEADING = math.radians(15.0), math.radians(0.5)
"""rad, 1 sigma of each direction when it is tried (the nearest is up to 22.5 deg off), and when the
error is estimated: small, so that the data and not the start decide."""

DIAGNOSED = 3600.0
"""s from the start in which faults are looked for: tens of runs of the filter."""

MOST_FAULTS = 4
"""At once: with more, nothing can be known."""

ROUNDS, SETTLED_GAIN = 6, 0.05
"""Gauss-Newton steps, and the gain of the log-likelihood below which they end."""

REFINED, TRIALS = 6, 40
"""Explanations that are worked out, by their gain at first sight; runs to fit coloured noise."""

LEAST_WHITE, LONGEST_COLOUR = -4.0, 1e4
"""Logarithm of the least factor on the white part of coloured fixes; s, longest correlation."""

SCALE_STEP, LARGEST_SCALE = math.log(5.0), math.log(1000.0)
"""Logarithm of the factors on a noise that are tried first, and of the largest."""

NOT_NOISE = 30.0
"""Times the noise of a model, beyond which a log is more likely wrong than a calibration."""

AMBIGUOUS = 3.0
"""Of the log-likelihood: an explanation that is less than 20 times as probable is no decision."""

MOST_OUTLIERS = 0.1
"""Fraction of the fixes beyond which those that a gate rejects are no outliers: it is the filter
that is wrong."""

ANYWHERE = 100.0
"""m, 1 sigma of a start whose fix is an outlier: farther ones count as such too, and more would
make the filter allow for products of errors."""

SEEN = 5.0
"""Standard errors that a constant error must have to be found at the level of the tests."""

UNSEEN = {"s": 0.5, "m": 3.0, "heading": math.radians(10.0)}
"""Least constant error that is found, beyond which a motion is reported not to show it: more is
rare in practice."""

MILD = 1.5
"""Factor on the deviations of fixes up to which the solution may be used all the same."""

# -- comparisons on a log --------------------------------------------------------------------------

SMOOTHER_STEP = 0.5
"""s between steps of the smoother's covariance: a turn of 6 deg/s makes 3 deg of it."""

OUTAGE, LONGEST_OUTAGE = 30.0, 600.0
"""s without fixes, and as long with them before the next: what a tunnel or a street of houses
takes, and long enough that errors of sensors are larger than those of the fixes."""

OUTAGES_FROM = 60.0
"""s from the start of the filter, in which it settles, to the first outage."""

FEWEST_OUTAGES = 8
"""Of a comparison: with fewer the interval of a ratio is a guess."""

LEAST_SHARE = 0.01
"""Of the predicted variance, that the difference of two covariances is at least."""

ACCURACY_LEVEL, SCORE_LEVEL = 0.04, 0.01
"""Probability that equal models are not a tie, by their errors and by what they predict: 5 % in
all."""

TIE_RATIO, TIE_SCORE = 0.02, 0.05
"""Logarithm of a ratio of errors, and difference of scores, up to which models are as good as each
other, however surely they differ: of the scores, standard deviations that are 13 % off."""

POWER, WORTH = 0.95, 0.9
"""Probability with which a difference is found, and the ratio of errors that is worth it."""

# -- validations ----------------------------------------------------------------------------------

SETTLED = 0.25
"""Fraction of the trajectory after which the filter with GNSS is judged."""

KEPT_EPOCHS = 300
"""Epochs of a run whose errors are kept, besides those of outages: a figure shows no more."""

OUTAGE_EPOCHS = 1.0
"""s between epochs that are kept in an outage."""

BOOTSTRAP_DRAWS = 4000
"""Of the runs, for intervals of 95 %: 100 draws lie beyond each end."""

BIAS_WINDOW = 60.0
"""s over which a recording is averaged to see how far its slow errors go: outages of a minute."""

# -- reduced models -------------------------------------------------------------------------------

SETTLING = 120.0
"""s before the first outage and between them, for the filter to settle."""

WHITE_AT = 1.0
"""s, averaging time at which white noise is read off an Allan plot, as data sheets do."""

SHORTEST_PEAK = 0.189
"""s, shortest averaging time at which a peak is read off: a correlation time of 0.1 s."""

SLOPE = 3e-3
"""Of the score over the logarithm of a factor, below which the search for factors ends."""

INERTIA = 1e-3
"""Of the score, for a factor's squared distance from 1: what does not matter stays there."""

LINEAR_TILT, LINEAR_HEADING = math.radians(5.0), math.radians(25.0)
"""rad, true attitude errors (1 sigma) at the end of an outage, beyond which covariance analysis
warns. 40 simulated runs of a loiter with the true model: NEES of the nine navigation errors 0.94 to
1.20 up to 4.1 and 22 deg, 2.1 at 10 and 45 deg."""

# -- studies --------------------------------------------------------------------------------------

LEAST_NUMBER, LARGEST_NUMBER = 1e-60, 1e60
"""SI, of a study, beyond which powers of it overflow or vanish; nothing physical comes near."""
