"""Wavelet variances of a model by simulation: indirect inference.

The mean over R series as long as the data, made with the same random numbers whatever the
parameters, takes the place of the closed form; the covariance of the moments grows by (1 + 1/R)
(Gourieroux, Monfort & Renault 1993, *J. Applied Econometrics* 8, S85-S118; eq. (13) ff. of Stebler
et al. 2012).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.process import Process
from gmwm.variance import wavelet_variance


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
    """Averaging times and mean wavelet variances; the same terms are asked for again and again."""
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
