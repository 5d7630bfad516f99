"""Numbers for a filter as the file of the program that runs it, and back."""

import os
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm._core.files import content_of, toml_beside, writable_file, write_text
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.export.curves import CURVES
from gmwm.export.imu import in_motion
from gmwm.export.state_space import StateSpaceFile
from gmwm.export.target import ImuFile, JsonFile, MemoryKeys, Pair, Target, WalkKeys, entries
from gmwm.filter_numbers import FilterNumbers
from gmwm.motion import InMotion
from gmwm.process import Model

_KINDS = {"json": JsonFile, "state-space": StateSpaceFile}


def _target(name: str, content: dict[str, Any]) -> Target:
    """A consumer as export.toml describes it."""
    kind = _KINDS.get(content.pop("kind", ""), ImuFile)
    for given, keys in (("walk_keys", WalkKeys), ("memory_keys", MemoryKeys)):
        if given in content:
            content["keys"] = keys(**_fixed(content.pop(given)))
    return kind(name, **{"file_name": f"{name}.yaml", **_fixed(content)})


def _fixed(content: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(each) if isinstance(each, list) else each for key, each in content.items()}


TARGETS: Mapping[str, Target] = MappingProxyType(
    {name: _target(name, content) for name, content in toml_beside(__file__).items()}
)
"""Every consumer by name."""

Source = Calibration | FilterNumbers | InMotion

_RATES = ("update_rate", "IMU.Frequency")
"""Keys of the rate of the IMU in files."""


def export(
    numbers: Source | Sequence[Source],
    target: str,
    *,
    horizon: float | None = None,
    interval: float | None = None,
    form: str | None = None,
    path: str | os.PathLike[str] | None = None,
) -> str:
    """Numbers for a small filter in the form that a program reads; see `TARGETS`.

    Or, for names of `CURVES` such as "px4-tc", the curves of the bias against the temperature.

    Parameters
    ----------
    numbers : Calibration, FilterNumbers, InMotion, or a sequence of them
        Of a calibration, those of `gmwm.bound` are written; those of `gmwm.reduce` if it has a
        random walk and the program has no place for one. Of noise in motion, `InMotion.numbers`
        from the interval to the horizon, the largest of all IMUs. Several together make one IMU,
        such as gyros and accelerometers of different rates.
    target : str
        Name of the program: "kalibr", "gtsam", ...
    horizon : float, optional
        Longest outage that the numbers are for, s; 60 s by default, 1 s in motion.
    interval : float, optional
        Shortest time between updates, s, for noise in motion; 0.1 s by default.
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
    checks.choice("target", target, (*TARGETS, *CURVES))
    given: list[Any] = list(numbers) if isinstance(numbers, Sequence) else [numbers]
    if target in CURVES:
        text = CURVES[target].text(given)
        if path is not None:
            write_text(writable_file(path), text)
        return text
    chosen, given = TARGETS[target], in_motion(given, horizon, interval)
    if path is None:
        return chosen.export(given, horizon, form)
    return chosen.save(writable_file(path), given, horizon, form)


def read_numbers(
    path: str | os.PathLike[str], rate: float | None = None
) -> dict[str, Pair | Model]:
    """The numbers of gyro and accelerometer in a program's file.

    path: Of a program of `TARGETS` that has keys: Kalibr, OpenVINS, GTSAM, PX4 and others.
    rate: Of the IMU, Hz, for programs whose numbers depend on it; by default the file's own.
    Returns: "gyro" and "accel", or each of the axes ("gyro_x" to "accel_z") where they differ -> N
        (u/sqrt(Hz)) and K (u/s/sqrt(Hz)), or a model with a Gauss-Markov process.
    Raises InputError if the file cannot be read, has no known keys, or its numbers need a rate.
    """
    values = entries(content_of(path).decode("utf-8-sig", errors="replace"))
    layouts = {each.keys: None for each in TARGETS.values() if each.keys}
    keys = next((each for each in layouts if any(name in values for name in each.names)), None)
    if keys is None:
        known = "; ".join(", ".join(each.names[:2]) for each in layouts)
        raise InputError(f"{path}: has no noise parameters of a known name ({known}): give N and K")
    for name in keys.names:
        if name not in values:
            raise InputError(f"{path}: {name} is missing: add it")
        if not np.all(values[name] > 0.0):
            raise InputError(f"{path}: {name} = {values[name][0]:g}: give a positive number")
    own_rate = next((float(values[key][0]) for key in _RATES if key in values), 0.0)
    try:
        found = keys.read(values, rate or own_rate)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return {
        f"{kind}_{letter}" if letter else kind: item
        for kind, items in zip(("gyro", "accel"), found, strict=True)
        for letter, item in zip("xyz" if len(items) == 3 else ("",), items, strict=True)
    }
