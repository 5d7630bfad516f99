"""Keys of files of programs: what a value means, to write a file and to read it back."""

from __future__ import annotations

import contextlib
import json
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import sqrt

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm._core.units import factor
from gmwm.errors import InputError
from gmwm.process import GaussMarkov, Model, WhiteNoise

Pair = tuple[float, float]
"""N and K."""

ARW, DEG_H = factor("deg/sqrt(h)", "rad/sqrt(s)"), factor("deg/h", "rad/s")
"""SI units in deg/sqrt(h) and deg/h."""


class Keys(ABC):
    """Names of the values of a file: those of the gyros, then those of the accelerometers."""

    names: tuple[str, ...]

    @abstractmethod
    def read(self, values: Mapping[str, FloatArray], rate: float) -> list[list[Pair | Model]]:
        """Numbers of gyro and accelerometer, of one axis for all or of three.

        values: By name, of one axis or of three.
        rate: Of the IMU, Hz; zero if unknown.
        Raises InputError if they depend on a rate that is not known.
        """


@dataclass(frozen=True)
class WalkKeys(Keys):
    """N and K: a value is ``(N sqrt(white f))^power``, and likewise of K with ``walk``.

    names: Of gyro N and K, then accelerometer N and K.
    white, walk: Factors of the rate f; zero where a value does not depend on it.
    rate: f, Hz, if it is not that of the IMU.
    """

    names: tuple[str, str, str, str]
    white: float = 0.0
    walk: float = 0.0
    power: int = 1
    rate: float | None = None

    @property
    def needs_rate(self) -> bool:
        """Whether values depend on the rate of the IMU."""
        return self.white > 0.0 and self.rate is None

    def written(self, letter: str, value: float, rate: float) -> float:
        """The value in the file of N or K."""
        share = self.white if letter == "N" else self.walk
        scale = sqrt(share * (self.rate or rate)) if share > 0.0 else 1.0
        return (value * scale) ** self.power

    def read(self, values: Mapping[str, FloatArray], rate: float) -> list[list[Pair | Model]]:
        f = self.rate or rate
        if self.white > 0.0 and not f > 0.0:
            raise InputError("its numbers depend on the rate of the IMU: give it in Hz")
        scales = [sqrt(share * f) if share > 0.0 else 1.0 for share in (self.white, self.walk)] * 2
        own = [
            values[name] ** (1.0 / self.power) / scale
            for name, scale in zip(self.names, scales, strict=True)
        ]
        pairs = [np.broadcast_arrays(*own[i : i + 2]) for i in (0, 2)]
        return [[(float(N), float(K)) for N, K in zip(*pair, strict=True)] for pair in pairs]


@dataclass(frozen=True)
class MemoryKeys(Keys):
    """N, sigma and tau of gyro and accelerometer, and their units in SI."""

    names: tuple[str, str, str, str, str, str]
    units: tuple[float, float, float, float, float, float]

    def read(self, values: Mapping[str, FloatArray], rate: float) -> list[list[Pair | Model]]:
        own = [values[name] * unit for name, unit in zip(self.names, self.units, strict=True)]
        triples = [np.broadcast_arrays(*own[i : i + 3]) for i in (0, 3)]
        return [
            [
                WhiteNoise(float(N)) + GaussMarkov(float(sigma), float(tau))
                for N, sigma, tau in zip(*triple, strict=True)
            ]
            for triple in triples
        ]


_COMMENT = re.compile(r"(#|//).*$", re.MULTILINE)
_ENTRY = re.compile(
    r"""^\s*(?:\d+\s+\d+\s+)?(?:\w+->|\w+\.(?=set))?["']?([A-Za-z_][\w.]*)["']?\s*[:=(\t](.*)$""",
    re.MULTILINE,
)
_ALONE = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(?:,|\t\d+)?\s*")
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?(?![\w.])")


def entries(text: str) -> dict[str, FloatArray]:
    """Values of a file by their keys: one number, or three.

    Of YAML, JSON, Python, C++ and parameter files, without knowing which it is.
    """
    values: dict[str, FloatArray] = {}
    # A list of JSON may have a line for each number.
    with contextlib.suppress(ValueError, RecursionError):
        text = "\n".join(_json_lines(json.loads(text)))
    for name, rest in _ENTRY.findall(_COMMENT.sub("", text)):
        alone = _ALONE.fullmatch(rest)
        found = [alone[1]] if alone else _NUMBER.findall(rest)
        if len(found) == 3 or alone:
            # A setter is named after what it sets.
            key = name[3].lower() + name[4:] if re.match(r"set[A-Z]", name) else name
            with contextlib.suppress(ValueError):
                values[key] = np.array([float(each) for each in found])
    return values


def _json_lines(content: object) -> Iterator[str]:
    """A line for each key of JSON whose value is a number or three."""
    if not isinstance(content, dict):
        return
    for key, value in content.items():
        several = value if isinstance(value, list) else [value]
        if len(several) in (1, 3) and all(map(checks.is_number, several)):
            yield f"{key}: {several if len(several) == 3 else several[0]}"
        yield from _json_lines(value)
