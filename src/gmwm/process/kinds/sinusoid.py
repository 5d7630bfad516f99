"""Periodic lines."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.process.base import Process, Shape
from gmwm.process.parameter import parameter
from gmwm.process.state_space import StateSpace

_GRID_PER_DECADE = 100


class Sinusoid(Process):
    """A periodic line of constant amplitude and random phase (IEEE Std 952, sinusoidal noise).

    Parameters
    ----------
    amplitude : float, optional
        u.
    frequency : float, optional
        Hz; what lies above 1/(2 dt) is aliased.
    """

    amplitude: float = parameter("u", "scale", meaning="line amplitude")
    frequency: float = parameter("Hz", meaning="line frequency")
    label: ClassVar[str] = "sinusoid"
    prefix: ClassVar[str] = "sinusoid_"
    is_line: ClassVar[bool] = True

    def __init__(self, amplitude: float | None = None, frequency: float | None = None) -> None:
        super().__init__(amplitude, frequency)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        """Zero: all of the variance is in the line, see `lines`."""
        return np.zeros_like(f)

    def lines(self) -> tuple[tuple[float, float], ...]:
        return ((float(self.frequency), float(self.amplitude)),)

    def haar_variance(self, tau: FloatArray, dt: float) -> FloatArray:
        m = np.asarray(tau, dtype=float) / dt
        return 0.5 * self.amplitude**2 * _line_gain(m, self.frequency * dt)

    def autocovariance(self, lag: FloatArray, dt: float) -> FloatArray:
        phase = 2.0 * np.pi * self.frequency * dt * np.asarray(lag)
        return 0.5 * self.amplitude**2 * np.cos(phase)

    def state_space(self, dt: float) -> StateSpace:
        self._require_given()
        angle = 2.0 * np.pi * self.frequency * dt
        rotation = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        return StateSpace(
            transition=rotation,
            process_noise=np.zeros((2, 2)),
            output=np.array([1.0, 0.0]),
            measurement_noise=0.0,
            initial_mean=np.zeros(2),
            initial_covariance=0.5 * self.amplitude**2 * np.eye(2),
            names=("line, in phase", "line, in quadrature"),
        )

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        cycles = self.frequency * dt * np.arange(n) + rng.random()
        return self.amplitude * np.cos(2.0 * np.pi * cycles)

    def shape_grid(self, dt: float, n: int) -> list[Shape]:
        # The gain's lobes at coarse levels make many local minima: the grid is finer than they are
        # where the line is seen at all.
        low, high = np.log10(2.0 / (n * dt)), np.log10(0.5 / dt)
        points = max(int(np.ceil((high - low) * _GRID_PER_DECADE)), 2)
        return [(float(frequency),) for frequency in np.logspace(low, high, points)]

    @classmethod
    def examples(cls) -> tuple[Process, ...]:
        return (cls(1.0, 0.00565), cls(0.1, 0.203))


def _line_gain(m: FloatArray, frequency: float) -> FloatArray:
    """Squared Haar gain at one frequency (cycles per sample), also at multiples of 1 and near 0."""
    alias = abs(frequency - np.rint(frequency))
    x = np.pi * m * alias
    # sin(x)^2 / (m sin(pi f)) with the ratio written through sinc so that f -> 0 stays exact.
    ratio = x * np.sinc(x / np.pi) ** 2 / np.sinc(alias)
    return np.asarray(ratio**2)
