"""Constants of filter numbers that change answers, each with its source or its reason."""

# s without aiding unless another is given: safe when aiding stops, and true errors of real sensors
# are at most 1.11 times the optimum, 1.36 times with 10 s: benchmarks/aided.py
HORIZON = 60.0
# s below which a horizon is warned of: behind a low-pass of 10 Hz K for 0.05, 0.5, 0.9 and 1 s is
# 2,560, 7.8, 1.6 and 1.3 times that for 60 s (test_a_horizon_within_the_low_pass_is_warned_of):
SHORTEST_HORIZON = 1.0

# -- dominance ------------------------------------------------------------------------------------

POINTS = 15  # Frequencies a decade of the linear program; the check repairs the 1 % between them
CHECKED_POINTS = 120  # Frequencies a decade of the check, by which a bound is scaled up
# Share of the largest ratio within which a maximum is refined, and points for that:
NEAR, REFINED = 3e-3, 41
# The lowest frequency is 1/(this pi T), T the longest time: spectra are flat to 4e-4 there:
LOWEST = 100.0
SHORTEST_MEMORY = 100.0  # s, the least T
DECADES = 14  # Decades below that in which a rising spectrum is followed to its limit
SETTLED = 1e-3  # Change of a log-log slope a decade below which a spectrum has reached its limit
RISING = 0.05  # Slope at the lowest frequency above which a spectrum has no limit there
STEEPEST = 2.05  # Slope above which no random walk dominates
# Times 1/horizon: frequency above which a peak averages out within a tenth of the horizon:
FAST = 10.0
PEAK = 2.0  # Times the largest density below that frequency, above which a term is such a peak
# Power of that frequency over a peak's, by which the peak counts beyond its foot: 10 % more of the
# horizon changes N by 15 % at most (without, N of 10 Hz fell from 7.4 to 4.4 u/s at 1 s):
FADING = 3.0
FADED = 1e-3  # Share of a peak below which notices do not mention it
PEAK_DECADE = 50  # Frequencies a decade at which peaks are searched, beside those about resonances
NO_FOOT = 1e-6  # Share of a peak below which its foot is zero, as of quantization noise
PEAK_POINTS = 401  # Frequencies within 10 % of a resonance: resolves a damping ratio of 0.001
AVERAGING_TIMES = 12  # Of the objective, from a tenth of the horizon to the horizon
TAU_POINTS = 6  # Correlation times a decade that are tried before the best is refined
# horizon/this is the shortest correlation time tried: white noise to the horizon:
SHORTEST_TAU = 600.0
AS_GOOD = 1e-4  # Relative difference of the objective that counts as none
TOUCHED = 1e-10  # Relative distance within which a bound touches a spectrum or a limit
SAFETY = 1.0 + 1e-9  # Times every variance of a bound: arithmetic of the linear program
# Times the variance of the slow terms, for that of the bias at the start. For one Gauss-Markov
# process below a walk of K^2 = 2 sigma^2/tau it is exactly what dominance on a half-line takes:
# (1/2 sigma^2) f(0)^2 is the boundary term of the inverse of its covariance. Once the variance
# fails (NEES 1.07); see docs/filter-numbers.md:
INITIAL_SHARE = 2.0
# NEES above which a bound is called overconfident for the terms that it leaves out:
OPTIMISTIC = 1.05
# Outages in horizons for that: a slow line returns to where it was:
SUSPECT = (0.1, 0.3, 1.0, 3.0, 10.0)
# Shorter ones, where none of these shows it: a peak has not averaged out before:
EARLY = (0.01, 0.03)
LOOSE = 1.2  # Predicted over true standard deviation at the horizon that is called loose
WORTH_A_STATE = 1.05  # Times less of it that another form has to have
ABOVE = 1.1  # N over the error model's, above which a notice says which terms it covers
NEEDED = 0.8  # Ratio of densities of a model and its numbers below which they are not alike
MENTIONED = 0.1  # Share of a density, above which a term is mentioned

# -- reduced numbers ------------------------------------------------------------------------------

# Shares of a horizon at which they are good in files: 10, 30 and 60 s of 60 s:
OUTAGES = (1.0 / 6.0, 0.5, 1.0)
# Least share of the objective at the start of the search: logarithms are searched:
LEAST_SHARE = 1e-3
# Weight of the squared log NEES beside the score: N+K has a NEES of 0.9 to 1.1 after 10, 30 and 60
# s then, 0.82 to 1.17 without, for 3 % larger errors: benchmarks/filter_numbers.py balance:
EVENNESS = 20.0
INCONSISTENT = 1.2  # NEES above which reduced numbers are called overconfident
BELOW = 0.98  # N over the error model's, below which reduced numbers say so
# Shared correlation times that are tried, in longest outages: from white noise to a walk:
SHARED_TAUS = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
SHARED_TAU_WITHIN = 0.1  # Of its logarithm: the score of six axes is flat to 0.01 there

# -- confidence regions ---------------------------------------------------------------------------

REGION_DRAWS = 300  # Models drawn from a region, starts of the searches for the largest densities
REGION_POINTS = 8  # Frequencies a decade at which the largest density is searched
REGION_STEP = 1e-6  # Of the way to the end of a parameter, for the slope of a density
REGION_SEED = 1  # Of those draws: the same region has the same numbers
ENVELOPE = 1.02  # Times the largest density found, for the gaps between the points of the search

# -- the filter by which numbers are judged -------------------------------------------------------

# Times the NEES of a heading above which that of its gain counts: rounding does not choose:
HIDDEN = 1.001
SLOPE = 3e-3  # of the score over the logarithm of a factor, at which the search for factors ends
INERTIA = 1e-3  # score of a factor's squared logarithm: factors without effect stay at 1
SETTLING = 120.0  # s of aiding before an outage, as between the outages of a loiter
FIX_INTERVAL = 1.0  # s between fixes, as of GNSS
# Fix of the last integral: 1 m of position (over gravity for the tilt of a gyro), or 0.01 rad:
FIX_SD = {"gyro": 1.0 / 9.80665, "accel": 1.0, "": 0.01}
# Integrals of an error: tilt, velocity, position; velocity, position; one if unknown:
ORDER = {"gyro": 3, "accel": 2, "": 1}
INITIAL_SD = (0.01, 0.1, 1.0)  # Of the integrals at the start, in order

# -- certificates ---------------------------------------------------------------------------------

# Relative pose between two keyframes, of a good camera or lidar: rad, m:
KEYFRAME_SD = {"gyro": 1e-3, "accel": 0.01, "": 1e-3}
# Integrals between keyframes: rotation; velocity and position:
KEYFRAME_ORDER = {"gyro": 1, "accel": 2, "": 1}
KEYFRAMES = 120  # Keyframes before the judged interval, for the bias to settle
# Usual motion: rad/s, m/s^2, s. Orders of magnitude; a recording is better:
MOTIONS = {
    "handheld": (0.7, 1.5, 0.15),
    "drone": (0.4, 1.5, 0.2),
    "car": (0.1, 1.0, 1.0),
    "fixed-wing": (0.1, 2.0, 2.0),
}
VIBRATION_MEMORY = 60.0  # s over which vibration stays the same, as an engine at one speed
LARGE = 2.0  # Factor by which a cause makes numbers larger, above which a state for it is better
# Times the N of the error model, above which N in use may be in other units: values in deg/s are 57
# times as large, in m/s/sqrt(h) 60, in deg/sqrt(h) 3,438; people enlarge theirs up to 20 times
# (https://github.com/ethz-asl/kalibr/issues/663):
OTHER_UNITS = 40.0
