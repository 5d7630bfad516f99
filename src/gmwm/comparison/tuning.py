"""Constants of the comparison that change answers, each with its source or its reason."""

LEVEL = 0.05
"""Of the tests of all channels of a comparison together (Holm 1979, *Scandinavian Journal of
Statistics* 6, 65-70)."""

LEAST_DOF = 8.0
"""Degrees of freedom of a wavelet variance in a recording from which its level is compared. With 2
the test found 7 % of equal recordings different, with 8 it is 4 to 5 % of 200 pairs of three kinds
(benchmarks/comparison.py); the deviation of such a level is known to 25 %."""

NOTABLE = 0.10
"""Difference of the Allan deviation that navigation would feel, as in the judgement of fits."""

EVIDENT = 2.5
"""Standard errors from which a part of the curve is named as one that differs, as there."""

FINEST_TIME, FINEST_SAMPLES = 0.1, 10.0
"""s and samples: averaging times below are those of the sensor's filter and rounding, as there."""

SAME_RATE = 1e-3
"""Relative difference of sampling rates, as in joint calibration."""

POWER = 3.24
"""Standard errors of a difference that is found at 5 % with a probability of 90 %: 1.96 + 1.28."""

SPREAD = 0.95
"""Level of the interval of a standard deviation between recordings."""

# -- the clock ------------------------------------------------------------------------------------

LARGEST_CLOCK = 1.3
"""Ratio of two clocks up to which lines are taken for the same: more is another rate."""

SMALLEST_CLOCK = 0.003
"""Relative difference of two frequencies from which they differ: lines wander by about half of it
within a record, and crystals are a hundred times better."""

SAME_CLOCK = 0.003
"""Relative difference of two ratios up to which they are one."""

DISTINCT = 0.02
"""Relative difference of two frequencies in one recording from which they are two lines."""

DENSITY_PART = 0.5
"""Of the change of N that a clock makes: the densities must be nearer to it than to none."""

FEWEST_DENSITIES = 3
"""Channels whose N must all follow the clock where a single line moved ..."""

FOLLOWS = 0.25
"""... each to within this part of the change."""
