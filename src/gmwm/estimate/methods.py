"""`fit`: one entrance to all methods of estimation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from gmwm import checks
from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate.allan import fit_allan
from gmwm.estimate.em import DRIFTS, fit_em
from gmwm.estimate.fit import Fit
from gmwm.estimate.gmwm import fit_gmwm, fit_simulated
from gmwm.estimate.joint import fit_joint
from gmwm.estimate.mle import fit_mle, fit_whittle
from gmwm.estimate.weights import OMEGAS
from gmwm.process import Model, Process, as_model
from gmwm.recording import Channel
from gmwm.variance.analysis import as_channel, as_wavelet_variance
from gmwm.variance.wavelet import WaveletVariance

Data = WaveletVariance | Channel | FloatArray

_OF_VARIANCES: dict[str, Callable[..., Fit]] = {
    "gmwm": fit_gmwm,
    "simulated": fit_simulated,
    "allan": fit_allan,
}
_SERIES = (WaveletVariance, Channel, np.ndarray)
_OF_SEVERAL = ("gmwm", "simulated")
_OF_SAMPLES: dict[str, Callable[..., Fit]] = {
    "mle": fit_mle,
    "whittle": fit_whittle,
    "em": fit_em,
}
_OPTIONS = {
    "gmwm": ("omega", "discrepancy"),
    "simulated": ("omega", "discrepancy", "replications", "seed"),
    "allan": ("regions",),
    "mle": ("start",),
    "whittle": ("start",),
    "em": ("start", "tolerance", "max_iterations", "accelerate", "drift"),
}
METHODS = tuple(_OPTIONS)
_CHECKS: dict[str, Callable[[Any], Any]] = {
    "omega": lambda given: checks.choice("omega", given, OMEGAS),
    "discrepancy": lambda given: _discrepancy(given),
    "replications": lambda given: checks.whole(
        "replications", given, 1, "give a positive whole number"
    ),
    "seed": lambda given: checks.whole("seed", given, 0, "give a whole number, zero or more"),
    "start": as_model,
    "tolerance": lambda given: checks.positive(
        "tolerance", given, "give a small positive number, e.g. 1e-10"
    ),
    "max_iterations": lambda given: checks.whole(
        "max_iterations", given, 1, "give a positive whole number"
    ),
    "accelerate": lambda given: checks.truth("accelerate", given),
    "drift": lambda given: checks.choice("drift", given, DRIFTS),
    "regions": lambda given: _regions(given),
}


def fit(
    model: Process | Model,
    data: Data | Sequence[Data],
    dt: float | None = None,
    *,
    method: str = "gmwm",
    omega: str | None = None,
    discrepancy: float | None = None,
    replications: int | None = None,
    seed: int | None = None,
    start: Process | Model | None = None,
    tolerance: float | None = None,
    max_iterations: int | None = None,
    accelerate: bool | None = None,
    drift: str | None = None,
    regions: Mapping[str, Sequence[float]] | None = None,
) -> Fit:
    """Estimate the open parameters of an error model from a static series.

    Parameters
    ----------
    model : Process or Model
        Parameters that are given stay as they are, open ones are estimated. No starting values
        are needed.
    data : WaveletVariance, Channel or (n,) array_like, or a list of them
        Missing samples are NaN. The methods "mle", "whittle" and "em" need the samples, "whittle"
        all of them. Several recordings are fitted jointly by "gmwm" and "simulated", see
        `gmwm.estimate.joint.JointFit`.
    dt : float, optional
        Sampling interval, s; needed for an array.
    method : {"gmwm", "simulated", "mle", "whittle", "em", "allan"}
        Generalized method of wavelet moments; the same with the model's wavelet variances found by
        simulation (indirect inference), for processes that can only be simulated; exact maximum
        likelihood by the Kalman filter; the debiased Whittle likelihood, for long series;
        expectation-maximization; straight lines in the Allan plot.
    omega : {"model", "data", "diagonal", "identity"}, optional
        Weights of "gmwm": inverse covariance of the wavelet variances, as the fitted model implies
        it (efficient, the default) or estimated from the coefficients; its diagonal, or none.
    discrepancy : float, optional
        For "gmwm": relative error that the model is granted at each level beyond the statistical
        one. By default it is estimated where the model fails the chi-square test, and zero
        elsewhere; see `gmwm.estimate.discrepancy`.
    replications : int, optional
        For "simulated": number of simulated series as long as the data (10). The covariance of the
        estimates grows by one part in so many.
    seed : int, optional
        For "simulated": seed of these series (0).
    start : Process or Model, optional
        Starting values of "mle", "whittle" and "em"; by default those of "gmwm".
    tolerance : float, optional
        "em" stops when the log-likelihood gains less than this share of itself (1e-10).
    max_iterations : int, optional
        Of "em" (10000).
    accelerate : bool, optional
        Whether "em" extrapolates its steps (it does by default).
    drift : {"ramp", "state"}, optional
        For "em": a ramp added to the signal (default), or an input to the first state as in
        Stebler et al. (2011), which a Gauss-Markov state forgets.
    regions : mapping of str to (float, float), optional
        For "allan": key -> first and last averaging time (s) of the region to read it from; found
        in the plot by default.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        If the data cannot be used, the model has nothing to estimate, or the method does not know
        a process or an option.

    Examples
    --------
    >>> import gmwm
    >>> truth = gmwm.WhiteNoise(N=0.2) + gmwm.GaussMarkov(sigma=0.5, tau=20.0)
    >>> fit = gmwm.fit(truth.opened(), gmwm.simulate(truth, n=100_000, dt=1.0, seed=1), dt=1.0)
    >>> fit.valid
    True
    """
    checks.choice("method", method, METHODS)
    options = {
        "omega": omega, "discrepancy": discrepancy, "replications": replications, "seed": seed,
        "start": start, "tolerance": tolerance,
        "max_iterations": max_iterations, "accelerate": accelerate, "drift": drift,
        "regions": regions,
    }  # fmt: skip
    given = _belonging(method, options)
    model = as_model(model)
    if not model.is_open:
        raise InputError(f"{model!r} has no open parameter: there is nothing to estimate")
    if are_several(data):
        if method not in _OF_SEVERAL:
            known = ", ".join(_OF_SEVERAL)
            raise InputError(f"method = {method!r} takes one recording at a time: take {known}")
        parts = [_variance(part, dt, omega) for part in cast("Sequence[Data]", data)]
        return fit_joint(model, parts, _OF_VARIANCES[method], **given)
    data = cast("Data", data)
    if method in _OF_VARIANCES:
        return _OF_VARIANCES[method](model, _variance(data, dt, omega), **given)
    if isinstance(data, WaveletVariance):
        raise InputError(
            f"method = {method!r} needs the samples: give the series, not its variance"
        )
    channel = data if isinstance(data, Channel) else as_channel(data, dt)
    where = f"channel {channel.name!r}" if channel.name else "the series"
    values = checks.real_numbers(channel.values, where)
    channel = replace(channel, values=values, dt=checks.sampling_interval(channel.dt))
    return _OF_SAMPLES[method](model, channel, **given)


def are_several(data: Data | Sequence[Data]) -> bool:
    """Whether it is a list of recordings; one of numbers is a series."""
    if not isinstance(data, list | tuple):
        return False
    if not data:
        raise InputError("there is no recording: give one wavelet variance at least")
    several = [isinstance(part, _SERIES) for part in data]
    if any(several) and not all(several):
        odd = data[several.index(False)]
        raise InputError(
            f"{checks.shown(odd)} stands among the recordings: give wavelet variances, channels "
            "or arrays"
        )
    return all(several)


def _variance(data: Data, dt: float | None, omega: str | None) -> WaveletVariance:
    return as_wavelet_variance(data, dt, data_covariance="octave" if omega == "data" else None)


def _belonging(method: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """The options that were given, all of which must belong to the method."""
    given = {name: value for name, value in options.items() if value is not None}
    for name in given:
        if name not in _OPTIONS[method]:
            known = ", ".join(_OPTIONS[method])
            raise InputError(f"{name} is no option of method {method!r}: it has {known}")
    return {name: _CHECKS[name](value) for name, value in given.items()}


def _discrepancy(given: Any) -> float:
    if not checks.is_number(given) or not 0.0 <= given < 1.0:
        raise InputError(
            f"discrepancy = {checks.shown(given)}: give a share of the variance, e.g. 0.02"
        )
    return float(given)


def _regions(given: Any) -> Any:
    """Regions as they are; `gmwm.estimate.allan` knows what they must be but for the start."""
    for key, region in given.items() if isinstance(given, Mapping) else ():
        first = region[0] if isinstance(region, Sequence | np.ndarray) and len(region) else 1.0
        if checks.is_number(first) and first < 0.0:
            raise InputError(
                f"regions[{key!r}] starts at {first:g} s: give an averaging time above zero"
            )
    return given
