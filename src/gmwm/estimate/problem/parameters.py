"""The free parameters of a model's noise: keys, coordinates, processes and the Jacobian between.

Coordinates are real numbers without bounds. An amplitude (the power of the scale or variance that
is a factor of the spectrum) enters by its logarithm, shapes as each process maps them. Rate ramps
are regressors and have no coordinate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gmwm._core.typing import BoolArray, FloatArray
from gmwm.errors import InputError
from gmwm.process import Model, Parameter, Process, Shape

_STEP = 1e-6  # of central differences of a process's own map


def difference(function: Callable[[FloatArray], Any], z: FloatArray, k: Any, step: float) -> Any:
    """Derivative of a function by coordinate k of z, as a central difference."""
    move = np.zeros(z.size)
    move[k] = step
    return (function(z + move) - function(z - move)) / (2.0 * step)


@dataclass(frozen=True, eq=False)
class Term:
    """A noise term of a model, and which of its parameters are free.

    free_shape: (s,) of bool, which shape parameters are open.
    """

    process: Process
    place: int
    free_scale: bool
    free_shape: BoolArray

    @classmethod
    def of(cls, process: Process, place: int) -> Term:
        linear, values = process.linear_parameter, process.values
        free_scale = linear is not None and values[linear.name] is None
        shape = [values[p.name] is None for p in process.shape_parameters]
        return cls(process, place, free_scale, np.array(shape, dtype=bool))

    @cached_property
    def linear(self) -> Parameter:
        """The linear parameter, which every term of free scale has."""
        return next(p for p in self.process.parameters if p.linear)

    @cached_property
    def n_shapes(self) -> int:
        """Number of free shape parameters."""
        return int(np.sum(self.free_shape))

    def moved(self, shape: Shape, free: FloatArray) -> Shape:
        """A shape with its free part at other coordinates, fixed parameters exactly as they are."""
        if not free.size:
            return shape
        if free.size == self.free_shape.size:
            return self.process.shape_from_free(free)
        point = self.process.shape_to_free(shape)
        point[self.free_shape] = free
        found = self.process.shape_from_free(point)
        pairs = zip(found, shape, self.free_shape, strict=True)
        return tuple(new if is_free else old for new, old, is_free in pairs)

    def shape_jacobian(self, shape: Shape) -> FloatArray:
        """Derivative of the free shape parameters by their coordinates, (s, s)."""
        z, free = self.process.shape_to_free(shape), np.flatnonzero(self.free_shape)

        def found(z: FloatArray) -> FloatArray:
            return np.array(self.process.shape_from_free(z))[free]

        return np.stack([difference(found, z, k, _STEP) for k in free], axis=1)


class Coordinates:
    """Free parameters of the noise terms of a model, in the order of the terms.

    owners: For each coordinate, its noise term and whether it is the amplitude.
    names: For each coordinate, its noise term and the name of the parameter.
    Raises InputError if the model has no noise.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self.terms = tuple(
            Term.of(process, place)
            for place, process in enumerate(model.terms)
            if not process.is_drift
        )
        if not self.terms:
            raise InputError(f"{model!r} has no noise process: add WhiteNoise() at least")
        self.names: list[tuple[int, str]] = []
        self.owners: list[tuple[int, bool]] = []
        self._places: list[tuple[slice, slice]] = []  # coordinates of amplitude and shape, by term
        for i, term in enumerate(self.terms):
            shapes = zip(term.process.shape_parameters, term.free_shape, strict=True)
            start, names = len(self.names), [term.linear.name] if term.free_scale else []
            names += [parameter.name for parameter, free in shapes if free]
            self.names += [(i, name) for name in names]
            self.owners += [(i, k == 0 and term.free_scale) for k in range(len(names))]
            middle = start + int(term.free_scale)
            self._places.append((slice(start, middle), slice(middle, start + len(names))))

    @property
    def noise(self) -> tuple[Process, ...]:
        """The noise terms as in the model, with open parameters."""
        return tuple(term.process for term in self.terms)

    def pack(self, processes: Sequence[Process]) -> FloatArray:
        """Coordinates of the terms with these values, (d,)."""
        z = np.empty(len(self.owners))
        for term, process, (scale, shape) in zip(self.terms, processes, self._places, strict=True):
            if term.free_scale:
                value = process.values[term.linear.name] or 0.0
                z[scale] = term.linear.power * np.log(value)
            z[shape] = process.shape_to_free(process.shape_values)[term.free_shape]
        return z

    def processes(self, z: FloatArray, like: Sequence[Process]) -> tuple[Process, ...]:
        """The terms at ``z``; fixed parameters are taken from ``like``.

        Raises InputError where a parameter is out of range.
        """
        return tuple([self.process(i, z, process) for i, process in enumerate(like)])

    def process(self, i: int, z: FloatArray, like: Process) -> Process:
        """Term ``i`` at ``z``, as in `processes`."""
        term, (scale, shape) = self.terms[i], self._places[i]
        changes: dict[str, float] = {}
        with np.errstate(over="ignore"):
            if term.free_scale:
                changes[term.linear.name] = float(np.exp(z[scale] / term.linear.power)[0])
            if term.n_shapes:
                found = term.moved(like.shape_values, z[shape])
                named = zip(like.shape_parameters, found, term.free_shape, strict=True)
                changes.update({p.name: value for p, value, is_free in named if is_free})
        return like.with_values(**changes)

    def jacobian(self, processes: Sequence[Process]) -> FloatArray:
        """Derivative of the parameters by z at these values, (d, d), block diagonal."""
        matrix = np.zeros((len(self.owners), len(self.owners)))
        for term, process, (scale, shape) in zip(self.terms, processes, self._places, strict=True):
            if term.free_scale:
                value = float(process.values[term.linear.name] or 0.0)
                matrix[scale, scale] = value / term.linear.power
            if term.n_shapes:
                matrix[shape, shape] = term.shape_jacobian(process.shape_values)
        return matrix

    def without(self, dropped: Sequence[int]) -> Coordinates:
        """Coordinates of the model without some noise terms (indices into ``terms``)."""
        places = {self.terms[i].place for i in dropped}
        kept = (term for place, term in enumerate(self.model.terms) if place not in places)
        return Coordinates(Model(tuple(kept)))

    def fitted(
        self, processes: Sequence[Process], slope: float | None = None
    ) -> tuple[Model, list[str]]:
        """The whole model with values, its terms in order, and the key of each coordinate."""
        values = {term.place: process for term, process in zip(self.terms, processes, strict=True)}
        terms = [values.get(place, term) for place, term in enumerate(self.model.terms)]
        if slope is not None:
            terms = [
                t.with_values(**{t.parameters[0].name: slope}) if t.is_drift else t for t in terms
            ]
        model = Model(tuple(terms))
        # The model sorts terms of a kind, but keeps the objects.
        moved = {id(term): place for place, term in enumerate(model.terms)}
        by_term = keys_by_term(model)
        return model, [
            by_term[moved[id(terms[self.terms[i].place])], name] for i, name in self.names
        ]


def keys_by_term(model: Model) -> Mapping[tuple[int, str], str]:
    """(Place of a term, name of its parameter) -> key in ``model.params``."""
    return {(item.term, item.parameter.name): item.key for item in model.parameters}


def drift_key(model: Model) -> str | None:
    """Key of the slope of a model's rate ramp, if it has one."""
    return next((item.key for item in model.parameters if model.terms[item.term].is_drift), None)
