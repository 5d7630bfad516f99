"""Limits of N, B and K: which units meet them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
    found: dict[str, dict[str, float]] = {}
    for name, own in limits.items() if isinstance(limits, Mapping) else [("", limits)]:
        if not (
            name and isinstance(name, str) and isinstance(own, Mapping) and {*own} <= {*LETTERS}
        ):
            raise InputError(f"limits of {checks.shown(name)} = {checks.shown(own)}: {hint}")
        found[name] = {k: checks.positive(f"limit {k} of {name}", v, hint) for k, v in own.items()}
    return found


def grid_of(limits: Limits, structures: Sequence[Structure], units: Sequence[Unit]) -> Grid:
    """The verdicts on every unit; a limit of an axis that no unit has is not met."""
    by_channel = {each.channel: each for each in structures}
    named = {*by_channel, *(each.quantity for each in structures)}
    wanted = {k: limits.get(k, limits.get(each.quantity, {})) for k, each in by_channel.items()}
    wanted |= {name: own for name, own in limits.items() if name not in named}
    grid: dict[str, dict[str, dict[str, str]]] = {unit.name: {} for unit in units}
    for name, row in grid.items():
        for channel, own in wanted.items():
            structure = by_channel.get(channel)
            known = structure.usable.get(name, {}) if structure is not None else {}
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
