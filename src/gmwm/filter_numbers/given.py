"""Numbers in use: as somebody gives them, or as the file of a program holds them."""

from __future__ import annotations

import contextlib
import json
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm._core.units import factor
from gmwm.errors import InputError
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.result import FilterNumbers, SensorNumbers
from gmwm.process import GaussMarkov, Model, Process, RandomWalk, WhiteNoise, as_model

Pair = tuple[float, float]
"""N and K."""

Given = FilterNumbers | SensorNumbers | Mapping[str, Any]
"""Numbers of all axes, or by axis or kind (gyro, accel): `FilterNumbers`, a model, or N and K."""


@dataclass(frozen=True)
class _Walk:
    """Keys of gyro N and K and accelerometer N and K, and what a value is worth.

    At a rate f (that of the IMU, or a given one) it is N sqrt(white f) and K sqrt(walk f), or N and
    K where these are zero, to a power. Sources: the same as in gmwm.export.
    """

    keys: tuple[str, str, str, str]
    white: float = 0.0
    walk: float = 0.0
    power: int = 1
    rate: float | None = None

    def numbers(self, values: Mapping[str, FloatArray], rate: float) -> list[list[Any]]:
        """Gyro and accelerometer: N and K of one axis for all, or of three."""
        f = self.rate or rate
        if self.white > 0.0 and not f > 0.0:
            raise InputError("its numbers depend on the rate of the IMU: give it in Hz")
        scale = [np.sqrt(a * f) if a > 0.0 else 1.0 for a in (self.white, self.walk)] * 2
        own = [values[k] ** (1.0 / self.power) / each
               for k, each in zip(self.keys, scale, strict=True)]  # fmt: skip
        pairs = [np.broadcast_arrays(*own[i : i + 2]) for i in (0, 2)]
        return [[(float(N), float(K)) for N, K in zip(*pair, strict=True)] for pair in pairs]


@dataclass(frozen=True)
class _Memory:
    """Keys of N, sigma and tau of gyro and accelerometer, and what one of them is in SI."""

    keys: tuple[str, str, str, str, str, str]
    units: tuple[float, float, float, float, float, float]

    def numbers(self, values: Mapping[str, FloatArray], rate: float) -> list[list[Any]]:
        own = [values[key] * unit for key, unit in zip(self.keys, self.units, strict=True)]
        triples = [np.broadcast_arrays(*own[i : i + 3]) for i in (0, 3)]
        return [
            [WhiteNoise(float(N)) + GaussMarkov(float(sigma), float(tau))
             for N, sigma, tau in zip(*triple, strict=True)]
            for triple in triples
        ]  # fmt: skip


_ARW, _DEG_H, _VRW = factor("deg/sqrt(h)", "rad/sqrt(s)"), factor("deg/h", "rad/s"), 1.0 / 60.0

_LAYOUTS = (
    _Walk(("gyroscope_noise_density", "gyroscope_random_walk",
           "accelerometer_noise_density", "accelerometer_random_walk")),
    _Walk(("IMU.NoiseGyro", "IMU.GyroWalk", "IMU.NoiseAcc", "IMU.AccWalk")),
    _Walk(("imuGyrNoise", "imuGyrBiasN", "imuAccNoise", "imuAccBiasN")),
    _Walk(("sigma_g_c", "sigma_gw_c", "sigma_a_c", "sigma_aw_c")),
    _Walk(("gyro_noise_density", "gyro_bias_random_walk_noise_density",
           "acc_noise_density", "acc_bias_random_walk_noise_density")),
    _Walk(("gyro_noise_std", "gyro_bias_std", "accel_noise_std", "accel_bias_std")),
    _Walk(("gyr_n", "gyr_w", "acc_n", "acc_w"), 2.0, 1.0),
    _Walk(("gyr_cov", "b_gyr_cov", "acc_cov", "b_acc_cov"), 1.0, 1.0, 2),
    _Walk(("gyroscopeCovariance", "biasOmegaCovariance",
           "accelerometerCovariance", "biasAccCovariance"), power=2),
    _Walk(("EKF2_GYR_NOISE", "EKF2_GYR_B_NOISE", "EKF2_ACC_NOISE", "EKF2_ACC_B_NOISE"),
          1.0, 1.0, rate=1.0 / tuning.EKF2_INTERVAL),
    _Memory(("arw", "gbstd", "corrtime", "vrw", "abstd", "corrtime"),
            (_ARW, _DEG_H, 3600.0, _VRW, 1e-5, 3600.0)),
    _Memory(("gyro_arw", "gyro_b_stability", "gyro_b_corr",
             "accel_vrw", "accel_b_stability", "accel_b_corr"),
            (_ARW, _DEG_H, 1.0, _VRW, 1.0, 1.0)),
)  # fmt: skip

