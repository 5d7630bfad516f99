"""The open parameters of a model's noise as a point of the whole real space.

Scales and variances enter as the logarithm of the amplitude (the power of the parameter that is a
factor of the spectrum), shapes as each process maps them. Rate ramps take no part: they are
regressors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.process import Model, Process, RateRamp
from gmwm.process.base import Shape

_STEP = 1e-6


def shape_jacobian(process: Process, shape: Shape, free: FloatArray) -> FloatArray:
    """Derivative of the free shape parameters by their z, (s, s); ``free`` (all,) marks them."""
    z = process.shape_to_free(shape)
    columns = np.flatnonzero(free)
    block = np.empty((columns.size, columns.size))
    for column, k in enumerate(columns):
        moved = []
        for step in (_STEP, -_STEP):
            point = z.copy()
            point[k] += step
            moved.append(np.array(process.shape_from_free(point)))
        block[:, column] = ((moved[0] - moved[1]) / (2.0 * _STEP))[columns]
    return block


class Coordinates:
    """Open parameters of the noise terms of a model, in the order of the terms.

    Parameters
    ----------
    model : Model
        With open parameters.

    Attributes
    ----------
    terms : tuple of Process
        The noise terms, without rate ramps.
    places : tuple of int
        Where they stand in the model.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        kept = [(i, t) for i, t in enumerate(model.terms) if not isinstance(t, RateRamp)]
        if not kept:
            raise InputError(f"{model!r} has no noise process: add WhiteNoise() at least")
        self.places = tuple(i for i, _ in kept)
        self.terms = tuple(term for _, term in kept)
        self._scaled = tuple(
            t.linear_parameter is not None and t.values[t.linear_parameter.name] is None
            for t in self.terms
        )
        self._free = tuple(
            np.array([t.values[p.name] is None for p in t.shape_parameters], dtype=bool)
            for t in self.terms
        )

    @property
    def owners(self) -> list[tuple[int, bool]]:
        """For each coordinate, its noise term and whether it is the amplitude."""
        result = []
        for i, (scaled, free) in enumerate(zip(self._scaled, self._free, strict=True)):
            result += [(i, True)] * scaled + [(i, False)] * int(np.sum(free))
        return result

    @property
    def names(self) -> list[tuple[int, str]]:
        """For each coordinate, its noise term and the name of the parameter."""
        result = []
        for i, (term, scaled, free) in enumerate(
            zip(self.terms, self._scaled, self._free, strict=True)
        ):
            if scaled and term.linear_parameter is not None:
                result.append((i, term.linear_parameter.name))
            result += [(i, p.name) for p, f in zip(term.shape_parameters, free, strict=True) if f]
        return result

    def pack(self, processes: Sequence[Process]) -> FloatArray:
        """Coordinates of the terms with these values, (d,)."""
        z: list[float] = []
        for process, scaled, free in zip(processes, self._scaled, self._free, strict=True):
            linear = process.linear_parameter
            if scaled and linear is not None:
                z.append(float(linear.power * np.log(process.values[linear.name] or 0.0)))
            z += list(process.shape_to_free(_shape(process))[free])
        return np.array(z)

    def processes(self, z: FloatArray, like: Sequence[Process]) -> tuple[Process, ...]:
        """The terms at ``z``; given parameters are taken from ``like``.

        Raises
        ------
        InputError
            Where a parameter is out of range.
        """
        with np.errstate(over="ignore"):
            return self._processes(z, like)

    def _processes(self, z: FloatArray, like: Sequence[Process]) -> tuple[Process, ...]:
        result = []
        start = 0
        for process, scaled, free in zip(like, self._scaled, self._free, strict=True):
            changes: dict[str, float] = {}
            linear = process.linear_parameter
            if scaled and linear is not None:
                changes[linear.name] = float(np.exp(z[start] / linear.power))
                start += 1
            count = int(np.sum(free))
            if count:
                point = process.shape_to_free(_shape(process))
                point[free] = z[start : start + count]
                start += count
                shape = process.shape_from_free(point)
                named = zip(process.shape_parameters, shape, free, strict=True)
                changes.update({p.name: value for p, value, is_free in named if is_free})
            result.append(process.with_values(**changes))
        return tuple(result)

    def jacobian(self, processes: Sequence[Process]) -> FloatArray:
        """Derivative of the parameters by z at these values, (d, d), block diagonal."""
        size = len(self.owners)
        matrix = np.zeros((size, size))
        start = 0
        for process, scaled, free in zip(processes, self._scaled, self._free, strict=True):
            linear = process.linear_parameter
            if scaled and linear is not None:
                matrix[start, start] = float(process.values[linear.name] or 0.0) / linear.power
                start += 1
            count = int(np.sum(free))
            if count:
                block = slice(start, start + count)
                matrix[block, block] = shape_jacobian(process, _shape(process), free)
                start += count
        return matrix

    def without(self, dropped: Sequence[int]) -> Coordinates:
        """The same for the model less some noise terms (indices into ``terms``)."""
        places = {self.places[i] for i in dropped}
        return Coordinates(
            Model(tuple(t for i, t in enumerate(self.model.terms) if i not in places))
        )


def fitted_model(
    model: Model, values: Mapping[int, Process]
) -> tuple[Model, dict[tuple[int, str], str]]:
    """The model with terms replaced by those with values, in order, and the keys by old place.

    Parameters
    ----------
    model : Model
        With open parameters.
    values : mapping of int to Process
        Place in the model -> process with values.

    Returns
    -------
    fitted : Model
        With Gauss-Markov terms by rising correlation time.
    keys : dict
        (place in ``model``, name of the parameter) -> key in ``fitted.params``.
    """
    terms = [values.get(i, term) for i, term in enumerate(model.terms)]
    fitted = Model(tuple(terms))
    by_term = {(item.term, item.parameter.name): item.key for item in fitted.parameters}
    keys = {}
    for place, term in enumerate(terms):
        moved = next(i for i, other in enumerate(fitted.terms) if other is term)
        keys.update({(place, p.name): by_term[moved, p.name] for p in term.parameters})
    return fitted, keys


def _shape(process: Process) -> Shape:
    return tuple(float(process.values[p.name] or 0.0) for p in process.shape_parameters)
