"""Error models that agree with the few numbers of a data sheet."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

from gmwm._core.text import brief
from gmwm._core.typing import FloatArray
from gmwm.datasheet import tuning
from gmwm.errors import InputError
from gmwm.process import BiasInstability, GaussMarkov, Model, Process, RandomWalk, WhiteNoise

_FLICKER = float(np.sqrt(2.0 * np.log(2.0) / np.pi))
"""Plateau of the Allan deviation over B, 0.664 (IEEE Std 952-1997, C.1.3)."""
_PEAK_TIME, _PEAK = 1.89, 0.617
"""Of the Allan deviation of a Gauss-Markov process, over tau and sigma (the same, C.1.5)."""


def agreeing(where: str, values: Mapping[str, float], N: float) -> dict[str, Model]:
    """Models with white noise N whose Allan deviation is lowest where the sheet says, by terms.

    The other term is a random walk, flicker noise, or a Gauss-Markov process of any correlation
    time, of such a size that the curve is first flat at the stated deviation. A Gauss-Markov
    process too weak to make the curve flat, below a walk, stands for what N and B do not show. If a
    rate random walk or a correlation time is stated, all models have it.

    values: By key of `KEYS`, SI.
    N: u/sqrt(Hz).
    Raises InputError if there is no such model, or no slow noise is stated.
    """
    lowest = lowest_deviation(values)
    known: list[Process] = [WhiteNoise(N)]
    if "K" in values:
        known.append(RandomWalk(values["K"]))
    if not lowest:
        if "K" in values:
            return {"N+K": Model(tuple(known))}
        raise InputError(
            f"{where}: no slow noise is stated, which leaves K open: add B, lowest_deviation or "
            "K, or record an hour at rest"
        )
    crossing = (N / lowest) ** 2  # s, where white noise alone has this deviation
    first, last, many = tuning.AVERAGING_TIMES
    tau = crossing * np.geomspace(first, last, many)
    found = {}
    for label, base, slow in _candidates(known, lowest, values.get("correlation_time")):
        size = _size(_allan(base, tau), _allan([slow(1.0)], tau), tau, lowest**2)
        if size is not None:
            found[label] = Model((*base, slow(size)))
    least = np.sqrt(np.min(_allan(known, tau)))
    if not found and "K" in values and abs(least / lowest - 1.0) < tuning.ALIKE:
        return {"N+K": Model(tuple(known))}
    if not found:
        raise InputError(
            f"{where}: no model with all of these numbers has a lowest Allan deviation of "
            f"{lowest:.3g} (SI): leave out {'K' if 'K' in values else 'correlation_time'}"
        )
    return found


def lowest_deviation(values: Mapping[str, float]) -> float:
    """The lowest Allan deviation that is stated, u; zero if none is."""
    return values.get("lowest_deviation", _FLICKER * values.get("B", 0.0))


def _candidates(
    known: list[Process], lowest: float, memory: float | None
) -> Iterator[tuple[str, list[Process], Callable[[float], Process]]]:
    """Terms that are known, and a slow one of any size."""
    label = "+".join(each.short_name for each in known)
    crossing = float(_allan(known[:1], np.ones(1))[0]) / lowest**2
    has_walk = len(known) > 1
    if memory is None:
        if not has_walk:
            yield f"{label}+K", known, RandomWalk
        yield f"{label}+B", known, BiasInstability
    first, last, many = tuning.TAU
    taus = crossing * np.geomspace(first, last, many) if memory is None else [memory]
    for tau in map(float, taus):
        yield f"{label}+GM {brief(tau, 2)} s", known, partial(GaussMarkov, tau=tau)
    if memory is not None or has_walk:
        return
    first, last, many = tuning.SHOULDER_TAU
    for tau in map(float, crossing * np.geomspace(first, last, many)):
        if tau > tuning.FASTEST_SHOULDER:
            white = lowest * np.sqrt(crossing / (_PEAK_TIME * tau))  # its deviation at the peak
            weak = GaussMarkov(tuning.SHOULDER * white / _PEAK, tau)
            yield f"{label}+GM {brief(tau, 2)} s+K", [*known, weak], RandomWalk


def _allan(terms: list[Process], tau: FloatArray) -> FloatArray:
    """Allan variance, u^2."""
    return 2.0 * Model(tuple(terms)).haar_variance(tau, float(tau[0]) / 100.0)


def _size(base: FloatArray, unit: FloatArray, tau: FloatArray, target: float) -> float | None:
    """Size of a term whose Allan variance is ``unit`` for 1, that makes the sum flat at ``target``.

    ``None`` if no size does.
    """
    steps = np.diff(np.log(tau))

    def reading(square: float) -> float:
        total = base + square * unit
        flat = np.flatnonzero(np.diff(np.log(total)) >= -tuning.FLAT * steps)
        return float(total[flat[0]]) if flat.size else 0.0

    low, high = target / float(np.max(unit)) * 1e-9, target / float(np.min(unit))
    if reading(low) > target:
        return None
    for _ in range(60):  # below the least size that makes it flat there is no reading
        middle = np.sqrt(low * high)
        low, high = (middle, high) if reading(middle) < target else (low, middle)
    return float(np.sqrt(high)) if abs(reading(high) / target - 1.0) < 2.0 * tuning.ALIKE else None
