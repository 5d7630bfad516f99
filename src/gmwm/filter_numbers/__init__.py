"""What a filter of few states should believe: consistent numbers for it, and a check of given ones.

A small filter has room for white noise with a random walk or a few Gauss-Markov processes on each
axis; which numbers are right depends on how long it goes without aiding, the horizon.
"""

from gmwm.filter_numbers.bound import bound
from gmwm.filter_numbers.chain import Chain, ChainErrors
from gmwm.filter_numbers.reduce import reduce
from gmwm.filter_numbers.result import FORMS, FilterNumbers, Predicted, SensorNumbers

__all__ = [
    "FORMS",
    "Chain",
    "ChainErrors",
    "FilterNumbers",
    "Predicted",
    "SensorNumbers",
    "bound",
    "reduce",
]
