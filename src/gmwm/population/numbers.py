"""One model structure for all recordings of a channel: parameters, their spread, filter numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.calibration import noise_density, random_walk
from gmwm.errors import InputError
from gmwm.estimate import Estimate, Fit, JointFit
from gmwm.estimate.problem import Scales
from gmwm.estimate.result import between
from gmwm.filter_numbers import FilterNumbers, bound
from gmwm.issues import Notice, notice
from gmwm.population import tuning
from gmwm.process import Process
from gmwm.selection import select


@dataclass(frozen=True)
class ParameterSpread:
    """One parameter of the joint model in all recordings.

    joint: Estimate from all recordings together.
    each: Estimate of the same structure from each compared recording; ``None`` where it has none.
    spread: Relative standard deviation between recordings beyond their standard errors; NaN where
        fewer than two determine it, or one has all the weight.
    p_value: Of the test that it is the same in all of them; NaN likewise.
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
    """N and K of an axis for a filter, for outages up to the horizon.

    each: Recording -> the bound of its own model.
    joint: The bound of the joint model.
    covering: One pair of numbers that bounds the models of all recordings.
    nees: Recording -> normalised error squared that a filter with the covering numbers predicts
        after the outage; 1 is right, below 1 conservative.
    upper: Letters that no recording determines -> the largest of their 95 % upper limits.
    """

    each: Mapping[str, FilterNumbers]
    joint: FilterNumbers | None
    covering: FilterNumbers | None
    nees: Mapping[str, float]
    upper: Mapping[str, float]

    def value(self, letter: str) -> float:
        """The covering N or K, or the upper limit where no recording determines it; else NaN."""
        found = getattr(self.covering, letter) if self.covering is not None else float("nan")
        return self.upper.get(letter, float("nan")) if found == 0.0 else float(found)

    def inflation(self, letter: str) -> float:
        """The covering number over that of the joint model; NaN where one is missing."""
        if self.joint is None or self.covering is None:
            return float("nan")
        own = getattr(self.joint, letter)
        return float(getattr(self.covering, letter) / own) if own > 0.0 else float("nan")


def joint_fit(fits: Sequence[Fit]) -> JointFit | Notice:
    """The model selected for all recordings of a channel, or why there is none."""
    dt = fits[0].wv.dt
    # Rates may differ by as much as clocks do; averaging times are taken as those of the first.
    curves = [
        wv if wv.dt == dt else replace(wv, dt=dt, tau=wv.tau * (dt / wv.dt))
        for wv in (fit.wv for fit in fits)
    ]
    # The largest line and the largest resonance, with a free amplitude.
    largest: dict[str, tuple[float, Process]] = {}
    for term in (term for fit in fits for term in fit.model.terms):
        size = term.linear_parameter
        if size is None or "frequency" not in term.values:
            continue
        kind, amplitude = type(term).__name__, term.values[size.name] or 0.0
        if kind not in largest or amplitude > largest[kind][0]:
            largest[kind] = amplitude, term.with_values(**{size.name: None})
    try:
        extra = tuple(largest[kind][1] for kind in sorted(largest))
        found = select(curves, extra=extra).fit
    except InputError as error:
        return notice("no-joint-model", fits[0].wv.name, error=error)
    assert isinstance(found, JointFit)
    return found


def parameter_spreads(joint: JointFit) -> tuple[ParameterSpread, ...]:
    """The parameters of a joint fit, one by one."""
    parts = [{each.key: each for each in part.estimates} for part in joint.parts]
    return tuple(_spread(own, [part.get(own.key) for part in parts]) for own in joint.estimates)


def _spread(own: Estimate, each: Sequence[Estimate | None]) -> ParameterSpread:
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
    """Filter numbers of a channel from its fits by recording, and what could not be found."""
    each: dict[str, FilterNumbers] = {}
    notices = []
    for label, fit in fits.items():
        try:
            each[label] = bound(fit, horizon=horizon)
        except InputError as error:
            notices.append(replace(notice("no-numbers", name, error=error), source=label))
    if not each:
        return AxisNumbers({}, None, None, {}, {}), tuple(notices)
    whole = covering = None
    nees: dict[str, float] = {}
    try:
        whole = None if joint is None else bound(joint, horizon=horizon)
        # The end of a name tells `bound` whether a gyro turns the heading.
        group = {f"{place} {name}": fits[label] for place, label in enumerate(each)}
        found = bound(group, horizon=horizon, shared=True)
        covering = next(iter(found.values()))
        own = (numbers.nees[horizon] for numbers in found.values())
        nees = dict(zip(each, own, strict=True))
    except InputError as error:
        notices.append(notice("no-numbers", name, error=error))
    return AxisNumbers(each, whole, covering, nees, _upper(fits, covering)), tuple(notices)


def _upper(fits: Mapping[str, Fit], covering: FilterNumbers | None) -> dict[str, float]:
    """Upper limits of the letters that are zero in the covering numbers."""
    found: dict[str, float] = {}
    for letter, level in (("N", noise_density), ("K", random_walk)):
        if covering is None or getattr(covering, letter) > 0.0:
            continue
        for fit in fits.values():
            try:
                found[letter] = max(level(fit).value, found.get(letter, 0.0))
            except InputError:
                continue  # this recording gives no limit
    return found


def curve_inflation(fits: Sequence[Fit], joint: Fit, longest: float) -> float:
    """Factor on the joint model's amplitudes that covers the curves of all recordings.

    The largest ratio, at least one, of the Allan deviation of a recording's own model to that of
    the joint model, from 0.1 s (or ten samples) to ``longest`` (s); NaN if there is no such time.
    """
    low = max(tuning.FINEST_TIME, tuning.FINEST_SAMPLES * joint.wv.dt)
    tau = joint.wv.tau[(joint.wv.tau >= low) & (joint.wv.tau <= longest)]
    if tau.size == 0:
        return float("nan")

    def variance(fit: Fit) -> FloatArray:
        scales = replace(Scales.of(fit.wv), tau=tau)
        return np.sum([scales.curve(t) for t in fit.model.terms if not t.is_drift], axis=0)

    ratios = np.array([variance(fit) for fit in fits]) / variance(joint)
    return float(max(1.0, np.sqrt(np.max(ratios))))
