"""Constants of the variances and their covariances, each with its source or its reason."""

# -- the Allan family -----------------------------------------------------------------------------

LEAST_DOF_OF_FAMILY = 0.5  # degrees of freedom of an interval that says nothing
LOBES = 32.0  # of a transfer function, beyond which their mean serves
NODES_OF_FAMILY = 1024  # of a spectral integral, within these lobes and beyond
FEW_AVERAGES = 16  # averaging times of a record that shows what its ends do
BLOCKS_OF_FAMILY = 12  # in an averaging time there

# -- the spectrum of a series ---------------------------------------------------------------------

TAPERS = 3
LAWS = (2.0, 1.0, 0.0, -1.0, -2.0)  # powers of the frequency: quantization noise to random walk
LAW_ITERATIONS = 150
LARGEST_MISFIT = 3.0  # factor from which a bin no longer pulls at the power laws
MOST_OF_SPECTRUM = (1 << 16) - 1  # samples whose periodogram is taken whole
PIECE_OF_SPECTRUM = (1 << 13) - 1  # samples, or means of blocks, of a piece of a longer series
COARSER_BLOCKS = 256  # times the block before, of the spectrum at lower frequencies
PLAIN_DRIFT = 4.0  # standard errors of the mean of the coarsest coefficients under the spectrum
MOST_BINS = 1000  # of a stored spectrum; a series of 2^40 samples has 300
SHARE_OF_RUN = 0.5  # of the samples, in a run that stands for a series with gaps
LEAST_ORDINATE = 8  # of a piece; lower frequencies are those of longer blocks
ORDINATES_OF_BIN = 12.0  # ordinates as certain as that a sum of power laws is right

# -- the spectrum implied by wavelet variances ----------------------------------------------------

PILOT_ITERATIONS = 12  # rounds of scaling; the last changes no level by as much as its error
PILOT_STEP = 0.8  # share of a step in logarithms: levels share frequencies, whole steps oscillate
PILOT_STEEPEST = 2.5  # power of the frequency from level to level; that of a random walk is 2
HAAR_PEAK = 0.37  # the Haar gain of averaging time tau peaks at f = 0.37/tau

# -- curves without samples -----------------------------------------------------------------------

SAME_VALUE = 0.1  # by which two values at one averaging time may differ, as rounded times do
LEAST_RATIO = 1.4  # of averaging times that are kept
LEAST_TIMES = 4
TIME_ROUNDING = 0.005  # relative, of averaging times that are whole numbers of samples as printed

# -- gaps -----------------------------------------------------------------------------------------

LONGEST_GAP = 0.25
"""Gaps in a coefficient are shorter than this share of the averaging time. With half of it, gaps of
18 samples make levels 45 % less certain, and no less biased."""

LARGEST_CHANGE = 10.0
"""Largest relative change of a variance by gaps: half of white noise missing singly has 1, so few
windows may come out at less. Bounded by 1.5, three coarse levels were 11 % too large."""

FEW_WINDOWS = 4  # last levels, of at most 16 windows without overlap: they may be low by chance

STRETCH_OF_GAP, LEAST_STRETCH = 4, 32
"""Lengths of a gap, and fewest samples, on either side that show whether the level changes."""

APART = 1e-3  # probability that noise has a gap in a series that passes for a change of the level
WIDER = 16  # a change of the level must also show over stretches 16 times as wide
PILOT_WINDOWS = 8.0  # windows without overlap of a level whose noise is known

LAGS_PER_OCTAVE = 12  # lags at which samples are compared, all below 24 samples
LAGS_PER_AVERAGE = 8  # lags per averaging time at which pairs of coefficients are counted
MOST_BLOCKS = 2048  # means of blocks from which a drift is estimated
MOST_BLOCKS_WITH_GAPS = 512  # the same where some are missing, which needs a dense matrix of them
BLOCKS_OF_REGRESSORS = 256  # beside which a curve is slow: a fit solves for them in each round

# -- covariances by lags --------------------------------------------------------------------------

EXACT_SAMPLES = 2048  # of the longest record with lags of single samples; others have blocks
BLOCKS = 1024  # blocks of a longer record, whose means give its coarse levels
BLOCKS_PER_AVERAGE = 8  # of the shortest of these; finer levels have the spectral integral
FOLDS = 2  # aliases on either side of a block's spectrum; the block mean suppresses farther ones
LEAST_LAGS = 2048  # lags for other wavelets: memory may be longer than a short record
BINS_PER_OCTAVE = 8  # of the smoothed empirical covariance

# -- covariances of the robust variances ----------------------------------------------------------

ROBUST_REACH = 4  # levels apart that are summed by lags: farther ones add 2^(-3d/2) or less
ROBUST_LAGS = 2048  # lags of a grid
ROBUST_FIRST_LEVELS = 7  # levels of 1 to 64 samples, on the samples themselves
ROBUST_LEVELS_PER_GRID = 3  # levels that share a coarser grid
ROBUST_BLOCKS_PER_AVERAGE = 16  # blocks of the finest level of a coarser grid
NEGLIGIBLE_POWER = 1e-5  # share of the excess below which powers of the correlation are left out

# -- heavy tails ----------------------------------------------------------------------------------

KURTOSIS_VARIANCE = 27.0
"""n times the variance of the excess kurtosis of n first differences of Gaussian white noise:
24 sum rho^4."""

LARGEST_KURTOSIS = 5.0  # standard errors of it that Gaussian noise does not reach

# -- streaming ------------------------------------------------------------------------------------

STREAMING_STARTS = 512
"""Windows that begin within an averaging time. The sampling variance of white noise is 1 +
1.25/512^2 times that of all windows, which differ by 0.2 % of a standard error."""

STREAMING_ROWS = 32  # octaves beyond that: more than any recording has
# The first and the last 1/16 of half a window must have a sample, so that gaps lie within it.
STREAMING_EDGE = 16
STREAMING_LEAST_EDGE = 4  # least samples of such a part, but for shorter averaging times
STREAMING_LEAST = 0.375
"""Least share of the samples of half a window; with half of all samples missing singly, 32 of 64,
that is four standard deviations less."""

LONGEST_WITHIN = 0.625  # longest gap within half a window, as a share: the rest of what must exist

ALIKE = 2.0 / 3.0
"""Sum of the squared autocorrelation of the Haar coefficients of white noise over all lags, in
averaging times: 2 (1/4 + 1/12)."""

LEAST_OF_BLOCK = 0.5  # share of a block of samples that its mean needs to count

# -- files ----------------------------------------------------------------------------------------

LARGEST_VARIANCE = 1e120
"""In a saved result, u^2: a channel whose spread is beyond 1e60 is not analysed."""
