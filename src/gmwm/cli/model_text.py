"""Models as they are written on the command line: ``N + K + 2 GM``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm.process import Model, Process

_TERM = re.compile(r"\s*(?:([1-9])\s*\*?\s*)?([A-Za-z]+)\s*")
_EXAMPLE = "write terms such as N, K, B, Q, R and GM with +, e.g. --model 'N + K + 2 GM'"


def written_models(texts: Sequence[str]) -> dict[str, Model]:
    """Models of ``--model MODEL`` and ``--model NAME=MODEL``, by name; empty for all channels.

    Raises
    ------
    InputError
        If a text is no model, or a name has two.
    """
    given: dict[str, Model] = {}
    for text in texts:
        name, _, model = map(str.strip, text.rpartition("="))
        if name in given:
            raise InputError(f"--model {text}: {name or 'all channels'} have a model: give one")
        given[name] = _model(model)
    return given


def models_of_channels(
    given: Mapping[str, Model], channels: Sequence[str]
) -> dict[str, Model] | None:
    """The model of each channel: its own, else that of its sensor, else that of all.

    Parameters
    ----------
    given : mapping of str to Model
        See `written_models`.
    channels : sequence of str

    Returns
    -------
    dict or None
        None if nothing is given.

    Raises
    ------
    InputError
        If a channel has no model, or a model no channel.
    """
    if not given:
        return None
    keys = {name: (name, name.partition("_")[0], "") for name in channels}
    for name in given:
        if not any(name in each for each in keys.values()):
            raise InputError(f"--model {name}=...: the channels are {', '.join(channels)}")
    for name, each in keys.items():
        if given.keys().isdisjoint(each):
            raise InputError(
                f"--model gives {name} no model: add one, e.g. --model '{name}=N + K', or "
                "leave it out by --channels"
            )
    return {name: next(given[key] for key in each if key in given) for name, each in keys.items()}


def _model(text: str) -> Model:
    """A model, all parameters of which are free.

    Raises
    ------
    InputError
        If it is none.
    """
    from gmwm.process import CATALOGUE, GaussMarkov, Model

    kinds: dict[str, type[Process]] = {"GM": GaussMarkov}
    for kind in CATALOGUE:
        kinds[kind.__name__] = kind
        if len(kind.parameters[0].name) == 1 and not kind.prefix:
            kinds[kind.parameters[0].name] = kind
    terms: list[Process] = []
    for part in text.split("+"):
        found = _TERM.fullmatch(part)
        if found is None or found[2] not in kinds:
            raise InputError(f"--model {text}: {part.strip()!r} is no term: {_EXAMPLE}")
        terms += [kinds[found[2]]() for _ in range(int(found[1] or 1))]
    try:
        return Model(tuple(terms))
    except InputError as error:
        raise InputError(f"--model {text}: {error}") from None
