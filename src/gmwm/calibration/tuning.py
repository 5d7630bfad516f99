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
"""Stationary noise has a departure in at most one of so many records (benchmarks/departures.py)."""

LIMITS = {
    "step": 21.0,
    "transient": 13.0,
    "drift-at-start": 14.0,
    "slow-period": 23.0,
    "drift": 12.0,
}
"""Twice the gain in log likelihood beside white noise and a random walk that each kind of departure
has by chance in one of 400 records: 150 simulated records each of white noise, of a random walk and
of both, of 24, 64 and 256 blocks, have 18, 9, 12, 20 and 9 in one of 100 at most."""

WALKS = tuple(np.geomspace(1e-6, 1e2, 28).tolist())
"""Variance of the steps of a random walk from block to block over that of the white noise."""

LARGEST_LOG = 700.0
"""Whose exponential is a number."""

MOST_MEANS = 256
"""Block means in which departures are looked for."""

MOST_REMOVED = 4
"""Departures of one record that may be accidents: real recordings of 2 h 46 min have four at
most."""

HARMFUL_SHARE = 0.19
"""Fraction of the wavelet variance that a departure accounts for: without it the deviation is 10 %
lower, as much as a valid fit may miss."""

MOST_DEPARTURES = 5
"""Departures of one channel at most."""

REMOVALS = 3
"""Rounds of subtracting departures: without the first ones more may show."""

FEWEST_DIFFERENCES = 16
"""Of block means, from which departures are looked for."""

NO_SLOW_PART = 1e-12
"""Of the floor: a part above it that is only rounding errors, as of white noise alone."""

RATIO_OF_TIMES = 1.2
"""Ratio of neighbouring time constants and ends."""

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
"""Part of the largest singular value below which curves are not independent."""

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
