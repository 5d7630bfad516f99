"""Constants of the estimation that change answers, each with its source or its reason.

``python benchmarks/tuning.py`` halves and doubles every one of them and prints the effect.
Constants that only keep arithmetic safe stand where they are used.
"""

# -- conditions of a valid fit --------------------------------------------------------------------

SIGNIFICANT = 1.645  # standard errors of an amplitude above zero: the one-sided 5 % point
UPPER_LEVEL = 0.95  # probability of upper limits, as of the intervals beside them
UNDETERMINED = 1.0  # relative standard error of a shape without an interval: a factor e
DISTINCT_SIGMA = 1.96  # standard errors between two log correlation times: two-sided 5 % point
DISTINCT_RATIO = 1.05  # of two correlation times: no record of any length distinguishes less
CONFOUNDED = 0.999  # correlation: one combination is known 45 times better than another
LOOSE = 0.1  # relative standard error from which a correlated parameter is not well known

LEAST_EFFICIENCY = 0.25
"""Smallest efficiency (against the information in the record) that upper limits allow for: with
less they would have no degrees of freedom left."""

REDUNDANT_P = 0.01
"""Level of the test that a term is needed, shared among the levels where it might be found: by its
gain, or by the levels that are missed without it (3.5 standard errors for twenty of them)."""

SEARCH_REACH = 7.0  # how far beyond the starting grid a shape may go: a factor of 1,000 (log)
SEARCH_MARGIN = 0.05  # distance from that limit, in logarithms, that counts as having reached it

WELL_KNOWN_DOF = 30.0  # degrees of freedom of a level whose deviation is known to 13 %
POOR_DEVIATION = 0.10  # misfit of the Allan deviation that predictions suffer from ...
BEYOND_CHANCE = 2.5  # ... if it exceeds so many standard errors: one level in eighty by chance

POOR_P = 0.05
"""Level of the test that such a misfit is no chance where the chi-square test is passed: with the
bar above alone, 4 of 400 fits of N+K, N+B, N+2GM and N+Q+GM to 2,000 s at 100 Hz were not valid,
but 8 of 100 of white noise, which no parameter fits to the coarse levels
(benchmarks/misfits.py)."""

OPEN_TIMES = 16  # correlation times at which a further Gauss-Markov process is tried
OPEN_MOVE = 0.3
"""Share by which parameters may move for a further Gauss-Markov process; beyond it the linear
approximation fails. ``python benchmarks/faint.py`` prints the coverage."""
OPEN_REDUNDANT = 1e-6  # size of a combination of parameters that the data do not show, by rounding
OPEN_APART = 1e-4  # a further process that differs by less from a sum of the terms is left out

EXCLUDED_P = 0.001  # level of the test of every averaging time: 4 standard errors for twenty

FINEST_TIME = 0.1
"""Averaging time (s) up to which a level may be off by the discrepancy: the sensor's filter, its
rounding and fast resonances show there, which an integral over longer times does not feel ..."""

FINEST_SAMPLES = 10.0  # ... and in samples, for slow recordings

RECORDINGS_DIFFER = 0.01  # level of the test that several recordings are the same noise

FILTER_LIKE = 10.0
"""Correlation time in samples below which a Gauss-Markov process without white noise beside it is
the sensor's own low-pass."""

FOOT = 0.01  # share of the bandwidth: a frequency at which the filtered noise is white

# -- the allowed discrepancy ----------------------------------------------------------------------

MISFIT_P = 0.001  # level of the chi-square test below which a discrepancy is estimated
DISCREPANCY_KNOWN = 0.3  # relative standard error of a variance that can show a discrepancy
DISCREPANCY_NOTABLE = 0.02  # of the reference mixture, to start a fit with: its grid has less

DISCREPANCY_NESTED = 0.2
"""Above which a fit may take the weights of a model that it nests. From 0.1 on, five real
recordings came out the same, one of them in 1.5 times the time."""
DISCREPANCY_LARGE = 0.3
"""A fit with a larger discrepancy is repeated from DISCREPANCY_NOTABLE, and the smaller of the two
is taken. A discrepancy near 1 allows for levels without any model noise, so that a model whose
amplitudes are all zero would pass."""

# -- search and iteration -------------------------------------------------------------------------

EXCHANGES = 2  # rounds in which each term is taken out and placed anew
MANY_SHAPES = 3  # shapes of a term from which it may have several minima worth a start ...

