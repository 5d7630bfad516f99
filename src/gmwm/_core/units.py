"""Units at the edges of the package: strings a person writes, SI inside.

A *quantity* is what a channel measures, ``"gyro"`` (rad/s) or ``"accel"`` (m/s^2). Parameters of
error processes have units derived from it (``rad/s/sqrt(Hz)``, ``rad/s/sqrt(s)``, ...), written
here with the placeholder ``u`` for the channel's own unit.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from gmwm.errors import InputError

if TYPE_CHECKING:
    import pint

SI_UNIT = {"gyro": "rad/s", "accel": "m/s^2"}
"""The SI unit of each quantity."""

# Own registry with just these lines: it loads in milliseconds, keeps the angle as a dimension
# (deg/s must not pass for 1/s) and lets "g" mean standard gravity, not gram.
_DEFINITIONS = (
    "nano- = 1e-9 = n-",
    "micro- = 1e-6 = u- = µ-",
    "milli- = 1e-3 = m-",
    "centi- = 1e-2 = c-",
    "kilo- = 1e3 = k-",
    "radian = [angle] = rad",
    "degree = 0.017453292519943295 * radian = deg",
    "arcminute = degree / 60 = arcmin",
    "arcsecond = degree / 3600 = arcsec",
    "second = [time] = s",
    "minute = 60 * second = min",
    "hour = 3600 * second = h = hr",
    "day = 86400 * second = d",
    "hertz = 1 / second = Hz",
    "meter = [length] = m",
    "standard_gravity = 9.80665 * meter / second ** 2 = g = g0",
    "degree_per_second = degree / second = dps",
)

_USUAL = {
    "rad/s": {
        "rad/s": 1.0, "deg/s": 0.017453292519943295, "deg/h": 4.84813681109536e-06,
        "mdeg/s": 1.7453292519943296e-05, "mrad/s": 0.001,
    },
    "m/s^2": {
        "m/s^2": 1.0, "g": 9.80665, "mg": 0.00980665, "ug": 9.806649999999999e-06, "cm/s^2": 0.01,
    },
    "rad/s/sqrt(Hz)": {
        "deg/sqrt(h)": 0.0002908882086657216, "deg/h/sqrt(Hz)": 4.84813681109536e-06,
    },
    "rad/sqrt(s)": {"deg/sqrt(h)": 0.0002908882086657216},
    "rad/s^2/sqrt(Hz)": {"deg/h/sqrt(h)": 8.080228018492267e-08},
    "m/s^2/sqrt(Hz)": {"ug/sqrt(Hz)": 9.806649999999999e-06, "m/s/sqrt(h)": 0.016666666666666666},
    "m/s^3/sqrt(Hz)": {"ug/sqrt(h)": 1.6344416666666664e-07},
    "rad": {"deg": 0.017453292519943295}, "m": {"m": 1.0}, "m/s": {"m/s": 1.0},
    "s": {"s": 1.0, "ms": 0.001, "us": 1e-06, "ns": 1e-09},
}  # fmt: skip
"""What pint finds for the units of most recordings: importing it takes 0.25 s and 20 MB."""


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[Any]:
    import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(None)
    for line in _DEFINITIONS:
        registry.define(line)
    return registry


# Letters and small exponents: a unit is not a formula to be worked out.
_EXPONENT = r"(?:\^|\*\*|(?<=[a-z]))-?[123](?!\d|\s*\^|\s*\*\*)"
_PLAIN = re.compile(rf"(?:1/)?(?:[A-Za-zµ/·()√²]|\s|\*(?=[A-Za-z])|{_EXPONENT})+")


def _quantity(text: str) -> pint.Quantity[Any]:
    """Parse a unit such as ``deg/h/sqrt(Hz)`` or ``m/s2``."""
    source = text.strip()
    expression = re.sub(r"sqrt\(([^()]*)\)|√\(?(\w+)\)?", r"((\1\2)**0.5)", source)
    expression = expression.replace("²", "**2").replace("^", "**").replace("·", "*")
    expression = re.sub(r"\b(s|sec)2\b", r"s**2", expression)
    expression = re.sub(r"\bsec\b", "s", expression)
    try:
        if not _PLAIN.fullmatch(source):
            raise ValueError("no unit")
        return 1.0 * _registry().parse_expression(expression)
    except Exception as error:  # pint raises a dozen types, some of them from the tokenizer
        raise InputError(
            f"unknown unit {text!r}: write it like deg/s, rad/s, g, m/s^2, deg/h/sqrt(Hz)"
        ) from error


@lru_cache(maxsize=512)
def factor(unit: str, si_unit: str) -> float:
    """How many ``si_unit`` one ``unit`` is, such as rad/s one deg/s.

    Raises InputError if a unit is unknown or the two do not measure the same thing.
    """
    known = _USUAL.get(si_unit, {}).get(unit)
    if known is not None:
        return known
    import pint

    value, target = _quantity(unit), _quantity(si_unit)
    try:
        return float((value / target).to("dimensionless").magnitude)
    except pint.DimensionalityError as error:
        raise InputError(
            f"unit {unit!r} does not measure the same as {si_unit}: use a unit of that kind"
        ) from error


def seconds_in(unit: str) -> float | None:
    """How many seconds a unit of time has, ``None`` if the text is none."""
    if any(unit in _USUAL[of_sensor] for of_sensor in SI_UNIT.values()):
        return None
    try:
        return factor(unit, "s")
    except InputError:
        return None


@lru_cache(maxsize=512)
def quantity_of(unit: str) -> str:
    """``"gyro"`` for an angular rate, ``"accel"`` for a specific force.

    Raises InputError if the unit is unknown or neither of the two.
    """
    for quantity, si_unit in SI_UNIT.items():
        if unit in _USUAL[si_unit]:
            return quantity
    # Without exceptions of pint, which keep the arrays of their callers until they are collected.
    dimension = _quantity(unit).dimensionality
    for quantity, si_unit in SI_UNIT.items():
        if dimension == _quantity(si_unit).dimensionality:
            return quantity
    raise InputError(
        f"unit {unit!r} is neither an angular rate nor a specific force: use one such as deg/s or g"
    )


AUXILIARY = ("temperature", "voltage", "clock")
"""Quantities of channels that are kept for what they explain; no error model is fitted to them."""


class AuxiliaryUnit(NamedTuple):
    """A unit of a quantity of `AUXILIARY`; times scale, plus offset it is in ``unit``, as kept."""

    quantity: str
    unit: str
    scale: float = 1.0
    offset: float = 0.0


_AUXILIARY_UNITS = {
    word: unit
    for words, unit in (
        ("degc c celsius", AuxiliaryUnit("temperature", "degC")),
        ("k kelvin degk", AuxiliaryUnit("temperature", "degC", 1.0, -273.15)),
        ("degf f fahrenheit", AuxiliaryUnit("temperature", "degC", 5.0 / 9.0, -160.0 / 9.0)),
        ("mdegc", AuxiliaryUnit("temperature", "degC", 1e-3)),
        ("v volt volts", AuxiliaryUnit("voltage", "V")),
        ("mv millivolt millivolts", AuxiliaryUnit("voltage", "V", 1e-3)),
        ("uv", AuxiliaryUnit("voltage", "V", 1e-6)),
        ("s sec seconds", AuxiliaryUnit("clock", "s")),
        ("ms", AuxiliaryUnit("clock", "s", 1e-3)),
        ("us", AuxiliaryUnit("clock", "s", 1e-6)),
        ("ns", AuxiliaryUnit("clock", "s", 1e-9)),
    )
    for word in words.split()
}


def auxiliary_unit(text: str) -> AuxiliaryUnit | None:
    """The unit of an auxiliary quantity that a text names, ``None`` for any other text."""
    plain = re.sub(r"[°º]", "deg", text).replace("µ", "u")
    return _AUXILIARY_UNITS.get(re.sub(r"[\s_.]", "", plain).lower())


class FieldUnit(NamedTuple):
    """A unit in which the field quotes a parameter, and how many of it one SI unit is."""

    unit: str
    per_si: float


# What data sheets and IEEE Std 952 / 1554 use for each parameter unit.
_FIELD_UNITS = {
    "gyro u/sqrt(Hz)": "deg/sqrt(h) deg/h/sqrt(Hz)",
    "gyro u": "deg/h",
    "gyro u s": "arcsec",
    "gyro u/s/sqrt(Hz)": "deg/h/sqrt(h)",
    "gyro u/s": "deg/h/h",
    "accel u/sqrt(Hz)": "ug/sqrt(Hz) m/s/sqrt(h)",
    "accel u": "ug",
    "accel u s": "m/s",
    "accel u/s/sqrt(Hz)": "ug/sqrt(h)",
    "accel u/s": "ug/h",
}


def si_parameter_unit(parameter_unit: str, quantity: str | None) -> str:
    """Spell a parameter's unit for a channel, e.g. ``u/sqrt(Hz)`` -> ``rad/s/sqrt(Hz)``."""
    base = SI_UNIT.get(quantity or "", "u")
    if parameter_unit[:1] != "u":
        return parameter_unit
    if parameter_unit == "u^2":
        return f"({base})^2"
    if parameter_unit in ("u/s", "u/s/sqrt(Hz)"):
        base = {"rad/s": "rad/s^2", "m/s^2": "m/s^3"}.get(base, f"{base}/s")
        return base + parameter_unit[3:]
    return base + parameter_unit[1:]


