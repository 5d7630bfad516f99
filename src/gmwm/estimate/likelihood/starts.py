"""Further points from which the top of a likelihood may be reached.

Where the model is not that of the data, the estimates by the method of moments may lie in a corner
from which the likelihood does not climb to its top. A few points spread over the shapes that the
record can show (a Sobol sequence: Sobol 1967, *USSR Computational Mathematics and Mathematical
Physics* 7, 86-112), each with amplitudes near the wavelet variances, cost one likelihood each.
"""

from __future__ import annotations

import numpy as np
import scipy

from gmwm.errors import InputError
from gmwm.estimate.likelihood.series import Series
from gmwm.estimate.moments import Design
from gmwm.estimate.problem import Moments, Scales, solve_nonnegative
from gmwm.process import Model, Process, Shape

_LOG2_COUNT = 3
_LEAST_LEFT = 0.01  # of a wavelet variance, after removing a drift
_SMALL = 0.1  # of the variance that is all of the data: of terms that are not needed


def candidates(series: Series) -> list[tuple[Process, ...]]:
    """Values of the noise terms of a series' model, eight sets where a shape is open."""
    try:
        design = Design(Model(series.coordinates.noise), Scales.of(series.wv))
    except InputError:
        return []  # coefficients of which some are given span no grid
    moments = Moments.of(series.wv, series.coordinates.model)
    target = np.maximum(moments.target, _LEAST_LEFT * series.wv.variance)
    if not design.shaped:
        return [_with_amplitudes(design, _at(design, np.zeros(0)), target)]
    points = scipy.stats.qmc.Sobol(len(design.shaped), scramble=False).random_base2(_LOG2_COUNT)
    centred = points + 0.5 / 2**_LOG2_COUNT
    return [_with_amplitudes(design, _at(design, point), target) for point in centred]


def _at(design: Design, point: np.ndarray) -> list[Shape]:
    """The shapes at these fractions (0 to 1) of the grids of the terms with an open shape."""
    fractions = dict(zip(design.shaped, point, strict=True))
    shapes = []
    for i in range(len(design.terms)):
        grid = design.grid(i)
        shapes.append(grid[int(fractions.get(i, 0.0) * len(grid))])
    return shapes


def _with_amplitudes(
    design: Design, shapes: list[Shape], target: np.ndarray
) -> tuple[Process, ...]:
    """The terms with the amplitudes of least relative squares, all of them positive."""
    curves = design.curves(shapes) / target[:, None]
    given = [i for i in range(len(design.terms)) if i not in design.linear]
    free = curves[:, list(design.linear)]
    x, _ = solve_nonnegative(free, 1.0 - curves[:, given].sum(axis=1))
    highest = np.maximum(np.max(free, axis=0, initial=0.0), np.finfo(float).tiny)
    return tuple(design.fitted_processes(np.maximum(x, _SMALL / highest), shapes))
