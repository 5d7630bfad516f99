"""Thresholds of the calibration, each with its source or its reason."""

SAME_RATE = 1e-3
"""Relative difference of the rates of recordings of one sensor: its averaging times are then the
same to 0.1 %, less than the width of any level."""

MOST_LEFT_OUT = 0.1
"""Fraction of the samples of a channel that outliers may take: up to it gaps move no level by more
than a fifth of a standard error (docs/health.md)."""

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
