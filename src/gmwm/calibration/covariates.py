"""Covariates of a recording, and the curves that are removed before its noise is fitted.

A first curve is that of the largest likelihood under white noise beside a random walk; with it the
degree and time constants are chosen, by the criterion of a selection. What is left is calibrated
with the regressors beside the noise, which correct the curve.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Any, Literal

import numpy as np

from gmwm._core import checks
from gmwm._core.spool import alike, release, windows
from gmwm._core.typing import FloatArray
from gmwm.calibration import tuning
from gmwm.calibration.curve import MOST_POWER, BiasCurve, Covariate, Regressor
from gmwm.calibration.scaling import Scaling, scaling
from gmwm.diagnosis import thermometer_fails
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.estimate.problem import pilot
from gmwm.issues import Notice, Severity, notice
from gmwm.readers import Channel, Recording, block_means
from gmwm.selection import penalty
from gmwm.variance import RegressorPart, Regressors, WaveletVariance

_DEGREES = {"linear": 1, "quadratic": 2, "cubic": 3, "quartic": 4}
_FORM = 'covariates={"temperature": "cubic, lag", "settling": "auto"}'
_TIME = re.compile(r"(?:lag +)?(\d+\.?\d*) *s")


@dataclass(frozen=True)
class Wanted:
    """What a curve may depend on one covariate by.

    degrees: To choose from; (0,) for "settling".
    constants: Time constants of a lag or of settling, s; None to choose, empty for none.
    """

    name: str
    degrees: tuple[int, ...]
    constants: tuple[float, ...] | None = ()

    @classmethod
    def of(cls, name: str, text: str) -> Wanted:
        """Parse words such as "cubic, lag 120 s"."""
        words = [word.strip() for word in str(text).lower().split(",")]
        degrees: tuple[int, ...] | None = None
        constants: tuple[float, ...] | None = () if name != "settling" else None
        for word in words:
            time = _TIME.fullmatch(word)
            if name != "settling" and word in _DEGREES:
                degrees = (_DEGREES[word],)
            elif name != "settling" and word.isdigit() and 1 <= int(word) <= MOST_POWER:
                degrees = (int(word),)
            elif word == "auto":
                degrees = None
            elif word.startswith("lag") == (name != "settling") and (time or word == "lag"):
                constants = (float(time[1]),) if time else None
            else:
                raise InputError(
                    f"covariates: {name!r}: {checks.shown(text)}: write auto, linear, quadratic, "
                    f"cubic or a degree up to {MOST_POWER}, with or without lag, as in {_FORM}"
                )
        if name == "settling":
            degrees = (0,)
        return cls(name, degrees or tuple(range(1, tuning.MOST_DEGREE + 1)), constants)

    def choices(self, length: float) -> Iterable[tuple[Regressor, ...]]:
        """Regressors to choose from, for records of a length, s."""
        kind: Literal["settling", "lag"] = "settling" if self.name == "settling" else "lag"
        times: Sequence[float] = self.constants or ()
        if self.constants is None:
            times = np.geomspace(*tuning.LAGS, tuning.LAG_STEPS).tolist()
            times = [each for each in times if each < length * tuning.LONGEST_LAG]
        covariate = "" if kind == "settling" else self.name
        for degree, constant in product(self.degrees, times or (0.0,)):
            powers = [Regressor("power", covariate, k + 1) for k in range(degree)]
            extra = [Regressor(kind, covariate, 0, constant)] if constant else []
            yield (*powers, *extra)


def wanted(covariates: Mapping[str, str] | None) -> tuple[Wanted, ...]:
    """Covariates as users write them.

    Raises InputError if there are none, or one cannot be read.
    """
    if covariates is None:
        return ()
    if not isinstance(covariates, Mapping) or not covariates:
        raise InputError(f"covariates = {checks.shown(covariates)}: write it like {_FORM}")
    return tuple(Wanted.of(str(name), text) for name, text in covariates.items())


@dataclass(frozen=True, eq=False)
class Nodes:
    """A recording's covariates at equally spaced times.

    time: (M,), s from its first sample.
    start: s of that since the recording began.
    rows: Name -> (M,).
    lost: (M,), NaN where one of them is missing for too long to be interpolated, else zero.
    notices: Which are.
    """

    time: FloatArray
    start: float
    rows: Mapping[str, FloatArray]
    lost: FloatArray
    notices: tuple[Notice, ...]

    @classmethod
    def of(cls, recording: Recording, names: Sequence[str], most: int = 0) -> Nodes:
        """Means of parts of a recording, interpolated where samples are missing."""
        length = max(recording.n // max(tuning.NODES, most), tuning.SHORTEST_NODE)
        parts, step = recording.n // length, length * recording.dt
        time = np.asarray(step * (np.arange(parts) + 0.5), dtype=float)
        rows: dict[str, FloatArray] = {}
        lost, notices = np.zeros(parts), list[Notice]()
        for name in names:
            channel = _channel_of(recording, name)
            when = recording.dt * np.arange(recording.n, dtype=float)
            own = when if channel is None else channel.values
            dt = recording.dt if channel is None else channel.dt
            size = max(int(own.size // max(parts, 1)), 1)
            means = block_means([own], size, 0.0)[:, 0]
            if channel is not None and channel.quantity == "temperature":
                means[fails := thermometer_fails(means, own)] = np.nan
                if np.any(fails):
                    values = {"length": size * dt * np.count_nonzero(fails)}
                    notices.append(notice("thermometer-fails", "", values, name=name))
            there = np.flatnonzero(~np.isnan(means))
            if there.size < 2:
                raise InputError(
                    f"{recording.source or 'the recording'}: {name} has no values: leave it out"
                )
            known = (there + 0.5) * size * dt
            rows[name] = np.interp(time, known, means[there])
            after = np.searchsorted(known, time)
            ends = known[np.clip([after - 1, after], 0, there.size - 1)]
            longest = max(tuning.LONGEST_BRIDGE * recording.duration, 2.0 * size * dt)
            away = np.ptp(ends, axis=0) > longest
            beyond = np.abs(time - np.clip(time, known[0], known[-1]))
            away |= beyond > max(step, size * dt)
            if np.any(away):
                lost[away] = np.nan
                values = {"length": step * np.count_nonzero(away)}
                notices.append(notice("covariate-missing", "", values, name=name))
        begun = [each.values["start"] for each in recording.notices if each.code == "part"]
        return cls(time, float(sum(begun)), rows, lost, tuple(notices))

    def columns(self, one: Regressor, scale: Mapping[str, Covariate]) -> FloatArray:
        """A regressor, (M,)."""
        name = one.covariate
        return one.along(self.time + self.start, self.rows.get(name), scale.get(name))


def _channel_of(recording: Recording, name: str) -> Channel | None:
    """The channel of a covariate: by its name, or the only one of that quantity; None for time."""
    if name in recording:
        if not recording[name].is_auxiliary:
            raise InputError(
                f"{name} is a channel of the sensor itself, not a covariate: name a temperature or "
                "another auxiliary channel",
                "no-covariate",
            )
        return recording[name]
    of_kind = [each for each in recording.channels if each.quantity == name]
    if len(of_kind) == 1:
        return of_kind[0]
    if of_kind:
        which = ", ".join(each.name for each in of_kind)
        raise InputError(
            f"{recording.source or 'the recording'} has several channels of {name}, {which}: name "
            f"one as the covariate, such as {of_kind[0].name}",
            "no-covariate",
        )
    if name == "time":
        return None
    known = ", ".join(each.name for each in recording.channels if each.is_auxiliary) or "none"
    raise InputError(
        f"{recording.source or 'the recording'} has no channel {name!r} as a covariate: it has "
        f"{known}; name its column with the unit, such as temperature [degC]",
        "no-covariate",
    )


@dataclass(frozen=True, eq=False)
class Design:
    """Regressors of a channel, and the first curve, which is removed from its samples.

    columns: Of each recording, (p, M), at its nodes.
    notices: What the curve lacks.
    """

    name: str
    covariates: tuple[Covariate, ...]
    regressors: tuple[Regressor, ...]
    nodes: tuple[Nodes, ...]
    columns: tuple[FloatArray, ...]
    removed: FloatArray
    offset: float
    notices: tuple[Notice, ...]

    def without(self, channel: Channel, place: int) -> Channel:
        """A channel of a recording less the first curve, missing where that is not known."""
        own = self.nodes[place]
        return _less(channel, own.time, self.removed @ self.columns[place] + own.lost)

    def evened(self, channel: Channel, place: int, growth: Scaling | None) -> Channel:
        """A channel less its mean, over the growth of its noise: its noise is then constant."""
        if growth is None:
            return channel
        nodes = self.nodes[place]
        factor = growth.factor(nodes.rows[self.covariates[0].name])
        middles = channel.dt * (np.arange(channel.n) + 0.5)
        values = (channel.values - channel.mean) / np.interp(middles, nodes.time, factor)
        return replace(channel, values=values)

    def beside(self, wv: WaveletVariance, place: int) -> WaveletVariance:
        """The wavelet variance of such a channel with the regressors."""
        middles = wv.block * wv.dt * (np.arange(wv.blocks.size) + 0.5)
        rows = [np.interp(middles, self.nodes[place].time, row) for row in self.columns[place]]
        return replace(wv, regressors=Regressors.of(wv, rows, self.removed))

    def curve(self, fit: Fit, *, may_lack: bool) -> BiasCurve:
        about = (self.covariates, self.regressors, self.offset)
        return BiasCurve.of(fit, *about, may_lack=may_lack)

    def scaling(self, channels: Sequence[Channel], places: Sequence[int]) -> Scaling | None:
        """How the fast noise of such channels depends on the first covariate."""
        if not self.covariates:
            return None
        name, nodes = self.covariates[0].name, [self.nodes[place] for place in places]
        pairs = zip(channels, nodes, strict=True)
        return scaling([(channel, own.time, own.rows[name]) for channel, own in pairs])


def _less(channel: Channel, time: FloatArray, curve: FloatArray) -> Channel:
    """A channel less a curve that is known at some times, s."""
    left = alike(channel.values, channel.n)
    for part in windows(channel.n):
        # A sample stands for its interval, as the times do.
        middles = channel.dt * (np.arange(part.start, part.stop) + 0.5)
        left[part] = channel.values[part] - np.interp(middles, time, curve)
        release(channel.values)
        release(left)
    return replace(channel, values=left)


def compensated(
    recording: Recording, curves: Mapping[str, BiasCurve]
) -> tuple[Recording, dict[str, float]]:
    """A recording less the curves of its channels, and the size of its noise over the models'.

    Curves count against their value at the covariates' centres. Beyond its range a curve is held at
    its end, which a notice says; the size is the root mean square over the record.

    Raises InputError with the code "no-covariate" if the recording lacks one.
    """
    own = {name: curve for name, curve in curves.items() if name in recording}
    if not own:
        return recording, {}
    scales = {one.name: one for curve in own.values() for one in curve.covariates}
    nodes = Nodes.of(recording, tuple(scales), int(recording.duration / tuning.NODE_STEP))
    notices = [*recording.notices, *(replace(n, hint="interpolated there") for n in nodes.notices)]
    noise, less = dict[str, float](), dict[str, Channel]()
    for name, one in scales.items():
        channel = _channel_of(recording, name)
        if channel is not None and (channel.unit or "unit") != one.unit:
            raise InputError(
                f"{name} of {recording.source or 'the recording'} is in {channel.unit or 'no unit'}"
                f", its curve in {one.unit}: convert it, and name the column {name} [{one.unit}]",
                "no-covariate",
            )
        x, reach = nodes.rows[name], tuning.MARGIN * (one.high - one.low)
        out = (x < one.low - reach) | (x > one.high + reach)
        values = {"share": float(np.mean(out)), "least": float(min(x)), "most": float(max(x))}
        ends = {"low": f"{one.low:.4g}", "high": f"{one.high:.4g}", "unit": one.unit}
        variant = "held" if np.any(out) else ""
        severity: Severity = "note"
        if variant:
            severity = "bad" if values["share"] > tuning.MOST_HELD else "warning"
        about: dict[str, Any] = {"variant": variant, "severity": severity, "name": name, **ends}
        about |= {} if variant else {"hint": ""}
        notices.append(notice("curve-subtracted", "", values, **about))
    for name, curve in own.items():
        held = {e.name: np.clip(nodes.rows[e.name], e.low, e.high) for e in curve.covariates}
        step, start = nodes.time[1] - nodes.time[0], nodes.start + nodes.time[0]
        along = curve.along(held or {"time": nodes.time}, float(step), float(start))
        less[name] = _less(recording[name], nodes.time, along)
        if curve.scaling is not None and curve.covariates:
            factor = curve.noise_factor(held[curve.covariates[0].name])
            noise[name] = float(np.sqrt(np.mean(factor**2)))
    channels = tuple(less.get(each.name, each) for each in recording.channels)
    return replace(recording, channels=channels, notices=tuple(notices)), noise


def designs_of(recordings: Sequence[Recording], given: Sequence[Wanted]) -> dict[str, Design]:
    """The design of each channel, chosen over all recordings that have it.

    Raises InputError if a covariate is missing, does not change, or changes with another.
    """
    names = [each.name for each in given if each.name != "settling"]
    nodes = tuple(Nodes.of(each, names) for each in recordings)
    scales = tuple(_scale(recordings[0], nodes, name) for name in names)
    rows = [np.concatenate([each.rows[name] for each in nodes]) for name in names]
    for (one, x), (other, y) in combinations(zip(names, rows, strict=True), 2):
        if (together := abs(float(np.corrcoef(x, y)[0, 1]))) > tuning.INSEPARABLE:
            raise InputError(
                f"{one} and {other} change together (correlation {together:.3f}), so that their "
                "curves cannot be separated: leave one of them out"
            )
    found = {}
    for name in dict.fromkeys(c.name for each in recordings for c in each.inertial):
        if not next(each[name] for each in recordings if name in each).is_constant:
            found[name] = _design(name, recordings, given, nodes, scales)
    return found


def _scale(recording: Recording, nodes: Sequence[Nodes], name: str) -> Covariate:
    channel, rows = _channel_of(recording, name), [each.rows[name] for each in nodes]
    low, high = float(min(map(np.min, rows))), float(max(map(np.max, rows)))
    unit = "s" if channel is None else channel.unit or "unit"
    if channel is not None and channel.quantity == "temperature" and not channel.unit:
        raise InputError(
            f"{recording.source or 'the recording'}: {name} has no unit: name its column with the "
            "unit, such as temperature [degC]",
            "no-covariate",
        )
    if not high - low > tuning.LEAST_RANGE * max(abs(high), abs(low)):
        raise InputError(
            f"{name} does not change ({low:.4g} {unit}), so no curve can be estimated: leave it "
            "out, or record while it changes"
        )
    return Covariate(name, unit, 0.5 * (low + high), 0.5 * (high - low), low, high)


def _design(
    name: str,
    recordings: Sequence[Recording],
    given: Sequence[Wanted],
    nodes: tuple[Nodes, ...],
    scales: tuple[Covariate, ...],
) -> Design:
    places = [place for place, each in enumerate(recordings) if name in each]
    known = {each.name: each for each in scales}
    channels = {place: recordings[place][name] for place in places}
    means = {}
    for place, channel in channels.items():
        size = round(2.0 * nodes[place].time[0] / channel.dt)
        means[place] = block_means([channel.values], size)[:, 0] + nodes[place].lost
    count = sum(channel.n for channel in channels.values())
    length = max(each.duration for each in recordings)

    def tested(chosen: tuple[Regressor, ...]) -> tuple[float, tuple[Regressor, ...], FloatArray]:
        own = []
        for k in places:
            rows = np.array([nodes[k].columns(one, known) for one in chosen])
            size = channels[k].n // means[k].size
            own.append(RegressorPart(means[k], rows, size, np.ones(1)))
        dt = channels[places[0]].dt
        found, likelihood = pilot(Regressors(tuple(own), np.zeros(len(chosen)), np.ones(1), dt))
        cost = len(chosen) + sum(one.constant > 0.0 for one in chosen)
        return penalty(count) * cost - 2.0 * likelihood, chosen, found.values

    tried = [
        tested(tuple(one for part in parts for one in part))
        for parts in product(*(each.choices(length) for each in given))
    ]
    least, chosen, removed = min(tried, key=lambda each: each[0])
    for criterion, rivals, _ in tried:
        if criterion < least + penalty(count):  # one of these may be true
            terms = [[each.columns(one, known) for one in rivals] for each in nodes]
            _check_separable(rivals, np.concatenate(terms, axis=1), is_chosen=len(tried) > 1)
    late = [
        tested((*chosen, lag))
        for each in given
        if each.constants == () and each.name != "time"
        for _, *lags in Wanted(each.name, (1,), None).choices(length)
        for lag in lags  # none of a short record
    ]
    better, (*_, lag), _ = min(late, key=lambda each: each[0], default=(least, chosen, removed))
    notices = list[Notice]()
    if least - better > tuning.EVIDENT_LAG:
        values = {"constant": lag.constant, "evidence": least - better}
        notices.append(notice("curve-lags", "", values, name=lag.covariate))
    columns = tuple(np.array([each.columns(one, known) for one in chosen]) for each in nodes)
    left = [np.nanmean(means[k] - removed @ columns[k]) for k in places]
    offset = float(np.mean(left))
    return Design(name, scales, chosen, nodes, columns, removed, offset, tuple(notices))


def _check_separable(chosen: Sequence[Regressor], rows: FloatArray, *, is_chosen: bool) -> None:
    """Raise InputError if the others imitate a lag or settling, as in a warm-up.

    A choice among them would then be by chance; intervals under given constants are only wide.
    """
    limit = tuning.INSEPARABLE if is_chosen else tuning.INSEPARABLE_IF_GIVEN
    for k, one in enumerate(chosen):
        if one.constant > 0.0:
            others = np.vstack([np.delete(rows, k, axis=0), np.ones(rows.shape[1])]).T
            left = rows[k] - others @ np.linalg.lstsq(others, rows[k])[0]
            together = float(np.sqrt(max(1.0 - np.var(left) / np.var(rows[k]), 0.0)))
            if together > limit:
                way = ", or give the degree and all time constants" if is_chosen else ""
                raise InputError(
                    f"{one.title} changes together with other terms of the curve (correlation "
                    f"{together:.4f}), so they cannot be separated: leave it out, record "
                    f"cycles of temperature{way}"
                )
