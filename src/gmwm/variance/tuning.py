"""Constants of the variances and their covariances, each with its source or its reason."""

# -- the Allan family -----------------------------------------------------------------------------

LEAST_FOR_SLOPE = 100
"""Averages from which the kind of noise is identified; with fewer, that of the level before."""

LEAST_DOF_OF_FAMILY = 0.5
"""Degrees of freedom of an interval that says nothing."""

# -- the spectrum that wavelet variances imply ----------------------------------------------------

PILOT_ITERATIONS = 12
"""Rounds of scaling; the last changes no level by as much as its error."""

PILOT_STEP = 0.8
"""Part of the way, in logarithms: neighbouring levels share frequencies, and whole steps
oscillate."""

PILOT_STEEPEST = 2.5
"""Power of the frequency from level to level; the steepest process (a random walk) has 2."""

HAAR_PEAK = 0.37
"""The Haar gain of averaging time tau peaks at f = 0.37/tau."""

# -- gaps -----------------------------------------------------------------------------------------

AVERAGES_OF_GAP = 4
"""Lengths of a gap in the shortest averaging time for which it is filled: the Haar autocorrelation
is a straight line there, and its error is small beside the coefficient."""

FILLING_REACH = 32
"""Blocks on either side that a filling looks at, at least; four lengths of the gap if that is
more. Farther ones take little from the error of a random walk or of white noise."""

GAP_BLOCKS = 64
"""Blocks in a gap, at most; longer gaps are taken in blocks of several samples."""

ISLAND = 32
"""A run of less than this part of a gap beside it is lost with the gap: there is no block of it."""

PASSED_OCTAVES = 3
"""By which a gap is shorter than another that looks across it."""

APART = 1e-3
"""Chance that noise has a gap in a series that is taken for a change of the level."""

WIDER = 16
"""Times the stretch beside a gap, over which a change of the level must show too."""

NEIGHBOURHOOD = 128
"""Half samples: gaps so near have correlated errors."""

PAIRED_KINDS = 24
"""Kinds of gaps, the most frequent, whose pairs are counted; twice as many change no expected
variance by 1 % where half of the samples are missing."""

LARGEST_CHANGE = 1.5
"""Of an expected variance by filling: half of white noise missing singly has 1.35, and a bias of
2 %."""

PILOT_WINDOWS = 8.0
"""Windows that do not overlap, from which a level gives the spectrum to fill gaps under."""

DECIDING_WINDOWS = 32.0
"""The same, from which a level shows whether it can be filled; coarser ones follow it."""

LAGS_PER_AVERAGE = 8
"""Lags at which pairs of coefficients are counted."""

MOST_BLOCKS = 2048
"""Means of blocks that a drift is estimated from."""

MOST_BLOCKS_WITH_GAPS = 512
"""The same where some are missing, which makes a dense matrix of them."""

# -- covariances by lags --------------------------------------------------------------------------

EXACT_SAMPLES = 2048
"""Longest record whose lags are single samples; longer ones are taken in blocks."""

BLOCKS = 1024
"""Blocks of a longer record; its coarse levels are computed from their means."""

BLOCKS_PER_AVERAGE = 8
"""Blocks of the shortest averaging time that is computed so; shorter ones have the spectral
integral."""

FOLDS = 2
"""Aliases on either side of a block's spectrum; the block mean suppresses farther ones."""

LEAST_LAGS = 2048
"""Lags for other wavelets: memory may be longer than a short record."""

BINS_PER_OCTAVE = 8
"""Of the smoothed empirical covariance."""

# -- covariances of the robust variances ----------------------------------------------------------

ROBUST_REACH = 4
"""Levels apart that are summed by lags: farther ones add 2^(-3d/2) or less."""

ROBUST_LAGS = 2048
"""Lags of a grid."""

ROBUST_FIRST_LEVELS = 7
"""Levels of 1 to 64 samples, on the samples themselves."""

ROBUST_LEVELS_PER_GRID = 3
"""Levels that share a coarser grid."""

ROBUST_BLOCKS_PER_AVERAGE = 16
"""Blocks of the finest level of a coarser grid."""

NEGLIGIBLE_POWER = 1e-5
"""Part of the excess below which powers of the correlation are left out."""

# -- heavy tails ----------------------------------------------------------------------------------

KURTOSIS_VARIANCE = 27.0
"""Of the excess kurtosis of n first differences of Gaussian white noise, times n: 24 sum rho^4."""

LARGEST_KURTOSIS = 5.0
"""Standard errors of it that Gaussian noise does not have."""

# -- streaming -------------------------------------------------------------------------------------

STREAMING_STARTS = 512
"""Windows that begin within an averaging time, from there on. The sampling variance of white noise
is 1 + 1.25/512^2 of that of all windows, which differ by 0.2 % of a standard error."""

STREAMING_ROWS = 32
"""Octaves beyond that: 2^32 averaging times of 512 samples are more than any recording has."""

STREAMING_PLACES, STREAMING_OCTAVES, FEW_WINDOWS = 128, 23, 0.5
"""Places of an octave at which windows of the coarsest level may begin, and octaves; averaging
times, up to which these are used: beyond, 256 windows at multiples of 1/512 are as good."""

STREAMING_EDGE = 16
"""Parts of an averaging time of which the first and the last must have a sample: what is missing
lies within a half window then, but for a sixteenth."""

STREAMING_LEAST_EDGE = 4
"""Samples of such a part at least, but for shorter averaging times."""

STREAMING_LEAST = 0.375
"""Part of the samples of half a window that must be there; with half of all samples missing singly,
32 of 64, that is four standard deviations less."""

STREAMING_LARGEST_CHANGE = 10.0
"""Of a variance by what gaps add to it: half of white noise missing singly has 1, so that few
windows may come out at less; bounded by 1.5, three coarse levels were 11 % too large."""

LONGEST_WITHIN = 0.625
"""Part of half a window that one gap may take, the rest of what must be there."""

ALIKE = 2.0 / 3.0
"""Sum of the squared autocorrelation of the Haar coefficients of white noise over all lags, in
averaging times: 2 (1/4 + 1/12)."""

LEAST_OF_BLOCK = 0.5
"""Part of a block of samples that must be there for its mean to count."""

# -- threads ---------------------------------------------------------------------------------------

SAMPLES_PER_THREAD = 1 << 20
"""Fewer take less time than threads need to begin."""

LARGEST_VARIANCE = 1e120
"""In a saved result, u^2: a channel whose spread is beyond 1e60 is not analysed."""
