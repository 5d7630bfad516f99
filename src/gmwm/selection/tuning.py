"""Constants of the selection that change answers, each with its source or its reason.

``python benchmarks/tuning.py`` halves and doubles every one of them and prints the effect.
"""

STRICTNESS = 1.5  # the c of Hannan & Quinn (1979); consistent above 1

TIE = 2.0
"""Difference of the criterion within which models fit equally well (twice the log-likelihood:
Burnham & Anderson 2002, *Model Selection and Multimodel Inference*, sec. 2.6)."""

RAMP_MARGIN = 6.0
"""Gain in the criterion by which a rate ramp must win: a straight line passes through any slow
drift that is seen only once."""

RAMP_P = 0.002  # level of the test that an unresolved random walk explains a slope
RAMP_PLAUSIBLE = 2.0  # squared slope over its variance, below which no ramp is tried
RAMP_ROUNDS = 3  # rounds of the slope under the mixture that is left without it
USELESS = 1.0  # gain of a Gauss-Markov process in the objective that ends the search for more

FITS = 5
"""Candidates that are fitted in full before the best one is taken as it is, and candidates without
a ramp whose own noise prices the slope."""

CONTEST = 40.0  # of the criterion, up to which simpler candidates are compared by their own fit ...
COMPARED = 3  # ... and how many of them
RIVALS = 5  # models that fit equally well of which the fits are shown
WIDER = 1.2  # times the interval, from which on the range over models is reported

BANDWIDTH_GAIN = 2.0
"""Times the price of its parameters: what a low-pass must gain over a mixture of textbook processes
to be in the model. No sum of such processes is better than their mixture."""

FILTER_LIKE = 10.0
"""Correlation time in samples below which a Gauss-Markov process would take over part of a filter:
none is beside the low-pass while its shape is sought."""

HELD_TIMES = 7
"""Correlation times at which the slowest term of ``rule="merge"`` is held, from the length of the
record downwards by halves: those held for 27 gyros of the paper's Table VI were a sixteenth of it
or longer (``python benchmarks/paper_sensor.py``)."""

HELD_LEVEL = 0.95  # probability of the shortest time that the record allows
