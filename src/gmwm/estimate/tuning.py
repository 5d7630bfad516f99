"""Constants of the estimation that change answers, each with its source or its reason.

``python benchmarks/tuning.py`` halves and doubles every one of them and prints what that
does. Constants that only keep arithmetic safe stand where they are used.
"""

# -- what makes a fit invalid ---------------------------------------------------------------------

SIGNIFICANT = 1.645
"""Standard errors above zero from which an amplitude is one: the one-sided 5 % point."""

UPPER_LEVEL = 0.95
"""Probability of upper bounds, as of the intervals beside them."""

LEAST_EFFICIENCY = 0.25
"""Of an estimate against the information in the record, below which upper bounds take it for this:
they would have no degrees of freedom left."""

UNDETERMINED = 1.0
"""Relative standard error of a shape above which its interval means nothing: a factor e."""

DISTINCT_SIGMA = 1.96
"""Standard errors of the difference of two log correlation times: the two-sided 5 % point."""

DISTINCT_RATIO = 1.05
"""Ratio of two correlation times below which no record distinguishes them, whatever its length."""

CONFOUNDED = 0.999
"""Correlation of two estimates: one combination of them is 45 times better known than another."""

LOOSE = 0.1
"""Relative standard error below which a correlated parameter is well known all the same."""

REDUNDANT_P = 0.01
"""Level of the test that a term is needed, shared among the levels where it might be found: by what
it gains, or by the levels that are missed without it (3.5 standard errors for twenty of them)."""

SEARCH_REACH = 7.0
"""How far beyond the grid of starting shapes a shape may go, in logarithms: a factor of 1,000."""

SEARCH_MARGIN = 0.05
"""Distance from that limit, in logarithms, at which a shape counts as having run to it."""

WELL_KNOWN_DOF = 30.0
"""Degrees of freedom of a level above which its deviation is known to 13 %."""

POOR_DEVIATION = 0.10
"""Misfit of the Allan deviation that navigation would feel ..."""

BEYOND_CHANCE = 2.5
"""... where it is more than so many standard errors: one level in eighty by chance."""

POOR_P = 0.05
"""Level of the test that such a misfit is no chance where the chi-square test is passed: with the
bar above alone, 4 of 400 fits of N+K, N+B, N+2GM and N+Q+GM to 2,000 s at 100 Hz were not valid,
but 8 of 100 of white noise, which no parameter fits to the coarse levels
(benchmarks/misfits.py)."""

EXCLUDED_P = 0.001
"""Level of the test that no averaging time is missed: 4 standard errors for twenty of them."""

FINEST_TIME = 0.1
"""Averaging time (s) up to which a level is judged with the discrepancy in its errors: the sensor's
filter, its rounding and fast resonances, which an integral over longer times does not feel ..."""

FINEST_SAMPLES = 10.0
"""... and the same in samples, of slow recordings."""

RECORDINGS_DIFFER = 0.01
"""Level of the test that several recordings are the same noise."""

FILTER_LIKE = 10.0
"""Correlation time in samples below which a Gauss-Markov process without white noise beside it is
the sensor's own low-pass."""

FOOT = 0.01
"""Of the bandwidth: a frequency at which the filtered noise is white."""

# -- the allowed discrepancy ----------------------------------------------------------------------

MISFIT_P = 0.001
"""Level of the chi-square test below which a discrepancy is estimated."""

DISCREPANCY_KNOWN = 0.3
"""Relative standard error of a variance below which its level can show a discrepancy."""

DISCREPANCY_NOTABLE = 0.02
"""Discrepancy of the reference mixture above which a fit starts with it: its own grid has less."""

# -- search and iteration -------------------------------------------------------------------------

EXCHANGES = 2
"""Rounds in which each term is taken out and placed anew."""

MANY_SHAPES = 3
"""Shapes of a term from which it may have several minima worth a start ..."""

STARTS = 8
"""... and places on its grid from which such a term is refined, unless one fits within chance. From
one, 59 of 80 fits of an ARMA(2, 1) to its own series ended at another minimum."""

IMPROVEMENT = 1e-3
"""Of the objective, below which an exchange is not worth a refinement."""

REWEIGHTINGS = 3
"""Rounds of weights of the reference mixture."""

MAX_ROUNDS = 40
"""Rounds of weights of a model before those of the reference mixture take their place."""

WANDERING_ROUNDS, WANDERING_STEP = 20, 0.1
"""Rounds in which no step below so many standard errors came: the iteration wanders. Of 98 fits of
the models of 24 channels (four real recordings) the 71 that settled had a step below 0.01 within 15
rounds; 21 of the others had none below 0.1 within 20."""

REFERENCE_ROUNDS = 3
"""Rounds of slope and discrepancy under these."""

LEAST_PART = 0.05
"""Smallest part of the way that relaxed weights are moved."""

DISCREPANCY_EVERY = 3
"""Rounds between estimates of the discrepancy while the weights still move."""

SETTLED = 1e-4
"""Change of the implied curve from round to round, in standard errors, that ends the iteration."""

# -- the rate ramp --------------------------------------------------------------------------------

LEAST_WALK = 0.03
"""Smallest walk that a slope is judged beside, as what it adds to the variance of the slope over
what the noise gives: below, a walk changes nothing."""

LARGEST_WALK = 3000.0
"""The largest: above, none of a thousand records would hide it."""

FEWEST_BLOCKS = 8
"""Blocks of samples from which a slope is estimated."""

LARGEST_TAKEN = 0.95
"""Fraction of a level's variance that detrending may take."""

# -- intervals ------------------------------------------------------------------------------------

FEWEST_DOF = 3.0
"""Of Student's t: below, its tails are heavier than those of a variance's logarithm."""

PROFILE_STEP = 0.5
"""Standard errors to either side, between which the growth of a standard error is taken."""

STEEPEST_GROWTH = 1.0
"""Largest power of a value with which its relative standard error goes."""

LOWEST_FREQUENCY = 0.25
"""Lowest frequency of the spectral information, in 1/(n dt); see `problem.information`."""

# -- likelihoods ----------------------------------------------------------------------------------

NEGLIGIBLE = 1e-4
"""Log-likelihood lost without a term that is not there."""

SMALL_START = 0.1
"""Of its upper bound: where an amplitude that the moments found to be zero starts."""

PREWHITENING_ROUNDS = 8
"""Rounds of prewhitening of the Whittle likelihood ..."""

PREWHITENING_SETTLED = 1e-2
"""... unless the estimates move by less, in standard errors."""

LONGEST_EXTRAPOLATION = 100.0
"""Of EM, in steps (Varadhan & Roland 2008 take no limit; beyond, rounding errors lead)."""

FARTHEST_EXTRAPOLATION = 3.0
"""Of EM, in logarithms of amplitudes and times."""

# -- lines in the Allan plot ----------------------------------------------------------------------

LEAST_OCTAVES = 2
"""Octaves of a straight region: three levels, which can show a bend."""

SLOPE_TOLERANCE = 0.10
"""Difference of slopes that passes for none when a plot is read by eye; see `lines`."""

SLOPE_SIGMA = 2.0
"""Standard errors of a local slope that are allowed for, up to the tolerance again."""

WRONG_SLOPE = 0.25
"""Difference of slopes half way from one kind of noise to the next."""

LINES_SIGMA = 3.0
"""Standard errors below which a misfit of the lines is an accident of the data."""
