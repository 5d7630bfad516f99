"""How well a fitted model describes the data, octave by octave.

With a million samples any model of a real sensor fails a chi-square test: the fine levels are known
to a tenth of a per cent. What matters is by how much the model misses the Allan deviation, and
whether that is more than chance at averaging times that count.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gmwm._typing import FloatArray
from gmwm.estimate.discrepancy import chi_square
from gmwm.estimate.moments import Moments
from gmwm.estimate.ramp import Slope
from gmwm.estimate.remarks import NO_TEST, WELL_KNOWN_DOF
from gmwm.estimate.scales import Scales
from gmwm.estimate.table import wrapped
from gmwm.process import Model

_LARGE_MISFIT = 0.1  # of the deviation
_EXCLUDED = 4.0  # standard errors: one of a thousand right models has such a level among twenty

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from gmwm.estimate.fit import Fit


@dataclass(frozen=True, eq=False)
class FittedMoments:
    """The moments at a fit: those of the data, those of the model, and their covariance.

    Attributes
    ----------
    scales : Scales
    target : (J,) ndarray
        Wavelet variances of the data without the drift of the model, u^2.
    implied : (J,) ndarray
        Those of the model's noise, u^2.
    statistical : (J, J) ndarray
        Covariance of ``target`` if the model is right, u^4.
    discrepancy : float
        Relative error granted to the model at each level.
    """

    scales: Scales
    target: FloatArray
    implied: FloatArray
    statistical: FloatArray
    discrepancy: float

    @classmethod
    def of(cls, fit: Fit) -> FittedMoments:
        """Made again from the model and the data of a fit by any method."""
        ramp = next((i for i in fit.model.parameters if i.parameter.role == "slope"), None)
        noise = [t for i, t in enumerate(fit.model.terms) if ramp is None or i != ramp.term]
        scales = Scales.of(fit.wv)
        moments = Moments(fit.wv, None, False, scales)
        if ramp is not None:
            slope = Slope(fit.params[ramp.key], fit.stderr.get(ramp.key, 0.0) ** 2)
            moments = Moments(fit.wv, slope, ramp.key in fit.keys, scales)
        if not noise:  # straight lines of the Allan plot may leave a ramp alone
            nothing = np.zeros_like(fit.wv.tau)
            return cls(scales, moments.target, nothing, fit.wv.covariance, fit.discrepancy)
        model = Model(tuple(noise))
        implied, statistical = scales.curve(model), moments.covariance(model)
        return cls(scales, moments.target, implied, statistical, fit.discrepancy)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of ``target`` with the discrepancy, u^4, (J, J)."""
        return self.statistical + np.diag((self.discrepancy * self.implied) ** 2)


@dataclass(frozen=True, eq=False)
class Goodness:
    """Agreement of model and data at each level, from ``gmwm.Fit.goodness``.

    Attributes
    ----------
    tau : (J,) ndarray
        Averaging times, s.
    data, model : (J,) ndarray
        Allan deviations, u; both without the drift where the model has a ramp.
    misfit : (J,) ndarray
        ``data / model - 1``.
    residual : (J,) ndarray
        Difference of the cube roots of the variances in statistical standard errors, close to
        standard normal at every level if the model is right (Wilson & Hilferty 1931, *PNAS* 17,
        684-688). Neighbouring levels are correlated.
    granted : (J,) ndarray
        The same in standard errors that hold the discrepancy too.
    dof : (J,) ndarray
        Equivalent degrees of freedom ``2 nu^4 / var(nu_hat^2)`` under the model.
    name, unit : str
        Of the channel.
    is_tested : bool
        Whether the variances are those of the data: not where gaps had to be bridged.
    """

    tau: FloatArray
    data: FloatArray
    model: FloatArray
    misfit: FloatArray
    residual: FloatArray
    granted: FloatArray
    dof: FloatArray
    name: str = ""
    unit: str = "u"
    is_tested: bool = True

    @classmethod
    def of(cls, fit: Fit) -> Goodness:
        """Compare the data of a fit with its model."""
        at = FittedMoments.of(fit)
        target = np.maximum(at.target, 0.0)  # less drift than the noise of its slope has
        level = np.full(target.size, np.nan)
        misfit, residual, granted, dof = (level.copy() for _ in range(4))
        variance = np.diag(at.statistical)
        has = (at.implied > 0.0) & (variance > 0.0)
        if np.any(has):
            block = np.ix_(has, has)
            implied = at.implied[has]
            misfit[has] = np.sqrt(target[has] / implied) - 1.0
            dof[has] = 2.0 * implied**2 / variance[has]
            residual[has] = chi_square(target[has], implied, at.statistical[block], implied)[0]
            granted[has] = chi_square(target[has], implied, at.covariance[block], implied)[0]
        return cls(
            tau=fit.wv.tau,
            data=np.sqrt(2.0 * target),
            model=np.sqrt(2.0 * at.implied),
            misfit=misfit,
            residual=residual,
            granted=granted,
            dof=dof,
            name=fit.wv.name,
            unit=fit.wv.unit or "u",
            is_tested=NO_TEST not in fit.remarks,
        )

    @property
    def worst(self) -> tuple[float, float] | None:
        """Largest misfit, with its sign, and its averaging time (s).

        Among levels of more than 30 degrees of freedom, where chance moves the deviation by less
        than 13 % (one sigma); None if there is none.
        """
        known = np.flatnonzero(self.dof > WELL_KNOWN_DOF)
        if not self.is_tested or known.size == 0:
            return None
        worst = known[int(np.argmax(np.abs(self.misfit[known])))]
        return float(self.misfit[worst]), float(self.tau[worst])

    @property
    def is_excluded(self) -> bool:
        """Whether the model misses some level by more than 10 % and by four standard errors.

        The errors are those that the model implies itself, with what was granted to it; the
        chi-square of a fit may have been taken under those of a richer model.
        """
        off = (np.abs(self.misfit) > _LARGE_MISFIT) & (np.abs(self.granted) > _EXCLUDED)
        return self.is_tested and bool(np.any(off))

    @property
    def sentence(self) -> str:
        """The largest misfit in words; empty if no level is known well."""
        worst = self.worst
        if worst is None:
            return ""
        return (
            f"largest misfit {100.0 * abs(worst[0]):.2g} % of the deviation at tau = "
            f"{worst[1]:.3g} s (levels of more than {WELL_KNOWN_DOF:g} degrees of freedom)"
        )

    def __str__(self) -> str:
        head = f"{'tau [s]':>10} {f'data [{self.unit}]':>14} {f'model [{self.unit}]':>14}"
        lines = [
            f"{self.name or 'series'}: Allan deviation of data and model",
            f"{head} {'misfit':>9} {'residual':>9} {'granted':>8} {'dof':>8}",
        ]
        columns = (
            self.tau, self.data, self.model, self.misfit, self.residual, self.granted, self.dof
        )  # fmt: skip
        for tau, data, model, misfit, residual, granted, dof in zip(*columns, strict=True):
            share = f"{100.0 * misfit:+.2f} %" if abs(misfit) < 10.0 else f"{100.0 * misfit:+.2g} %"
            lines.append(
                f"{tau:>10.5g} {data:>14.4g} {model:>14.4g} {share:>9} {residual:>+9.2f} "
                f"{granted:>+8.2f} {dof:>8.3g}"
            )
        return "\n".join([*lines, *wrapped(self.sentence, indent=2)])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Standardised residuals by level, with the misfit told at each; returns the axes."""
        from gmwm import plot

        return plot.residuals(self.tau, self.residual, self.misfit, title=self.name, ax=ax)
