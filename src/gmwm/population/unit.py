"""The units of a lot, one model structure for an axis of all, and the sensor numbers from it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa

from gmwm._core import checks
from gmwm._core.documents import NotNegative, OrInfinity, Text
from gmwm._core.frozen import freeze
from gmwm._core.jobs import one_blas_thread
from gmwm._core.memory import OUT_OF_MEMORY
from gmwm._core.units import si_parameter_unit
from gmwm.calibration import Calibration, axis_numbers
from gmwm.errors import InputError, printable
from gmwm.estimate import Fit, estimate
from gmwm.estimate.problem import chi_square
from gmwm.issues import Notice, failure
from gmwm.population import tuning
from gmwm.process import GaussMarkov, Model, Process, RandomWalk, WhiteNoise
from gmwm.selection import penalty

LETTERS = {"N": "u/sqrt(Hz)", "B": "u", "K": "u/s/sqrt(Hz)"}
"""Sensor numbers (see `gmwm.Calibration.numbers`) and their units."""

_TYPES = dict.fromkeys(("value", "stderr", "lower", "upper"), pa.float64())
_TYPES |= {"valid": pa.bool_()} | dict.fromkeys(("reasons", "notices"), pa.list_(pa.string()))
_NAMES = (
    "device path channel quantity model number kind value stderr lower upper unit valid "
    "reasons notices"
)
SCHEMA = pa.schema([(name, _TYPES.get(name, pa.string())) for name in _NAMES.split()])
"""Columns of the table; null where one does not apply. ``number`` is N, B or K; of an upper limit
(``kind`` "bound") ``value`` is null. ``model`` is the one that it comes from. ``reasons`` are the
codes of why a fit, a channel or a unit is not valid."""

Row = dict[str, Any]
S = TypeVar("S")
T = TypeVar("T")


@dataclass(frozen=True)
class Number:
    """A sensor number with its 95 % interval, SI; no ``value`` where only ``upper`` is known."""

    value: NotNegative | None
    stderr: NotNegative | None
    lower: NotNegative
    upper: OrInfinity

    @property
    def error(self) -> float:
        """Standard error of the logarithm; NaN for an upper limit."""
        if not self.value:
            return float("nan")
        if self.lower > 0.0 and isfinite(self.upper):
            return float(np.log(self.upper / self.lower)) / 3.92
        return (self.stderr or 0.0) / self.value


def numbers_of(fit: Fit) -> dict[str, Number]:
    """N, B and K of a fit."""
    return {
        each.key: Number(
            None if each.kind == "bound" else each.value, each.stderr, each.lower, each.upper
        )
        for each in axis_numbers(fit)
    }


@dataclass(frozen=True)
class Unit:
    """A unit of a fleet.

    digest: SHA-256 of the recording; empty where it cannot be read.
    """

    path: str
    name: str
    result: Calibration | Notice
    digest: str = ""

    @property
    def valid(self) -> bool:
        """Whether a channel has a valid model."""
        return isinstance(self.result, Calibration) and any(
            fit.valid for fit in self.result.values()
        )


def failed(name: str, error: Exception) -> Notice:
    """Why a unit has no calibration: an error at its recording or its fits."""
    if isinstance(error, InputError):
        return failure(error.code or "not-calibrated", name, str(error))
    if isinstance(error, MemoryError):
        return failure("memory", name, OUT_OF_MEMORY)
    text = f"{type(error).__name__}: {checks.line(str(error))}"
    return failure("unexpected", name, text)


class UnitError(Exception):
    """One unit of a lot prevents that a structure is chosen; holds a `Notice` of it."""


def _of_each(units: Mapping[str, S], work: Callable[[S], T]) -> dict[str, T]:
    """Do some work for each unit; raises UnitError at the first where it fails."""
    found = {}
    for name, each in units.items():
        try:
            found[name] = work(each)
        except Exception as error:
            raise UnitError(failed(name, error)) from error
    return found


def rows_of(units: Iterable[Unit], structures: Sequence[Structure]) -> Iterator[Row]:
    """Rows of the table: N, B and K of every channel of every unit.

    A unit without a calibration, and a channel without a fit, has one row with the reason.
    """
    by_channel = {each.channel: each for each in structures}
    for unit in units:
        own = dict.fromkeys(SCHEMA.names) | {
            "device": unit.name,
            "path": printable(unit.path),
            "valid": False,
        }
        if isinstance(unit.result, Notice):
            yield {**own, "reasons": [unit.result.code], "notices": [unit.result.code]}
            continue
        for name, fit in unit.result.items():
            for each in _of_channel(unit, name, fit, by_channel[name]):
                row = own | each
                yield {
                    key: None if isinstance(value, float) and not isfinite(value) else value
                    for key, value in row.items()
                }
        for name, why in unit.result.skipped.items():
            yield {**own, "channel": name, "reasons": [why.code], "notices": [why.code]}


def _of_channel(unit: Unit, name: str, fit: Fit, structure: Structure) -> Iterator[Row]:
    """Rows of a channel, without the columns of the unit."""
    assert isinstance(unit.result, Calibration)
    notices = [*fit.notices, *(n for n in unit.result.notices if n.where in ("", name))]
    is_valid = unit.name in structure.usable
    is_common = is_valid and unit.name not in structure.own
    reasons = [] if is_valid else list(fit.reasons)
    own = {
        "channel": name,
        "quantity": fit.wv.quantity,
        "model": structure.model if is_common else fit.model.title(),
        "valid": is_valid,
        "reasons": reasons,
        "notices": list(dict.fromkeys(n.code for n in notices if n.severity != "good")),
    }
    for key, number in structure.numbers[unit.name].items():
        known = {each: getattr(number, each) for each in ("value", "stderr", "lower", "upper")}
        known |= {"kind": "bound" if number.value is None else "estimated", "number": key}
        yield {**own, **known, "unit": si_parameter_unit(LETTERS[key], fit.wv.quantity)}


_SIMPLE = (
    Model((WhiteNoise(),)),
    WhiteNoise() + RandomWalk(),
    WhiteNoise() + GaussMarkov(),
    WhiteNoise() + RandomWalk() + GaussMarkov(),
)
"""Structures that are tried for every lot."""

_ORDER: dict[type[Process], int] = {WhiteNoise: 0, RandomWalk: 1, GaussMarkov: 2}

_SUPERFLUOUS = {
    *("amplitude-bound", "confounded", "indistinct-terms", "redundant-term", "search-limit"),
    "undetermined",
}
"""Codes of what a unit may have: a term of the lot can be too small to see in one of its units."""

_MISFITS = {"level-missed", "misfit"}


@dataclass(frozen=True)
class Structure:
    """The model of an axis of a lot, and N, B and K of its units.

    model: Title of the noise terms that all units are fitted with; empty without a valid unit.
    counts: Title -> number of units for which these noise terms were selected, commonest first.
    own: Units that reject the model: their numbers are those of their own.
    invalid: Units without a valid model; their numbers are not to be used.
    numbers: Unit -> letter -> `Number`.
    """

    channel: Text
    quantity: Text
    model: Text
    counts: Mapping[Text, int]
    own: tuple[Text, ...]
    invalid: tuple[Text, ...]
    numbers: Mapping[Text, Mapping[Text, Number]]

    def __post_init__(self) -> None:
        freeze(self, "counts", "numbers")

    @cached_property
    def usable(self) -> dict[str, Mapping[str, Number]]:
        """The numbers of units with a valid model."""
        invalid = {*self.invalid}
        return {name: own for name, own in self.numbers.items() if name not in invalid}


@dataclass(frozen=True)
class Choice:
    """The choice of a structure as a function of the channel, which can be sent to workers.

    is_given: Whether the models were given, so that there is nothing to choose.
    """

    fits: Mapping[str, Mapping[str, Fit]]
    is_given: bool

    def attempt(self, channel: str) -> Structure | Notice:
        """The structure of a channel, or which unit prevents it."""
        try:
            return self(channel)
        except UnitError as error:
            return error.args[0]

    @one_blas_thread()
    def __call__(self, channel: str) -> Structure:
        """Choose the structure of a channel and fit it to every unit.

        Raises UnitError if that fails for one of them.
        """
        fits = self.fits[channel]
        usable = _of_each(fits, self._is_usable)
        sound = {name: fit for name, fit in fits.items() if usable[name]}
        titles = _of_each(sound, lambda fit: _noise(fit.model))
        counts = Counter(model.title() for model in titles.values())
        usual = {model.title(): model for model in titles.values()}
        chosen, common = next(iter(counts), ""), dict(sound)
        if sound and not self.is_given:
            likely = [usual[title] for title, _ in counts.most_common(tuning.LIKELY)]
            tried = {model.title(): model for model in (*likely, *_SIMPLE)}
            chosen, common = _best({t: _fitted(sound, model) for t, model in tried.items()})
            # The lot's model may fit where the one selected for the unit alone does not.
            lost = {k: fit for k, fit in fits.items() if k not in sound and _is_noise(fit)}
            again = _fitted(lost, tried[chosen]) if lost else {}
            common |= {name: fit for name, fit in again.items() if self._is_usable(fit)}
        # Those that contradict the structure of the lot while their own model is valid.
        accepted = {k for k, fit in common.items() if fit is sound.get(k) or self._is_usable(fit)}
        own = [name for name in sound if name not in accepted]
        used = {**fits, **common} | {name: sound[name] for name in own}
        return Structure(
            channel=channel,
            quantity=next((fit.wv.quantity or "" for fit in fits.values()), ""),
            model=chosen,
            counts=dict(counts.most_common()),
            own=tuple(own),
            invalid=tuple(name for name in fits if name not in {*common, *own}),
            numbers=_of_each(used, numbers_of),
        )

    def _is_usable(self, fit: Fit) -> bool:
        """Whether a fit is valid but for small terms, and misfits that are chance in such a lot."""
        fitting = tuning.REJECTED / sum(map(len, self.fits.values())) <= fit.goodness.largest_p
        codes = {n.code for n in fit.notices if n.severity == "bad"} - _SUPERFLUOUS
        return not (codes - _MISFITS if fitting else codes)


def _is_noise(fit: Fit) -> bool:
    """Whether nothing but the model is wrong with a fit."""
    return all(n.severity != "bad" or n.issue.topic == "fit" for n in fit.notices)


def _is_common(term: Process) -> bool:
    return term.is_candidate and not term.is_drift


def _noise(model: Model) -> Model:
    """The terms that units have in common, open; N also for band-limited noise."""
    terms = [term for term in model.opened().terms if _is_common(term)]
    if not any(term.is_white for term in terms):
        terms.insert(0, WhiteNoise())
    return Model(tuple(sorted(terms, key=lambda term: _ORDER.get(type(term), len(_ORDER)))))


def _fitted(fits: Mapping[str, Fit], noise: Model) -> dict[str, Fit]:
    """A structure fitted to every unit that it can be fitted to, with the unit's own terms."""
    found = _of_each(fits, lambda fit: _with_noise(fit, noise))
    return {name: fit for name, fit in found.items() if fit is not None}


