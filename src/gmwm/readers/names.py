"""What a column's name says: which channel it is, and in what unit.

Names are cut into words (``AngularVelocity.x`` -> angular velocity x), so that separators, case
and the path before a name do not matter. A unit is what stands in brackets at the end
(``ax [m/s^2]``) or the last words (``gyro_x_dps``, ``time_us``).
"""

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from gmwm._core.files import toml_beside
from gmwm._core.units import Unit, auxiliary_unit, seconds_in, sensor_unit
from gmwm.errors import InputError

AXES = ("x", "y", "z")
CANONICAL = tuple(f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in AXES)
TIME = "time"  # role of a column of time stamps

_WORDS = toml_beside(__file__)
_TIME_WORDS, _BEFORE_TIME, NUMBERS_OF_SENSORS = (
    frozenset(_WORDS[key].split()) for key in ("time", "before_time", "numbers")
)
_NO_SAMPLES, _NO_SENSOR, _NO_AUXILIARY = (
    frozenset(_WORDS[key].split()) for key in ("no_samples", "no_sensor", "no_auxiliary")
)
_OTHER_MEANINGS = _NO_SAMPLES | _NO_SENSOR
_OTHER_AUXILIARY = _NO_SAMPLES | _TIME_WORDS | _NO_AUXILIARY


def _by_word(key: str) -> dict[str, str]:
    return {word: meant for meant, words in _WORDS[key].items() for word in words.split()}


_SENSOR_WORDS, _SENSOR_LETTERS = _by_word("sensor"), _by_word("sensor_letter")
_AUXILIARY_WORDS, _UNIT_WORDS = _by_word("auxiliary"), _by_word("unit")
_SECONDS = {word: float(seconds) for word, seconds in _by_word("seconds").items()}
_LONG_SECONDS = {word: float(seconds) for word, seconds in _by_word("long_seconds").items()}

_BRACKETS = re.compile(r"\s*[\[(]([^\[\]()]*)[\])]\s*$")
_CAMEL_HUMP = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")
_GLUED_UNIT = re.compile(r"(time|timestamp|stamp)([mun]s)")

# Only plain products of powers go on to the unit parser: a header is not to be computed.
_UNIT_FACTOR = r"[A-Za-z°]+(?:(?:\^|\*\*)?-?[1-3])?"
_UNIT_IN_HEADER = re.compile(rf"{_UNIT_FACTOR}(?:\s*[/*·\s]\s*{_UNIT_FACTOR}){{0,3}}")
_POWER = re.compile(r"(?<=[A-Za-z])(?:\^|\*\*)?(-?[1-3])")


@dataclass(frozen=True)
class Meaning:
    """What a name says."""

    # One of `CANONICAL`, `TIME`, "temperature", "voltage", or ``None`` for anything else.
    role: str | None
    unit: Unit | None = None  # its unit, if the name has one that is understood
    seconds: float | None = None  # for a time column, its unit in seconds
    stated: str = ""  # of a time column or a channel, what stands in brackets after its name


def stated_seconds(source: str, name: str) -> float | None:
    """Unit of a time column in seconds, ``None`` if its name states none; rejects other units."""
    found = meaning(name)
    if found.stated and found.seconds is None:
        text = f"{source}, column {name!r}: {found.stated!r} is not a known unit of time"
        hint = "write s, ms, us, ns, min, h or days in the header, or give the sampling rate"
        raise InputError(f"{text}: {hint}, rate=100", "time-unit")
    return found.seconds


@lru_cache(maxsize=4096)
def meaning(name: str) -> Meaning:
    """Interpret the name of a column, e.g. ``"gyro_x [deg/s]"`` or ``"#timestamp [ns]"``."""
    plain = unicodedata.normalize("NFKC", name.replace("²", "^2")).replace("μ", "u")
    base, bracket = plain, ""
    if found := _BRACKETS.search(plain):
        base, bracket = plain[: found.start()], found.group(1).strip()
    if bracket in ("0", "1", "2"):  # acc[0] is an axis; PX4's gyro_rad[0] holds rates all the same
        base = f"{re.sub(r'gyro_rad$', 'gyro_rad_s', base)}_{AXES[int(bracket)]}"
        bracket = ""
    words = [word.lower() for word in re.findall(r"[A-Za-z0-9]+", _CAMEL_HUMP.sub("_", base))]
    return (
        _as_time(words, bracket)
        or _as_channel(words, bracket)
        or _as_auxiliary(words, bracket)
        or Meaning(None, _unit(bracket))
    )


def bare(name: str) -> str:
    """A name without the unit in brackets after it."""
    return _BRACKETS.sub("", name).strip()


def of_dates(name: str) -> str:
    """Name of a column of dates, which are read as seconds; a scale such as (UTC) is left out."""
    plain = bare(name)
    words = re.findall(r"[A-Za-z]+", plain.lower())
    is_vague = not plain or (bool(words) and words[-1] in _BEFORE_TIME)
    return f"{plain} time [s]".lstrip() if is_vague else f"{plain} [s]"


