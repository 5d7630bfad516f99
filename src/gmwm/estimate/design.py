"""A model as the estimator sees it: linear amplitudes times curves of non-linear shapes.

The wavelet variance of a model is ``offset(z) + U(z) x``: the columns of U are the curves of the
terms at unit amplitude, x >= 0 their free squared scales (or variances), z the free shape
parameters mapped to the real line, and the offset holds the terms of given amplitude. Rate ramps
take no part: they are deterministic, see `gmwm.estimate.ramp`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.scales import Scales
from gmwm.process import GaussMarkov, Model, Parameter, Process
from gmwm.process.base import Shape

_STEP = 1e-5  # of central differences in z, whose natural scale is 1
_SIMULATED_STEP = 0.05  # where a simulation may move in jumps
_REACH = 7.0  # how far beyond the grid of starting values z may go (factor 1000 for a time)


@dataclass(frozen=True, eq=False)
class Term:
    """One stochastic term of a model and what of it is to be estimated.

    Attributes
    ----------
    process : Process
        As given, with open parameters.
    index : int
        Its place in the model.
    free_scale : bool
        Whether the linear parameter is open.
    free_shape : (s,) ndarray of bool
        Which shape parameters are open.
    """

    process: Process
    index: int
    free_scale: bool
    free_shape: FloatArray

    @classmethod
    def of(cls, process: Process, index: int) -> Term:
        linear = process.linear_parameter
        values = process.values
        shape = [values[p.name] is None for p in process.shape_parameters]
        if any(shape) and not all(shape) and not process.separable_shape:
            raise InputError(
                f"{process!r} has some coefficients given and some open: give all or none"
            )
        free_scale = linear is not None and values[linear.name] is None
        return cls(process, index, free_scale, np.array(shape, dtype=bool))

    @property
    def linear_parameter(self) -> Parameter:
        """The linear parameter, which every term of free scale has."""
        return next(p for p in self.process.parameters if p.linear)

    def with_shape(self, shape: Shape) -> Process:
        """The process at this shape and unit amplitude (its own one, where given)."""
        names = [p.name for p in self.process.shape_parameters]
        values: dict[str, float | None] = dict(zip(names, shape, strict=True))
        linear = self.process.linear_parameter
        if linear is not None and self.free_scale:
            values[linear.name] = 1.0
        return self.process.with_values(**values)

    def curve(self, shape: Shape, scales: Scales) -> FloatArray:
        """Wavelet variance of `with_shape`, (J,)."""
        if self.free_scale:
            return scales.unit_curve(self.process, shape)
        return scales.curve(self.with_shape(shape))

    def grid(self, scales: Scales) -> list[Shape]:
        """Starting shapes; given parameters have their value in all of them."""
        if not np.any(self.free_shape):
            given = tuple(self.process.values[p.name] for p in self.process.shape_parameters)
            return [tuple(float(v) for v in given if v is not None)]
        shapes = self.process.shape_grid(scales.dt, scales.n)
        names = [p.name for p in self.process.shape_parameters]
        fixed = {i: self.process.values[name] for i, name in enumerate(names)}
        filled = {
            tuple(v if fixed[i] is None else float(fixed[i] or 0.0) for i, v in enumerate(shape))
            for shape in shapes
        }
        return sorted(filled)


class Design:
    """The moment curves of a model over the free parameters.

    Parameters
    ----------
    model : Model
        With open parameters.
    scales : Scales
    """

    def __init__(self, model: Model, scales: Scales) -> None:
        self.model, self.scales = model, scales
        self.terms = tuple(
            Term.of(process, index)
            for index, process in enumerate(model.terms)
            if not any(p.role == "slope" for p in process.parameters)
        )
        self.linear = tuple(i for i, term in enumerate(self.terms) if term.free_scale)
        self.shaped = tuple(i for i, term in enumerate(self.terms) if np.any(term.free_shape))
        self._grids: dict[int, list[Shape]] = {}
        self._curves: dict[int, FloatArray] = {}

    @property
    def n_free(self) -> int:
        """Number of free parameters of the stochastic part."""
        shapes = sum(int(np.sum(self.terms[i].free_shape)) for i in self.shaped)
        return len(self.linear) + shapes

    def grid(self, i: int) -> list[Shape]:
        """Starting shapes of term ``i``; terms that are alike share one list."""
        first = self._alike(i)
        if first not in self._grids:
            self._grids[first] = self.terms[first].grid(self.scales)
        return self._grids[first]

    def grid_curves(self, i: int) -> FloatArray:
        """Curves of term ``i`` on its grid, (J, G)."""
        first = self._alike(i)
        if first not in self._curves:
            term = self.terms[first]
            columns = [term.curve(shape, self.scales) for shape in self.grid(first)]
            self._curves[first] = np.stack(columns, axis=1)
        return self._curves[first]

    def _alike(self, i: int) -> int:
        return next(j for j in range(i + 1) if self.terms[j].process == self.terms[i].process)

    def fixed_shapes(self) -> list[Shape | None]:
        """The shape of each term, ``None`` where something of it is free."""
        return [
            None if np.any(term.free_shape) else term.grid(self.scales)[0] for term in self.terms
        ]

    # -- z <-> shapes -----------------------------------------------------------------------------

    def pack(self, shapes: Sequence[Shape]) -> FloatArray:
        """The free shape parameters of all terms on the real line."""
        parts = [
            self.terms[i].process.shape_to_free(shapes[i])[self.terms[i].free_shape]
            for i in self.shaped
        ]
        return np.concatenate(parts) if parts else np.zeros(0)

    def unpack(self, z: FloatArray, template: Sequence[Shape]) -> list[Shape]:
        """Shapes of all terms; given parameters are taken from ``template``."""
        shapes = list(template)
        start = 0
        for i in self.shaped:
            term = self.terms[i]
            count = int(np.sum(term.free_shape))
            free = term.process.shape_to_free(template[i])
            free[term.free_shape] = z[start : start + count]
            shape = list(term.process.shape_from_free(free))
            for k, is_free in enumerate(term.free_shape):
                if not is_free:
                    shape[k] = template[i][k]
            shapes[i] = tuple(shape)
            start += count
        return shapes

    def bounds(self, template: Sequence[Shape]) -> tuple[FloatArray, FloatArray]:
        """How far z may go: `_REACH` beyond the grids."""
        low, high = [], []
        for i in self.shaped:
            term = self.terms[i]
            free = np.array([term.process.shape_to_free(shape) for shape in self.grid(i)])
            low.append((free.min(axis=0) - _REACH)[term.free_shape])
            high.append((free.max(axis=0) + _REACH)[term.free_shape])
        if not low:
            return np.zeros(0), np.zeros(0)
        return np.concatenate(low), np.concatenate(high)

    # -- curves -----------------------------------------------------------------------------------

    def curves(self, shapes: Sequence[Shape]) -> FloatArray:
        """Curves of all terms at unit free amplitude, (J, terms)."""
        columns = [
            term.curve(shape, self.scales) for term, shape in zip(self.terms, shapes, strict=True)
        ]
        return np.stack(columns, axis=1) if columns else np.zeros((self.scales.tau.size, 0))

    def amplitudes(self, x: FloatArray) -> FloatArray:
        """Amplitudes of all terms, 1 where given, (terms,)."""
        result = np.ones(len(self.terms))
        result[list(self.linear)] = x
        return result

    def shape_derivatives(self, shapes: Sequence[Shape]) -> FloatArray:
        """Derivative of each term's curve by its own z, at unit free amplitude, (J, z)."""
        columns = []
        for i in self.shaped:
            term = self.terms[i]
            z = term.process.shape_to_free(shapes[i])
            width = _SIMULATED_STEP if self.scales.is_simulated(term.process) else _STEP
            for k in np.flatnonzero(term.free_shape):
                pair = []
                for step in (width, -width):
                    moved = z.copy()
                    moved[k] += step
                    pair.append(term.curve(term.process.shape_from_free(moved), self.scales))
                columns.append((pair[0] - pair[1]) / (2.0 * width))
        return np.stack(columns, axis=1) if columns else np.zeros((self.scales.tau.size, 0))

    def owners(self) -> list[int]:
        """For each element of z, the term it belongs to."""
        return [i for i in self.shaped for _ in range(int(np.sum(self.terms[i].free_shape)))]

    # -- models -----------------------------------------------------------------------------------

    def fitted_processes(self, x: FloatArray, shapes: Sequence[Shape]) -> list[Process]:
        """The terms with estimated values."""
        amplitude = self.amplitudes(x)
        result: list[Process] = []
        for i, (term, shape) in enumerate(
            zip(self.terms, _distinct(self.terms, shapes), strict=True)
        ):
            process = term.with_shape(shape)
            result.append(
                process.with_amplitude(float(amplitude[i])) if term.free_scale else process
            )
        return result

    def fitted_noise(self, x: FloatArray, shapes: Sequence[Shape]) -> Model:
        """The model of the terms that have an amplitude; of the first one if none has."""
        fitted = self.fitted_processes(x, shapes)
        amplitude = self.amplitudes(x)
        present = [process for process, a in zip(fitted, amplitude, strict=True) if a > 0.0]
        return Model(tuple(present or fitted[:1]))

    def ordered(self, shapes: Sequence[Shape]) -> list[int]:
        """Order of the terms in which Gauss-Markov terms stand by rising correlation time."""
        order = list(range(len(self.terms)))
        places = [i for i in order if isinstance(self.terms[i].process, GaussMarkov)]
        ranked = sorted(places, key=lambda i: shapes[i][0])
        for place, source in zip(places, ranked, strict=True):
            order[place] = source
        return order


def _distinct(terms: Sequence[Term], shapes: Sequence[Shape]) -> list[Shape]:
    """Shapes with those moved apart that came out equal, as terms without amplitude do."""
    seen: set[tuple[type, Shape]] = set()
    result = []
    for term, shape in zip(terms, shapes, strict=True):
        while shape and (type(term.process), shape) in seen:
            shape = (shape[0] * (1.0 + 1e-9), *shape[1:])
        seen.add((type(term.process), shape))
        result.append(shape)
    return result
