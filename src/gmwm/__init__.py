"""Stochastic error models of inertial sensors, by the Generalized Method of Wavelet Moments.

A static recording goes in (`read`, `Recording`), its wavelet variance says what the noise does at
each averaging time (`wavelet_variance`), an error model is fitted to it (`fit`) or chosen
(`select`), and `calibrate` does so for every channel. Inside, everything is in SI units and
seconds; averaging times are 2^(j-1) dt; the Haar wavelet variance is half the Allan variance.

Names are loaded when they are first used, so that importing the package costs next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gmwm.budget import ErrorBudget, ErrorRow
    from gmwm.calibration import Calibration, calibrate, load
    from gmwm.coasting import error_budget
    from gmwm.diagnosis import Health, health
    from gmwm.errors import InputError
    from gmwm.estimate.bootstrap import Bootstrap, bootstrap, bootstrap_test
    from gmwm.estimate.bounds import CramerRao, cramer_rao
    from gmwm.estimate.fit import Fit
    from gmwm.estimate.joint import JointFit
    from gmwm.estimate.methods import fit
    from gmwm.process import (
        AR,
        ARIMA,
        ARMA,
        MA,
        BiasInstability,
        GaussMarkov,
        Model,
        Parameter,
        Process,
        QuantizationNoise,
        RandomWalk,
        RateRamp,
        Resonance,
        SimulatedProcess,
        Sinusoid,
        StateSpace,
        WhiteNoise,
    )
    from gmwm.process.model import simulate
    from gmwm.readers import read
    from gmwm.recording import Channel, Recording
    from gmwm.selection import Selection, select
    from gmwm.variance.allan_family import Deviations, deviations
    from gmwm.variance.analysis import wavelet_variance
    from gmwm.variance.covariance import haar_covariance
    from gmwm.variance.modwt import Modwt, imodwt, modwt
    from gmwm.variance.wavelet import WaveletVariance

__version__ = "0.1.0"

_HOME = {
    **dict.fromkeys(("ErrorBudget", "ErrorRow"), "budget"),
    **dict.fromkeys(("Calibration", "calibrate", "load"), "calibration"),
    "error_budget": "coasting",
    **dict.fromkeys(("Health", "health"), "diagnosis"),
    "InputError": "errors",
    **dict.fromkeys(("Bootstrap", "bootstrap", "bootstrap_test"), "estimate.bootstrap"),
    **dict.fromkeys(("CramerRao", "cramer_rao"), "estimate.bounds"),
    "Fit": "estimate.fit",
    "JointFit": "estimate.joint",
    "fit": "estimate.methods",
    **dict.fromkeys(
        (
            "AR",
            "ARIMA",
            "ARMA",
            "MA",
            "BiasInstability",
            "GaussMarkov",
            "Model",
            "Parameter",
            "Process",
            "QuantizationNoise",
            "RandomWalk",
            "RateRamp",
            "Resonance",
            "SimulatedProcess",
            "Sinusoid",
            "StateSpace",
            "WhiteNoise",
        ),
        "process",
    ),
    "simulate": "process.model",
    "read": "readers",
    **dict.fromkeys(("Channel", "Recording"), "recording"),
    **dict.fromkeys(("Selection", "select"), "selection"),
    "haar_covariance": "variance.covariance",
    "WaveletVariance": "variance.wavelet",
    **dict.fromkeys(("Modwt", "imodwt", "modwt"), "variance.modwt"),
    "wavelet_variance": "variance.analysis",
    **dict.fromkeys(("Deviations", "deviations"), "variance.allan_family"),
}

__all__ = [
    "AR",
    "ARIMA",
    "ARMA",
    "MA",
    "BiasInstability",
    "Bootstrap",
    "Calibration",
    "Channel",
    "CramerRao",
    "Deviations",
    "ErrorBudget",
    "ErrorRow",
    "Fit",
    "GaussMarkov",
    "Health",
    "InputError",
    "JointFit",
    "Model",
    "Modwt",
    "Parameter",
    "Process",
    "QuantizationNoise",
    "RandomWalk",
    "RateRamp",
    "Recording",
    "Resonance",
    "Selection",
    "SimulatedProcess",
    "Sinusoid",
    "StateSpace",
    "WaveletVariance",
    "WhiteNoise",
    "bootstrap",
    "bootstrap_test",
    "calibrate",
    "cramer_rao",
    "deviations",
    "error_budget",
    "fit",
    "haar_covariance",
    "health",
    "imodwt",
    "load",
    "modwt",
    "read",
    "select",
    "simulate",
    "wavelet_variance",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'gmwm' has no attribute {name!r}")
    value = getattr(import_module(f"gmwm.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
