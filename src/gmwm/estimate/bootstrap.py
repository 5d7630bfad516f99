"""Parametric bootstrap: how estimates would scatter, and whether one more term is needed.

Wavelet variances are drawn from their distribution under the fitted model: their cube roots are
nearly normal (Wilson & Hilferty 1931, *PNAS* 17, 684-688), with the covariance that the model
implies. A draw takes milliseconds, whatever the length of the record.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gmwm._core import checks
from gmwm._core.documents import Array, Document, Text
from gmwm._core.frozen import freeze
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.moments.design import Design
from gmwm.estimate.moments.profile import Profile, search
from gmwm.estimate.moments.weights import Weights
from gmwm.estimate.problem.moments import FittedMoments
from gmwm.estimate.problem.parameters import drift_key
from gmwm.estimate.result.fit import Fit
from gmwm.process import Model, Process, as_model


@dataclass(frozen=True, eq=False)
class Bootstrap(Document):
    """Estimates from simulated data.

    Attributes
    ----------
    keys : tuple of str
        Parameters, as in ``Fit.params``.
    draws : (runs, p) ndarray
        Their estimates, SI units.
    """

    SCHEMA: ClassVar[str] = "gmwm.bootstrap"

    keys: tuple[Text, ...]
    draws: Array

    def __post_init__(self) -> None:
        freeze(self, "draws")

    def __repr__(self) -> str:
        return f"<Bootstrap of {', '.join(self.keys)}, {len(self.draws)} draws>"

    def check_content(self) -> None:
        if not self.keys or self.draws.shape != (len(self.draws), len(self.keys)):
            raise ValueError("draws are not one value a key")
        if len(self.draws) < 2:
            raise ValueError("there are fewer than two draws")

    @property
    def stderr(self) -> dict[str, float]:
        """Standard deviation of the estimates."""
        return dict(zip(self.keys, map(float, np.std(self.draws, axis=0, ddof=1)), strict=True))

    def interval(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Percentile intervals (Efron & Tibshirani 1993, ch. 13).

        Raises
        ------
        InputError
            If ``level`` is not between 0 and 1.
        """
        level = checks.share("level", level, 0.95)
        ends = np.quantile(self.draws, [0.5 - 0.5 * level, 0.5 + 0.5 * level], axis=0)
        return {key: (float(a), float(b)) for key, a, b in zip(self.keys, *ends, strict=True)}


def bootstrap(fit: Fit, runs: int = 200, seed: int = 0) -> Bootstrap:
    """Estimates of the same model from data simulated under a fit.

    Parameters
    ----------
    fit : Fit
        By the method of moments, of one recording or several.
    runs : int, optional
    seed : int, optional

    Returns
    -------
    Bootstrap

    Raises
    ------
    InputError
        If the fit is of another method, or ``runs`` is less than 2.
    """
    runs = _check(fit, runs)
    rng, opened = checks.generator(seed), _opened(fit)
    draws: list[dict[str, float]] = []
    at, root = fit.moments, _root(fit)
    design = Design(opened, at.scales)
    start = [fit.model.terms[term.place].shape_values for term in design.terms]
    ramp = str(drift_key(fit.model))
    slopes = np.zeros(runs)
    if ramp in fit.keys:
        slopes = fit.params[ramp] + fit.stderr[ramp] * rng.standard_normal(runs)
    for target, slope in zip(_targets(at, runs, rng), slopes, strict=True):
        profile = Profile(design, target, root)
        point = profile.refine(profile.at(start))
        fitted = Model(tuple(design.fitted_processes(point.x, point.shapes)))
        found = {key: float(value or 0.0) for key, value in fitted.params.items()}
        draws.append(found | ({ramp: float(slope)} if ramp in fit.keys else {}))
    keys = tuple(key for key in fit.params if key in opened.params and opened.params[key] is None)
    table = np.array([[values.get(key, np.nan) for key in keys] for values in draws])
    return Bootstrap(keys, table)


def bootstrap_test(
    fit: Fit, larger: Process | Model | str, runs: int = 200, seed: int = 0
) -> float:
    """Probability, under a fit, of the gain that a larger model makes on the data.

    The chi-square test of a further term is invalid: under the smaller model its amplitude is zero,
    on the edge of what it can be, and its correlation time is nothing at all (Davies 1987,
    *Biometrika* 74, 33-43). Here the gain in the objective is compared with its distribution.

    Parameters
    ----------
    fit : Fit
        Of the smaller model, by the method of moments.
    larger : Process or Model
        With open parameters; it contains the smaller one.
    runs : int, optional
    seed : int, optional

    Returns
    -------
    float
        p-value; small if the further terms are needed.

    Raises
    ------
    InputError
        If the fit is of another method, or ``runs`` is less than 2.
    """
    runs = _check(fit, runs)
    at, root = fit.moments, _root(fit)
    designs = [Design(model, at.scales) for model in (_opened(fit), as_model(larger))]
    if designs[1].n_free <= designs[0].n_free:
        raise InputError(f"{larger!r}: give a model with more terms than {fit.model.opened()!r}")

    def gain(target: FloatArray) -> float:
        small, large = (search(Profile(design, target, root)).objective for design in designs)
        return small - large

    rng, observed = checks.generator(seed), gain(at.target)
    gains = np.array([gain(target) for target in _targets(at, runs, rng)])
    return float((1 + np.sum(gains >= observed)) / (runs + 1))


def _check(fit: Fit, runs: int) -> int:
    if fit.method != "gmwm":
        raise InputError(
            f"a fit by {fit.method!r} has no weights to simulate: fit by method='gmwm'"
        )
    return checks.whole("runs", runs, 2)


def _opened(fit: Fit) -> Model:
    """The fitted model with the parameters open that were estimated."""
    return fit.model.with_params(dict.fromkeys((*fit.keys, *fit.upper_bounds)))


def _root(fit: Fit) -> FloatArray:
    """L with L'L the weight matrix at a fit."""
    at = fit.moments
    return Weights.of(fit.weights, fit.wv).root(at.covariance, at.implied - at.target)


def _targets(at: FittedMoments, runs: int, rng: np.random.Generator) -> FloatArray:
    """Wavelet variances drawn under a fit, (runs, J)."""
    deviation = np.sqrt(np.diag(at.covariance))
    share = (deviation / at.implied) ** 2 / 9.0  # 2/(9 dof)
    values, vectors = np.linalg.eigh(at.covariance / np.outer(deviation, deviation))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    normal = rng.standard_normal((runs, deviation.size)) @ root.T
    cube_root = 1.0 - share + np.sqrt(share) * normal
    return np.asarray(at.implied * np.maximum(cube_root, 0.0) ** 3)
