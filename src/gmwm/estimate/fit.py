"""The result of an estimation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import norm

from gmwm import checks
from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.goodness import Goodness
from gmwm.estimate.interval import confidence_interval
from gmwm.estimate.region import Region, slope_name
from gmwm.estimate.scales import Scales
from gmwm.estimate.table import HEAD, describe, parameter_row, parameter_rows, wrapped
from gmwm.process import Model
from gmwm.variance.wavelet import WaveletVariance

if TYPE_CHECKING:
    from matplotlib.axes import Axes


METHOD_NAMES = {
    "gmwm": "GMWM",
    "simulated": "simulated moments",
    "allan": "slopes of the Allan deviation",
    "em": "EM",
    "mle": "exact maximum likelihood",
    "whittle": "debiased Whittle likelihood",
}
"""Methods as they are named in tables."""


@dataclass(frozen=True, eq=False)
class Fit:
    """An estimated error model of one channel.

    Attributes
    ----------
    model : Model
        With the estimated (and the given) values.
    wv : WaveletVariance
        The data.
    keys : tuple of str
        Names of the estimated parameters, without those estimated as zero.
    covariance : (p, p) ndarray
        Covariance of the estimates, in the order of ``keys``, in products of their SI units.
    upper_bounds : dict
        95 % upper bound of each amplitude that is zero or not significantly above it.
    objective : float
        Weighted sum of squares (nu_hat - nu)' Sigma^-1 (nu_hat - nu) at the estimate; chi-square
        with ``dof`` degrees of freedom if the model is right.
    dof : int
        Levels less estimated parameters.
    discrepancy : float
        Relative error granted to the model at each level, as a share of the variance; zero where
        it describes the data to within their statistical errors.
    p_value : float
        Of the chi-square test, taken on the cube roots of the wavelet variances, which are close
        to normal at coarse levels too; NaN without degrees of freedom.
    method, omega : str
        How it was estimated; ``omega`` is empty but for ``method="gmwm"``.
    valid : bool
        Whether every parameter is supported by the data and the model describes them.
    remarks : tuple of str
        What is off, one sentence each.
    log_likelihood : float
        At the estimate, of the methods that maximise it; NaN for the others.
    trace : tuple of float
        Log-likelihood after each iteration of EM.
    slope_dof : float
        Degrees of freedom of the variance of a ramp's slope.
    error_growth : dict
        How the relative standard error of a positive parameter goes with its value: the exponent
        of a power law, by key.
    regions : tuple of Region
        What ``method="allan"`` read the parameters from.
    """

    model: Model
    wv: WaveletVariance
    keys: tuple[str, ...]
    covariance: FloatArray
    upper_bounds: dict[str, float]
    objective: float
    dof: int
    discrepancy: float
    p_value: float
    method: str
    omega: str
    valid: bool
    remarks: tuple[str, ...]
    log_likelihood: float = float("nan")
    trace: tuple[float, ...] = ()
    slope_dof: float = float("inf")
    error_growth: dict[str, float] = field(default_factory=dict)
    regions: tuple[Region, ...] = ()

    # -- numbers ----------------------------------------------------------------------------------

    @property
    def params(self) -> dict[str, float]:
        """Parameter values in SI units; Gauss-Markov terms by rising correlation time."""
        return {key: float(value or 0.0) for key, value in self.model.params.items()}

    @property
    def stderr(self) -> dict[str, float]:
        """Standard errors of the estimated parameters, in SI units."""
        errors = np.sqrt(np.diag(self.covariance))
        return dict(zip(self.keys, map(float, errors), strict=True))

    @property
    def message(self) -> str:
        """What is off, in sentences; empty if nothing is."""
        return "; ".join(self.remarks)

    def interval(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Confidence intervals that keep to the parameters' ranges.

        See `gmwm.estimate.interval.confidence_interval`. The interval of an amplitude that is not
        significantly above zero goes from zero to its upper bound (which is one of 95 %).

        Parameters
        ----------
        level : float, optional

        Returns
        -------
        dict
            Key -> (lower, upper), in SI units, for every estimated parameter.

        Raises
        ------
        InputError
            If ``level`` is not between 0 and 1.
        """
        level = checks.share("level", level, 0.95)
        params, errors = self.params, self.stderr
        result = {}
        for item in self.model.parameters:
            key, value = item.key, params[item.key]
            if key in self.upper_bounds:
                result[key] = (0.0, float(self.upper_bounds[key]))
            elif key in errors:
                result[key] = confidence_interval(
                    item.parameter, value, errors[key], level,
                    growth=self.error_growth.get(key, 0.0), slope_dof=self.slope_dof,
                )  # fmt: skip
        return result

    def needed_length(self, relative_error: float = 0.1) -> dict[str, float]:
        """Length of record that would give each parameter a relative standard error.

        Errors go with the root of the length. That is too hopeful where a discrepancy was granted
        to the model, which no length removes.

        Parameters
        ----------
        relative_error : float, optional

        Returns
        -------
        dict
            Key -> seconds, of all recordings together, for every estimated parameter but the slope
            of a ramp; infinite for an amplitude that is not significantly above zero.

        Raises
        ------
        InputError
            If ``relative_error`` is not a positive number.
        """
        aim = checks.positive("relative_error", relative_error, "give a positive number, e.g. 0.1")
        duration, params, errors = self.wv.n_all * self.wv.dt, self.params, self.stderr
        lengths = {}
        for item in self.model.parameters:
            key = item.key
            if key in self.upper_bounds:
                lengths[key] = float("inf")
            elif key in errors and item.parameter.role != "slope":
                size = abs(params[key])
                relative = errors[key] / size if size > 0.0 else float("inf")
                lengths[key] = duration * (relative / aim) ** 2
        return lengths

    # -- curves -----------------------------------------------------------------------------------

    @property
    def implied(self) -> FloatArray:
        """Wavelet variance of the fitted model at the data's averaging times, u^2, (J,)."""
        return Scales.of(self.wv).curve(self.model)

    @property
    def components(self) -> dict[str, FloatArray]:
        """Wavelet variance of each term, u^2, (J,)."""
        scales = Scales.of(self.wv)
        curves = [scales.curve(term) for term in self.model.terms]
        return dict(zip(self.model.term_labels(), curves, strict=True))

    @cached_property
    def goodness(self) -> Goodness:
        """How well the model describes the data at each averaging time."""
        return Goodness.of(self)

    def deviation_interval(
        self, tau: FloatArray, level: float = 0.95
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Allan deviation of the fitted model with its interval, at any averaging times.

        Parameters
        ----------
        tau : array_like
            Averaging times, s.
        level : float, optional

        Returns
        -------
        value, lower, upper : ndarray
            In u, same shape as ``tau``; by linear propagation of the parameters' covariance to
            the logarithm of the deviation.
        """
        level = checks.share("level", level, 0.95)
        tau = np.asarray(tau, dtype=float)
        scales = replace(Scales.of(self.wv), tau=tau)
        curve = scales.curve(self.model)
        errors = np.sqrt(np.diag(self.covariance))
        gradient = np.empty((len(self.keys), tau.size))
        for i, key in enumerate(self.keys):
            step = 1e-3 * min(errors[i], abs(self.params[key]) or errors[i])
            pair = [
                scales.curve(self.model.with_params({key: self.params[key] + sign * step}))
                for sign in (1.0, -1.0)
            ]
            gradient[i] = ((pair[0] - pair[1]) / (2.0 * step) / (2.0 * curve)).ravel()
        spread = np.sqrt(np.einsum("ij,ik,kj->j", gradient, self.covariance, gradient))
        value = np.sqrt(2.0 * curve)
        ratio = np.exp(norm.ppf(0.5 + 0.5 * level) * spread.reshape(tau.shape))
        return value, value / ratio, value * ratio

    # -- looks ------------------------------------------------------------------------------------

    def rows(self) -> list[dict[str, Any]]:
        """One dict a parameter: key, value, stderr, lower, upper (SI), unit, meaning, field units.

        ``field`` is a list of (value, lower, upper, unit); ``kind`` is "estimated", "given" or
        "bound".
        """
        return parameter_rows(self)

    def __str__(self) -> str:
        lines = wrapped(f"{self.wv.name or 'series'}: {describe(self.model)}", indent=2)
        lines += wrapped(f"{self._size()}, {self.wv.tau.size} levels; {self._how()}", indent=2)
        lines += ["", HEAD, *(parameter_row(row) for row in self.rows()), ""]
        fitness = f"objective {self.objective:.4g} on {self.dof} degrees of freedom"
        if np.isfinite(self.p_value):
            fitness += f", p = {self.p_value:.2g}"
        if np.isfinite(self.log_likelihood):
            lines.append(f"log-likelihood {self.log_likelihood:.8g}")
            fitness = f"of the wavelet variances: {fitness}"
        lines += wrapped(fitness, indent=2)
        lines += wrapped(self.goodness.sentence, indent=2)
        lines.append("valid" if self.valid else "NOT VALID")
        for remark in self.remarks:
            lines += wrapped(remark, first="- ", indent=2)
        return "\n".join(lines)

    def _size(self) -> str:
        return f"{self.wv.n:,} samples at {1.0 / self.wv.dt:g} Hz"

    def _how(self) -> str:
        name = METHOD_NAMES[self.method]
        if self.omega:
            return f"{name}, {self.omega} weights"
        return f"{name}, {len(self.trace)} iterations" if self.trace else name

    def plot(self, ax: Axes | None = None) -> Axes:
        """Allan deviation with error bars, fitted curve and components; returns the axes.

        For ``method="allan"`` the lines and the regions that they were read from take the place of
        the components.
        """
        from gmwm import plot

        wv = self.wv
        axes = plot.deviation(
            wv.tau,
            wv.allan_deviation,
            np.sqrt(2.0 * wv.lower),
            np.sqrt(2.0 * wv.upper),
            unit=wv.unit,
            title=wv.name,
            ax=ax,
        )
        total = np.sqrt(2.0 * self.implied)
        if self.regions:
            plot.curves(axes, wv.tau, total, {}, wv.allan_deviation)
            plot.straight_lines(axes, self._lines())
            return axes
        components = {k: np.sqrt(2.0 * v) for k, v in self.components.items() if np.any(v > 0.0)}
        plot.curves(axes, wv.tau, total, components, wv.allan_deviation)
        return axes

    def _lines(self) -> dict[str, tuple[float, float, float, float]]:
        """Lines of the Allan plot as `gmwm.plot.straight_lines` takes them."""
        units = {row["key"]: row["unit"] for row in self.rows()}
        return {
            f"{r.key} = {self.params[r.key]:.3g} {units[r.key]} (slope {slope_name(r.slope)})": (
                r.slope,
                r.coefficient,
                r.tau_min,
                r.tau_max,
            )
            for r in self.regions
        }

    def plot_trace(self, ax: Axes | None = None) -> Axes:
        """Log-likelihood against the iterations of EM; returns the axes.

        Raises
        ------
        InputError
            If the fit was not made by EM.
        """
        from gmwm import plot

        if not self.trace:
            raise InputError(f"a fit by {self.method!r} has no iterations to show")
        return plot.trace(np.array(self.trace), ax=ax)

    # -- tables and files -------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """Everything, in JSON types; see `from_dict`."""
        return {
            "model": [term.to_dict() for term in self.model.terms],
            "params": self.params,
            "stderr": self.stderr,
            "keys": list(self.keys),
            "covariance": self.covariance.tolist(),
            "upper_bounds": {
                key: bound if np.isfinite(bound) else None
                for key, bound in self.upper_bounds.items()
            },
            "objective": self.objective,
            "dof": self.dof,
            "discrepancy": self.discrepancy,
            "p_value": None if np.isnan(self.p_value) else self.p_value,
            "method": self.method,
            "omega": self.omega,
            "valid": self.valid,
            "remarks": list(self.remarks),
            "units": {row["key"]: row["unit"] for row in self.rows()},
            "log_likelihood": None if np.isnan(self.log_likelihood) else self.log_likelihood,
            "trace": list(self.trace),
            "slope_dof": None if np.isinf(self.slope_dof) else self.slope_dof,
            "error_growth": self.error_growth,
            "regions": [asdict(region) for region in self.regions],
            "wavelet_variance": self.wv.to_dict(),
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Fit:
        """Inverse of `to_dict`; a `JointFit` if it was one.

        Raises
        ------
        InputError
            If the content is no fit, or a damaged one.
        """
        from gmwm.estimate.stored import fit_from_dict

        return fit_from_dict(content)
