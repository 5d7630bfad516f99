"""What a file is written from: the numbers of three gyros and three accelerometers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from gmwm.errors import InputError
from gmwm.filter_numbers import AxisFilterNumbers
from gmwm.issues import Notice

SENSORS = {"gyro": "gyroscope", "accel": "accelerometer"}
"""Quantity -> how messages and most consumers call the sensor."""

LETTERS = "xyz"

NO_RATE = "the numbers hold no sampling rate, which this file needs: export the calibration"


@dataclass(frozen=True)
class Axis:
    """The numbers of one axis in a file.

    name: Of its channel.
    N, K: u/sqrt(Hz) and u/s/sqrt(Hz).
    sigma, tau: Of the Gauss-Markov process, u and s; not a number in forms without one.
    initial_sd: Of the bias at the start, u.
    nees: Predicted normalised error squared by time without aiding.
    rate: Of its samples, Hz; NaN if it is not known.
    upper: Which of the numbers are upper limits of a term that was not found.
    notices: Those of its filter numbers.
    covers: The largest term that N or K covers beside the sensor's own; empty if there is none.
    """

    name: str
    N: float
    K: float
    sigma: float
    tau: float
    initial_sd: float
    nees: Mapping[float, float] = field(default_factory=dict)
    rate: float = float("nan")
    upper: frozenset[str] = frozenset()
    notices: tuple[Notice, ...] = ()
    covers: str = ""

    def moved(self, tau: float) -> Axis:
        """With a Gauss-Markov process of another correlation time that bounds its own.

        The spectral density of (sigma, tau) is below that of (sigma', tau') at all frequencies if
        it is at zero, sigma^2 tau, and at infinity, sigma^2/tau.
        """
        ratio = max(tau / self.tau, self.tau / tau)
        return replace(self, sigma=self.sigma * float(np.sqrt(ratio)), tau=tau)


@dataclass(frozen=True)
class Triad:
    """The axes of the gyros or of the accelerometers.

    quantity: {"gyro", "accel"}.
    axes: Each with its own numbers.
    common: The bound of all, where a file has one value for them and one calibration has them all.
    shared_nees: Where a file has one value for all: predicted normalised error squared of each axis
        with that value, by time without aiding; empty for an axis whose model is not known.
    """

    quantity: str
    axes: tuple[Axis, ...]
    common: AxisFilterNumbers | None = None
    shared_nees: Mapping[str, Mapping[float, float]] | None = None

    @property
    def N(self) -> float:
        """For all axes, u/sqrt(Hz)."""
        return self._for_all("N")

    @property
    def K(self) -> float:
        """For all axes, u/s/sqrt(Hz)."""
        return self._for_all("K")

    @property
    def initial_sd(self) -> float:
        """For all axes, u."""
        return self._for_all("initial_sd")

    def is_upper(self, letter: str) -> bool:
        """Whether no axis has the term."""
        return all(letter in axis.upper for axis in self.axes)

    def _for_all(self, name: str) -> float:
        """The bound over the axes; the largest of their upper limits if no axis has the term."""
        if self.common is not None and not self.is_upper(name):
            return float(getattr(self.common, name))
        found = [axis for axis in self.axes if name not in axis.upper]
        return max(getattr(axis, name) for axis in found or self.axes)

    @property
    def rate(self) -> float:
        return self.axes[0].rate

    def xyz(self) -> tuple[Axis, ...]:
        """Axes x, y, z; one that was not calibrated has the largest numbers of the others."""
        ends = [axis.name[-1:].lower() for axis in self.axes]
        is_named = set(ends) <= set(LETTERS) and len(set(ends)) == len(ends)
        letters = ends if is_named else LETTERS[: len(ends)]
        by_letter = dict(zip(letters, self.axes, strict=True))
        known = [axis.tau for axis in self.axes if axis.tau > 0.0]
        # To this correlation time all can be moved at the least cost to the one it costs most.
        tau = float(np.sqrt(min(known) * max(known))) if known else float("nan")
        sigma = max((a.moved(tau) if a.tau > 0.0 else a).sigma for a in self.axes)
        upper = frozenset().union(*(axis.upper for axis in self.axes))
        values = (self.N, self.K, sigma, tau, self.initial_sd)
        largest = Axis("", *values, rate=self.rate, upper=upper)
        return tuple(
            by_letter.get(letter, replace(largest, name=f"{self.quantity}_{letter}"))
            for letter in LETTERS
        )

    def listed(self, value: Callable[[Axis], float]) -> str:
        """A value of each axis as a list of Python, YAML or JSON."""
        return f"[{', '.join(f'{value(axis):.6e}' for axis in self.xyz())}]"


@dataclass(frozen=True)
class ImuNumbers:
    """Gyros and accelerometers, and the purpose of the numbers.

    horizon: Time without aiding, s.
    method: {"bound", "reduce", "given"}.
    sources: One line about each recording.
    invalid: Axes that are not valid -> why.
    topic: On which the samples were sent, where a bag was calibrated; else empty.
    """

    gyro: Triad
    accel: Triad
    form: str
    horizon: float
    method: str
    sources: tuple[str, ...] = ()
    invalid: Mapping[str, str] = field(default_factory=dict)
    topic: str = ""

    def by_axis(self) -> ImuNumbers:
        """The same for a file that has the numbers of each axis."""
        gyro, accel = (replace(each, common=None, shared_nees=None) for each in self.triads)
        return replace(self, gyro=gyro, accel=accel)

    @property
    def triads(self) -> tuple[Triad, Triad]:
        return self.gyro, self.accel

    @property
    def rate(self) -> float:
        """The higher of the two sensors' rates, Hz; raises InputError if it is not known."""
        rate = max(self.gyro.rate, self.accel.rate)
        if not rate > 0.0:
            raise InputError(NO_RATE)
        return rate
