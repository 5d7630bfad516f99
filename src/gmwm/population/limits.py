"""Limits of N, B and K: which units meet them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from gmwm._core import checks
from gmwm.errors import InputError
from gmwm.population.structure import Structure
from gmwm.population.unit import LETTERS, Number, Unit

PASS, FAIL, OPEN, NONE = "pass", "FAIL", "?", "none"
"""The 95 % interval is below the limit, above it, or contains it; or no number can be used."""

Limits = Mapping[str, Mapping[str, float]]
Grid = Mapping[str, Mapping[str, Mapping[str, str]]]
"""Unit -> channel -> letter -> verdict."""


def checked(limits: Any) -> Limits:
    """Limits in SI by sensor or channel; raises InputError if they are something else."""
    hint = 'give them in SI as {"gyro": {"N": 6e-5}}'
    if not isinstance(limits, Mapping):
        raise InputError(f"limits = {checks.shown(limits)}: {hint}")
    found = {}
    for name, own in limits.items():
        if not (isinstance(name, str) and isinstance(own, Mapping) and own):
            raise InputError(f"limits of {checks.shown(name)} = {checks.shown(own)}: {hint}")
        for letter, value in own.items():
            if letter not in LETTERS:
                raise InputError(f"limit {checks.shown(letter)} of {name}: known are N, B and K")
            checks.positive(f"limit {letter} of {name}", value, hint)
        found[name] = {letter: float(own[letter]) for letter in LETTERS if letter in own}
    return MappingProxyType(found)


def grid_of(limits: Limits, structures: Sequence[Structure], units: Sequence[Unit]) -> Grid:
    """The verdicts on every unit; a limit of an axis that no unit has is not met."""
    wanted = {each.channel: limits.get(each.channel, limits.get(each.quantity, {}))
              for each in structures}  # fmt: skip
    named = {each.channel for each in structures} | {each.quantity for each in structures}
    wanted |= {name: own for name, own in limits.items() if name not in named}
    by_channel = {each.channel: each for each in structures}
    grid: dict[str, dict[str, dict[str, str]]] = {unit.name: {} for unit in units}
    for channel, own in wanted.items():
        structure = by_channel.get(channel)
        for name, row in grid.items():
            known: Mapping[str, Number] = {}
            if structure is not None and name not in structure.invalid:
                known = structure.numbers.get(name, {})
            if own:
                row[channel] = {key: _verdict(known.get(key), end) for key, end in own.items()}
    return grid


def _verdict(number: Number | None, limit: float) -> str:
    if number is None:
        return NONE
    if number.upper <= limit:
        return PASS
    return FAIL if number.lower > limit else OPEN


def in_words(verdicts: Mapping[str, str]) -> str:
    """The verdicts on an axis in a word: ``pass``, ``FAIL NK``, ``? B`` or ``none``."""
    for state in (NONE, FAIL, OPEN):
        letters = "".join(letter for letter, each in verdicts.items() if each == state)
        if letters:
            return state if state == NONE else f"{state} {letters}"
    return PASS
