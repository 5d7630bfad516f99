"""Constants of navigation that change answers, each with its source or its reason."""

import math

COVARIANCE_STEP = 0.1
"""s between steps of the covariance: short against a manoeuvre and the time between fixes."""

POSITION_SD = (1.0, 1.0, 1.5)
"""m north, east and down, for fixes without their own: a good receiver in the open."""

VELOCITY_SD = (0.1, 0.1, 0.15)
"""m/s, likewise."""

GATE = 1e-5
"""Probability of a larger innovation at which a standstill is rejected: at one a second, one in a
day is rejected falsely."""

GATE_PATIENCE = 5
"""Rejections in a row after which the filter is more likely wrong than the fixes: with 3 %
outliers, five in a row come once in 40 million."""

BAROMETER = (10.0, 3600.0)
"""m and s: drift of a barometric height set at the start, and its correlation time: weather changes
the pressure by some hPa, 8 m each, in hours."""

CONTRADICTED = 0.001
"""Probability below which a filter is called inconsistent, or its innovations contradict it."""

CONFIDENCE = 0.95
"""Confidence of bands and intervals."""

SETTLED = 0.25
"""Fraction of the trajectory after which the filter with GNSS is judged."""

BOOTSTRAP_DRAWS = 4000
"""Draws of the runs for intervals of 95 %: 100 draws lie beyond each end."""

BIAS_WINDOW = 60.0
"""s over which a recording is averaged to measure its slow errors: an outage of a minute."""

SETTLING = 120.0
"""s before the first outage and between them, for the filter to settle."""

WHITE_AT = 1.0
"""s, averaging time at which white noise is read off an Allan plot, as data sheets do."""

SHORTEST_PEAK = 0.189
"""s, shortest averaging time at which a peak is read off: a correlation time of 0.1 s."""

SLOPE = 3e-3
"""Slope of the score over the logarithm of a factor at which the search for factors ends."""

INERTIA = 1e-3
"""Score for a factor's squared distance from 1: factors without effect stay at 1."""

LINEAR_TILT, LINEAR_HEADING = math.radians(5.0), math.radians(25.0)
"""rad, true attitude errors (1 sigma) at the end of an outage, beyond which covariance analysis
warns. 40 simulated runs of a loiter with the true model: NEES of the nine navigation errors 0.94 to
1.20 up to 4.1 and 22 deg, 2.1 at 10 and 45 deg."""
