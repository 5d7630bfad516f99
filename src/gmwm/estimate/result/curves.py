"""The curves of a fitted model at averaging times close to each other, to be drawn."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.estimate.problem import Scales
from gmwm.process import Model

if TYPE_CHECKING:
    from gmwm.estimate.result.fit import Fit

_PER_OCTAVE = 12
"""At one an octave the lobes of a periodic line and a resonance look broken."""


def dense_curves(
    fitted: Fit, model: Model | None = None
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Allan deviation of each term of a model at whole numbers of samples.

    model: That of the fit by default.
    Returns: tau (k,), averaging times from the first to the last of the data, s; those of the data
        alone where a term is known by simulation only, or the wavelet is not Haar's; deviations, by
        the term's label, u; the root of the sum of their squares is that of the model.
    """
    wv, shown = fitted.wv, fitted.model if model is None else model
    scales = Scales.of(wv)
    if wv.wavelet == "haar" and not any(map(scales.is_simulated, shown.terms)):
        octaves = np.log2(wv.tau[-1] / wv.tau[0])
        steps = 2.0 ** np.linspace(0.0, octaves, int(_PER_OCTAVE * octaves) + 1)
        scales = replace(scales, tau=wv.dt * np.unique(np.rint(steps * wv.tau[0] / wv.dt)))
    curves = [np.sqrt(2.0 * scales.curve(term)) for term in shown.terms]
    return scales.tau, dict(zip(shown.term_labels(), curves, strict=True))