STARTS = 8
"""... and places on its grid from which such a term is refined, unless one fits within chance. From
one, 59 of 80 fits of an ARMA(2, 1) to its own series ended at another minimum."""

SAME_MINIMUM = 0.01  # of the objective, a chi-square: moves no estimate by 0.1 standard errors
IMPROVEMENT = 1e-3  # share of the objective that makes an exchange worth a refinement
REWEIGHTINGS = 3  # rounds of weights of the reference mixture
MAX_ROUNDS = 40  # rounds of weights of a model before those of the reference mixture

WANDERING_ROUNDS, WANDERING_STEP = 20, 0.1
"""Rounds without a step below so many standard errors: the iteration wanders. Of 98 fits of the
models of 24 channels (four real recordings) the 71 that settled had a step below 0.01 within 15
rounds; 21 of the others had none below 0.1 within 20."""

REFERENCE_ROUNDS = 3  # rounds of slope and discrepancy under the reference mixture
LEAST_PART = 0.05  # smallest part of the way that relaxed weights are moved
DISCREPANCY_EVERY = 3  # rounds between estimates of the discrepancy while the weights move
SETTLED = 1e-4  # change of the implied curve, in standard errors, that ends the iteration

# -- the rate ramp --------------------------------------------------------------------------------

MEAN_OF_LIMIT = 0.41
"""Mean amplitude of a term that comes out as zero, as a share of its 95 % limit: of a half-normal
distribution. So much of it counts in the error of a slope."""

LEAST_WALK = 0.03
"""Smallest random walk beside which a slope is judged, as its share of the variance that the noise
gives the slope: below, a walk changes nothing."""

LARGEST_WALK = 3000.0  # the largest: above, none of a thousand records would hide it
FAINT = 0.15
"""Relative standard error of a random walk beside a ramp from which on its interval averages over
all walks: it then has fewer than 22 degrees of freedom, which 128 block means show as well."""

FEWEST_BLOCKS = 8  # blocks of samples from which a slope is estimated
LARGEST_TAKEN = 0.95  # fraction of a level's variance that detrending may take

# -- intervals ------------------------------------------------------------------------------------

FEWEST_DOF = 3.0  # of Student's t: below, its tails are heavier than a log variance's
PROFILE_STEP = 0.5  # standard errors to either side, for the growth of a standard error
STEEPEST_GROWTH = 1.0  # largest power of a value that its relative standard error grows with
LOWEST_FREQUENCY = 0.25  # of the spectral information, in 1/(n dt); see `problem.information`

# -- likelihoods ----------------------------------------------------------------------------------

NEGLIGIBLE = 1e-4  # log-likelihood lost without a term that is not there
SMALL_START = 0.1  # share of its upper limit where an amplitude starts that came out as zero
PREWHITENING_ROUNDS = 8  # rounds of prewhitening of the Whittle likelihood ...
PREWHITENING_SETTLED = 1e-2  # ... unless the estimates move by less, in standard errors

LONGEST_EXTRAPOLATION = 100.0
"""Of EM, in steps (Varadhan & Roland 2008 set no limit; beyond, rounding errors lead)."""

FARTHEST_EXTRAPOLATION = 3.0  # of EM, in logarithms of amplitudes and times

# -- lines in the Allan plot ----------------------------------------------------------------------

LEAST_OCTAVES = 2  # octaves of a straight region: three levels, which can show a bend
SLOPE_TOLERANCE = 0.10  # difference of slopes that reading a plot by eye accepts; see `lines`
SLOPE_SIGMA = 2.0  # standard errors of a local slope that are allowed, up to the tolerance
REGION_SIGMA = 3.5  # standard errors between two levels of a region: 100 of white noise keep all
HEIGHT_TOLERANCE = 0.01  # ... and of their heights, as far as a curve is drawn and read
WRONG_SLOPE = 0.25  # difference of slopes half way from one kind of noise to the next
LINES_SIGMA = 3.0  # standard errors below which a misfit of the lines is chance

# -- what channels share --------------------------------------------------------------------------

SHARED_ROUNDS, KEPT_ROUNDS = 6, 3  # of weights, with correlation times and without
SHARED_STEP = 0.5  # longest step of the log of a correlation time
SAME_SAMPLES = 1.0 - 1e-6  # correlation at all levels
LEAST_SHARED_DOF = 0.5  # of a variance: those that are nearly zero seem better known
CONE_STEPS = 200
CONE_GAP = 1e-4  # of the weighted sum of squares to its minimum
