"""A composite error model: the flat sum of independent processes."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gmwm._core import checks
from gmwm._core.documents import plain_schema
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process.base import Process
from gmwm.process.parameter import Parameter
from gmwm.process.state_space import StateSpace, numbered_names

_TERM = re.compile(r"\s*(?:([1-9])\s*\*?\s*)?(\w+)\s*(?:\(\s*\))?\s*")


@dataclass(frozen=True)
class ModelParameter:
    """A parameter of one term of a model.

    key: Its name in ``model.params``, e.g. ``"sigma_2"``.
    """

    key: str
    term: int
    parameter: Parameter
    value: float | None


class Model:
    """Sum of independent error processes.

    Made with ``+`` and ``2 * process``. Gauss-Markov terms whose correlation times are given are
    put in the order of rising time.

    Raises
    ------
    InputError
        If two terms cannot be distinguished: two of a kind without a shape parameter, or two of
        equal given shape.

    Examples
    --------
    >>> from gmwm import GaussMarkov, WhiteNoise
    >>> WhiteNoise() + 2 * GaussMarkov()
    WhiteNoise() + 2 * GaussMarkov()
    >>> (WhiteNoise(N=0.2) + GaussMarkov(sigma=1, tau=5)).params
    {'N': 0.2, 'sigma': 1.0, 'tau': 5.0}
    """

    terms: tuple[Process, ...]

    def __init__(self, terms: tuple[Process, ...]) -> None:
        ordered = list(terms)
        if not ordered:
            raise InputError("a model needs at least one process")
        for kind in {type(term) for term in terms if term.ordered_by}:
            places = [i for i, term in enumerate(terms) if type(term) is kind]
            keys = {i: terms[i].values[kind.ordered_by] for i in places}
            if None not in keys.values():
                ranked = sorted(places, key=lambda i: keys[i] or 0.0)
                for place, source in zip(places, ranked, strict=True):
                    ordered[place] = terms[source]
        _check_distinct(tuple(ordered))
        object.__setattr__(self, "terms", tuple(ordered))

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("a Model does not change: make a new one")

    @cached_property
    def parameters(self) -> tuple[ModelParameter, ...]:
        """All parameters, term by term; keys with _1, _2, ... where several would share one."""
        keys = [term.prefix + p.name for term in self.terms for p in term.parameters]
        numbered = iter(numbered_names(keys, "_"))
        return tuple(
            ModelParameter(next(numbered), index, p, term.values[p.name])
            for index, term in enumerate(self.terms)
            for p in term.parameters
        )

    @property
    def params(self) -> dict[str, float | None]:
        """Key -> value, ``None`` where open; see `ModelParameter.key`."""
        return {item.key: item.value for item in self.parameters}

    @property
    def is_open(self) -> bool:
        """Whether any parameter is left open."""
        return any(term.is_open for term in self.terms)

    def with_params(self, params: Mapping[str, float | None]) -> Model:
        """A copy with other parameter values, by key.

        Raises
        ------
        InputError
            For an unknown key or a value out of range.
        """
        known = self.params
        unknown = [key for key in params if key not in known]
        if unknown:
            raise InputError(
                f"the model {self!r} has no parameter {unknown[0]!r}: it has {', '.join(known)}"
            )
        changes: list[dict[str, float | None]] = [{} for _ in self.terms]
        for item in self.parameters:
            if item.key in params:
                changes[item.term][item.parameter.name] = params[item.key]
        terms = zip(self.terms, changes, strict=True)
        return Model(tuple(term.with_values(**change) for term, change in terms))

    def opened(self) -> Model:
        """A copy with every parameter open."""
        return self.with_params(dict.fromkeys(self.params))

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        """Two-sided spectral density (u^2/Hz) at ``f`` (Hz), without lines; see `Process.psd`."""
        self.require_given()
        f = np.asarray(f, dtype=float)
        return np.sum([term.psd(f, dt) for term in self.terms], axis=0, dtype=float)

    def lines(self) -> tuple[tuple[float, float], ...]:
        """Spectral lines of all terms as (frequency in Hz, amplitude in u)."""
        return tuple(line for term in self.terms for line in term.lines())

    def white_density(self) -> float:
        """Power spectral density of the white terms, u^2/Hz."""
        white = (term for term in self.terms if term.is_white)
        return float(sum(term.psd(np.ones(1), 1.0)[0] for term in white))

    def drift_rate(self) -> float:
        """Deterministic slope, u/s."""
        return float(sum(term.drift_rate() for term in self.terms))

    def haar_variance(self, tau: FloatArray, dt: float) -> FloatArray:
        """Haar wavelet variance (u^2) at times ``tau`` (s); see `Process.haar_variance`."""
        return self.wavelet_variance(tau, dt)

    def wavelet_variance(self, tau: FloatArray, dt: float, wavelet: str = "haar") -> FloatArray:
        """Wavelet variance (u^2) at times ``tau`` (s); see `Process.wavelet_variance`."""
        return np.sum(self.component_variances(tau, dt, wavelet), axis=0)

    def component_variances(self, tau: FloatArray, dt: float, wavelet: str = "haar") -> FloatArray:
        """Wavelet variance of each term, shape (terms,) + tau.shape, in u^2."""
        self.require_given()
        tau = np.asarray(tau, dtype=float)
        return np.stack([term.wavelet_variance(tau, dt, wavelet) for term in self.terms])

    def autocovariance(self, lag: FloatArray, dt: float) -> FloatArray:
        """Autocovariance (u^2) at lags in samples, of stationary models."""
        self.require_given()
        return np.sum([term.autocovariance(lag, dt) for term in self.terms], axis=0)

    def state_space(self, dt: float) -> StateSpace:
        """State-space form: the terms' states stacked, white noise as measurement noise."""
        return StateSpace.stack([term.state_space(dt) for term in self.terms])

    def simulate(
        self, n: int, dt: float, seed: int | np.random.Generator | None = None
    ) -> FloatArray:
        """Draw ``n`` samples, in u; see `Process.simulate`."""
        self.require_given()
        rng = checks.generator(seed)
        total = self.terms[0].simulate(n, dt, rng)
        for term in self.terms[1:]:
            total += term.simulate(n, dt, rng)
        return total

    def require_given(self, where: str = "the model") -> None:
        """Raise InputError if a parameter is open; its message shows how to give it."""
        missing = [key for key, value in self.params.items() if value is None]
        if missing:
            written = " + ".join(
                f"{type(term).__name__}({', '.join(f'{name}=...' for name in term.values)})"
                for term in self.terms
            )
            raise InputError(
                f"{where} {self!r} has free parameters ({', '.join(missing)}): estimate them with "
                f"gmwm.fit, or give values, {written}"
            )

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        return plain_schema(model_from_list, lambda model: [t.to_dict() for t in model.terms])

    def title(self) -> str:
        """Its terms in a few words: ``white noise + 2 Gauss-Markov``."""
        counts = Counter(term.title() for term in self.terms)
        return " + ".join(f"{n} {title}" if n > 1 else title for title, n in counts.items())

    def term_labels(self) -> list[str]:
        """One label per term, numbered where a kind occurs more than once."""
        return numbered_names([term.title() for term in self.terms])

    def __add__(self, other: Any) -> Model:
        return Model((*self.terms, *as_model(other).terms))

    def __radd__(self, other: Any) -> Model:
        # sum([...]) starts from 0
        if isinstance(other, int) and other == 0:
            return self
        return as_model(other) + self

    def __rmul__(self, times: int) -> Model:
        if not isinstance(times, int | np.integer) or isinstance(times, bool) or times < 1:
            raise InputError(f"{times!r} * process: the number of terms must be 1 or more, whole")
        return Model(self.terms * int(times))

    __mul__ = __rmul__

    def __repr__(self) -> str:
        counts = Counter(self.terms)
        return " + ".join(f"{n} * {term!r}" if n > 1 else repr(term) for term, n in counts.items())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and self.terms == other.terms

    def __hash__(self) -> int:
        return hash(self.terms)


