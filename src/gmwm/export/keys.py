"""Keys of files of programs: what a value means, to write a file and to read it back."""

from __future__ import annotations

import contextlib
import json
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process import GaussMarkov, Model, WhiteNoise

Pair = tuple[float, float]
"""N and K."""


@dataclass(frozen=True)
class Keys(ABC):
    """Names of the values of a file, with blanks between: of the gyros, then of accelerometers."""

    text: str

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.text.split())

    @abstractmethod
    def read(self, values: Mapping[str, FloatArray], rate: float) -> list[list[Pair | Model]]:
        """Numbers of gyro and accelerometer, of one axis for all or of three.

        values: By name, of one axis or of three.
        rate: Of the IMU, Hz; zero if unknown.
        Raises InputError if they depend on a rate that is not known.
        """

    @staticmethod
    def by_axis(own: Sequence[FloatArray], item: Callable[..., Pair | Model]) -> list[list[Any]]:
        """The items of gyro and accelerometer, of the SI values of each name."""
        half = len(own) // 2
        sensors = (np.broadcast_arrays(*each) for each in (own[:half], own[half:]))
        return [[item(*map(float, axis)) for axis in zip(*one, strict=True)] for one in sensors]


@dataclass(frozen=True)
class WalkKeys(Keys):
    """N and K: a value is ``(N sqrt(white f))^power``, and likewise of K with ``walk``.

    text: Of gyro N and K, then accelerometer N and K.
    white, walk: Factors of the rate f; zero where a value does not depend on it.
    rate: f, Hz, if it is not that of the IMU.
    """

    white: float = 0.0
    walk: float = 0.0
    power: int = 1
    rate: float | None = None

    @property
    def needs_rate(self) -> bool:
        """Whether values depend on the rate of the IMU."""
        return self.white > 0.0 and self.rate is None

    def _scale(self, letter: str, rate: float) -> float:
        share = self.white if letter == "N" else self.walk
        return sqrt(share * (self.rate or rate)) if share > 0.0 else 1.0

    def written(self, letter: str, value: float, rate: float) -> float:
        """The value in the file of N or K."""
        return (value * self._scale(letter, rate)) ** self.power

    def read(self, values: Mapping[str, FloatArray], rate: float) -> list[list[Pair | Model]]:
        if self.needs_rate and not rate > 0.0:
            raise InputError("its numbers depend on the IMU's rate: give the rate in Hz")
        own = [
            values[name] ** (1.0 / self.power) / self._scale(letter, rate)
            for name, letter in zip(self.names, "NKNK", strict=True)
        ]
        return self.by_axis(own, lambda N, K: (N, K))


@dataclass(frozen=True)
class MemoryKeys(Keys):
    """N, sigma and tau of gyro and accelerometer, and their units in SI."""

    units: tuple[float, ...]

    def read(self, values: Mapping[str, FloatArray], rate: float) -> list[list[Pair | Model]]:
        own = [values[name] * unit for name, unit in zip(self.names, self.units, strict=True)]
        return self.by_axis(own, lambda N, sigma, tau: WhiteNoise(N) + GaussMarkov(sigma, tau))


_COMMENT = re.compile(r"(#|//).*$", re.MULTILINE)
_ENTRY = re.compile(
    # Blanks, not line ends: where each line may begin with those of the next, time is squared.
    r"""^[ \t]*(?:\d+[ \t]+\d+[ \t]+)?(?:\w+->|\w+\.(?=set))?"""
    r"""["']?([A-Za-z_][\w.]*)["']?[ ]*[:=(\t](.*)$""",
    re.MULTILINE,
)
_ALONE = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(?:,|\t\d+)?\s*")
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w.])")


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
