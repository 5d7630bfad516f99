"""A consumer of the numbers: the keys of its file, what it says of them, how it is put together."""

from __future__ import annotations

import contextlib
import json
import os
import re
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core import checks
from gmwm._core.files import write_text
from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.export.imu import ImuNumbers, Triad, imu_of, numbers_for
from gmwm.filter_numbers import FORMS, usable
from gmwm.process import GaussMarkov, Model, WhiteNoise

if TYPE_CHECKING:
    from jinja2 import Template


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


def entries(text: str) -> tuple[dict[str, FloatArray], set[str]]:
    """Values of a file by their keys, one number or three, and the keys that have several values.

    Of YAML, JSON, Python, C++ and parameter files, without knowing which it is.
    """
    values, ambiguous = dict[str, FloatArray](), set[str]()
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
                value = np.array([float(each) for each in found])
                if not np.array_equal(values.setdefault(key, value), value):
                    ambiguous.add(key)
    return values, ambiguous


def _json_lines(content: object) -> Iterator[str]:
    """A line for each key of JSON whose value is a number or three."""
    if not isinstance(content, dict):
        return
    for key, value in content.items():
        several = value if isinstance(value, list) else [value]
        if len(several) in (1, 3) and all(map(checks.is_number, several)):
            yield f"{key}: {several if len(several) == 3 else several[0]}"
        yield from _json_lines(value)


WIDTH = 72
"""Columns of a line of comment, 80 with the marks of the languages around it."""

MOST = 6
"""Lines of comment in a file."""

_LONGEST = 500  # characters of one remark or name

_UNITS = {
    ("gyro", "N"): "rad/s/sqrt(Hz)",
    ("gyro", "K"): "rad/s^2/sqrt(Hz)",
    ("accel", "N"): "m/s^2/sqrt(Hz)",
    ("accel", "K"): "m/s^3/sqrt(Hz)",
}

_HOW = {
    "bound": "the smallest that are never overconfident for the error models",
    "reduce": "by gmwm.reduce, consistent on average, since no N+GM covers a random walk",
    "given": "given, not from a recording",
    "motion": "with them errors in motion grow no faster than predicted between updates",
}


def plain(text: str) -> str:
    """A foreign text on one line, without characters that a parser might stop at.

    Line ends of every kind become blanks; other control characters, and a backslash, which
    continues a C++ comment on the next line, become question marks.
    """
    line = " ".join(text.split())[:_LONGEST]
    return "".join(c if c.isprintable() and c != "\\" else "?" for c in line)


def wrapped(text: str) -> list[str]:
    """A text in lines that are at most 80 columns wide in every file."""
    return textwrap.wrap(
        text, WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )


def comment(lines: Sequence[str], mark: str) -> list[str]:
    """Lines as comments of a language: those that begin with ``mark``, or XML for ``<!--``."""
    if mark == "<!--":
        # XML forbids two hyphens inside.
        inside = "\n     ".join(lines).replace(" --", " ").replace("--", "- -")
        return f"<!-- {inside} -->".splitlines()
    return [f"{mark} {line}".rstrip() for line in lines]


def notes(imu: ImuNumbers, title: str, caution: str) -> list[str]:
    """The lines of comment in a file: what the numbers are, for what, and what to mind."""
    how = f", {imu.method}" if imu.method in ("reduce", "motion") else ""
    purpose = f"{imu.form} for outages up to {imu.horizon:g} s{how}"
    upper = [f"{t.quantity} {k}" for t in imu.triads for k in ("N", "K", "sigma") if t.is_upper(k)]
    slow = [triad.slowest for triad in imu.triads]
    covers = "; ".join(f"{axis.name} {axis.covers}" for axis in slow if axis.covers)
    notices = [n for triad in imu.triads for axis in triad.axes for n in axis.notices]
    is_short = any(n.code == "short-horizon" for n in notices)
    is_beyond = any(_has(triad, "beyond-record") for triad in imu.triads)
    unlikely = dict.fromkeys(n.where for n in notices if n.code == "unlikely-sheet")
    lines = [
        f"{title}: {' and '.join(imu.sources)}",
        f"{purpose}; see gmwm export --to NAME --explain",
        not_valid_line(imu.invalid) if imu.invalid else "",
        f"with reservation, steps or drifts may recur: {', '.join(imu.reserved)}"
        if imu.reserved
        else "",
        "record too short: use N alone, not K and the start bias" if is_beyond else "",
        "do not use: below a second N and K describe the sensor's low-pass" if is_short else "",
        f"unlikely, check the units of the sheet: {', '.join(unlikely)}" if unlikely else "",
        caution,
        _consistency(imu),
        _start(imu),
        f"95 % upper limit, no such term was found: {', '.join(upper)}" if upper else "",
        f"N, K also cover {covers}" if covers else "",
        "for a filter with a Gauss-Markov state: gmwm bound --form N+K+GM"
        if any(n.code == "loose-form" and n.hint for n in notices)
        else "",
    ]
    return [_fitting(line) for line in lines if line][:MOST]


