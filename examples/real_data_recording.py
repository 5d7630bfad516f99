"""One recording of docs/real-data.md: read, examined, and looked at piece by piece."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.signal import welch

import gmwm
from gmwm import Channel, Fit, Health, JointFit, Recording
from gmwm.issues import Notice
from gmwm._core.units import SI_UNIT, factor

NUMBERS = (1, 2, 3, 4)
CHANNELS = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
ACCELEROMETERS = CHANNELS[3:]
PIECES = 8  # of a recording, to see what changes within it
BUMPS = {"gyro_z": (17.0, 23.0), "accel_x": (8.5, 11.5)}  # Hz, where the broad peak is looked for
_WELCH = 4096  # samples of a segment: 0.024 Hz resolve the peaks


@dataclass(frozen=True)
class Recorded:
    """A recording, what was found in it, and it without the samples of shocks."""

    number: int
    raw: Recording
    health: Health
    clean: Recording

    @classmethod
    def read(cls, folder: Path, number: int) -> Recorded:
        """Read and examine one of the files."""
        path = folder / f"adis16405_{number}.csv.gz"
        raw = gmwm.read(path, rate=100, units={"gyro": "deg/s", "accel": "g"})
        found = gmwm.health(raw)
        return cls(number, raw, found, found.masked(raw))

    def largest_event(self, channels: str) -> Notice | None:
        """The highest shock of the channels whose names begin so."""
        events = [e for e in self.health.of(code="event") if e.where.startswith(channels)]
        return max(events, key=lambda event: abs(event.values["height"]), default=None)


def shown_unit(channel: str) -> tuple[str, float]:
    """Unit in which a channel is shown, and how much of SI one is."""
    quantity, unit = ("gyro", "deg/s") if channel.startswith("gyro") else ("accel", "mg")
    return unit, factor(unit, SI_UNIT[quantity])


def parts_of(fit: Fit) -> tuple[Fit, ...]:
    """The same model fitted to each recording."""
    return fit.parts if isinstance(fit, JointFit) else (fit,)


def pieces_of(channel: Channel) -> list[Channel]:
    """Consecutive parts of equal length."""
    values = np.asarray(channel.values, dtype=float)
    return [replace(channel, values=part) for part in np.array_split(values, PIECES)]


def spectrum_of(channel: Channel, length: int = _WELCH) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and density (u^2/Hz, one-sided) by Welch; missing samples are the mean."""
    values = np.asarray(channel.values, dtype=float)
    filled = np.where(np.isnan(values), np.nanmean(values), values)
    frequency, density = welch(filled, 1.0 / channel.dt, nperseg=length)
    return frequency, density


def peaks_of_pieces(channel: Channel, band: tuple[float, float]) -> np.ndarray:
    """Where the spectrum of each piece is largest within a band, Hz."""
    found = []
    for piece in pieces_of(channel):
        frequency, density = spectrum_of(piece)
        inside = (frequency > band[0]) & (frequency < band[1])
        found.append(frequency[inside][np.argmax(density[inside])])
    return np.array(found)


def noise_of_pieces(channel: Channel) -> tuple[np.ndarray, float]:
    """Allan deviation of each piece at the sampling interval, over their mean, and its error."""
    variances = [gmwm.wavelet_variance(piece) for piece in pieces_of(channel)]
    level = np.array([wv.allan_deviation[0] for wv in variances])
    error = float(1.0 / np.sqrt(2.0 * variances[0].dof[0]))
    return level / np.mean(level), error