def _with_noise(fit: Fit, noise: Model) -> Fit | None:
    """A unit fitted by other noise; ``None`` if it is too short for so many parameters."""
    own = [term for term in fit.model.terms if not _is_common(term)]
    opened = []
    for each in own:
        size = each.linear_parameter  # a drift has none
        names = [size] if size is not None else each.parameters
        opened.append(each.with_values(**dict.fromkeys(item.name for item in names)))
    # Behind the sensor's low-pass there need be no other white noise.
    is_white = any(term.is_white for term in fit.model.terms)
    behind = any(term.is_band_limited for term in own) and not is_white
    terms = (*(term for term in noise.terms if not (behind and term.is_white)), *opened)
    try:
        return estimate(Model(terms), fit.wv)
    except InputError:
        return None


def _best(tried: Mapping[str, dict[str, Fit]]) -> tuple[str, dict[str, Fit]]:
    """The structure with the smallest sum of criteria over the units, and its fits."""
    names = dict.fromkeys(name for own in tried.values() for name in own)
    candidates = {name: [own.get(name) for own in tried.values()] for name in names}
    criteria = np.array(list(_of_each(candidates, _criteria).values()))
    excess = np.minimum(criteria - criteria.min(axis=1, keepdims=True), tuning.CONTRADICTION)
    title = list(tried)[int(np.argmin(excess.sum(axis=0)))]
    return title, tried[title]


def _criteria(candidates: Sequence[Fit | None]) -> list[float]:
    """Hannan and Quinn's criterion of each structure, all with the least discrepancy needed."""
    least = min((fit.discrepancy for fit in candidates if fit is not None), default=0.0)
    found = []
    for fit in candidates:
        if fit is None:
            found.append(1e12)
            continue
        at = fit.moments
        has = (at.implied > 0.0) & (np.diag(at.statistical) > 0.0)
        implied, block = at.implied[has], np.ix_(has, has)
        covariance = at.statistical[block] + np.diag((least * implied) ** 2)
        target = np.maximum(at.target[has], 0.0)
        free = len({*fit.keys, *fit.upper_bounds})
        statistic = chi_square(target, implied, covariance, implied)[1]
        found.append(statistic + penalty(fit.wv.n) * free)
    return found