def _has(triad: Triad, code: str) -> bool:
    return any(notice.code == code for axis in triad.axes for notice in axis.notices)


def not_valid_line(invalid: Mapping[str, str]) -> str:
    """One line about axes that are not valid, with the reasons if they fit."""
    reasons = ", ".join(f"{name} ({why})" for name, why in invalid.items())
    text = "not valid, do not use: "
    return text + (reasons if len(text + reasons) <= WIDTH else ", ".join(invalid))


def _fitting(text: str) -> str:
    """A text on one line."""
    line = plain(text)
    if len(line) > WIDTH:
        line = line.replace("Gauss-Markov", "GM")
    return line if len(line) <= WIDTH else f"{line[: WIDTH - 3].rstrip()}..."


def _start(imu: ImuNumbers) -> str:
    if not any(triad.initial_sd for triad in imu.triads):
        return "add your turn-on bias to the bias at the start"
    values = [
        f"{triad.quantity} {triad.initial_sd:.2e} {SI_UNIT[triad.quantity]}"
        for triad in imu.triads
        if triad.initial_sd
    ]
    lacking = [t.quantity for t in imu.triads if not any(axis.turn_on_sd for axis in t.axes)]
    which = f"{lacking[0]} turn-on" if len(lacking) == 1 else "turn-on bias"
    return f"start bias {', '.join(values)}" + f", plus {which}" * bool(lacking)


def _consistency(imu: ImuNumbers) -> str:
    """Range of the NEES of each sensor at the horizon; empty if unknown."""
    parts = []
    for triad in imu.triads:
        by_axis = (triad.shared_nees or {}).values()
        found = by_axis if triad.shared_nees is not None else [axis.nees for axis in triad.axes]
        values = [each.get(imu.horizon, np.nan) for each in found]
        if np.all(np.isfinite(values)):
            ends = dict.fromkeys(f"{end(values):.3g}" for end in (min, max))
            parts.append(f"{triad.quantity} {' to '.join(ends)}")
    if not parts and imu.method == "motion":
        return "NEES at most 1 in these flights; for other flights: gmwm certify --motion"
    if not parts:
        return "NEES unknown: the file holds other numbers; export the calibration"
    return f"NEES at {imu.horizon:g} s: {', '.join(parts)}; 1: consistent"


def purpose(imu: ImuNumbers) -> list[str]:
    """What the numbers are for, how they were found, and what to mind, as texts."""
    texts = [f"{imu.form} for outages up to {imu.horizon:g} s; {_HOW[imu.method]}"]
    if imu.invalid:
        why = ", ".join(f"{name} ({reason})" for name, reason in imu.invalid.items())
        texts.append(plain(f"not valid, do not use: {why}"))
    if max(imu.gyro.rate, imu.accel.rate) > min(imu.gyro.rate, imu.accel.rate):
        texts.append(
            f"gyros at {imu.gyro.rate:.6g} Hz, accelerometers at {imu.accel.rate:.6g} Hz: the rate "
            "of the file is the higher, of a message that holds both"
        )
    return texts


@dataclass(frozen=True)
class Target(ABC):
    """A file that some program reads; export.toml says what the attributes are.

    keys: By which the numbers are read back; None if they cannot be.
    """

    name: str
    title: str
    file: str
    convention: str
    source: str
    form: str = "N+K"
    caution: str = ""
    warnings: tuple[str, ...] = ()
    file_name: str = ""
    to_copy: str = ""
    keys: WalkKeys | MemoryKeys | None = None

    @abstractmethod
    def export(self, given: Sequence[Any], horizon: float | None, form: str | None) -> str:
        """The file of calibrations or of numbers.

        Raises InputError if they lack something that the file needs.
        """

    @abstractmethod
    def explain(
        self, given: Sequence[Any], horizon: float | None = None, form: str | None = None
    ) -> str:
        """What the values of the file are and mean; errors as of `export`."""

    def about(self) -> list[str]:
        """Name, caution, warnings and convention, as texts."""
        texts = [self.caution, *self.warnings, f"{self.convention} ({self.source})"]
        return [f"{self.title}, {self.file}", *filter(None, texts)]

    def save(
        self, path: str | os.PathLike[str], given: Sequence[Any], horizon: float | None, form: Any
    ) -> str:
        """Write the file whole or not at all; returns its text."""
        text = self.export(given, horizon, form)
        write_text(path, text)
        return text


