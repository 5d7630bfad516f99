"""Stochastic error models of inertial sensors, by the Generalized Method of Wavelet Moments.

A static recording goes in (`read`, `Recording`), its wavelet variance says what the noise does at
each averaging time (`wavelet_variance`), an error model is fitted to it (`fit`) or chosen
(`select`), and `calibrate` does so for every channel. Inside, everything is in SI units and
seconds; averaging times are 2^(j-1) dt; the Haar wavelet variance is half the Allan variance.

Names are loaded when they are first used, so that importing the package costs next to nothing.
"""

import copyreg
import sys
from importlib import import_module
from types import ModuleType

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

# Functions that use the package go to other processes with it, by name. Only plain modules do so by
# themselves, and this one guards functions from modules of their name.
if type(sys.modules[__name__]) is not ModuleType:
    copyreg.pickle(type(sys.modules[__name__]), lambda module: (import_module, (module.__name__,)))
