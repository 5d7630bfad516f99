"""Units at the edges of the package: strings a person writes, SI inside.

A *quantity* is what a channel measures, ``"gyro"`` (rad/s) or ``"accel"`` (m/s^2). Parameters of
error processes have units derived from it (``rad/s/sqrt(Hz)``, ``rad/s/sqrt(s)``, ...), written
here with the placeholder ``u`` for the channel's own unit.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from gmwm._core.files import toml_beside
from gmwm.errors import InputError

if TYPE_CHECKING:
    import pint

SI_UNIT = {"gyro": "rad/s", "accel": "m/s^2"}
"""The SI unit of each quantity."""

_TABLE = toml_beside(__file__)
_USUAL: dict[str, dict[str, float]] = _TABLE["usual"]
"""What pint finds for the units of most recordings."""
_SAME_UNIT = 1e-6  # relative; the same unit in two spellings differs by rounding


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[Any]:
    import pint

    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(None)
    for line in _TABLE["definitions"].strip().splitlines():
        registry.define(line)
    return registry


# Letters and small exponents: a unit is not a formula to be worked out.
_EXPONENT = r"(?:\^|\*\*|(?<=[a-z]))-?[123](?!\d|\s*\^|\s*\*\*)"
_PLAIN = re.compile(rf"(?:1/)?(?:[A-Za-zµ/·()√²]|\s|\*(?=[A-Za-z])|{_EXPONENT})+")

_ROOT = re.compile(r"\brt[- ]?\(?([A-Za-z]+)\)?|([A-Za-z]+)\^\(?(?:0?\.5|1/2)\)?")


def _quantity(text: str) -> pint.Quantity[Any]:
    """Parse a unit such as ``deg/h/sqrt(Hz)`` or ``m/s2``."""
    source = re.sub(r"[°º]", "deg", text.strip()).replace("μ", "µ")
    source = _ROOT.sub(r"sqrt(\1\2)", source)
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
    """How many ``si_unit`` one ``unit`` is, such as rad/s one deg/s."""
    known = _USUAL.get(si_unit, {}).get(unit)
    if known is not None:
        return known
    import pint

    value, target = _quantity(unit), _quantity(si_unit)
    try:
        return float((value / target).to("dimensionless").magnitude)
    except pint.DimensionalityError as error:
        raise InputError(
            f"unit {unit!r} cannot be converted to {si_unit}: use a unit of that kind"
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
    """``"gyro"`` for an angular rate, ``"accel"`` for a specific force."""
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


AUXILIARY = ("temperature", "voltage", "vibration", "clock")
"""Quantities of channels that are kept for what they explain; no error model is fitted to them."""


class Unit(NamedTuple):
    """The unit of a channel: values times scale, plus offset, are in the unit as kept."""

    text: str  # as written
    quantity: str  # "gyro", "accel" or one of `AUXILIARY`
    kept: str  # of a sensor the SI unit
    scale: float = 1.0
    offset: float = 0.0


_AUXILIARY_UNITS = {
    word: unit for words, unit in _TABLE["auxiliary"].items() for word in words.split()
}


def auxiliary_unit(text: str) -> Unit | None:
    """The unit of an auxiliary quantity that a text names, ``None`` for any other text."""
    plain = re.sub(r"[°º]", "deg", text).replace("µ", "u")
    found = _AUXILIARY_UNITS.get(re.sub(r"[\s_.]", "", plain).lower())
    return found and Unit(text, *found)


def sensor_unit(text: str, quantity: str = "") -> Unit:
    """The unit that a text names of an angular rate or a specific force, of which if it is said."""
    quantity = quantity or quantity_of(text)
    return Unit(text, quantity, SI_UNIT[quantity], factor(text, SI_UNIT[quantity]))


def is_other_unit(text: str, unit: str) -> bool:
    """Whether a text is a unit, and not another spelling of this one."""
    try:
        factor(text, text)
    except InputError:
        return False
    try:
        return abs(factor(text, unit) - 1.0) >= _SAME_UNIT
    except InputError:
        return True


class FieldUnit(NamedTuple):
    """A unit in which the field quotes a parameter, and how many of it one SI unit is."""

    unit: str
    per_si: float


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
    names = _TABLE["field"].get(quantity, {}).get(parameter_unit, ())
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
