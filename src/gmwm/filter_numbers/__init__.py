"""What a filter of few states should believe: consistent numbers for it, and a check of given ones.

A small filter has room for white noise with a random walk or a few Gauss-Markov processes on each
axis; which numbers are right depends on how long it goes without aiding, the horizon.
"""

from gmwm.filter_numbers.bound import bound as bound, judged as judged
from gmwm.filter_numbers.certificate import (
    CONSUMERS as CONSUMERS,
    Cause as Cause,
    Certificate as Certificate,
    Check as Check,
)
from gmwm.filter_numbers.certify import certify as certify
from gmwm.filter_numbers.chain import Chain as Chain, ChainErrors as ChainErrors
from gmwm.filter_numbers.given import read_numbers as read_numbers
from gmwm.filter_numbers.imperfections import Imperfections as Imperfections, Motion as Motion
from gmwm.filter_numbers.reduce import reduce as reduce
from gmwm.filter_numbers.result import (
    FORMS as FORMS,
    FilterNumbers as FilterNumbers,
    Predicted as Predicted,
    SensorNumbers as SensorNumbers,
)
from gmwm.filter_numbers.tuning import EKF2_INTERVAL as EKF2_INTERVAL
