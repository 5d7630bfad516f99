"""Numbers in use: as somebody gives them, or as the file of a program holds them."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm.errors import InputError
from gmwm.filter_numbers.result import FilterNumbers, SensorNumbers
from gmwm.process import Model, Process, RandomWalk, WhiteNoise, as_model

Pair = tuple[float, float]
"""N and K."""

Given = FilterNumbers | SensorNumbers | Mapping[str, Any]
"""Numbers of all axes, or by axis or kind (gyro, accel): `FilterNumbers`, a model, or N and K."""

# Keys of gyro N and K, accelerometer N and K; what a value is worth at a rate f: N as N sqrt(a f),
# K as K sqrt(b f), or the squares of these. Sources: the same as in gmwm.export.
_LAYOUTS = (
    (("gyroscope_noise_density", "gyroscope_random_walk",
      "accelerometer_noise_density", "accelerometer_random_walk"), 0.0, 0.0, 1),
    (("IMU.NoiseGyro", "IMU.GyroWalk", "IMU.NoiseAcc", "IMU.AccWalk"), 0.0, 0.0, 1),
    (("imuGyrNoise", "imuGyrBiasN", "imuAccNoise", "imuAccBiasN"), 0.0, 0.0, 1),
    (("gyr_n", "gyr_w", "acc_n", "acc_w"), 2.0, 1.0, 1),
    (("gyr_cov", "b_gyr_cov", "acc_cov", "b_acc_cov"), 1.0, 1.0, 2),
)  # fmt: skip

_RATES = ("update_rate", "IMU.Frequency")
_ENTRY = re.compile(r"^\s*([A-Za-z_][\w.]*)\s*:\s*([-+.\deE]+)\s*(?:#.*)?$", re.MULTILINE)


def read_numbers(path: str | os.PathLike[str], rate: float | None = None) -> dict[str, Pair]:
    """N and K of gyro and accelerometer in a program's file.

    Parameters
    ----------
    path : path-like
        Of Kalibr, OpenVINS and others with their keys, VINS-Mono and VINS-Fusion, ORB-SLAM3,
        FAST-LIO, LIO-SAM.
    rate : float, optional
        Of the IMU, Hz, for programs whose numbers depend on it; by default the file's own.

    Returns
    -------
    dict
        "gyro" and "accel" -> N (u/sqrt(Hz)) and K (u/s/sqrt(Hz)).

    Raises
    ------
    InputError
        If the file cannot be read, has no known keys, or its numbers need a rate.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error}): check the path") from None
    values: dict[str, float] = {}
    for name, number in _ENTRY.findall(text):
        try:
            values[name] = float(number)
        except ValueError:
            continue
    for keys, white, walk, power in _LAYOUTS:
        found = [key for key in keys if key in values]
        if not found:
            continue
        missing = [key for key in keys if key not in values]
        if missing:
            raise InputError(f"{path}: {missing[0]} is missing: add it")
        wrong = [key for key in keys if not values[key] > 0.0]
        if wrong:
            raise InputError(f"{path}: {wrong[0]} = {values[wrong[0]]:g}: give a positive number")
        f = rate or next((values[key] for key in _RATES if key in values), 0.0)
        if white > 0.0 and not f > 0.0:
            raise InputError(f"{path}: its numbers depend on the rate of the IMU: give it in Hz")
        scale = [np.sqrt(a * f) if a > 0.0 else 1.0 for a in (white, walk)] * 2
        numbers = [
            float(values[key] ** (1.0 / power) / each)
            for key, each in zip(keys, scale, strict=True)
        ]
        return {"gyro": (numbers[0], numbers[1]), "accel": (numbers[2], numbers[3])}
    known = "; ".join(", ".join(layout[0][:2]) for layout in _LAYOUTS)
    raise InputError(f"{path}: has no noise parameters by names known here ({known}): give N and K")


def in_use(given: Given, name: str, quantity: str, horizon: float, start: float) -> FilterNumbers:
    """The numbers of one axis.

    Parameters
    ----------
    given : FilterNumbers, SensorNumbers or mapping
    name : str
        Of the channel.
    quantity : str
        Its kind.
    horizon : float
        s, of numbers that name none.
    start : float
        Standard deviation of the bias at the start, of numbers that name none, u.

    Raises
    ------
    InputError
        If there are none for this axis.
    """
    item: Any = given
    if isinstance(given, Mapping):
        kind = quantity or name
        if name not in given and kind not in given:
            raise InputError(
                f"there are no numbers for {name or 'the axis'}: give them by axis, or for "
                f"{kind or 'gyro and accel'}"
            )
        item = given[name] if name in given else given[kind]
    if isinstance(item, FilterNumbers):
        return item
    if isinstance(item, Process | Model):
        model = as_model(item)
    elif isinstance(item, tuple | list) and len(item) == 2:
        N, K = (checks.positive(f"N and K of {name or quantity or 'the axis'}", v) for v in item)
        model = WhiteNoise(N) + RandomWalk(K)
    else:
        raise InputError(
            f"{checks.shown(item)} is not what a filter believes: give N and K, a model, or what "
            "gmwm.bound returns"
        )
    kinds = {type(term).__name__ for term in model.terms}
    number = sum(type(term).__name__ == "GaussMarkov" for term in model.terms)
    form = "N" + "+K" * ("RandomWalk" in kinds) + {0: "", 1: "+GM", 2: "+2GM"}.get(number, "+?")
    return FilterNumbers(form, model, horizon, start, "given", quantity=quantity)
