"""All that a validation by navigating needs."""

from __future__ import annotations

from dataclasses import dataclass

from gmwm.ins.imu import SensorModels
from gmwm.ins.montecarlo.scenario import ErrorSource, Scenario


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
