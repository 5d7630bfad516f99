"""The samples of a channel as the likelihood methods take them, and where they start from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.likelihood.likelihood import Columns
from gmwm.estimate.moments import GMWM
from gmwm.estimate.problem import Coordinates
from gmwm.estimate.result import Fit
from gmwm.process import Model, Process, as_model
from gmwm.readers import Channel
from gmwm.variance import MIN_SAMPLES, Runs, WaveletVariance, wavelet_variance


@dataclass(frozen=True, eq=False)
class Series:
    """A channel ready for a likelihood.

    columns: The samples and regressors.
    wv: Of the samples; where gaps leave none, of the series bridged by straight lines.
    is_bridged: Whether ``wv`` is of the bridged series: fine levels are then too low, so that it is
        a starting point but no test of a fit.
    coordinates: Of the model's noise.
    start: Starting values of its terms, all of them positive.
    start_is_valid: Whether they are valid estimates by the method of moments.
    """

    columns: Columns
    wv: WaveletVariance
    is_bridged: bool
    coordinates: Coordinates
    start: tuple[Process, ...]
    start_is_valid: bool

    @classmethod
    def of(
        cls, model: Model, channel: Channel, start: Process | Model | None, *, gaps: bool
    ) -> Series:
        """Check the samples and find starting values.

        Raises InputError if the samples are no series of numbers, if some are missing and ``gaps``
            are not allowed, or if ``start`` is not the same model.
        """
        coordinates = Coordinates(model)
        for term in coordinates.noise:
            if type(term).state_space is Process.state_space:
                raise InputError(
                    f"{type(term).__name__} has no state-space form, which a likelihood needs: "
                    'take method = "gmwm"'
                )
        missing = _missing(channel)
        if missing and not gaps:
            raise InputError(
                f"the series misses {missing:,} samples, which a Fourier transform needs: take "
                'method = "mle" or "gmwm"'
            )
        values = np.asarray(channel.values, dtype=float)
        bridged, is_bridged = channel, False
        if missing:
            # Scattered gaps leave no wavelet coefficients at coarse levels, or none at all.
            k = np.arange(values.size)
            known = k[~np.isnan(values)]
            filled = np.interp(k, known, values[known])[known[0] : known[-1] + 1]
            bridged = replace(channel, values=filled)
            is_bridged = Runs.of(values).longest < MIN_SAMPLES
        to_start = wavelet_variance(bridged)
        wv = wavelet_variance(channel) if missing and not is_bridged else to_start
        ramp = next((term for term in model.terms if term.is_drift), None)
        given = None if ramp is None or ramp.is_open else ramp.drift_rate()
        columns = Columns(values, channel.dt, given, ramp is not None)
        if start is None:
            fit = GMWM().estimate(model, to_start)
            first, is_valid = _from_moments(fit, coordinates), fit.valid
        else:
            first, is_valid = _from_user(model, as_model(start), coordinates), False
        return cls(columns, wv, is_bridged, coordinates, first, is_valid)


def _missing(channel: Channel) -> int:
    """Number of missing samples of a series that has enough of them.

    Raises InputError if hardly any sample is there.
    """
    values = np.asarray(channel.values, dtype=float)
    if values.ndim != 1 or np.any(np.isinf(values)):
        return 0  # no series: the wavelet variance reports it
    missing = int(np.sum(np.isnan(values)))
    if missing and values.size - missing < MIN_SAMPLES:
        where = f"channel {channel.name!r}" if channel.name else "the series"
        raise InputError(
            f"{where} has {values.size - missing} samples that are not missing: give "
            f"{MIN_SAMPLES} or more"
        )
    return missing


def _from_moments(fit: Fit, coordinates: Coordinates) -> tuple[Process, ...]:
    """Estimates by the method of moments, with amplitudes of zero replaced by small ones."""
    level = float(np.sqrt(np.min(fit.wv.variance)))
    fitted = list(fit.model.terms)
    # The model has sorted its terms; any with the kind and the given values will do.
    found = []
    for term in coordinates.noise:
        match = next(p for p in fitted if _same_given(term, p))
        fitted.remove(match)
        linear = match.linear_parameter
        if linear is not None and match.values[linear.name] == 0.0:
            key = next(
                item.key
                for item in fit.model.parameters
                if fit.model.terms[item.term] is match and item.parameter.name == linear.name
            )
            limit = fit.upper_bounds.get(key, np.inf)
            small = tuning.SMALL_START * limit if 0.0 < limit < np.inf else 1e-3 * level
            match = match.with_values(**{linear.name: small})
        found.append(match)
    return tuple(found)


def _same_given(term: Process, fitted: Process) -> bool:
    """Whether ``fitted`` is ``term`` with its open parameters filled in."""
    if type(term) is not type(fitted) or term.values.keys() != fitted.values.keys():
        return False
    return all(v is None or v == fitted.values[k] for k, v in term.values.items())


def _from_user(model: Model, start: Model, coordinates: Coordinates) -> tuple[Process, ...]:
    kept = [term for term in start.terms if not term.is_drift]
    terms: Sequence[Process] = coordinates.noise
    found = []
    for term in terms:
        match = next((p for p in kept if _same_given(term, p)), None)
        if match is None or match.is_open:
            raise InputError(
                f"start = {start!r} does not give every term of {model!r} a value: repeat the "
                "model with numbers"
            )
        kept.remove(match)
        linear = match.linear_parameter
        if linear is not None and not (match.values[linear.name] or 0.0) > 0.0:
            raise InputError(f"start = {start!r}: {linear.name} must be positive")
        found.append(match)
    if kept:
        raise InputError(f"start = {start!r} has a term that {model!r} has not: {kept[0]!r}")
    return tuple(found)
