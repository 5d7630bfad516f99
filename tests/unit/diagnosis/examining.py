"""Noises, and channels as the checks see them with prediction errors made by hand."""

import numpy as np

import gmwm
from gmwm import BiasInstability, GaussMarkov, QuantizationNoise, RandomWalk, WhiteNoise
from gmwm.diagnosis.innovations import Examined, Innovations
from gmwm.process import as_model

DT = 0.01
SMOOTH = {
    "white": WhiteNoise(0.1),
    "walk": RandomWalk(1.0),
    "white on walk": WhiteNoise(0.1) + RandomWalk(0.1),
    "Gauss-Markov": WhiteNoise(0.02) + GaussMarkov(1.0, 5.0),
    "flicker": WhiteNoise(0.01) + BiasInstability(0.1),
    "quantization": QuantizationNoise(0.01),
}
"""Noises with smooth spectra."""


def simulated(model, n, seed):
    return gmwm.simulate(as_model(model), n=n, dt=DT, seed=seed)


def examined(
    values, *, step=0.0, scatter=1.0, unit="rad/s", errors=None, usable=None, events=(), quiet=None
):
    """A channel at 100 Hz whose usual prediction error is ``scatter``."""
    values = np.asarray(values, dtype=float)
    n = values.size
    if errors is None:
        known = np.ones(max(n, 1), dtype=bool)
        errors = Innovations(np.zeros(known.size), known, np.full(known.size, scatter), 0.0)
    usable = errors.known if usable is None else usable
    quiet = values if quiet is None else quiet
    events = tuple(events)
    return Examined("gyro_x", unit, 0.01, values, step, step, errors, events, events, 0.0, None,
                    usable, quiet)  # fmt: skip


def only(notices):
    """The notice, or None."""
    return next(iter(notices), None)
