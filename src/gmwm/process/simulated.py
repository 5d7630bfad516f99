"""Processes that are known by simulation only."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.process.base import Process


class SimulatedProcess(Process):
    """An error process without a spectrum in closed form.

    A subclass names its ``parameters`` and gives ``_draw``. To be estimated, it must use the
    generator in the same way whatever its parameters are: the same random numbers then give series
    that change smoothly with the parameters. See ``gmwm.fit(method="simulated")``.

    Examples
    --------
    >>> import numpy as np
    >>> from gmwm import Parameter, SimulatedProcess
    >>> class RoundedNoise(SimulatedProcess):
    ...     parameters = (Parameter("sigma", "u"), Parameter("lsb", "u"))
    ...     def _draw(self, n, dt, rng):
    ...         return self.lsb * np.rint(self.sigma / self.lsb * rng.standard_normal(n))
    >>> float(np.std(RoundedNoise(sigma=1.0, lsb=0.5).simulate(1000, dt=1.0, seed=1)) > 0.9)
    1.0
    """

    @abstractmethod
    def _draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        """``n`` samples, u."""

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        raise InputError(
            f'{type(self).__name__} is known by simulation only: fit it with method = "simulated"'
        )
