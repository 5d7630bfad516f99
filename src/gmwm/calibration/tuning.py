"""Thresholds of the calibration, each with its source or its reason."""

import numpy as np

SAME_RATE = 1e-3
"""Relative difference of the rates of recordings of one sensor: its averaging times are then the
same to 0.1 %, less than the width of any level."""

MOST_LEFT_OUT = 0.1
"""Fraction of the samples of a channel that outliers may take: up to it gaps move no level by more
than a fifth of a standard error (docs/moments.md)."""

MANY_EVENTS = 20
"""Shocks and spikes of a channel from which they may be how it is noisy, and no accidents ..."""

TAKEN, FEWEST_WINDOWS = 1.1, 30
"""... if without them the deviation is smaller by more than a tenth at an averaging time of which
the record has so many, which know it to about as much."""

MOST_TERMS = 2
"""Lines and resonances offered to the model of a channel; each doubles the candidate models."""

SAME_FREQUENCY = 0.02
"""Relative difference of the frequency of one line in several recordings: lines of engines and
fans wander by about as much (docs/real-data.md)."""

REFERENCE_TIME = 1.0
"""s, the averaging time at which white noise is read from an Allan plot (IEEE Std 952)."""

WHITE_RATIO = 0.6
"""Of the wavelet variances at twice the reference time and at it, below which a term acts as white
noise, which has 0.5."""

LOW_FREQUENCY = 0.01
"""Over one by the reference time: where the spectrum of what averages out by then is flat."""

FLAT = 0.8
"""Of the density there and at half that frequency, above which it is that of white noise."""

# -- departures from stationary noise -------------------------------------------------------------

EVIDENT = 100.0
"""Evidence that stationary noise has in at most one of 100 records (Markov's inequality)."""

POSSIBLE = 3.0
"""Evidence from which a departure is mentioned: "positive" after Kass & Raftery (1995)."""

HARMFUL_SHARE = 0.19
"""Fraction of the wavelet variance that a departure accounts for: without it the deviation is 10 %
lower, as much as a valid fit may miss."""

MOST_DEPARTURES = 5
"""Of one channel."""

REMOVALS = 3
"""Rounds of taking off what is found: beside the noise that is left without it more may show."""

MOST_REMOVED = 4
"""Departures of one record that may be accidents: a telegraph bias has five or more in five of six
records of six mean dwell times, real recordings of 2 h 46 min have four at most."""

OTHER_SIZE = 1e-3
"""Chance of three steps up and down between two levels to differ by as much: of two levels, steps
have one size (benchmarks/departures.py jumps)."""

WELL_KNOWN = 0.1
"""Relative standard error of sizes up to which it says something that three are the same."""

MOST_MEANS = 256
"""Block means; dense matrices of them are made."""

FEWEST_DIFFERENCES = 16
"""Of block means, from which departures are looked for."""

SLOW_PARTS = (1e-3, 0.03, 0.1, 0.25, 0.5, 0.7, 1.0, 1.4, 2.0, 4.0)
"""Factors of the spectrum above its floor; finer about one, where the data decide."""

NO_SLOW_PART = 1e-12
"""Of the floor: a part above it that is only rounding errors, as of white noise alone."""

WALKS = (0.0, 1.0, 30.0)
"""Factors of the variance of a random walk beside it."""

WALK_AT = 0.25
"""Of the record: the averaging time at which the first of these walks equals the floor."""

PRIOR_SIZES = 4.0 ** np.arange(2.0, 12.0)
"""g: squares of the size beforehand, over the variance of its estimate."""

TABLE = 8192
"""Points at which the Bayes factor of a chi-square is computed."""

RATIO_OF_TIMES = 1.2
"""Of neighbouring time constants and ends."""

FEWEST_CYCLES, MOST_CYCLES = 0.5, 24.0
"""In a record, of slow periods: half a one is a hump or a bend; `gmwm.health` finds lines from 20
on."""

SHARE_POINTS = 512
"""Places of a coefficient at which the share of a level is computed."""

NO_INFORMATION = 1e-9
"""Of the largest information, which a curve has that known ones explain; and of the variance of the
block means, which rounding errors stay below."""

NEAR = 2
"""Members on either side of one that is found that are known with it: its time is between them."""

SPANNED = 1e-6
"""Of the largest singular value, below which curves are no others."""

FEW = 0.05
"""Fraction of differences that are not zero, below which those of a family are kept as sparse."""

NO_EVIDENCE = 30.0
"""Logarithm by which a noise explains less than another, beyond which it counts no more (1e-13)."""

LARGEST_LOG_EVIDENCE = 700.0
"""Whose exponential is a number."""

FREQUENCIES = 64
"""At which the floor of the spectrum is looked for, from one period of the record to two blocks."""

MOST_STRETCHES = 20
"""Stretches at rest of one log that are fitted jointly, the longest ones."""

WORTH_PROCESSES = 1_000_000
"""Samples of all channels together beyond which processes share the work: one takes 1.2 s to start,
as long as the models of two channels."""

# -- what a record leaves open ---------------------------------------------------------------------

OPEN_AT, OPEN = 600.0, 1.1
"""s, and growth of the deviation there from which a walk that the record leaves open is told: the
longest time without aiding that the report has, and as much as a valid fit may miss."""

# -- noise that changes its size ------------------------------------------------------------------

DIVISIONS, MEANS_OF_PART, LEAST_OF_PART = (8, 4, 2), 128, 0.5
"""Parts of a record that are compared; block means of each, of which dense matrices are made; share
of them that must be there."""

POWERS = (1.0, 4.0)
"""Of the share of the slow noise in a variance, as weights: best for small changes of it, and where
it is nearly all of the variance, for large ones."""

FEWEST_FREEDOM = 3.0
"""Degrees of freedom of a part, from which Bartlett's test has its level."""

FALSE_ALARM = 1e-3
"""Chance of a notice for a channel of stationary Gaussian noise."""

UNSTEADY, HARMFUL_UNSTEADY = 0.1, 2.0
"""Of the deviation of all above that of the quiet quarter of the parts, for a notice: as much as a
valid fit may miss. Deviation of the loudest part over that of the quietest, from which a fit is not
valid: in nine channels of real recordings at rest it is 1.6 to 2.1 (docs/health.md)."""