def _as_time(words: Sequence[str], bracket: str) -> Meaning | None:
    seconds = _SECONDS.get(bracket.lower()) or (seconds_in(bracket.lower()) if bracket else None)
    rest = list(words)
    if rest and (glued := _GLUED_UNIT.fullmatch(rest[-1])):
        rest[-1:] = glued.groups()
    if rest and rest[-1] in _SECONDS:
        unit = rest.pop()
        seconds = seconds or _SECONDS[unit]
        if not rest:
            # "s" alone may be anything, and so may "second [g]"
            return Meaning(TIME, seconds=seconds) if unit != "s" and not bracket else None
    elif rest and rest[-1] in _LONG_SECONDS and len(rest) > 1:
        seconds = seconds or _LONG_SECONDS[rest.pop()]
    if rest == ["sample", "time", "fine"]:  # of Xsens, 10 kHz
        return Meaning(TIME, seconds=1e-4)
    if rest[-2:] == ["time", "stamp"]:
        rest[-2:] = ["timestamp"]
    if not rest or rest[-1] not in _TIME_WORDS or not _BEFORE_TIME.issuperset(rest[:-1]):
        return None
    if rest[-1] == "t" and bracket and seconds is None:
        return None  # "t [degC]"
    return Meaning(TIME, seconds=seconds, stated=bracket)


def _as_channel(words: Sequence[str], bracket: str) -> Meaning | None:
    rest, unit = _split_unit(words)
    if rest[-1:] == ["out"]:
        rest.pop()
    for sensor_words, axis in _ways_to_part(rest):
        before, inner_unit = _split_unit(sensor_words)
        sensor = _sensor(sensor_words) or _sensor(before)
        if sensor:
            known = _unit(bracket) or unit or inner_unit
            return Meaning(f"{sensor}_{axis}", known, stated=bracket)
    return None


def _as_auxiliary(words: Sequence[str], bracket: str) -> Meaning | None:
    """Temperature, voltage and vibration, by a word of the name (``imu_temp1``) or by the unit."""
    if not _OTHER_AUXILIARY.isdisjoint({*words[:1]} - {"t"} | {*words[1:]}):
        return None  # "T [degC]" is one, "time of temp" is not
    found = auxiliary_unit(bracket)
    if found is not None:
        return None if found.quantity == "clock" else Meaning(found.quantity, found)
    quantities = [_AUXILIARY_WORDS.get(word.rstrip("0123456789")) for word in words]
    quantity = next((quantity for quantity in quantities if quantity), None)
    if quantity is None:
        return None
    for size in (2, 1):  # temp deg c, temp_c
        found = auxiliary_unit(" ".join(words[-size:]))
        if len(words) > size and found is not None and found.quantity == quantity:
            return Meaning(quantity, found)
    return Meaning(quantity)


def _split_unit(words: Sequence[str]) -> tuple[list[str], Unit | None]:
    """Split a unit of up to three words from the end: ``gyro x rad s``."""
    for size in (3, 2, 1):
        unit = _UNIT_WORDS.get("".join(words[-size:]))
        if unit and len(words) > size:
            return list(words[:-size]), sensor_unit(unit)
    return list(words), None


def _ways_to_part(words: Sequence[str]) -> list[tuple[list[str], str]]:
    """Sensor and axis: ``gyro x`` and ``gyrox``, ``imu xgyro``, ``x gyro``."""
    if not words:
        return []
    *before, last = words
    ways = [([*before, last[:-1]], last[-1])]
    if len(last) > 2:  # "xa" would be too bold
        ways.append(([*before, last[1:]], last[0]))
    if len(last) > 1:
        ways.append(([*words[1:]], words[0]))
    return [([word for word in rest if word], axis) for rest, axis in ways if axis in AXES]


def _sensor(words: Sequence[str]) -> str | None:
    """The sensor that the last words name, whatever stands before them."""
    if len(words) == 1 and words[0] in _SENSOR_LETTERS:
        return _SENSOR_LETTERS[words[0]]
    for start in range(len(words)):
        sensor = _SENSOR_WORDS.get("".join(words[start:]))
        if sensor and _OTHER_MEANINGS.isdisjoint(words[:start]):
            return sensor
    return None


def _unit(text: str) -> Unit | None:
    """The unit in a header, if it is one of an angular rate or a specific force."""
    cleaned = re.sub(r"\bsec\b", "s", text.replace("°", "deg"))
    cleaned = "g" if cleaned == "G" else cleaned
    if len(cleaned) > 24 or not _UNIT_IN_HEADER.fullmatch(cleaned):
        return None
    try:
        return sensor_unit(_POWER.sub(r"^\1", cleaned))
    except InputError:
        return None