def field_units(parameter_unit: str, quantity: str | None) -> tuple[FieldUnit, ...]:
    """The units in which the field quotes a parameter, the customary one first; empty for SI.

    parameter_unit: With the placeholder ``u``, e.g. ``"u/sqrt(Hz)"``.
    """
    names = _FIELD_UNITS.get(f"{quantity} {parameter_unit}", "").split()
    si_unit = si_parameter_unit(parameter_unit, quantity).replace(" s", "*s")
    return tuple(FieldUnit(name, 1.0 / factor(name, si_unit)) for name in names)


def customary_unit(parameter_unit: str, quantity: str | None, unit: str) -> tuple[str, float]:
    """The first of `field_units` and its value per SI unit; else as written for the channel."""
    for known in field_units(parameter_unit, quantity):
        return known
    return parameter_unit.replace("u", unit or "u", 1), 1.0


def shown_unit(quantity: str | None, unit: str, units: str) -> tuple[str, float]:
    """The unit in which a plot shows a channel, and how many of it one SI unit is.

    Raises InputError if ``units`` is neither "field" nor "si".
    """
    if units not in ("field", "si"):
        raise InputError(f"units = {units!r}: give 'field' or 'si'")
    return customary_unit("u", quantity, unit) if units == "field" else (unit or "u", 1.0)
