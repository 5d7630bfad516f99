"""One structure for all recordings: its parameters, their spread, the numbers for a filter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.calibration import noise_density, random_walk
from gmwm.comparison import tuning
from gmwm.errors import InputError
from gmwm.estimate import Estimate, Fit, JointFit
from gmwm.estimate.problem import Scales
from gmwm.estimate.result import between
from gmwm.filter_numbers import FilterNumbers, bound
from gmwm.process import Process
from gmwm.selection import select
from gmwm.variance import WaveletVariance


@dataclass(frozen=True)
class ParameterSpread:
    """One parameter of the joint model in all recordings.

    joint: Of all recordings together.
    each: Of each recording that is compared, with the same structure; ``None`` where it has none.
    spread: Standard deviation between recordings beyond their standard errors, relative; NaN where
        fewer than two determine it, or one has all the weight.
    p_value: That it is the same in all of them; NaN likewise.
    """

    joint: Estimate
    each: tuple[Estimate | None, ...]
    spread: float
    p_value: float

    @property
    def key(self) -> str:
        """Name of the parameter."""
        return self.joint.key


@dataclass(frozen=True)
class AxisNumbers:
    """N and K that a filter should believe of an axis, for a time without aiding.

    each: Recording -> the bound of its own model.
    joint: The bound of the joint model.
    covering: One pair of numbers that bounds the models of all recordings.
    nees: Recording -> predicted normalised error squared of a filter with the covering numbers
        after that time; 1 is right, below 1 cautious.
    upper: Letters that no recording determines -> the largest of their 95 % upper bounds.
    """

    each: Mapping[str, FilterNumbers]
    joint: FilterNumbers | None
    covering: FilterNumbers | None
    nees: Mapping[str, float]
    upper: Mapping[str, float]

    def value(self, letter: str) -> float:
        """The covering N or K, or the upper bound of what no recording determines; NaN without."""
        found = getattr(self.covering, letter) if self.covering is not None else float("nan")
        return self.upper.get(letter, float("nan")) if found == 0.0 else float(found)

    def inflation(self, letter: str) -> float:
        """The covering number over that of the joint model; NaN where one of them is none."""
        if self.joint is None or self.covering is None:
            return float("nan")
        own = getattr(self.joint, letter)
        return float(getattr(self.covering, letter) / own) if own > 0.0 else float("nan")


def joint_fit(fits: Sequence[Fit]) -> JointFit | Notice:
    """The model selected for all recordings of a channel, or why there is none."""
    dt = fits[0].wv.dt
    try:
        found = select([_at(fit.wv, dt) for fit in fits], extra=_extra(fits)).fit
    except InputError as error:
        return Notice("no-joint-model", "warning", fits[0].wv.name, str(error))
    assert isinstance(found, JointFit)
    return found


def _at(wv: WaveletVariance, dt: float) -> WaveletVariance:
    """The same at the averaging times of another recording of nearly the same rate."""
    return wv if wv.dt == dt else replace(wv, dt=dt, tau=wv.tau * (dt / wv.dt))


def _extra(fits: Sequence[Fit]) -> tuple[Process, ...]:
    """The largest line and the largest resonance in the models, with a free amplitude."""
    found: dict[str, tuple[float, Process]] = {}
    for term in (term for fit in fits for term in fit.model.terms):
        size = term.linear_parameter
        if size is None or "frequency" not in term.values:
            continue
        kind, amplitude = type(term).__name__, term.values[size.name] or 0.0
        if kind not in found or amplitude > found[kind][0]:
            found[kind] = amplitude, term.with_values(**{size.name: None})
    return tuple(found[kind][1] for kind in sorted(found))


def spreads(joint: JointFit) -> tuple[ParameterSpread, ...]:
    """The parameters of a joint fit, one by one."""
    parts = [{each.key: each for each in part.estimates} for part in joint.parts]
    return tuple(_spread(own, [part.get(own.key) for part in parts]) for own in joint.estimates)


def _spread(own: Estimate, each: Sequence[Estimate | None]) -> ParameterSpread:
    """Of the recordings that determine it; positive values by their logarithm."""
    known = [e for e in each if e is not None and e.kind == "estimated" and e.stderr]
    if len(known) < 2:
        return ParameterSpread(own, tuple(each), float("nan"), float("nan"))
    values, errors = np.array([[e.value, e.stderr or np.nan] for e in known]).T
    if np.all(values > 0.0):
        found, p_value = between(np.log(values), (errors / values) ** 2.0)
    else:
        found, p_value = between(values, errors**2.0)
        found /= abs(float(np.mean(values)) or 1.0)
    return ParameterSpread(own, tuple(each), found, p_value)


def axis_numbers(
    name: str, fits: Mapping[str, Fit], joint: Fit | None, horizon: float
) -> tuple[AxisNumbers, tuple[Notice, ...]]:
    """What a filter should believe of an axis.

    name: Of the channel.
    fits: Recording -> its own fit.
    horizon: s.
    """
    each: dict[str, FilterNumbers] = {}
    notices = []
    for label, fit in fits.items():
        try:
            each[label] = bound(fit, horizon=horizon)
        except InputError as error:
            notices.append(Notice("no-numbers", "warning", name, str(error), source=label))
    if not each:
        return AxisNumbers({}, None, None, {}, {}), tuple(notices)
    whole = covering = None
    nees: dict[str, float] = {}
    try:
        whole = None if joint is None else bound(joint, horizon=horizon)
        # By names that end as the channel does, which says whether its gyro turns a heading.
        group = {f"{place} {name}": fits[label] for place, label in enumerate(each)}
        found = bound(group, horizon=horizon, shared=True)
        covering = next(iter(found.values()))
        own = (numbers.nees[horizon] for numbers in found.values())
        nees = dict(zip(each, own, strict=True))
    except InputError as error:
        notices.append(Notice("no-numbers", "warning", name, str(error)))
    return AxisNumbers(each, whole, covering, nees, _upper(fits, covering)), tuple(notices)


def _upper(fits: Mapping[str, Fit], covering: FilterNumbers | None) -> dict[str, float]:
    """Upper bounds of the letters that the covering numbers have not."""
    found: dict[str, float] = {}
    for letter, level in (("N", noise_density), ("K", random_walk)):
        if covering is None or getattr(covering, letter) > 0.0:
            continue
        values = []
        for fit in fits.values():
            try:
                values.append(level(fit).value)
            except InputError:
                continue  # this record bounds nothing
        if values:
            found[letter] = max(values)
    return found


def curve_inflation(fits: Sequence[Fit], joint: Fit, longest: float) -> float:
    """By how much the joint model's amplitudes must grow to cover the curves of all recordings.

    Largest ratio of the Allan deviation of a recording's own model to that of the joint model, from
    0.1 s (or ten samples) to ``longest`` (s); at least one.
    """
    low = max(tuning.FINEST_TIME, tuning.FINEST_SAMPLES * joint.wv.dt)
    tau = joint.wv.tau[(joint.wv.tau >= low) & (joint.wv.tau <= longest)]
    if tau.size == 0:
        return float("nan")
    curves = [_variance(fit, tau) for fit in fits]
    return float(max(1.0, np.sqrt(np.max(np.array(curves) / _variance(joint, tau)))))


def _variance(fit: Fit, tau: FloatArray) -> FloatArray:
    """Wavelet variance of the noise of a model, u^2."""
    scales = replace(Scales.of(fit.wv), tau=tau)
    return np.sum([scales.curve(each) for each in fit.model.terms if not each.is_drift], axis=0)
