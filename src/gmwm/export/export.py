"""Numbers for a filter as the file of the program that runs it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from gmwm._core import checks
from gmwm._core.files import writable_file
from gmwm.calibration import Calibration
from gmwm.export.programs.gtsam import GTSAM
from gmwm.export.programs.json_targets import JSON_TARGETS
from gmwm.export.programs.keyed import KEYED
from gmwm.export.programs.kfgins import KFGINS
from gmwm.export.programs.matlab import MATLAB
from gmwm.export.programs.ros import ROS
from gmwm.export.programs.simulators import SIMULATORS
from gmwm.export.programs.state_space import STATE_SPACE
from gmwm.export.target import Target
from gmwm.filter_numbers import SensorNumbers

TARGETS: Mapping[str, Target] = MappingProxyType(
    {
        target.name: target
        for target in (
            *KEYED, *GTSAM, ROS, MATLAB, STATE_SPACE, *SIMULATORS, KFGINS,
            *JSON_TARGETS,
        )
    }
)  # fmt: skip
"""Every consumer by name."""


def export(
    numbers: Calibration | SensorNumbers | Sequence[Calibration | SensorNumbers],
    target: str,
    *,
    horizon: float | None = None,
    form: str | None = None,
    path: str | os.PathLike[str] | None = None,
) -> str:
    """Numbers for a small filter in the form that a program reads; see `TARGETS`.

    Parameters
    ----------
    numbers : Calibration, SensorNumbers, or a sequence of them
        Of a calibration, those of `gmwm.bound` are written; those of `gmwm.reduce` if it has a
        random walk and the program has no place for one. Several together make one IMU, such as
        gyros and accelerometers of different rates.
    target : str
        Name of the program: "kalibr", "gtsam", ...
    horizon : float, optional
        Time without aiding that the numbers are for, s; 1 s for programs that relate keyframes or
        scans, 60 s for others.
    form : str, optional
        Of the numbers, "N+K" or "N+GM"; each program holds one. For "state-space", which holds the
        full model, also another: see `gmwm.bound`.
    path : path-like, optional
        The file to write; "state-space" also writes NPZ, by suffix.

    Returns
    -------
    str
        The text of the file.

    Raises
    ------
    InputError
        If the program is not known, a sensor is missing, the numbers do not fit, or the file
        cannot be written.
    """
    chosen = TARGETS[checks.choice("target", target, tuple(TARGETS))]
    alone = isinstance(numbers, Calibration | SensorNumbers) or not isinstance(numbers, Sequence)
    given: list[Any] = [numbers] if alone else list(numbers)
    if path is None:
        return chosen.export(given, horizon, form)
    return chosen.save(writable_file(path), given, horizon, form)
