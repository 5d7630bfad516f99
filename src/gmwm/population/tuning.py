"""Constants of `compare` and `fleet` that change answers, each with its source or its reason."""

SAME_RATE = 1e-3
"""Relative difference of sampling rates that count as one: clocks of units differ by less."""

# -- compare --------------------------------------------------------------------------------------

LEVEL = 0.05
"""Level of the tests of all channels together (Holm 1979, *Scandinavian Journal of Statistics* 6,
65-70)."""

LEAST_DOF = 8.0
"""Degrees of freedom from which a level of the wavelet variance is compared. With 2 the test found
7 % of equal recordings different, with 8 it is 4 to 5 % of 200 pairs of three kinds
(benchmarks/comparison.py); the deviation of such a level is known to 25 %."""

NOTABLE = 0.10
"""Difference of the Allan deviation that matters in navigation, as in the goodness of fits."""

EVIDENT = 2.5
"""Standard errors from which a part of the curve is named as different, as there."""

FINEST_TIME, FINEST_SAMPLES = 0.1, 10.0
"""s and samples: shorter averaging times show the sensor's filter and rounding, as there."""

POWER = 3.24
"""Standard errors of a difference that is found at 5 % with a probability of 90 %: 1.96 + 1.28."""

SPREAD = 0.95
"""Level of the interval of a standard deviation between recordings."""

# -- fleet ----------------------------------------------------------------------------------------

CONTENT = 0.95
"""Fraction of the units that a limit holds for."""

CONFIDENCE = 0.95
"""Confidence of a limit; both are the usual ones of ISO 16269-6."""

OUTLIER_LEVEL = 0.01
"""Probability that a fleet without outliers has one named, for each parameter."""

LEAST_FOR_OUTLIERS = 5
"""Units; with fewer, half of them may be the odd ones."""

SIMULATED, MOST_SIMULATED = 20_000, 4_000_000
"""Fleets simulated for the distance of an outlier, whose level is then known to 7 %; and the most
numbers drawn, which takes 0.1 s."""

CONTRADICTED = 0.01
"""p-value of the Shapiro-Wilk test below which limits of normal theory are doubtful."""

LENGTHS = 2.0
"""Ratio of the longest to the shortest recording above which it is reported."""
