"""Scenarios and experiments: trajectory, aiding, outages, sources of errors, filters."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter import Aiding, InitialSd, Outage, Outputs
from gmwm.ins.imu import SensorErrors, SensorModels
from gmwm.ins.trajectory import Trajectory

_SAME_TIME = 1e-6  # s


class ErrorSource(Protocol):
    """Where sensor errors come from: models, or a real recording."""

    @property
    def available(self) -> int | None:
        """Number of independent runs; ``None`` for any number."""

    def draw(self, run: int, n: int, dt: float, rng: np.random.Generator) -> SensorErrors:
        """Errors of one run."""


@dataclass(frozen=True)
class Simulated:
    """Sensor errors drawn from models.

    Attributes
    ----------
    models : SensorModels
    """

    models: SensorModels

    @property
    def available(self) -> int | None:
        """Any number of runs."""
        return None

    def draw(self, run: int, n: int, dt: float, rng: np.random.Generator) -> SensorErrors:
        """Errors of one run; see `SensorModels.simulate`."""
        return self.models.simulate(n, dt, rng)


@dataclass(frozen=True, eq=False)
class Scenario:
    """A trajectory with its aiding and outages.

    Attributes
    ----------
    trajectory : Trajectory
    aiding : Aiding
        Error-free fixes of the whole trajectory; their noise is drawn run by run.
    outages : tuple of Outage
    initial_sd : InitialSd
        The error of the initial state is drawn from it.
    step : float
        Of the covariance, s.
    interval : float
        At which errors are kept, s; zero for some 300 epochs.
    second_order : bool
        Whether filters allow for the square of the tilt error; see `gmwm.ins.filter.Filter`.
    """

    trajectory: Trajectory
    aiding: Aiding
    outages: tuple[Outage, ...] = ()
    initial_sd: InitialSd = field(default_factory=InitialSd)
    step: float = tuning.COVARIANCE_STEP
    interval: float = 0.0
    second_order: bool = True

    def __post_init__(self) -> None:
        dt = self.trajectory.dt
        for outage in self.outages:
            epoch = outage.end / dt
            if abs(epoch - round(epoch)) * dt > _SAME_TIME:
                raise InputError(
                    f"the outage from {outage.start:g} s ends at {outage.end:.9g} s, between two "
                    f"epochs of the trajectory: give multiples of its {dt:g} s"
                )
            if round(epoch) > self.trajectory.n:
                raise InputError(
                    f"the outage from {outage.start:g} s to {outage.end:g} s goes beyond the end "
                    f"of the trajectory at {self.trajectory.duration:g} s: begin it earlier"
                )

    @property
    def kept_interval(self) -> float:
        """Interval at which errors are kept, s."""
        least = self.trajectory.duration / tuning.KEPT_EPOCHS
        return self.interval or float(max(np.ceil(least), self.trajectory.dt))

    def outputs(self) -> Outputs:
        """Epochs that are kept: evenly spaced, every second of an outage, and its end before the
        first fix.
        """
        dt, n = self.trajectory.dt, self.trajectory.n
        within = [np.arange(o.start, o.end, max(tuning.OUTAGE_EPOCHS, dt)) for o in self.outages]
        ends = [outage.end for outage in self.outages]
        return Outputs.every(self.kept_interval, dt, n, ends, also=np.concatenate([[], *within]))


@dataclass(frozen=True, eq=False)
class Experiment:
    """Filters that navigate on the same errors.

    Attributes
    ----------
    scenario : Scenario
    source : ErrorSource
    filters : dict
        Name -> `SensorModels`.
    truth : SensorModels or None
        The models that errors are drawn from; ``None`` for real ones.
    runs, seed : int
    title : str
    """

    scenario: Scenario
    source: ErrorSource
    filters: dict[str, SensorModels]
    truth: SensorModels | None
    runs: int = 100
    seed: int = 0
    title: str = ""
