"""The numbers of a data sheet, to be laid over what was measured."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core.checks import shown
from gmwm._core.documents import read_yaml
from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT, factor, si_parameter_unit
from gmwm.errors import InputError
from gmwm.process import BiasInstability, Process, RandomWalk, WhiteNoise

UNITS = {"N": "u/sqrt(Hz)", "B": "u", "K": "u/s/sqrt(Hz)"}
"""Of the numbers that a data sheet states."""

_TERMS: dict[str, type[Process]] = {"N": WhiteNoise, "B": BiasInstability, "K": RandomWalk}
_VALUE = re.compile(r"\s*([-+.\deE]+)\s+(\S.*?)\s*")
_HINT = "write it like 'N: 0.15 deg/sqrt(h)', 'B: 7 deg/h'"


@dataclass(frozen=True)
class Datasheet:
    """N, B and K by sensor or channel.

    name: Of the file.
    entries: "gyro", "accel" or a channel -> letter -> value, SI.
    """

    name: str
    entries: dict[str, dict[str, float]]

    def of(self, channel: str, quantity: str | None) -> dict[str, float]:
        """What it states of a channel; empty if nothing."""
        return self.entries.get(channel, self.entries.get(quantity or "", {}))

    def deviation(
        self, channel: str, quantity: str | None, tau: FloatArray, dt: float
    ) -> FloatArray | None:
        """The Allan deviation that it states, u, or ``None``."""
        values = self.of(channel, quantity)
        if not values:
            return None
        curves = [_TERMS[key](value).haar_variance(tau, dt) for key, value in values.items()]
        return np.asarray(np.sqrt(2.0 * np.sum(curves, axis=0)), dtype=float)


def read_datasheet(
    path: str | os.PathLike[str], channels: dict[str, str] | None = None
) -> Datasheet:
    """Read a YAML file of N, B and K, each a number with its unit, by sensor or channel.

    Parameters
    ----------
    path : path-like
    channels : dict of str to str, optional
        Channel name -> quantity. Without them a name may be of any axis, such as gyro_x.

    Raises InputError if it cannot be read or has anything else.
    """
    content = read_yaml(path)
    if not isinstance(content, dict) or not content:
        raise InputError(f"{path}: holds no sensors: begin with 'gyro:' or 'accel:', and {_HINT}")
    if channels is None:
        kinds = {name: name.partition("_")[0] for name in content if isinstance(name, str)}
        channels = {name: kind for name, kind in kinds.items() if kind in SI_UNIT}
    known = {**{quantity: quantity for quantity in SI_UNIT}, **channels}
    entries: dict[str, dict[str, float]] = {}
    for name, values in content.items():
        if not isinstance(name, str) or name not in known:
            raise InputError(
                f"{path}: {shown(name)} is not a sensor of the recording; there are "
                f"{', '.join(known)}"
            )
        if not isinstance(values, dict):
            raise InputError(f"{path}: {name} has no numbers: {_HINT}")
        entries[name] = {
            str(key): _value(f"{path}: {name}", key, value, known[name])
            for key, value in values.items()
        }
    return Datasheet(Path(path).name, entries)


def _value(where: str, key: Any, value: Any, quantity: str) -> float:
    if key not in UNITS:
        raise InputError(f"{where}: {shown(key)} is not one of {', '.join(UNITS)}: {_HINT}")
    found = _VALUE.fullmatch(value) if isinstance(value, str) else None
    try:
        if found is None:
            raise ValueError
        number = float(found[1])
    except ValueError:
        raise InputError(
            f"{where}: {key} = {shown(value)} is not a number with a unit: {_HINT}"
        ) from None
    unit = si_parameter_unit(UNITS[key], quantity)
    si = number * factor(found[2], unit)
    if not (np.isfinite(si) and si > 0.0):
        raise InputError(f"{where}: {key} = {value[:40]} is not positive: give a positive number")
    return si
