"""Constants of filter numbers that change answers, each with its source or its reason."""

# -- dominance ------------------------------------------------------------------------------------

POINTS = 15
"""Frequencies a decade of the linear program: between them the spectra of a bound and of a truth
differ by less than 1 %, which the check repairs."""

CHECKED_POINTS = 120
"""Frequencies a decade of the check, by which a bound is scaled up."""

NEAR, REFINED = 3e-3, 41
"""Of the largest ratio, within which a maximum is refined, and by how many points."""

LOWEST = 100.0
"""Times pi and the longest time of a problem, over which lies the lowest frequency: a spectrum is
flat there to 4 parts in ten thousand."""

SHORTEST_MEMORY = 100.0
"""s, the least such time."""

DECADES = 14
"""Below that, in which a spectrum that still rises is followed to its limit."""

SETTLED = 1e-3
"""Of the slope of a spectrum on logarithmic axes, from one decade to the next: its limit is
reached."""

RISING = 0.05
"""Slope at the lowest frequency above which a spectrum has no limit there: it walks off."""

STEEPEST = 2.05
"""Slope above which no random walk dominates."""

FAST = 10.0
"""Over the horizon: the frequency above which a peak of a spectrum is gone within the shortest
averaging time of the objective, a tenth of the horizon."""

PEAK = 2.0
"""Times the largest density below that frequency, above which a term is such a peak."""

FADING = 3.0
"""Power of that frequency over that of a peak, to which the peak counts beyond its foot: a tenth
more of the horizon changes N by 15 % at most. N of a resonance of 10 Hz fell from 7.4 to 4.4 u/s
at once where the horizon passed 1 s."""

FADED = 1e-3
"""Of a peak, below which notices do not mention it."""

PEAK_DECADE = 50
"""Frequencies a decade at which peaks are looked for, beside those about resonances."""

NO_FOOT = 1e-6
"""Of the density of a peak, below which its foot is none, as that of quantization noise."""

PEAK_POINTS = 401
"""Frequencies within 10 % of that of a resonance: a damping ratio of 0.001 is resolved."""

AVERAGING_TIMES = 12
"""Of the objective, from a tenth of the horizon to the horizon."""

TAU_POINTS = 6
"""Correlation times a decade that are tried before the best is refined."""

SHORTEST_TAU = 600.0
"""Of the horizon, the shortest correlation time that is tried: it is white noise to the horizon."""

AS_GOOD = 1e-4
"""Of the objective, below which a difference is none."""

TOUCHED = 1e-10
"""Of a spectrum or of a limit, within which a bound touches it."""

SAFETY = 1.0 + 1e-9
"""Times every variance of a bound: arithmetic of the linear program."""

INITIAL_SHARE = 2.0
"""Times the variance of the slow terms, for that of the bias at the start. For one Gauss-Markov
process below a walk of K^2 = 2 sigma^2/tau it is exactly what dominance on a half-line takes:
(1/2 sigma^2) f(0)^2 is the boundary term of the inverse of its covariance. Once the variance fails
(NEES 1.07); see docs/filter-numbers.md."""

OPTIMISTIC = 1.05
"""NEES per degree of freedom, above which a bound is called too optimistic for what it leaves out
(ramps, slow lines, quantization without white noise above it)."""

SUSPECT = (0.1, 0.3, 1.0, 3.0, 10.0)
"""Horizons without aiding at which that is looked for: a slow line returns to where it was."""

EARLY = (0.01, 0.03)
"""Horizons at which that is looked for, and with fixes, where it is at none of these: a peak that
is gone at the horizon has not averaged out before."""

LOOSE = 1.2
"""Predicted over true standard deviation at the horizon, above which a bound is called loose."""

WORTH_A_STATE = 1.05
"""Times less of it that another form has to have."""

ABOVE = 1.1
"""N over that of the error model, above which it is said what else it stands for."""

NEEDED = 0.8
"""Density of a model over that of its numbers, or the inverse, below which they are not alike."""

MENTIONED = 0.1
"""Share of a density, above which a term is mentioned."""

# -- reduced numbers ------------------------------------------------------------------------------

LEAST_SHARE = 1e-3
"""Of the objective, that each number has at the start of the search: its logarithm is searched."""

DIFFERENCE = 1e-4
"""Of the logarithms of the numbers, for slopes."""