def as_model(model: Process | Model | str) -> Model:
    """A model as it is, of a process, or of a text such as "N + K + 2 GM".

    A text has short names or class names, of the user's own processes too; InputError otherwise.
    """
    if isinstance(model, Model | Process):
        return model if isinstance(model, Model) else Model((model,))
    if not isinstance(model, str):
        raise InputError(f"{checks.shown(model)} is not an error model: write one like 'N + 2 GM'")
    kinds, terms = _kinds(), []
    for part in model.split("+"):
        found = _TERM.fullmatch(part)
        if found is None or found[2] not in kinds:
            known = {kind.short_name for kind in kinds.values() if kind.short_name[0] != "_"}
            names = ", ".join(sorted(known, key=lambda name: (len(name), name)))
            raise InputError(
                f"{checks.shown(part.strip())} is not a term: write {names} with +, e.g. "
                "'N + K + 2 GM'"
            )
        terms += [{"process": found[2]}] * int(found[1] or 1)
    return model_from_list(terms)


def _kinds() -> dict[str, type[Process]]:
    """Every process defined so far by short name and class name; the latest of a name."""
    kinds = [Process]
    for kind in kinds:
        kinds += kind.__subclasses__()
    return {name: kind for kind in kinds[1:] for name in (kind.short_name, kind.__name__)}


def model_from_list(content: Sequence[Mapping[str, Any]]) -> Model:
    """The model whose terms were written with ``to_dict``."""
    kinds, terms = _kinds(), []
    for item in content:
        arguments = dict(item)
        name = arguments.pop("process", None)
        if name not in kinds:
            raise InputError(
                f"unknown process {name!r}: import the module that defines it, then load"
            )
        try:
            terms.append(kinds[name](**arguments))
        except TypeError as error:
            raise InputError(f"{name}: {error}") from None
    return Model(tuple(terms))


def _check_distinct(terms: tuple[Process, ...]) -> None:
    seen: set[Any] = set()
    for term in terms:
        kind, name = type(term), type(term).__name__
        shape = {p.name: term.values[p.name] for p in term.shape_parameters}
        if (kind in seen and not term.is_repeatable) or (kind, *shape.values()) in seen:
            values = ", ".join(f"{key} = {value:g}" for key, value in shape.items())
            equal = f" of equal {values}" if term.is_repeatable else ""
            raise InputError(
                f"two {name}{equal} in one model cannot be distinguished: keep one "
                "(variances add up)"
            )
        seen.add(kind)
        if None not in shape.values():
            seen.add((kind, *shape.values()))


def simulate(
    model: Process | Model | str,
    n: int,
    dt: float | None = None,
    seed: int | np.random.Generator | None = None,
    *,
    rate: float | None = None,
) -> FloatArray:
    """Draw ``n`` samples of an error model, in u.

    Parameters
    ----------
    model : Process or Model
        With all parameters given.
    n : int
    dt, rate : float
        Sampling interval, s, or rate, Hz.
    seed : int or numpy.random.Generator, optional

    Returns
    -------
    (n,) ndarray
        Stationary processes start in their stationary state, walks and ramps at zero.

    Raises
    ------
    InputError
        If a parameter is open, or ``n``, ``dt`` or ``rate`` is not positive.
    """
    return as_model(model).simulate(n, checks.sampling_interval(dt, rate), seed)
