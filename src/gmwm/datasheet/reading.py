"""Reading what a data sheet states, from YAML or from the sheets that are installed."""

import os
import re
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm._core.checks import shown
from gmwm._core.documents import read_yaml
from gmwm._core.units import SI_UNIT, factor, si_parameter_unit
from gmwm.datasheet.sheet import KEYS, Datasheet
from gmwm.errors import InputError

_WORDS = {
    "angle_random_walk": "N",
    "velocity_random_walk": "N",
    "bias_instability": "B",
    "rate_random_walk": "K",
}
_VALUE = re.compile(r"\s*([-+.\deE]+)\s+(\S.*?)(?:\s+\((.+)\))?\s*")
_ABOUT = ("name", "document", "temperature")
_HINT = "write it like 'N: 0.15 deg/sqrt(h)', 'B: 7 deg/h'"
_RMS = "rms_noise with bandwidth"
_ALIKE = (
    ("N", "noise_density", 0.84),
    ("N", _RMS, 0.63),
    ("noise_density", _RMS, 0.9),
    ("lowest_deviation", "B", 0.664),
)
"""Two that say one thing, and the usual ratio of the first to the second."""
_SHEETS = files("gmwm.datasheet").joinpath("sheets")


def datasheet(source: str | os.PathLike[str] | Mapping[str, Any]) -> Datasheet:
    """Read what a data sheet states.

    Parameters
    ----------
    source : str, path-like or mapping
        A sensor of `sheets`, a YAML file, or its content: by "gyro", "accel" or channel, values
        with their units, such as ``{"gyro": {"N": "0.15 deg/sqrt(h)", "B": "7 deg/h"}}``. The page
        may follow in brackets: ``7 deg/h (p. 3)``. Keys:

        N, angle_random_walk, velocity_random_walk
            Where the Allan deviation is N / sqrt(tau).
        noise_density
            One-sided, such as deg/s/sqrt(Hz): N is between this over sqrt(2) and, where it was
            read off an Allan plot, this.
        rms_noise, bandwidth
            From which the noise density follows.
        B, bias_instability
            Of IEEE Std 952: the lowest Allan deviation over 0.664.
        lowest_deviation
            Where the sheet calls the lowest point itself bias instability.
        K, rate_random_walk
        correlation_time
            Of a Gauss-Markov process.
        turn_on_bias
            1 sigma.

        The content can also have texts: name, document, temperature (such as "-40 to 85 degC").

    Returns
    -------
    Datasheet

    Raises
    ------
    InputError
        If there is no such sensor or file, or it states anything else.
    """
    if isinstance(source, Mapping):
        return _read("the data sheet", dict(source), None)
    if isinstance(source, str) and source.lower() in sheets():
        source = str(_SHEETS.joinpath(f"{source.lower()}.yaml"))
    elif isinstance(source, str) and re.fullmatch(r"[\w-]+", source) and not Path(source).exists():
        known = ", ".join(sheets())
        raise InputError(f"no data sheet of {source!r}: give a YAML file, or one of {known}")
    return read_datasheet(source)


def sheets() -> tuple[str, ...]:
    """Sensors whose data sheets are installed with the package."""
    names = (each.name.removesuffix(".yaml") for each in _SHEETS.iterdir())
    return tuple(sorted(name for name in names if not name.startswith("_")))


def read_datasheet(
    path: str | os.PathLike[str], channels: dict[str, str] | None = None
) -> Datasheet:
    """Read a YAML file of what a data sheet states; see `datasheet`.

    channels: Channel name -> quantity. Without them a name may be of any axis, such as gyro_x.
    Raises InputError if it cannot be read or has anything else.
    """
    return _read(str(path), read_yaml(path), channels)


def _read(place: str, content: Any, channels: dict[str, str] | None) -> Datasheet:
    if not isinstance(content, dict):
        content = {}
    about = {key: str(content.pop(key)) for key in _ABOUT if key in content}
    if not content:
        raise InputError(f"{place}: holds no sensors: begin with 'gyro:' or 'accel:', and {_HINT}")
    if channels is None:
        kinds = {name: name.partition("_")[0] for name in content if isinstance(name, str)}
        channels = {name: kind for name, kind in kinds.items() if kind in SI_UNIT}
    known = {**{quantity: quantity for quantity in SI_UNIT}, **channels}
    entries: dict[str, dict[str, float]] = {}
    pages: dict[str, dict[str, str]] = {}
    for name, values in content.items():
        if not isinstance(name, str) or name not in known:
            raise InputError(
                f"{place}: {shown(name)} is not a sensor here: write one of {', '.join(known)}"
            )
        if not isinstance(values, dict):
            raise InputError(f"{place}: {name} needs numbers with names: {_HINT}")
        found = [
            _value(f"{place}: {name}", key, value, known[name]) for key, value in values.items()
        ]
        entries[name] = {key: value for key, value, _ in found}
        pages[name] = {key: page for key, _, page in found if page}
        if len(entries[name]) < len(found):
            raise InputError(f"{place}: {name} states a number twice: leave one out")
        stated = dict(entries[name])
        if {"rms_noise", "bandwidth"} <= {*stated}:
            stated[_RMS] = stated["rms_noise"] / np.sqrt(stated["bandwidth"])
        for first, second, usual in _ALIKE:
            ratio = stated.get(first, usual) / stated.get(second, 1.0) / usual
            if {first, second} <= {*stated} and not 0.5 <= ratio <= 2.0:
                raise InputError(
                    f"{place}: {name}: {first} and {second} contradict each other by a factor of "
                    f"{max(ratio, 1.0 / ratio):.3g}: leave one out"
                )
    about.setdefault("name", Path(place).name)
    return Datasheet(entries=entries, pages=pages, **about)


def _value(where: str, key: Any, value: Any, quantity: str) -> tuple[str, float, str]:
    """Key, number in SI and page."""
    letter = _WORDS.get(key, key) if isinstance(key, str) else ""
    if letter not in KEYS:
        raise InputError(f"{where}: {shown(key)} is not one of {', '.join(KEYS)}: {_HINT}")
    found = _VALUE.fullmatch(value) if isinstance(value, str) else None
    try:
        if found is None:
            raise ValueError
        number = float(found[1])
    except ValueError:
        raise InputError(
            f"{where}: {key} = {shown(value)} is not a number with a unit: {_HINT}"
        ) from None
    try:
        si = number * factor(found[2], si_parameter_unit(KEYS[letter], quantity))
    except InputError as error:
        raise InputError(f"{where}: {key}: {error}") from None
    if not 0.0 < si <= checks.LARGEST:
        raise InputError(f"{where}: {key} = {value[:40]}: give a positive number of plausible size")
    return letter, si, found[3] or ""
