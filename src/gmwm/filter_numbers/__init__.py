"""What a filter of few states should believe: consistent numbers for it, and a check of given ones.

A small filter has room for white noise with a random walk or a few Gauss-Markov processes on each
axis; which numbers are right depends on how long it goes without aiding, the horizon.
"""

from gmwm.filter_numbers.bound import bound, judged
from gmwm.filter_numbers.certificate import CONSUMERS, Cause, Certificate, Check
from gmwm.filter_numbers.certify import certify
from gmwm.filter_numbers.chain import Chain, ChainErrors
from gmwm.filter_numbers.given import read_numbers
from gmwm.filter_numbers.imperfections import Imperfections, Motion
from gmwm.filter_numbers.reduce import reduce
from gmwm.filter_numbers.result import FORMS, FilterNumbers, Predicted, SensorNumbers
from gmwm.filter_numbers.tuning import EKF2_INTERVAL

__all__ = [
    "CONSUMERS",
    "EKF2_INTERVAL",
    "FORMS",
    "Cause",
    "Certificate",
    "Chain",
    "ChainErrors",
    "Check",
    "FilterNumbers",
    "Imperfections",
    "Motion",
    "Predicted",
    "SensorNumbers",
    "bound",
    "certify",
    "judged",
    "read_numbers",
    "reduce",
]
