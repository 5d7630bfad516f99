"""A smooth change of a quantity: its rate ramps up, holds and ramps down."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm._typing import FloatArray


@dataclass(frozen=True)
class Pulse:
    """A change of a quantity.

    Attributes
    ----------
    change : float
        By how much, signed.
    limit : float
        Largest rate, unit of the quantity per second; a change too small for it has a lower one.
    ramp : float
        Time in which the rate comes up, and goes down, s. It follows 10 x^3 - 15 x^4 + 6 x^5, of
        which two derivatives vanish at both ends.
    """

    change: float
    limit: float
    ramp: float

    @property
    def rate(self) -> float:
        """Rate between the ramps, signed."""
        return float(np.clip(self.change / self.ramp, -self.limit, self.limit))

    @property
    def hold(self) -> float:
        """Time between the ramps, s."""
        return max(abs(self.change) / self.limit - self.ramp, 0.0) if self.change else 0.0

    @property
    def duration(self) -> float:
        """From the begin of the first ramp to the end of the last one, s; 0 without a change."""
        return 2.0 * self.ramp + self.hold if self.change else 0.0

    def value(self, time: FloatArray) -> FloatArray:
        """What has changed some time after the begin, s."""
        up, down = self._ramps(time)
        area = self.rate * self.ramp * (_integral(up) - _integral(down))
        # After a ramp its step goes on at 1.
        past_up = np.maximum(time - self.ramp, 0.0)
        past_down = np.maximum(time - 2.0 * self.ramp - self.hold, 0.0)
        found = area + self.rate * (past_up - past_down)
        return np.where(time >= self.duration, self.change, found)

    def slope(self, time: FloatArray) -> FloatArray:
        """Its rate some time after the begin, s."""
        up, down = self._ramps(time)
        return self.rate * (_step(up) - _step(down))

    def curvature(self, time: FloatArray) -> FloatArray:
        """Derivative of the rate some time after the begin, s."""
        up, down = self._ramps(time)
        return self.rate / self.ramp * (_bell(up) - _bell(down))

    def _ramps(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How far the two ramps are, 0 to 1."""
        up = np.clip(time / self.ramp, 0.0, 1.0)
        return up, np.clip((time - self.ramp - self.hold) / self.ramp, 0.0, 1.0)


def _integral(x: FloatArray) -> FloatArray:
    return x**4 * (2.5 + x * (-3.0 + x))


def _step(x: FloatArray) -> FloatArray:
    return x**3 * (10.0 + x * (-15.0 + 6.0 * x))


def _bell(x: FloatArray) -> FloatArray:
    return 30.0 * x**2 * (1.0 - x) ** 2
