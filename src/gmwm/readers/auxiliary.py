"""What is recorded beside rates and forces: temperature, supply voltage, further clocks."""

from __future__ import annotations

import re
from dataclasses import dataclass

AUXILIARY = ("temperature", "voltage", "clock")
"""Quantities of channels that are kept for what they explain; no error model is fitted to them."""


@dataclass(frozen=True)
class AuxiliaryUnit:
    """A unit of an auxiliary quantity.

    Attributes
    ----------
    quantity : str
        One of `AUXILIARY`.
    unit : str
        In which channels of the quantity are kept: degC, V, s.
    scale, offset : float
        Multiply by the one, then add the other, to have a number in ``unit``.
    """

    quantity: str
    unit: str
    scale: float = 1.0
    offset: float = 0.0


_UNITS = {
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
    return _UNITS.get(re.sub(r"[\s_.]", "", plain).lower())
