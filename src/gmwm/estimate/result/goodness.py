"""How well a fitted model describes the data, octave by octave, and what it may lack.

With a million samples any model of a real sensor fails a chi-square test: the fine levels are known
to a tenth of a per cent. So the misfit of the Allan deviation is given, and whether it exceeds
chance at the averaging times that matter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gmwm._core.distributions import norm
from gmwm._core.text import cell, per_cent, plain_table, wrapped
from gmwm._core.typing import BoolArray, FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.problem.moments import FittedMoments, chi_square, weight_root
from gmwm.process import GaussMarkov, Model
from gmwm.variance import WaveletVariance

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from gmwm.estimate.result.fit import Fit

_STEP = 1e-4  # relative, of central differences


@dataclass(frozen=True, eq=False)
class Goodness:
    """Agreement of model and data at each level, from ``gmwm.Fit.goodness``.

    tau: (J,), averaging times, s.
    data, model: (J,), Allan deviations, u; both without the drift where the model has a ramp.
    misfit: (J,), ``data / model - 1``.
    residual: (J,), difference of the cube roots of the variances in statistical standard errors,
        close to standard normal at every level if the model is right (Wilson & Hilferty 1931,
        *PNAS* 17, 684-688). Neighbouring levels are correlated.
    allowed: (J,), ``residual`` in standard errors that include the discrepancy.
    dof: (J,), equivalent degrees of freedom ``2 nu^4 / var(nu_hat^2)`` under the model.
    is_tested: Whether the variances are those of the data; false where gaps were bridged.
    """

    tau: FloatArray
    data: FloatArray
    model: FloatArray
    misfit: FloatArray
    residual: FloatArray
    allowed: FloatArray
    dof: FloatArray
    name: str = ""
    unit: str = "u"
    is_tested: bool = True

    @classmethod
    def of(cls, at: FittedMoments, wv: WaveletVariance, *, is_tested: bool) -> Goodness:
        """Compare wavelet variances with those of the model fitted to them."""
        target = np.maximum(at.target, 0.0)  # less drift than the noise of its slope has
        misfit, residual, allowed, dof = np.full((4, target.size), np.nan)
        variance = np.diag(at.statistical)
        has = (at.implied > 0.0) & (variance > 0.0)
        if np.any(has):
            block = np.ix_(has, has)
            implied, taken = at.implied[has], at.taken[has]
            misfit[has] = np.sqrt(target[has] / implied) - 1.0
            dof[has] = 2.0 * implied**2 / variance[has]
            for each, covariance in ((residual, at.statistical), (allowed, at.covariance)):
                each[has] = chi_square(target[has], implied, covariance[block], implied, taken)[0]
        return cls(
            tau=wv.tau,
            data=np.sqrt(2.0 * target),
            model=np.sqrt(2.0 * at.implied),
            misfit=misfit,
            residual=residual,
            allowed=allowed,
            dof=dof,
            name=wv.name,
            unit=wv.unit or "u",
            is_tested=is_tested,
        )

    @property
    def worst(self) -> tuple[float, float] | None:
        """Largest misfit, with its sign, and its averaging time (s).

        Among levels of more than 30 degrees of freedom, where chance moves the deviation by less
        than 13 % (one sigma); None if there is none.
        """
        worst = self._largest(self.misfit, self.dof > tuning.WELL_KNOWN_DOF)
        return None if worst is None else (float(self.misfit[worst]), float(self.tau[worst]))

    def _largest(self, values: FloatArray, among: BoolArray) -> int | None:
        """Level of the largest absolute value among some; None without a test or any of them."""
        if not self.is_tested or not np.any(among):
            return None
        return int(np.argmax(np.where(among, np.abs(values), -1.0)))

    @property
    def known_to(self) -> float:
        """Longest averaging time (s) of levels with more than 30 degrees of freedom, or NaN."""
        known = np.flatnonzero(self.dof > tuning.WELL_KNOWN_DOF)
        return float(self.tau[known[-1]]) if known.size else float("nan")

    @property
    def beyond_chance(self) -> tuple[float, float, float] | None:
        """Largest misfit beyond chance, its averaging time (s) and residual; None if there is none.

        Among levels whose residual exceeds 2.5 statistical standard errors under the model.
        """
        worst = self._largest(self.misfit, np.abs(self.residual) > tuning.BEYOND_CHANCE)
        if worst is None:
            return None
        return float(self.misfit[worst]), float(self.tau[worst]), float(self.residual[worst])

    @property
    def is_poor(self) -> bool:
        """Whether a misfit beyond chance exceeds 10 % of the deviation: predictions suffer."""
        beyond = self.beyond_chance
        return beyond is not None and abs(beyond[0]) > tuning.POOR_DEVIATION

    @property
    def judged(self) -> FloatArray:
        """Residuals that decide whether a level is missed, (J,).

        The discrepancy is allowed for below 0.1 s (or ten samples), where filters and rounding
        show; from there on errors are statistical.
        """
        fine = self.tau < max(tuning.FINEST_TIME, tuning.FINEST_SAMPLES * float(self.tau[0]))
        return np.where(fine, self.allowed, self.residual)

    @property
    def largest(self) -> tuple[float, float] | None:
        """Largest of the residuals `judged`, and its averaging time (s).

        Among all levels that the model gives a variance; None if there is none.
        """
        largest = self._largest(self.judged, ~np.isnan(self.judged))
        return None if largest is None else (float(self.judged[largest]), float(self.tau[largest]))

    @property
    def largest_p(self) -> float:
        """Probability that some level of a right model has as large a residual; NaN without one.

        Errors are those that the model implies. For independent levels (Sidak 1967, *JASA* 62,
        626-633); correlated ones have a smaller probability.
        """
        if self.largest is None:
            return float("nan")
        one = 2.0 * norm.sf(abs(self.largest[0]))
        return float(-np.expm1(np.count_nonzero(~np.isnan(self.allowed)) * np.log1p(-one)))

    @property
    def is_excluded(self) -> bool:
        """Whether the model misses a level more clearly than one in a thousand right models."""
        return self.largest_p < tuning.EXCLUDED_P

    @property
    def missed(self) -> BoolArray:
        """Levels that are missed as one in a hundred right models does, or `is_poor` at, (J,)."""
        if not self.is_tested:
            return np.zeros(self.tau.size, dtype=bool)
        levels = max(np.count_nonzero(~np.isnan(self.allowed)), 1)
        limit = norm.isf(-0.5 * np.expm1(np.log1p(-tuning.REDUNDANT_P) / levels))
        poor = np.abs(self.misfit) > tuning.POOR_DEVIATION
        poor &= np.abs(self.residual) > tuning.BEYOND_CHANCE
        return np.asarray(poor | (np.abs(self.judged) > limit))

    @property
    def misses_a_level(self) -> bool:
        """Whether there is one of `missed`."""
        return bool(np.any(self.missed))

    def loses_to(self, larger: Goodness) -> bool:
        """Whether it misses an averaging time that a larger model describes.

        Both may still have an equal sum of squares over all levels, and what both miss elsewhere
        is no reason against the larger one unless that excludes it.
        """
        return not larger.is_excluded and bool(np.any(self.missed & ~larger.missed))

    @property
    def sentence(self) -> str:
        """The largest misfit in words; empty if no level is known well."""
        worst = self.worst
        if worst is None:
            return ""
        return (
            f"largest misfit {per_cent(abs(worst[0]))} of the deviation at tau = "
            f"{worst[1]:.3g} s (levels of more than {tuning.WELL_KNOWN_DOF:g} degrees of freedom)"
        )

    def __str__(self) -> str:
        heads = ["tau [s]", f"data [{self.unit}]", f"model [{self.unit}]", "misfit"]
        rows = [
            [
                f"{tau:.5g}",
                cell(self.data[j]),
                cell(self.model[j]),
                f"{100.0 * self.misfit[j]:+.3g} %",
                f"{self.residual[j]:+.2f}",
                f"{self.allowed[j]:+.2f}",
                cell(self.dof[j], 3),
            ]
            for j, tau in enumerate(self.tau)
        ]
        title = f"{self.name or 'series'}: Allan deviation of data and model"
        table = plain_table([*heads, "residual", "allowed", "dof"], rows)
        return "\n".join([title, table, *wrapped(self.sentence, indent=2)])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Standardised residuals by level, with the misfit written at each; returns the axes."""
        from gmwm import plotting

        return plotting.residuals(self.tau, self.residual, self.misfit, title=self.name, ax=ax)


def left_open(fit: Fit, level: float = 0.95) -> tuple[Model, ...]:
    """Models with one more Gauss-Markov process, as large as the data leave open.

    A selection includes a further Gauss-Markov process only if it exceeds some four standard
    errors. The selected model lacks smaller ones, and its intervals do not cover them.

    level: Of the interval of the added variance, whose upper end is taken.
    Returns: One for each of some correlation times over the range of the data.

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
