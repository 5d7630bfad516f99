"""A random walk that a record leaves open: what the model lacks, and how large it may be."""

from __future__ import annotations

import numpy as np

from gmwm._core.text import brief
from gmwm._core.units import customary_unit
from gmwm.calibration import tuning
from gmwm.calibration.numbers import upper_limit
from gmwm.errors import InputError
from gmwm.estimate import Fit, estimate
from gmwm.issues import Notice, notice
from gmwm.process import Model, RandomWalk

UNRESOLVED = "unresolved-walk"
"""Code of the notice that a walk may be there that the model lacks."""


def with_largest_walk(fitted: Fit) -> Model | None:
    """The model with the random walk that is its upper bound (95 %), fitted beside it.

    None where the model has a walk or a ramp, or the walk would change little at `tuning.OPEN_AT`.
    """
    if any(term.is_drift for term in fitted.model.terms):
        return None
    try:
        if fitted.params.get("K", 0.0) > 0.0 and "K" not in fitted.upper_bounds:
            return None
        walk = upper_limit(fitted, "K")
        noise = Model(tuple(t for t in fitted.model.terms if not isinstance(t, RandomWalk)))
        free = [key for key in (*fitted.keys, *fitted.upper_bounds) if key in noise.params]
        largest = estimate(
            noise.with_params(dict.fromkeys(free)) + RandomWalk(walk), fitted.wv
        ).model
    except InputError:  # of a record so short that nothing bounds it
        return None
    return largest if _growth(fitted, largest) > tuning.OPEN else None


def unresolved_notice(name: str, fitted: Fit, largest: Model) -> Notice:
    """Say how large the walk and its effect may be."""
    walk, tau = largest.params["K"] or 0.0, _time(fitted)
    unit, per_si = customary_unit("u/s/sqrt(Hz)", fitted.wv.quantity, fitted.wv.unit)
    growth = _growth(fitted, largest)
    values = {"K": walk, "tau": tau, "growth": growth}
    return notice(
        UNRESOLVED, name, values, shown=f"{walk * per_si:.2g} {unit}", times=brief(growth)
    )


def _time(fitted: Fit) -> float:
    return max(tuning.OPEN_AT, fitted.wv.dt)


def _growth(fitted: Fit, largest: Model) -> float:
    """Ratio of the deviations of two models at the time that is looked at."""
    tau = np.array([_time(fitted)])
    there, least = (
        float(model.haar_variance(tau, fitted.wv.dt)[0]) for model in (largest, fitted.model)
    )
    return float(np.sqrt(there / least)) if least > 0.0 else float("inf")
