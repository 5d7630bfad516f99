"""Values that the user gave: what they must be, or one sentence about it."""

import textwrap
from collections.abc import Sequence
from numbers import Real
from reprlib import Repr
from typing import Any

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError

SHORTEST_INTERVAL, LONGEST_INTERVAL = 1e-9, 1e6
"""Sampling intervals that a sensor may have, s."""

LONGEST_TIME = 1e9
"""Without aiding, s: 30 years."""

LARGEST = 1e20
"""Largest filter numbers, SI, and times, s, whose powers stay in the range of floats."""

MOST_SAMPLES = 10**11
"""800 GB."""

# What is nested deeply, or refers to itself many times over, is not written out.
_REPR = Repr()
_REPR.maxlevel, _REPR.maxstring, _REPR.maxother, _REPR.maxlong = 3, 200, 200, 200


def shown(value: Any) -> str:
    """A value as messages quote it: one short line."""
    return _cut(_REPR.repr(value), 60)


def line(text: str) -> str:
    """A text of others, such as another library's message, as messages quote it: one short line."""
    return _cut(text, 120)


def _cut(text: str, length: int) -> str:
    words = textwrap.shorten(text, length, placeholder=" ...")
    if len(words) > length // 2 or len(text) <= length:
        return words
    return f"{text[: length - 4]} ..."  # of one long word nothing would be left


def _wrong(name: str, value: Any, hint: str) -> InputError:
    return InputError(f"{name} = {shown(value)}: {hint}")


def is_number(value: Any) -> bool:
    """Whether it is a finite real number; a truth value is none."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        return False
    try:
        return bool(np.isfinite(float(value)))
    except OverflowError:
        return False


def positive(name: str, value: Any, hint: str = "give a positive number") -> float:
    """A number above zero.

    Raises InputError for anything else; so do all functions of this module.
    """
    if not is_number(value) or not value > 0.0:
        raise _wrong(name, value, hint)
    return plausible(name, value)


def plausible(name: str, value: Any) -> float:
    """A number whose powers can be computed, zero or more."""
    if not is_number(value) or not 0.0 <= value <= LARGEST:
        raise _wrong(name, value, f"give a number from 0 to {LARGEST:g}")
    return float(value)


def whole(name: str, value: Any, least: int, hint: str = "") -> int:
    """A whole number, which may be written as 1e6, not below the least one."""
    if not is_number(value) or value != int(value) or value < least:
        raise _wrong(name, value, hint or f"give an integer, {least} or more")
    return int(value)


def share(name: str, value: Any, example: float) -> float:
    """A number between 0 and 1, neither included."""
    if not is_number(value) or not 0.0 < value < 1.0:
        raise _wrong(name, value, f"give a number between 0 and 1, e.g. {example:g}")
    return float(value)


def choice(name: str, value: Any, known: Sequence[str]) -> str:
    """One of the words that are known."""
    if not isinstance(value, str) or value not in known:
        raise _wrong(name, value, f"choose from {', '.join(known)}")
    return value


def truth(name: str, value: Any) -> bool:
    """True or False."""
    if not isinstance(value, bool | np.bool_):
        raise _wrong(name, value, "give True or False")
    return bool(value)


def samples(value: Any, least: int = 1) -> int:
    """A number of samples ``n`` that a computer can hold."""
    n = whole("n", value, least, f"give an integer number of samples, {least} or more")
    if n > MOST_SAMPLES:
        raise _wrong("n", value, f"that is too long, give at most {MOST_SAMPLES:,} samples")
    return n


def sampling_interval(dt: Any, rate: Any = None) -> float:
    """A sampling interval that a sensor may have, s, from ``dt`` (s) or ``rate`` (Hz)."""
    if dt is None and rate is None:
        raise InputError("the sampling rate is missing: give it in Hz, as in rate=100, or dt=0.01")
    if rate is not None:
        if dt is not None:
            raise InputError(f"dt = {shown(dt)} and rate = {shown(rate)}: give only one of them")
        dt = 1.0 / positive("rate", rate, "give a positive rate in Hz, e.g. 100")
    hint = "give a positive sampling interval in seconds"
    dt = positive("dt", dt, hint)
    if not SHORTEST_INTERVAL <= dt <= LONGEST_INTERVAL:
        raise _wrong("dt", dt, f"{hint}, {SHORTEST_INTERVAL:g} to {LONGEST_INTERVAL:g}")
    return dt


def generator(seed: Any) -> np.random.Generator:
    """A random generator as it is, or a new one of a seed."""
    try:
        return np.random.default_rng(seed)
    except (TypeError, ValueError):
        hint = "give an integer, zero or more, or a numpy.random.Generator"
        raise _wrong("seed", seed, hint) from None


def unmasked(values: Any) -> Any:
    """The values, NaN where a masked array has none."""
    if isinstance(values, np.ma.MaskedArray):
        return np.ma.filled(values.astype(float), np.nan)
    return values


def real_numbers(values: Any, where: str) -> FloatArray:
    """An array of real numbers, NaN where one is masked."""
    try:
        array = np.asarray(unmasked(values))
        if array.dtype.kind in "cmM":
            kind = "complex numbers" if array.dtype.kind == "c" else "dates or durations"
            raise InputError(f"{where} holds {kind}: give real numbers in the sensor's unit")
        return np.asarray(array, dtype=float)
    except InputError:
        raise
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{where} holds something that is not a number: correct it") from None
