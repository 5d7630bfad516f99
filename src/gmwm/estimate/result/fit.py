"""The result of an estimation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
from annotated_types import Ge, Gt, Le, MaxLen

from gmwm._core import checks
from gmwm._core.distributions import chi2, norm
from gmwm._core.documents import Array, Document, OrInfinity, OrNaN, Text, check_covariance
from gmwm._core.frozen import freeze, frozen
from gmwm._core.text import Printed, bullets, frame, html_table, per_cent, plain_table, wrapped
from gmwm._core.typing import FloatArray
from gmwm._core.units import shown_unit
from gmwm.errors import InputError, MissingNameError
from gmwm.estimate import tuning
from gmwm.estimate.problem.information import error_growth
from gmwm.estimate.problem.moments import FittedMoments, Scales
from gmwm.estimate.problem.parameters import drift_key
from gmwm.estimate.problem.ramp import Walks, walks_beside
from gmwm.estimate.result.estimate import (
    Estimate,
    Region,
    confidence_interval,
    estimates_of,
    slope_name,
)
from gmwm.estimate.result.goodness import Goodness, left_open
from gmwm.issues import Notice
from gmwm.process import Model
from gmwm.variance import WaveletVariance

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

METHOD_NAMES = {
    "gmwm": "GMWM",
    "simulated": "simulated moments",
    "allan": "slopes of the Allan deviation",
    "em": "EM",
    "mle": "exact maximum likelihood",
    "whittle": "debiased Whittle likelihood",
}
"""Names of the methods in tables."""

_HEADS = ("parameter", "estimate", "std. error", "95 % interval", "unit")
_LARGEST_DISCREPANCY = 1000.0  # a model that is off by more describes nothing
_PER_OCTAVE = 12  # points of a curve: with one, a line and a resonance look broken


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Document, Printed):
    """An estimated error model of one channel.

    ``fit["tau_1"]`` is the `Estimate` of one parameter.

    Attributes
    ----------
    model : Model
        With the estimated (and the fixed) values.
    wv : WaveletVariance
        The data.
    keys : tuple of str
        Names of the estimated parameters, without those estimated as zero.
    covariance : (p, p) ndarray
        Covariance of the estimates, in the order of ``keys``, in products of their SI units.
    upper_bounds : dict
        95 % upper bound of each amplitude that is zero or not significantly above it.
    objective : float
        Weighted sum of squares (nu_hat - nu)' Sigma^-1 (nu_hat - nu) at the estimate.
    chi_square : float
        Sum of squares on the cube roots of the wavelet variances, which are close to normal at
        coarse levels too: chi-square with ``dof`` degrees of freedom if the model is right. NaN
        where there are none, or the method does not minimise it.
    chi_square_allowed : float
        ``chi_square`` with the discrepancy in the errors.
    dof : int
        Levels less estimated parameters.
    discrepancy : float
        Relative error allowed for at each level, as a fraction of the variance; zero where the
        model describes the data to within their statistical errors.
    method, weights : str
        How it was estimated; only the method of moments has ``weights``.
    notices : tuple of Notice
        Severity "bad" makes the fit not valid.
    log_likelihood : float
        At the estimate; NaN for methods that do not maximise it.
    trace : tuple of float
        Log-likelihood after each iteration of EM.
    slope_dof : float
        Degrees of freedom of the variance of a ramp's slope.
    regions : tuple of Region
        Parts of the Allan plot that ``method="allan"`` read the parameters from.
    """

    SCHEMA: ClassVar[str] = "gmwm.fit"
    KEYS: ClassVar[Mapping[str, str]] = {"wv": "wavelet_variance"}

    model: Model
    wv: WaveletVariance
    keys: tuple[Text, ...]
    covariance: Array
    upper_bounds: Mapping[Text, Annotated[OrInfinity, Ge(0.0)]]
    objective: OrNaN
    chi_square: OrNaN
    chi_square_allowed: OrNaN
    dof: Annotated[int, Ge(-checks.MOST_SAMPLES), Le(checks.MOST_SAMPLES)]
    discrepancy: Annotated[float, Ge(0.0), Le(_LARGEST_DISCREPANCY)]
    method: Text
    weights: Text
    notices: tuple[Notice, ...]
    log_likelihood: OrNaN = float("nan")
    trace: Annotated[tuple[float, ...], MaxLen(1_000_000)] = ()
    slope_dof: Annotated[OrInfinity, Gt(0.0)] = float("inf")
    regions: tuple[Region, ...] = ()

    def __post_init__(self) -> None:
        checks.choice("method", self.method, tuple(METHOD_NAMES))
        if not self.keys:
            object.__setattr__(self, "covariance", np.zeros((0, 0)))
        freeze(self, "covariance", "upper_bounds")

    # -- validity ---------------------------------------------------------------------------------

    @property
    def valid(self) -> bool:
        """Whether the data support every parameter and the model describes them."""
        return not any(notice.severity == "bad" for notice in self.notices)

    @property
    def reasons(self) -> Mapping[str, str]:
        """Property of a valid fit that this one lacks -> sentence; empty for a valid fit."""
        found: dict[str, str] = {}
        for each in self.notices:
            if each.severity == "bad":
                name = each.issue.lacks or each.code
                found[name] = f"{found.get(name, '')} {each.sentence}".lstrip()
        result: Mapping[str, str] = frozen(found)
        return result

    @property
    def message(self) -> str:
        """The notices as text; empty if there are none."""
        return "; ".join(map(str, self.notices))

    @property
    def p_value(self) -> float:
        """p-value of the chi-square test under statistical errors alone; NaN without a test."""
        return _p_value(self.chi_square, self.dof)

    @property
    def p_value_allowed(self) -> float:
        """p-value with the discrepancy allowed for, which is chosen to make it about 0.5."""
        return _p_value(self.chi_square_allowed, self.dof)

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

    @cached_property
    def error_growth(self) -> Mapping[str, float]:
        """Exponents with which relative standard errors grow with the parameters, by key.

        Only intervals need it, and a selection asks few of its many fits for theirs.
        """
        if self.method == "allan":
            return {}
        noise = [key for key in self.keys if key != drift_key(self.model)]
        result: Mapping[str, float] = frozen(error_growth(self.model, noise, self.wv.n, self.wv.dt))
        return result

    @cached_property
    def _walks(self) -> Walks | None:
        """Random walks that the record leaves open beside an estimated slope."""
        keys = {*self.keys, *self.upper_bounds}
        return walks_beside(self.model, keys, self.wv) if np.isfinite(self.slope_dof) else None

    def interval(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Confidence intervals that stay in the parameters' ranges.

        See `gmwm.estimate.result.estimate.confidence_interval`. An amplitude that is not
        significantly above zero has the interval from zero to its 95 % upper limit. Beside a rate
        ramp, those of R and of a faint K average over random walks of all sizes, see
        `gmwm.estimate.problem.ramp`.

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
                term, walks = self.model.terms[item.term], self._walks
                if walks is not None and term.is_drift:
                    ends = walks.slope_interval(value, level)
                elif walks is not None and term.is_walk and errors[key] > tuning.FAINT * value:
                    ends = walks.size_interval(value, level)
                else:
                    growth, dof = self.error_growth.get(key, 0.0), self.slope_dof
                    ends = confidence_interval(
                        item.parameter, value, errors[key], level, growth=growth, slope_dof=dof
                    )
                result[key] = ends
        return result

    def needed_length(self, relative_error: float = 0.1) -> dict[str, float]:
        """Length of record that would give each parameter a relative standard error.

        Errors fall as 1/sqrt(length). That is optimistic where a discrepancy was allowed for, which
        no length removes.

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
        is_tested = all(notice.code != "no-test" for notice in self.notices)
        return Goodness.of(self.moments, self.wv, is_tested=is_tested)

    @cached_property
    def moments(self) -> FittedMoments:
        """The moments of the data and of the model, whatever the method."""
        is_free = drift_key(self.model) in self.keys
        return FittedMoments.of(self.model, self.wv, self.discrepancy, is_free=is_free)

    def deviation_interval(
        self, tau: FloatArray, level: float = 0.95, rivals: Sequence[Model] | None = None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Allan deviation of the fitted model with its interval, at any averaging times.

        The interval holds if the model is the right one. A model that was selected from these data
        lacks terms too faint to be chosen, and others may fit equally well: with ``rivals`` the
        interval covers both.

        Parameters
        ----------
        tau : array_like
            Averaging times, s.
        level : float, optional
        rivals : sequence of Model, optional
            Models with their values that fit equally well (`Calibration.rivals`,
            `Selection.rivals`), empty if there are none. Each counts with the relative error of
            this one. One further Gauss-Markov process, as large as the data leave open
            (`left_open`), then counts too.

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
        spread = 0.5 * self.logarithmic_error(lambda model: scales.curve(model).ravel())
        value = np.sqrt(2.0 * curve)
        with np.errstate(over="ignore"):  # an end that nothing limits is infinite
            ratio = np.exp(norm.ppf(0.5 + 0.5 * level) * spread.reshape(tau.shape))
        faint = () if rivals is None else left_open(self, level)
        all_, larger = (
            np.array([value, *(np.sqrt(2.0 * scales.curve(each)) for each in models)])
            for models in (rivals or (), faint)
        )
        lower = np.fmin(np.min(all_, axis=0) / ratio, np.min(larger, axis=0))
        return value, lower, np.fmax(np.max(all_, axis=0) * ratio, np.max(larger, axis=0))

    def logarithmic_error(self, value: Callable[[Model], FloatArray]) -> FloatArray:
        """Standard error of the logarithm of a positive function of the model, (k,).

        By linear propagation of the parameters' covariance.

        Parameters
        ----------
        value : callable
            Model with values -> array of k numbers.
        """
        errors = np.sqrt(np.diag(self.covariance))
        here = value(self.model)
        gradient = np.zeros((len(self.keys), here.size))
        for i, key in enumerate(self.keys):
            step = 1e-3 * min(errors[i], abs(self.params[key]))
            if step == 0.0:
                continue  # at a limit, where it is not estimated
            up, down = (
                value(self.model.with_params({key: self.params[key] + sign * step}))
                for sign in (1.0, -1.0)
            )
            gradient[i] = (up - down) / (2.0 * step) / here
        return np.sqrt(np.einsum("ij,ik,kj->j", gradient, self.covariance, gradient))

    # -- looks ------------------------------------------------------------------------------------

    @cached_property
    def estimates(self) -> tuple[Estimate, ...]:
        """Every parameter with its uncertainty, in SI and data-sheet units."""
        return tuple(
            estimates_of(
                self.model, self.wv.quantity or "", self.stderr, self.interval(), self.upper_bounds
            )
        )

    def __getitem__(self, key: str) -> Estimate:
        for estimate in self.estimates:
            if estimate.key == key:
                return estimate
        raise MissingNameError(f"the fit has no parameter {key!r}: it has {', '.join(self.params)}")

    def __repr__(self) -> str:
        verdict = "valid" if self.valid else "not valid"
        return f"<{type(self).__name__} {self.model!r}, {METHOD_NAMES[self.method]}, {verdict}>"

    def __str__(self) -> str:
        return self.text()

    def _repr_html_(self) -> str:
        title = f"{self.wv.name or 'series'}: {self.model.title()}"
        notes, mark = [self.goodness.sentence, *self.notices], "not " * (not self.valid) + "valid"
        return html_table(title, _HEADS, [each.cells() for each in self.estimates], notes, mark)

    def text(self, units: str = "field") -> str:
        """The text of `print`: estimates in data-sheet units or, with "si", in SI."""
        lines = wrapped(f"{self.wv.name or 'series'}: {self.model.title()}", indent=2)
        how = METHOD_NAMES[self.method]
        if self.weights:
            how += f", {self.weights} weights"
        elif self.trace:
            how += f", {len(self.trace)} iterations"
        lines += wrapped(f"{self.wv.extent}, {self.wv.tau.size} levels; {how}", indent=2)
        lines += ["", plain_table(_HEADS, [each.cells(units) for each in self.estimates]), ""]
        fitness = f"objective {self.objective:.4g} on {self.dof} degrees of freedom"
        if np.isfinite(self.p_value):
            fitness += f", p = {self.p_value:.2g}"
            if self.discrepancy > 0.0:
                fitness += (
                    f" ({self.p_value_allowed:.2g} if the model may be off by "
                    f"{per_cent(self.discrepancy)} of the variance)"
                )
        if np.isfinite(self.log_likelihood):
            lines.append(f"log-likelihood {self.log_likelihood:.8g}")
            fitness = f"of the wavelet variances: {fitness}"
        lines += wrapped(fitness, indent=2)
        lines += wrapped(self.goodness.sentence, indent=2)
        lines.append("valid" if self.valid else "NOT VALID")
        lines += bullets(self.notices)
        return "\n".join(lines)

    def plot(self, ax: Axes | None = None, *, units: str = "field") -> Axes:
        """Allan deviation with error bars, fitted curve, its 95 % band and components.

        In data-sheet units (deg/h, ug), or in SI if ``units`` is "si". For ``method="allan"`` the
        lines and their regions take the place of the band and the components. Returns the axes.
        """
        from gmwm import plotting

        factor = shown_unit(self.wv.quantity, self.wv.unit, units)[1]
        axes = self.wv.plot(ax, units=units)
        tau, curves = dense_curves(self)
        components = {label: factor * curve for label, curve in curves.items() if np.any(curve)}
        total = np.sqrt(factor**2 * np.sum([c**2 for c in curves.values()], axis=0))
        data = factor * self.wv.allan_deviation
        if not self.regions:
            _, *band = (factor * each for each in self.deviation_interval(tau))
            plotting.curves(axes, tau, total, components, data, band)
        else:
            plotting.curves(axes, tau, total, {}, data)
            lines = {}
            for region in self.regions:
                found, slope = self[region.key], slope_name(region.slope)
                label = f"{region.key} = {found.value:.3g} {found.unit} (slope {slope})"
                height = factor * region.coefficient
                lines[label] = (region.slope, height, region.tau_min, region.tau_max)
            plotting.straight_lines(axes, lines)
        return axes

    # -- tables and files -------------------------------------------------------------------------

    def to_frame(self, *, units: str = "field") -> pandas.DataFrame:
        """A table of the parameters, one a row; needs pandas.

        Parameters
        ----------
        units : {"field", "si"}, optional
            Data-sheet units, or SI.
        """
        return frame((estimate.to_dict(units) for estimate in self.estimates), Estimate.COLUMNS)

    def derived(self) -> dict[str, Any]:
        return {
            "params": self.params,
            "stderr": self.stderr,
            "p_value": plain(self.p_value),
            "p_value_allowed": plain(self.p_value_allowed),
            "valid": self.valid,
            "units": {estimate.key: estimate.unit for estimate in self.estimates},
        }

    def check_content(self) -> None:
        if self.model.is_open or len({*self.keys}) != len(self.keys):
            raise ValueError("its model has open parameters, or a key stands twice")
        if not {*self.keys, *self.upper_bounds} <= {*self.params}:
            raise ValueError("keys or upper_bounds are not those of parameters")
        check_covariance(self.covariance.tolist(), len(self.keys))

    @classmethod
    def from_content(cls, content: Mapping[str, Any]) -> Self:
        found = super().from_content(content)
        for name, value in found.derived().items():
            if not _is_alike(content.get(name, value), value):
                raise InputError(f"{name} contradicts the other entries: correct them")
        return found


def _is_alike(given: Any, value: Any) -> bool:
    """Whether JSON is equal but for the last digits of numbers."""
    if isinstance(value, dict):
        same_keys = isinstance(given, dict) and given.keys() == value.keys()
        return same_keys and all(_is_alike(given[key], each) for key, each in value.items())
    if isinstance(value, float):
        return checks.is_number(given) and bool(np.isclose(given, value, 1e-6, 0.0, equal_nan=True))
    return bool(given == value)


def _p_value(statistic: float, dof: int) -> float:
    if np.isnan(statistic) or dof <= 0:
        return float("nan")
    return float(chi2.sf(statistic, dof))


def plain(value: float) -> float | None:
    """A number for JSON, which has no infinity and no NaN."""
    return value if np.isfinite(value) else None


def dense_curves(
    fitted: Fit, model: Model | None = None
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Allan deviation of each term of a model at closely spaced whole numbers of samples.

    Returns: tau (k,), averaging times from the first to the last of the data, s, and only those of
        the data where a term is simulated or the wavelet is not Haar's; deviations by the term's
        label, u, the root of whose sum of squares is that of the model.
    """
    wv, shown = fitted.wv, fitted.model if model is None else model
    scales = Scales.of(wv)
    if wv.wavelet == "haar" and not any(map(scales.is_simulated, shown.terms)):
        octaves = np.log2(wv.tau[-1] / wv.tau[0])
        steps = 2.0 ** np.linspace(0.0, octaves, int(_PER_OCTAVE * octaves) + 1)
        scales = replace(scales, tau=wv.dt * np.unique(np.rint(steps * wv.tau[0] / wv.dt)))
    curves = [np.sqrt(2.0 * scales.curve(term)) for term in shown.terms]
    return scales.tau, dict(zip(shown.term_labels(), curves, strict=True))
