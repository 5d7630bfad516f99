"""A model as the estimator sees it: linear amplitudes times curves of non-linear shapes.

The wavelet variance of a model is ``offset(z) + U(z) x``: the columns of U are the curves of the
terms at unit amplitude, x >= 0 their free squared scales (or variances), z the free shape
parameters mapped to the real line, and the offset holds the terms of fixed amplitude. Rate ramps
are regressors, see `gmwm.estimate.problem.ramp`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.problem.moments import Scales
from gmwm.estimate.problem.parameters import Coordinates, difference
from gmwm.process import Model, Process, Shape

_STEP = 1e-5  # of central differences in z, whose natural scale is 1
_SIMULATED_STEP = 0.05  # where a simulation may move in jumps


class Design:
    """The moment curves of a model over the free parameters.

    owners: For each element of z, the term it belongs to.
    Raises InputError if the model has no noise, or a process that cannot be fitted in part is fixed
        in part.
    """

    def __init__(self, model: Model, scales: Scales) -> None:
        self.coordinates, self.scales = Coordinates(model), scales
        self.terms = self.coordinates.terms
        for term in self.terms:
            if 0 < term.n_shapes < term.free_shape.size and not term.process.separable_shape:
                raise InputError(
                    f"{term.process!r} has some coefficients fixed and some free: fix all or none"
                )
        self.linear = tuple(i for i, term in enumerate(self.terms) if term.free_scale)
        self.shaped = tuple(i for i, term in enumerate(self.terms) if term.n_shapes)
        shapes = [i for i, is_amplitude in self.coordinates.owners if not is_amplitude]
        self.owners = np.array(shapes, dtype=int)
        self._own: dict[Any, Any] = {}
        self._last: dict[int, tuple[Shape, FloatArray]] = {}
        self._parts: dict[tuple[int, ...], Design] = {}

    @property
    def model(self) -> Model:
        """With open parameters."""
        return self.coordinates.model

    @property
    def n_free(self) -> int:
        """Number of free parameters of the stochastic part."""
        return len(self.coordinates.owners)

    # -- one term ---------------------------------------------------------------------------------

    def at_shape(self, i: int, shape: Shape) -> Process:
        """Term ``i`` at a shape, with unit amplitude where that is free."""
        process, is_free = self.terms[i].process, self.terms[i].free_scale
        return process.at_unit(shape) if is_free else process.with_shape(shape)

    def unit_terms(self, shapes: Sequence[Shape]) -> list[Process]:
        """`at_shape` of all terms."""
        return [self.at_shape(i, shape) for i, shape in enumerate(shapes)]

    def curve(self, i: int, shape: Shape) -> FloatArray:
        """Wavelet variance of `at_shape`, (J,)."""
        known = self._last.get(i)
        if known is None or known[0] != shape:
            if self.terms[i].free_scale:
                found = self.scales.unit_curve(self.terms[i].process, shape)
            else:
                found = self.scales.curve(self.at_shape(i, shape))
            known = self._last[i] = shape, found
        return known[1]

    def grid(self, i: int) -> list[Shape]:
        """Starting shapes of term ``i``, with fixed parameters at their value; see `_cached`."""
        term, own = self.terms[i], self.terms[i].process.shape_values
        if not term.n_shapes:
            return [own]

        def make() -> list[Shape]:
            shapes = term.process.shape_grid(self.scales.dt, self.scales.n)
            filled = {
                tuple(v if free else o for v, o, free in zip(s, own, term.free_shape, strict=True))
                for s in shapes
            }
            return sorted(filled)

        return self._cached("grid", i, make)

    def grid_curves(self, i: int) -> FloatArray:
        """Curves of term ``i`` on its grid, (J, G)."""
        shapes = self.grid(i)
        return self._cached("curves", i, lambda: self._stacked(i, shapes))

    def dense_grid(self, i: int) -> tuple[list[Shape], FloatArray]:
        """Shapes and curves of the grid with geometric means in between, for ordered kinds.

        The finest levels of long records are known to a thousandth, and a mixture of these curves
        must not fail because of its grid.
        """
        if not self.terms[i].process.ordered_by:
            return self.grid(i), self.grid_curves(i)

        def make() -> tuple[list[Shape], FloatArray]:
            values = np.array([shape[0] for shape in self.grid(i)])
            middle = np.sqrt(values[1:] * values[:-1])
            shapes: list[Shape] = [(float(v),) for v in np.sort(np.concatenate([values, middle]))]
            return shapes, self._stacked(i, shapes)

        found: tuple[list[Shape], FloatArray] = self._cached("dense", i, make)
        return found

    def _stacked(self, i: int, shapes: Sequence[Shape]) -> FloatArray:
        """Curves of term ``i`` at some shapes, (J, k)."""
        return np.stack([self.curve(i, shape) for shape in shapes], axis=1)

    def _cached(self, name: str, i: int, make: Callable[[], Any]) -> Any:
        """A value that depends on a term and the levels only, shared by designs of these levels."""
        term = self.terms[i]
        plain = term.process.is_plain and not self.scales.is_simulated(term.process)
        kept = self.scales.shared if plain and term.n_shapes else self._own
        key = name, term.process
        if key not in kept:
            kept[key] = make()
        return kept[key]

    # -- z <-> shapes -----------------------------------------------------------------------------

    def pack(self, shapes: Sequence[Shape]) -> FloatArray:
        """The free shape parameters of all terms on the real line."""
        chosen = ((self.terms[i], shapes[i]) for i in self.shaped)
        parts = [term.process.shape_to_free(shape)[term.free_shape] for term, shape in chosen]
        return np.concatenate([np.zeros(0), *parts])

    def unpack(self, z: FloatArray, template: Sequence[Shape]) -> list[Shape]:
        """Shapes of all terms; fixed parameters are taken from ``template``."""
        shapes = list(template)
        start = 0
        for i in self.shaped:
            count = self.terms[i].n_shapes
            shapes[i] = self.terms[i].moved(template[i], z[start : start + count])
            start += count
        return shapes

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """How far z may go: `SEARCH_REACH` beyond the grids."""
        low, high = [np.zeros(0)], [np.zeros(0)]
        for i in self.shaped:
            term = self.terms[i]
            free = self._cached("free", i, partial(self._free_grid, i))
            low.append((free.min(axis=0) - tuning.SEARCH_REACH)[term.free_shape])
            high.append((free.max(axis=0) + tuning.SEARCH_REACH)[term.free_shape])
        return np.concatenate(low), np.concatenate(high)

    def _free_grid(self, i: int) -> FloatArray:
        return np.array([self.terms[i].process.shape_to_free(shape) for shape in self.grid(i)])

    def part(self, present: Sequence[int]) -> Design:
        """The design of some of the terms."""
        key = tuple(present)
        if key not in self._parts:
            self._parts[key] = Design(Model(tuple(self.terms[i].process for i in key)), self.scales)
        return self._parts[key]

    # -- curves -----------------------------------------------------------------------------------

    def curves(self, shapes: Sequence[Shape]) -> FloatArray:
        """Curves of all terms at unit free amplitude, (J, terms)."""
        result = np.empty((self.scales.tau.size, len(self.terms)))
        for i, shape in enumerate(shapes):
            result[:, i] = self.curve(i, shape)
        return result

    def implied(self, x: FloatArray, shapes: Sequence[Shape]) -> FloatArray:
        """Wavelet variance of the noise, u^2, (J,)."""
        return np.asarray(self.curves(shapes) @ self.amplitudes(x))

    def amplitudes(self, x: FloatArray) -> FloatArray:
        """Amplitudes of all terms, 1 where fixed, (terms,)."""
        result = np.ones(len(self.terms))
        result[list(self.linear)] = x
        return result

    def shape_derivatives(self, shapes: Sequence[Shape]) -> FloatArray:
        """Derivative of each term's curve by its own z, at unit free amplitude, (J, z)."""
        slopes = [self._slopes(i, shapes[i])[:, self.terms[i].free_shape] for i in self.shaped]
        return np.hstack([np.zeros((self.scales.tau.size, 0)), *slopes])

    def _slopes(self, i: int, shape: Shape) -> FloatArray:
        """Derivative of a curve by all its coordinates, (J, s)."""
        process, scales = self.terms[i].process, self.scales
        is_simulated = scales.is_simulated(process)
        if self.terms[i].free_scale and scales.wavelet == "haar" and not is_simulated:
            known = process.unit_haar_slopes(shape, scales.tau, scales.dt)
            if known is not None:
                return known
        z, width = process.shape_to_free(shape), _SIMULATED_STEP if is_simulated else _STEP

        def curve(z: FloatArray) -> FloatArray:
            return self.curve(i, process.shape_from_free(z))

        return np.stack([difference(curve, z, k, width) for k in range(z.size)], axis=1)

    # -- models -----------------------------------------------------------------------------------

    def fitted_processes(self, x: FloatArray, shapes: Sequence[Shape]) -> list[Process]:
        """The terms with estimated values.

        Shapes that came out equal, as those of terms without amplitude do, are moved apart.
        """
        result: list[Process] = []
        seen: set[tuple[type, Shape]] = set()
        for i, (amplitude, shape) in enumerate(zip(self.amplitudes(x), shapes, strict=True)):
            term = self.terms[i]
            while shape and (type(term.process), shape) in seen:
                shape = (shape[0] * (1.0 + 1e-9), *shape[1:])
            seen.add((type(term.process), shape))
            process = self.at_shape(i, shape)
            result.append(process.with_amplitude(float(amplitude)) if term.free_scale else process)
        return result

    def fitted_noise(self, x: FloatArray, shapes: Sequence[Shape]) -> Model:
        """The model of the terms that have an amplitude; of the first one if none has."""
        fitted = self.fitted_processes(x, shapes)
        amplitude = self.amplitudes(x)
        present = [process for process, a in zip(fitted, amplitude, strict=True) if a > 0.0]
        return Model(tuple(present or fitted[:1]))