_RATES = ("update_rate", "IMU.Frequency")
_COMMENT = re.compile(r"(#|//).*$", re.MULTILINE)
_ENTRY = re.compile(
    r"""^\s*(?:\d+\s+\d+\s+)?(?:\w+->|\w+\.(?=set))?["']?([A-Za-z_][\w.]*)["']?\s*[:=(\t](.*)$""",
    re.MULTILINE,
)
_ALONE = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(?:,|\t\d+)?\s*")
_EACH = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?(?![\w.])")


def _lines(content: object) -> Iterator[str]:
    """A line for each key of JSON whose value is a number or three."""
    if not isinstance(content, dict):
        return
    for key, value in content.items():
        several = value if isinstance(value, list) else [value]
        if len(several) in (1, 3) and all(map(checks.is_number, several)):
            yield f"{key}: {several if len(several) == 3 else several[0]}"
        yield from _lines(value)


def _entries(text: str) -> dict[str, FloatArray]:
    """Values of keys: one number, or three."""
    values: dict[str, FloatArray] = {}
    # A list of JSON may have a line for each number.
    with contextlib.suppress(ValueError, RecursionError):
        text = "\n".join(_lines(json.loads(text)))
    for name, rest in _ENTRY.findall(_COMMENT.sub("", text)):
        alone = _ALONE.fullmatch(rest)
        found = [alone[1]] if alone else _EACH.findall(rest)
        if len(found) not in (1, 3) or (len(found) == 1 and not alone):
            continue
        # A setter is called as what it sets.
        key = name[3].lower() + name[4:] if re.match(r"set[A-Z]", name) else name
        try:
            values[key] = np.array([float(each) for each in found])
        except ValueError:
            continue
    return values


def read_numbers(
    path: str | os.PathLike[str], rate: float | None = None
) -> dict[str, Pair | Model]:
    """The numbers of gyro and accelerometer in a program's file.

    path: Of Kalibr, OpenVINS, Kimera and others with their keys, VINS-Mono and VINS-Fusion,
        ORB-SLAM3, FAST-LIO, LIO-SAM, OKVIS2, maplab, Basalt, PX4 (EKF2 at its usual interval),
        GTSAM (Python, C++), KF-GINS and gnss-ins-sim.
    rate: Of the IMU, Hz, for programs whose numbers depend on it; by default the file's own.
    Returns: "gyro" and "accel", or each of the axes ("gyro_x" to "accel_z") where they differ -> N
        (u/sqrt(Hz)) and K (u/s/sqrt(Hz)), or a model with a Gauss-Markov process.
    Raises InputError if the file cannot be read, has no known keys, or its numbers need a rate.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read ({error}): check the path") from None
    values = _entries(text)
    for layout in _LAYOUTS:
        if not any(key in values for key in layout.keys):
            continue
        missing = [key for key in layout.keys if key not in values]
        if missing:
            raise InputError(f"{path}: {missing[0]} is missing: add it")
        wrong = [key for key in layout.keys if not np.all(values[key] > 0.0)]
        if wrong:
            raise InputError(
                f"{path}: {wrong[0]} = {values[wrong[0]][0]:g}: give a positive number"
            )
        f = rate or next((float(values[key][0]) for key in _RATES if key in values), 0.0)
        try:
            found = layout.numbers(values, f)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        names = ("gyro", "accel")
        return {
            f"{name}_{axis}" if axis else name: item
            for name, items in zip(names, found, strict=True)
            for axis, item in zip(("x", "y", "z") if len(items) == 3 else ("",), items, strict=True)
        }
    known = "; ".join(", ".join(layout.keys[:2]) for layout in _LAYOUTS)
    raise InputError(f"{path}: has no noise parameters by names known here ({known}): give N and K")


def in_use(given: Given, name: str, quantity: str, horizon: float, start: float) -> FilterNumbers:
    """The numbers of one axis.

    name: Of the channel.
    quantity: Its kind.
    horizon: s, of numbers that name none.
    start: Standard deviation of the bias at the start, of numbers that name none, u.
    Raises InputError if there are none for this axis.
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
