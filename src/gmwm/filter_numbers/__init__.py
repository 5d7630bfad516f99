"""What a filter of few states should believe: consistent numbers for it, and a check of given ones.

A small filter has room for white noise with a random walk or a few Gauss-Markov processes on each
axis; which numbers are right depends on how long it goes without aiding, the horizon. `bound` is
never overconfident, `reduce` is right for given outages, `certify` checks numbers in use, and
`error_budget` predicts how fast a navigation without aiding goes wrong.
"""

from gmwm.filter_numbers.bound import bound as bound
from gmwm.filter_numbers.budget import (
    FIELD_UNITS as FIELD_UNITS,
    HORIZONTAL as HORIZONTAL,
    QUANTITIES as QUANTITIES,
    TIMES as TIMES,
    ErrorBudget as ErrorBudget,
    ErrorRow as ErrorRow,
    axis as axis,
    error_budget as error_budget,
    is_steep as is_steep,
    per_si as per_si,
    root_sum as root_sum,
)
from gmwm.filter_numbers.certify import Certificate as Certificate, certify as certify
from gmwm.filter_numbers.imperfections import Imperfections as Imperfections, Motion as Motion
from gmwm.filter_numbers.propagation import Chain as Chain, integral_rms as integral_rms
from gmwm.filter_numbers.reduce import reduce as reduce, usable as usable
from gmwm.filter_numbers.result import (
    FORMS as FORMS,
    AxisFilterNumbers as AxisFilterNumbers,
    FilterNumbers as FilterNumbers,
    InUnits as InUnits,
    Predicted as Predicted,
    shown_unit as shown_unit,
)
from gmwm.filter_numbers.tuning import HORIZON as HORIZON