SLOPE = 3e-3
"""Of the score over the logarithm of a number, below which the search ends; as in `gmwm.ins`."""

INERTIA = 1e-3
"""Of the score, for a number's squared distance from the start: what does not matter stays."""

EVENNESS = 20.0
"""Times the squared logarithm of the NEES at the end of an outage, beside the score there: N+K has
a NEES of 0.9 to 1.1 after 10, 30 and 60 s then, of 0.82 to 1.17 without, and errors that are 3 %
larger on the mean: ``python benchmarks/filter_numbers.py balance``."""

INCONSISTENT = 1.2
"""NEES per degree of freedom, above which reduced numbers are called too optimistic."""

BELOW = 0.98
"""N over that of the error model, below which reduced numbers say so."""

STEPS = 60
"""Of the search, at most."""

SHARED_TAUS = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
"""Times the longest outage: correlation times for all axes of which the best is refined. Shorter
ones are white noise to the end of the outage, longer ones a walk."""

SHARED_TAU_WITHIN = 0.1
"""Of its logarithm: the score is flat there, to 0.01 of six axes together."""

FARTHEST = 12.0
"""Largest logarithm of a factor on the start: beyond, numbers have no meaning any more."""

# -- confidence regions ---------------------------------------------------------------------------

REGION_DRAWS = 300
"""Models drawn from a region, from which the searches for the largest densities start."""

REGION_POINTS = 8
"""Frequencies a decade at which the largest density is searched."""

REGION_POINTS_OF_PEAK = 16
"""Such frequencies within the width of the narrowest resonance of a region."""

REGION_STEP = 1e-6
"""Of the way to the end of a parameter, for the slope of a density."""

REGION_SEED = 1
"""Of those draws: the same region has the same numbers."""

ENVELOPE = 1.02
"""Times the largest density that was found, for what lies between the points of the search."""

# -- the filter by which numbers are judged -------------------------------------------------------

HIDDEN = 1.001
"""Times the NEES of a heading, and times one, above which that of the angle gained since the last
fix is given: where both are consistent rounding does not choose."""

SETTLING = 120.0
"""s of aiding before it ends: as long as between the outages of `gmwm.ins.reduce`."""

FIX_INTERVAL = 1.0
"""s between fixes, as of GNSS."""

FIX_SD = {"gyro": 1.0 / 9.80665, "accel": 1.0, "": 0.01}
"""Of a fix of the last integral: 1 m of position (per unit of gravity for the tilt of a gyro),
or 0.01 rad."""

ORDER = {"gyro": 3, "accel": 2, "": 1}
"""Integrals of the sensor's error: tilt, velocity and position; velocity and position; the first
where the quantity is not known."""

INITIAL_SD = (0.01, 0.1, 1.0)
"""Of the integrals at the start, in order."""

# -- certificates ---------------------------------------------------------------------------------

KEYFRAME_SD = {"gyro": 1e-3, "accel": 0.01, "": 1e-3}
"""Of the relative pose between two keyframes as a camera or lidar sees it: rad, m; a tenth of a
degree less than that of good odometry and a centimetre."""

KEYFRAME_ORDER = {"gyro": 1, "accel": 2, "": 1}
"""Integrals between keyframes: rotation; velocity and position."""

KEYFRAMES = 120
"""Before the interval that is judged, for the bias to settle."""

MOTIONS = {
    "handheld": (0.7, 1.5, 0.15),
    "drone": (0.4, 1.5, 0.2),
    "car": (0.1, 1.0, 1.0),
    "fixed-wing": (0.1, 2.0, 2.0),
}
"""Usual motion: rad/s, m/s^2, s. Orders of magnitude; a recording of one's own is better."""

VIBRATION_MEMORY = 60.0
"""s over which vibration stays the same, as an engine at one speed."""

LARGE = 2.0
"""Factor by which a cause makes numbers larger, above which a state for it is better."""

OTHER_UNITS = 40.0
"""Times the N of the error model, above which N in use may be in other units: values in deg/s are
57 times as large, in m/s/sqrt(h) 60, in deg/sqrt(h) 3,438; people enlarge theirs up to 20 times
(https://github.com/ethz-asl/kalibr/issues/663)."""

# -- files of programs ----------------------------------------------------------------------------

EKF2_INTERVAL = 0.01
"""s, the update interval of PX4's EKF2: its parameter EKF2_PREDICT_US is 10000 by default."""
