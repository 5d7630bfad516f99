"""Levels that a fleet is judged by."""

CONTENT = 0.95
"""Fraction of the units for which a limit is to hold."""

CONFIDENCE = 0.95
"""Probability with which it does; both are the usual ones of ISO 16269-6."""

OUTLIER_LEVEL = 0.01
"""Probability that any unit is named in a parameter of a fleet that has no outlier."""

LEAST_FOR_OUTLIERS = 5
"""Units; of fewer, half may be the odd ones."""

SIMULATED = 20_000
"""Fleets by which the distance of an outlier is found: its level is known to 7 %."""

MOST_SIMULATED = 4_000_000
"""Numbers drawn for that: 0.1 s."""

CONTRADICTED = 0.01
"""p-value of the test of Shapiro and Wilk from which on normal theory is reported as doubtful."""

SAME_RATE = 1e-3
"""Relative difference of sampling rates that are one: clocks of units differ by less."""

LENGTHS = 2.0
"""Ratio of the longest to the shortest recording from which on it is reported."""
