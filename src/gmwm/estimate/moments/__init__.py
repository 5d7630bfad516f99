"""The Generalized Method of Wavelet Moments."""

from gmwm.estimate.moments.design import Design as Design
from gmwm.estimate.moments.gmwm import GMWM as GMWM, SimulatedMoments as SimulatedMoments
from gmwm.estimate.moments.profile import (
    Point as Point,
    Profile as Profile,
    search as search,
)
from gmwm.estimate.moments.weights import (
    TEXTBOOK as TEXTBOOK,
    Reference as Reference,
    dictionary as dictionary,
    dictionary_fit as dictionary_fit,
)
