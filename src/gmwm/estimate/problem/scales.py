"""The levels at which a model meets the data, and the model's curves there.

Curves are in closed form, or simulated for processes that are known by simulation only (indirect
inference): the mean over R series as long as the data, made with the same random numbers whatever
the parameters, takes the place of the closed form, and the covariance of the moments grows by
(1 + 1/R) (Gourieroux, Monfort & Renault 1993, *J. Applied Econometrics* 8, S85-S118; eq. (13) ff.
of Stebler et al. 2012).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from gmwm._core.frozen import frozen
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process import PSD, Model, Process, Shape
from gmwm.variance import WaveletVariance, pilot_psd, wavelet_variance


@dataclass(frozen=True)
class Simulation:
    """How moments are simulated.

    replications: Number of series.
    """

    replications: int
    seed: int

    def inflation(self, lengths: float = 1.0) -> float:
        """Growth of the covariance of the moments, for data of so many simulated lengths."""
        return 1.0 + lengths / self.replications

    def curve(
        self, process: Process, tau: FloatArray, n: int, dt: float, wavelet: str
    ) -> FloatArray:
        """Mean wavelet variance over the simulated series, u^2, same shape as ``tau``.

        Between levels it is interpolated in logarithms.
        """
        times, variance = _simulated(self, process, n, dt, wavelet)
        if not np.any(variance > 0.0):
            return np.zeros_like(tau)
        level = np.log(np.maximum(variance, np.finfo(float).tiny))
        return np.asarray(np.exp(np.interp(np.log(tau), np.log(times), level)))


@lru_cache(maxsize=1024)
def _simulated(
    simulation: Simulation, process: Process, n: int, dt: float, wavelet: str
) -> tuple[FloatArray, FloatArray]:
    """Averaging times and mean wavelet variances; a fit asks for the same terms repeatedly."""
    total: FloatArray | float = 0.0
    times = np.ones(1)
    for replication in range(simulation.replications):
        rng = np.random.default_rng([simulation.seed, replication])
        series = process.simulate(n, dt, rng)
        if np.all(series == series[0]):
            continue  # rounded to nothing: no variance
        wv = wavelet_variance(series, dt, wavelet=wavelet)
        times, total = wv.tau, total + wv.variance
    return times, np.asarray(total / simulation.replications)


@dataclass(frozen=True, eq=False)
class Scales:
    """The levels of a wavelet variance, without its values.

    tau: (J,), averaging times, s.
    dt: Sampling interval, s.
    n: Length of the record, samples.
    simulation: How curves without a closed form are simulated.
    simulate_all: Whether all curves are simulated.
    shared: Cache of starting shapes and their curves, for fits of several models to these levels.
    """

    tau: FloatArray
    dt: float
    n: int
    wavelet: str = "haar"
    simulation: Simulation = Simulation(10, 0)
    simulate_all: bool = False
    shared: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(cls, wv: WaveletVariance) -> Scales:
        return _of_levels(tuple(wv.tau.tolist()), wv.dt, wv.n, wv.wavelet)

    def curve(self, model: Process | Model) -> FloatArray:
        """Wavelet variance of a model, u^2, (J,)."""
        if isinstance(model, Model):
            return np.sum([self.curve(term) for term in model.terms], axis=0)
        if self.is_simulated(model):
            return self.simulation.curve(model, self.tau, self.n, self.dt, self.wavelet)
        return np.asarray(model.wavelet_variance(self.tau, self.dt, self.wavelet), dtype=float)

    def unit_curves(self, process: Process) -> Callable[[Shape], FloatArray]:
        """Wavelet variance of a process at unit amplitude as a function of its shape, u^2, (J,)."""
        if self.is_simulated(process):
            return lambda shape: self.curve(process.at_unit(shape))
        if process.shape_parameters:
            if self.wavelet == "haar":
                return process.unit_haar_curves(self.tau, self.dt)
            return lambda shape: process.unit_wavelet_variance(
                shape, self.tau, self.dt, self.wavelet
            )
        found = frozen(process.unit_wavelet_variance((), self.tau, self.dt, self.wavelet))
        return lambda _: found

    def unit_slopes(self, process: Process) -> Callable[[Shape], FloatArray | None]:
        """Derivative of `unit_curves` by the coordinates of the shape, (J, s), where known."""
        if self.wavelet != "haar" or self.is_simulated(process):
            return lambda shape: None
        return lambda shape: process.unit_haar_slopes(shape, self.tau, self.dt)

    def is_simulated(self, process: Process) -> bool:
        """Whether the curve of a process is simulated."""
        return self.simulate_all or not process.has_spectrum()

    def spectrum(self, model: Model) -> PSD:
        """Spectrum of a model, or a smooth one with its wavelet variances if it has none."""
        if all(term.has_spectrum() for term in model.terms):
            return model.psd
        curve = self.curve(model)
        if not np.any(curve > 0.0):
            raise InputError(
                f"{model!r} has no variance when simulated: check its draw, or add WhiteNoise()"
            )
        positive = np.maximum(curve, 1e-12 * np.max(curve))
        return pilot_psd(positive, np.rint(self.tau / self.dt), self.dt)


@lru_cache(maxsize=16)
def _of_levels(tau: tuple[float, ...], dt: float, n: int, wavelet: str) -> Scales:
    """One object for all series of the same levels."""
    return Scales(frozen(np.array(tau)), dt, n, wavelet)


def is_plain(process: Process) -> bool:
    """Whether an instance holds only parameters, so that equal ones are the same."""
    return vars(process).keys() <= {parameter.name for parameter in process.parameters}
