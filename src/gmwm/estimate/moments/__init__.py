"""The Generalized Method of Wavelet Moments."""

from gmwm.estimate.moments.design import Design
from gmwm.estimate.moments.discrepancy import suffices
from gmwm.estimate.moments.gmwm import GMWM, SimulatedMoments
from gmwm.estimate.moments.profile import Point, Profile
from gmwm.estimate.moments.start import Reference, dictionary, dictionary_fit, search
from gmwm.estimate.moments.weights import Weights

__all__ = [
    "GMWM",
    "Design",
    "Point",
    "Profile",
    "Reference",
    "SimulatedMoments",
    "Weights",
    "dictionary",
    "dictionary_fit",
    "search",
    "suffices",
]