@dataclass(frozen=True)
class ImuFile(Target):
    """Numbers of gyros and accelerometers, below comments that say what they are."""

    shared: bool = False
    one_tau: bool = False
    mark: str = "#"
    head: tuple[str, ...] = ()
    line: str = "{key}: {value:.6e}  # {unit}"
    most: Mapping[str, float] = field(default_factory=dict)
    template: str = ""

    def body(self, imu: ImuNumbers) -> str:
        """What stands below the comments.

        The template can use the numbers (imu, gyro, accel), the name of the topic, the ``units`` of
        `MemoryKeys`, and the functions ``values``, a line for each of `WalkKeys`, and ``rate``.
        """
        text = compiled_template(self.template).render(
            imu=imu,
            gyro=imu.gyro,
            accel=imu.accel,
            topic=imu.topic or "/imu0  # set to the topic of your bag",
            units=self.keys.units if isinstance(self.keys, MemoryKeys) else (),
            values=partial(self._values, imu),
            rate=partial(_rate, imu),
        )
        return text.rstrip("\n")

    def _values(self, imu: ImuNumbers) -> str:
        """Lines of N and K of accelerometers and gyros."""
        keys, (gyro, accel) = self.keys, imu.triads
        assert isinstance(keys, WalkKeys)
        rate, lines = imu.rate if keys.needs_rate else float("nan"), list[str]()
        beyond = list[str]()
        triads = (gyro, gyro, accel, accel)
        for key, letter, triad in zip(keys.names, "NKNK", triads, strict=True):
            value = keys.written(letter, getattr(triad, letter), rate)
            unit = _UNITS[triad.quantity, letter]
            unit = unit.removesuffix("/sqrt(Hz)") if keys.white else unit
            unit = f"({unit})^2" if keys.power == 2 else unit
            if any(axis.name in imu.invalid for axis in triad.axes):
                unit += ", do not use: not valid"
            elif letter == "K" and _has(triad, "beyond-record"):
                unit += ", do not use: record too short"
            lines.append(self.line.format(key=key, value=value, unit=unit))
            if value > self.most.get(key, value):
                limit = f"{self.title} takes at most {self.most[key]:g} as {key}: enter that"
                beyond.append(f"{self.mark} {limit}")
        return "\n".join([*lines[2:], *lines[:2], *beyond])

    def text(self, imu: ImuNumbers) -> str:
        """The whole file."""
        lines = comment(notes(imu, self.title, self.caution), self.mark)
        return "\n".join([*self.head, *lines, self.body(imu)]) + "\n"

    def export(self, given: Sequence[Any], horizon: float | None, form: str | None) -> str:
        return self.text(self._imu(given, horizon, form))

    def explain(
        self, given: Sequence[Any], horizon: float | None = None, form: str | None = None
    ) -> str:
        imu = self._imu(given, horizon, form)
        parts = [
            "\n".join(line for each in [*self.about(), *purpose(imu)] for line in wrapped(each))
        ]
        if self.shared:
            parts.append("The same for all axes of a sensor, as in the file:")
            own = [each for each in given if isinstance(each, Calibration)]
            parts += [usable(each, self.form, imu.horizon, shared=True).text("si") for each in own]
            parts.append("Each axis by itself (not in the file):")
        sources = numbers_for(given, self.form, horizon, self.one_tau)
        return "\n\n".join([*parts, *(each.text("si") for each in sources)]) + "\n"

    def _imu(self, given: Sequence[Any], horizon: float | None, form: str | None) -> ImuNumbers:
        if form is not None and checks.choice("form", form, FORMS) != self.form:
            raise InputError(f"form {form}: {self.title} takes {self.form} only")
        try:
            return imu_of(given, self.form, horizon, shared=self.shared, one_tau=self.one_tau)
        except InputError as error:
            raise InputError(f"{self.title}: {error}", error.code) from None


def _rate(imu: ImuNumbers) -> str:
    """Rate of the IMU, Hz, with a point, since OpenCV distinguishes whole numbers from others."""
    shown = f"{imu.rate:.9g}"
    return shown if "." in shown or "e" in shown else f"{shown}.0"


@cache
def compiled_template(text: str) -> Template:
    """A template of Jinja; importing that takes a while."""
    from jinja2 import Environment, StrictUndefined

    return Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True).from_string(
        text.removeprefix("\n")
    )


class JsonFile(ImuFile):
    """A file in JSON, whose comments are an entry of their own at the end."""

    def text(self, imu: ImuNumbers) -> str:
        comments = notes(imu, self.title, self.caution)
        return json_text({**json.loads(self.body(imu)), "comment": comments}) + "\n"


def json_text(value: Any, indent: str = "") -> str:
    """JSON with an entry, or a line of text, on each line; matrices on one."""
    inner = indent + "  "
    if isinstance(value, dict):
        lines = [
            f"{inner}{json.dumps(key)}: {json_text(each, inner)}" for key, each in value.items()
        ]
        return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
    if isinstance(value, list) and value and all(isinstance(each, str) for each in value):
        return "[\n" + ",\n".join(inner + json.dumps(each) for each in value) + f"\n{indent}]"
    return json.dumps(value, allow_nan=False)
