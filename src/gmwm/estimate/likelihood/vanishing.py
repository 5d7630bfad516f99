"""Terms that the likelihood can do without, and how large they may be all the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from gmwm._core.typing import FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.likelihood.likelihood import Columns, LogLikelihood, defined, objective_of
from gmwm.estimate.likelihood.scoring import Maximum, maximise
from gmwm.estimate.problem import Coordinates, density, frequency_nodes
from gmwm.process import Process

_CLOSE = 0.02  # twice the error of the profile likelihood
_STEPS = 6  # to each of its points, which lie near each other
_FALL = 6.0  # log-likelihood below its maximum from where on nothing counts
_DOUBLINGS = 20
_INTERVALS = 16
_FINE = 2000


@dataclass(frozen=True, eq=False)
class Top:
    """The maximum of a likelihood over the open parameters of some terms.

    processes: The terms at the maximum.
    information: (d, d), observed information of the coordinates.
    likelihood: The log-likelihood of any processes.
    """

    processes: tuple[Process, ...]
    maximum: Maximum
    information: FloatArray
    likelihood: LogLikelihood


def redundant_term(
    coordinates: Coordinates, processes: Sequence[Process], likelihood: LogLikelihood
) -> int | None:
    """A term of free amplitude without which the likelihood is as high, if there is one."""
    value = defined(likelihood, processes)
    for i, is_amplitude in coordinates.owners:
        rest = [p for k, p in enumerate(processes) if k != i]
        if is_amplitude and rest and defined(likelihood, rest) > value - tuning.NEGLIGIBLE:
            return i
    return None


def upper_bound(process: Process, coordinates: Coordinates, top: Top, columns: Columns) -> float:
    """95 % upper bound of the scale of a term whose amplitude is zero, at its present shape.

    The quantile of the profile likelihood as a density of the scale. A random walk that can hardly
    be seen shows in few degrees of freedom, so that the likelihood falls off much slower than its
    curvature at zero shows.

    process: The term; its amplitude does not matter.
    coordinates: Of the other terms.
    top: Of the other terms.
    columns: The series.
    """
    power = next(p.power for p in process.parameters if p.linear)

    def profile(scale: float) -> float:
        raised = process.with_amplitude(scale**power)

        def likelihood(others: Sequence[Process]) -> float:
            return top.likelihood([*others, raised])

        objective = objective_of(likelihood, coordinates, top.processes)
        start, information = top.maximum.z, top.information
        return maximise(objective, start, information, close=_CLOSE, max_steps=_STEPS).value

    f, weight = frequency_nodes(columns.n, columns.dt)
    own = density([process.with_amplitude(1.0)], f, columns.dt)
    information = float(weight @ (own / density(top.processes, f, columns.dt)) ** 2)
    if not information > 0.0:
        return np.inf
    far = information ** (-0.5 / power)
    low = profile(0.0) - _FALL
    for _ in range(_DOUBLINGS):
        if profile(far) < low:
            break
        far *= 2.0
    else:
        return np.inf
    scale = np.linspace(0.0, far, _INTERVALS + 1)
    heights = np.array([max(profile(float(k)), low - _FALL) for k in scale])
    fine = np.linspace(0.0, far, _FINE)
    smooth = scipy.interpolate.PchipInterpolator(scale, heights)(fine)
    share = np.cumsum(np.exp(smooth - np.max(heights)))
    return float(np.interp(tuning.UPPER_LEVEL, share / share[-1], fine))
