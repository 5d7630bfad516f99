"""Terms too faint to be chosen: how large one more Gauss-Markov process may be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import norm

from gmwm.estimate import tuning
from gmwm.estimate.problem import weight_root
from gmwm.process import GaussMarkov, Model

if TYPE_CHECKING:
    from gmwm.estimate.result.fit import Fit

_STEP = 1e-4  # relative, of central differences


def left_open(fit: Fit, level: float = 0.95) -> tuple[Model, ...]:
    """Models with one more Gauss-Markov process, as large as the data leave open.

    A selection includes a further Gauss-Markov process only if it exceeds some four standard
    errors. The selected model lacks smaller ones, and its intervals do not cover them.

    Parameters
    ----------
    fit : Fit
    level : float, optional
        Of the interval of the added variance, whose upper end is taken.

    Returns
    -------
    tuple of Model
        One for each of some correlation times over the range of the data.

    Notes
    -----
    With the whitened derivatives D of the fitted wavelet variances, their residual r and the curve
    g of the added process, all orthogonal to D, the added variance is estimated by g'r / g'g with
    variance 1 / g'g; the other parameters give way by D^+ g. A negative estimate is cut off at zero
    by its chi-square (Wilks 1938, *Annals of Mathematical Statistics* 9, 60-62). Parameters move
    by at most a share of `tuning.OPEN_MOVE`: where the process could replace another term, the
    intervals of that term cover it.
    """
    at, model = fit.moments, fit.model
    noise = Model(tuple(term for term in model.terms if not term.is_drift))
    free = [i for i in noise.parameters if i.key in fit.keys and fit.params[i.key] > 0.0]
    keys = [item.key for item in free]
    if not keys:
        return ()
    root = weight_root(at.covariance)
    columns = []
    for key in keys:
        up, down = (
            at.scales.curve(noise.with_params({key: fit.params[key] * (1.0 + step)}))
            for step in (_STEP, -_STEP)
        )
        columns.append(root @ (up - down) / (2.0 * _STEP))
    # A parameter that changes nothing, or what others change, is not moved.
    basis, sizes, turn = np.linalg.svd(np.stack(columns, axis=1), full_matrices=False)
    apart = sizes > tuning.OPEN_REDUNDANT * sizes[0]
    basis, to_move = basis[:, apart], turn[apart].T / sizes[apart]
    residual = root @ (at.target - at.implied)
    width = float(norm.ppf(0.5 + 0.5 * level))
    powers = np.array([1.0 if item.parameter.role == "shape" else 2.0 for item in free])
    models = []
    # Not at round numbers: a model must not hold two processes of equal correlation time.
    for tau in np.geomspace(np.sqrt(5.0) * fit.wv.dt, 2.0 * fit.wv.tau[-1], tuning.OPEN_TIMES):
        curve = root @ at.scales.curve(GaussMarkov(1.0, float(tau)))
        known = basis.T @ curve
        own = curve - basis @ known
        squared = float(own @ own)
        if not squared > tuning.OPEN_APART**2 * float(curve @ curve):
            continue  # a copy of terms that are there
        error, found = squared**-0.5, float(own @ residual) / squared
        added = found + error * (width if found > 0.0 else np.hypot(width, found / error))
        move = -added * (to_move @ known)
        share = tuning.OPEN_MOVE / max(tuning.OPEN_MOVE, float(np.max(np.abs(move))))
        moved = (1.0 + share * powers * move) ** (1.0 / powers)
        values = {key: fit.params[key] * float(x) for key, x in zip(keys, moved, strict=True)}
        term = GaussMarkov(float(np.sqrt(share * added)), float(tau))
        models.append(model.with_params(values) + term)
    return tuple(models)
