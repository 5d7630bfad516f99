"""`fit`: one entrance to all methods of estimation."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from gmwm._core import checks
from gmwm._core.jobs import one_blas_thread
from gmwm._core.typing import FloatArray
from gmwm.errors import FitWarning, InputError
from gmwm.estimate.likelihood.em import EM
from gmwm.estimate.likelihood.mle import MLE, Whittle
from gmwm.estimate.lines import AllanLines
from gmwm.estimate.moments.gmwm import GMWM, SimulatedMoments
from gmwm.estimate.result.fit import Fit
from gmwm.estimate.result.joint import fit_joint
from gmwm.process import Model, Process, as_model
from gmwm.readers import Channel
from gmwm.variance import WaveletVariance, as_channel, as_wavelet_variance

Data = WaveletVariance | Channel | FloatArray | Sequence[float]
OfVariances = GMWM | SimulatedMoments | AllanLines
OfSamples = MLE | Whittle | EM
Method = OfVariances | OfSamples

METHODS: dict[str, type[Method]] = {
    kind.name: kind for kind in (GMWM, SimulatedMoments, MLE, Whittle, EM, AllanLines)
}
"""Methods by name."""


def fit(
    model: Process | Model | str,
    data: Data | Sequence[Data],
    dt: float | None = None,
    *,
    method: str | Method = "gmwm",
    weights: str | None = None,
    omega: str | None = None,
    rate: float | None = None,
) -> Fit:
    """Estimate the open parameters of an error model from a static series.

    Parameters
    ----------
    model : Process, Model or str
        Given parameters stay as they are, open ones are estimated; a text such as "N + K + 2 GM"
        has only open ones. No starting values are needed.
    data : WaveletVariance, Channel or (n,) array_like, or a list of them
        Missing samples are NaN. The methods "mle", "whittle" and "em" need the samples, "whittle"
        all of them. Several recordings are fitted jointly by "gmwm" and "simulated", see
        `JointFit`.
    dt, rate : float, optional
        Sampling interval, s, or rate, Hz; one is needed for an array.
    method : str or object that holds the options of a method
        "gmwm" or `GMWM`, the Generalized Method of Wavelet Moments; "simulated" or
        `SimulatedMoments`, the same with simulated moments; "mle" or `MLE`, exact maximum
        likelihood; "whittle" or `Whittle`, the debiased Whittle likelihood, for long series; "em"
        or `EM`, expectation-maximization; "allan" or `AllanLines`, straight lines in the Allan
        plot.
    weights : {"model", "data", "diagonal", "identity"}, optional
        Omega of the method of moments, see `GMWM`.
    omega : str, optional
        The same as ``weights``, by the paper's name.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        If the data cannot be used, the model has nothing to estimate, or the method does not know
        a process or an option.

    Warns
    -----
    FitWarning
        If the fit is not valid.

    Examples
    --------
    >>> import gmwm
    >>> truth = gmwm.WhiteNoise(N=0.2) + gmwm.GaussMarkov(sigma=0.5, tau=20.0)
    >>> x = gmwm.simulate(truth, n=100_000, dt=1.0, seed=1)
    >>> gmwm.fit(truth.opened(), x, dt=1.0).valid
    True
    >>> gmwm.fit(truth.opened(), x, dt=1.0, method=gmwm.GMWM(discrepancy=0.01)).discrepancy
    0.01
    """
    if rate is not None:
        dt = checks.sampling_interval(dt, rate)
    found = estimate(model, data, dt, _with_options(method, weights, omega))
    if not found.valid:
        warnings.warn(f"{found!r}: {found.message}", FitWarning, stacklevel=2)
    return found


@one_blas_thread()
def estimate(
    model: Process | Model | str,
    data: Data | Sequence[Data],
    dt: float | None = None,
    method: Method | None = None,
) -> Fit:
    """`fit` by a method with its options, without a warning where the fit is not valid."""
    method = method or GMWM()
    model = as_model(model)
    if not model.is_open:
        raise InputError(f"{model!r} has nothing to estimate: free its parameters by .opened()")
    if are_several(data):
        if not isinstance(method, GMWM):
            raise InputError(
                f"method = {method.name!r} takes one recording at a time: use method='gmwm'"
            )
        parts = [_variance(part, dt, method) for part in cast("Sequence[Data]", data)]
        return fit_joint(model, parts, method.estimate)
    data = cast("Data", data)
    if not isinstance(method, OfSamples):
        return method.estimate(model, _variance(data, dt, method))
    if isinstance(data, WaveletVariance):
        raise InputError(
            f"method = {method.name!r} needs the samples: give the series, not its variance, as in "
            f"fit(model, recording['gyro_x'], method={method.name!r})"
        )
    channel = data if isinstance(data, Channel) else as_channel(data, dt)
    where = f"channel {channel.name!r}" if channel.name else "the series"
    values = checks.real_numbers(channel.values, where)
    channel = replace(channel, values=values, dt=checks.sampling_interval(channel.dt))
    return method.estimate(model, channel)


def _with_options(method: Any, weights: str | None, omega: str | None) -> Method:
    """The method with its options."""
    if weights is not None and omega is not None and weights != omega:
        raise InputError(f"weights = {weights!r} and omega = {omega!r} are the same: give one")
    weights = weights or omega
    if isinstance(method, str) and method in METHODS:
        method = METHODS[method]()
    if not isinstance(method, Method):
        raise InputError(
            f"method = {checks.shown(method)} is not known: give one of {', '.join(METHODS)}, or "
            "an options object such as gmwm.EM(tolerance=1e-8)"
        )
    if weights is None:
        return method
    if not isinstance(method, GMWM):
        raise InputError(
            f"method {method.name!r} has no weights: leave them out, or use method='gmwm'"
        )
    return replace(method, weights=weights)


def are_several(data: Data | Sequence[Data]) -> bool:
    """Whether the data are a list of recordings; a list of numbers is a series."""
    if not isinstance(data, list | tuple):
        return False
    if not data:
        raise InputError("no recordings given: give at least one wavelet variance")
    several = [isinstance(part, WaveletVariance | Channel | np.ndarray) for part in data]
    if any(several) and not all(several):
        odd = data[several.index(False)]
        raise InputError(
            f"{checks.shown(odd)} is not a recording: give wavelet variances, channels or arrays"
        )
    return all(several)


def _variance(data: Data, dt: float | None, method: OfVariances) -> WaveletVariance:
    of_data = isinstance(method, GMWM) and method.weights == "data"
    return as_wavelet_variance(data, dt, data_covariance="octave" if of_data else None)
