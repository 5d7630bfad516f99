"""`array`: weights of several IMUs that are read together, for outages of some length."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from gmwm._core import checks
from gmwm._core.distributions import chi2, norm
from gmwm._core.documents import Array, Document, Positive, Probability, Text
from gmwm._core.frozen import freeze
from gmwm._core.text import Printed, brief, bullets, plain_table
from gmwm._core.typing import FloatArray, Progress
from gmwm._core.units import factor
from gmwm.calibration import departure_notices, departures, screened
from gmwm.diagnosis import rest_of
from gmwm.errors import InputError, MissingNameError
from gmwm.estimate import estimate, fit_shared
from gmwm.filter_numbers import integral_rms
from gmwm.issues import Notice, notice
from gmwm.population import tuning
from gmwm.population.compare import labelled
from gmwm.process import GaussMarkov, Process, RandomWalk, WhiteNoise
from gmwm.readers import Channel, Recording, require_recording
from gmwm.variance import wavelet_covariance, wavelet_variance

_UNITS = {"gyro": ("rad", "deg"), "accel": ("m/s", "m/s")}
_Z = norm.ppf(0.975)


@dataclass(frozen=True, eq=False)
class ArrayAxis(Document):
    """Weights of one axis of an array, and the errors that they lead to.

    weights: (N,), those of least error, with sum 1. IMUs that share errors with better ones may
        have negative ones.
    lower, upper: (N,), ends of 95 % intervals.
    alone: (N,), standard deviation of the angle (rad) or velocity (m/s) of each IMU after the
        horizon.
    best, mean, inverse: The same of the sum with ``weights``, of the mean of all, and with weights
        1/N^2 from the angle or velocity random walks. ``best`` includes what the weights' errors
        cost.
    cost: By how much the variance exceeds that of the best weights, on average, as these are known
        from a recording only; relative.
    p_value: Of the test that the mean is the best sum.
    correlation: (N, N), of the errors of the IMUs after the horizon.
    """

    channel: Text
    quantity: Text
    weights: Array
    lower: Array
    upper: Array
    alone: Array
    best: Positive
    mean: Positive
    inverse: Positive
    cost: Positive
    p_value: Probability
    correlation: Array

    def __post_init__(self) -> None:
        freeze(self, "weights", "lower", "upper", "alone", "correlation")


@dataclass(frozen=True, eq=False, repr=False)
class SensorArray(Document, Printed):
    """Weights of the IMUs of an array, axis by axis.

    Attributes
    ----------
    imus : tuple of str
    horizon : float
        Length of the outages that the weights are for, s.
    duration : float
        Of the recordings, s.
    axes : tuple of ArrayAxis
    notices : tuple of Notice
    """

    SCHEMA: ClassVar[str] = "gmwm.array"

    imus: tuple[Text, ...]
    horizon: Positive
    duration: Positive
    axes: tuple[ArrayAxis, ...]
    notices: tuple[Notice, ...] = ()

    def __getitem__(self, channel: str) -> ArrayAxis:
        for each in self.axes:
            if each.channel == channel:
                return each
        known = ", ".join(each.channel for each in self.axes)
        raise MissingNameError(f"the array has no channel {channel!r}: it has {known}")

    def __repr__(self) -> str:
        return f"<SensorArray of {', '.join(self.imus)}: {len(self.axes)} axes>"

    def __str__(self) -> str:
        weights, errors = [], []
        for each in self.axes:
            ends = zip(each.weights, each.lower, each.upper, strict=True)
            few = len(self.imus) <= tuning.WITH_INTERVALS
            cells = [f"{w:.2f}" + f" +-{0.5 * (b - a):.2f}" * few for w, a, b in ends]
            weights.append([each.channel, *cells])
            si, unit = _UNITS[each.quantity]
            values = (np.min(each.alone), each.mean, each.inverse, each.best)
            shown = [brief(float(v) / factor(unit, si), 3) for v in values]
            gain = f"{100.0 * (each.best / each.mean - 1.0):+.1f} %"
            errors.append([each.channel, unit, *shown, gain])
        heads = ("1 sigma", "unit", "best alone", "mean", "1/N^2", "weights", "vs mean")
        lines = [
            f"Weights for outages of {self.horizon:g} s, from {self.duration:.6g} s of "
            f"{len(self.imus)} IMUs together",
            *("", plain_table(["channel", *self.imus], weights), ""),
            f"Angle or velocity error after {self.horizon:g} s, slow errors known at its start",
            *("", plain_table(heads, errors)),
        ]
        notes = bullets(self.notices)
        return "\n".join([*lines, *([""] if notes else []), *notes])


def array(
    recordings: Sequence[Recording] | Mapping[str, Recording],
    *,
    horizon: float = 60.0,
    progress: Progress | None = None,
) -> SensorArray:
    """Find static weights of several IMUs that measure the same motion, axis by axis.

    The sum of the IMUs with these weights has the least angle or velocity error after an outage,
    among sums of weights that add up to 1. Wavelet covariances of the IMUs say which errors they
    share: shared errors do not average out, and weights of white noise alone (1/N^2) can be worse
    than those of the mean.

    Parameters
    ----------
    recordings : sequence or mapping of str to Recording
        Two or more, at rest, recorded together, with aligned axes. They are cut to their common
        time; without stamps they begin together. Rates may differ: means over a 32nd of the horizon
        are compared. Shocks and spikes are left out.
    horizon : float, optional
        Length of the outages, s.
    progress : callable, optional
        Called as ``progress(done, total, channel)``.

    Raises
    ------
    InputError
        If there are fewer than two recordings, they have no time or no channel in common, one is
        not static or has a channel that is stuck or dead, two have the same samples, they are
        shorter than 16 horizons, or the horizon has too few samples.
    """
    horizon = checks.positive("horizon", horizon, "give the length of outages in seconds")
    named = _together(_named(recordings))
    shared = list(named.values())
    names = [c.name for c in shared[0].inertial if all(c.name in each for each in shared[1:])]
    names = [name for name in names if shared[0][name].quantity in _UNITS]
    if not names:
        raise InputError(
            "the recordings have no gyro or accelerometer axis in common: check their channels"
        )
    intervals = {each[name].dt for each in shared for name in names}
    least = max(intervals) * (1.0 if len(intervals) == 1 else tuning.FEWEST_OF_BLOCK)
    step, blocks = max(horizon / tuning.BLOCKS_OF_HORIZON, least), tuning.FEWEST_BLOCKS
    if horizon < blocks * step:
        raise InputError(
            f"horizon = {horizon:g}: these rates need outages of {blocks * step:g} s or more"
        )
    duration = min(each.duration for each in shared)
    if duration < tuning.LEAST_HORIZONS * horizon:
        raise InputError(
            f"the recordings have {duration:.6g} s in common: outages of {horizon:g} s need "
            f"{tuning.LEAST_HORIZONS * horizon:g} s or more; record longer, or give a shorter "
            "horizon"
        )
    named = {imu: _without_shocks(imu, each, names) for imu, each in named.items()}
    times = np.geomspace(step, duration / 8.0, _parts(duration / step))
    parts = (WhiteNoise(1.0), *(GaussMarkov(1.0, tau) for tau in times.tolist()), RandomWalk(1.0))
    axes, notices, tell = [], list[Notice](), progress or (lambda *_: None)
    for done, name in enumerate(names):
        tell(done, len(names), name)
        own = [
            Channel(
                imu,
                _means(each[name], step, int(duration / step)),
                step,
                each[name].quantity,
                each[name].unit,
            )
            for imu, each in named.items()
        ]
        axes.append(_axis(name, str(shared[0][name].quantity), own, parts, horizon))
        notices += [each for channel in own for each in _steps(channel, name)]
    tell(len(names), len(names), "")
    alike = [x.channel for x in axes if x.p_value > tuning.LEVEL or x.best >= x.mean]
    if alike:
        notices.append(notice("array-mean", values={"axes": len(alike)}, listed=", ".join(alike)))
    return SensorArray(tuple(named), horizon, duration, tuple(axes), tuple(notices))


def _named(recordings: Sequence[Recording] | Mapping[str, Recording]) -> dict[str, Recording]:
    """Recordings by name, if they can be an array."""
    given = [*recordings.values()] if isinstance(recordings, Mapping) else [*recordings]
    for each in given:
        require_recording(each)
        if rest_of(each) is not None:
            raise InputError(
                f"{each.source or 'a recording'} is not static: cut all recordings to the same "
                "stretch at rest, with part(start, stop)"
            )
    if len(given) < 2:
        raise InputError(f"an array has two IMUs or more ({len(given)} given): give each recording")
    if isinstance(recordings, Mapping):
        return {str(name): each for name, each in recordings.items()}
    return labelled(given, [""] * len(given))


def _together(named: Mapping[str, Recording]) -> dict[str, Recording]:
    """Recordings cut to the time that they have in common by their stamps."""
    start = max(each.start for each in named.values())
    stop = min(each.start + each.duration for each in named.values())
    if stop <= start:
        raise InputError(
            "the recordings do not overlap in time: give simultaneous recordings; if they began "
            "together, read them by their rate, without time stamps (--rate, --time none)"
        )
    return {imu: each.part(start - each.start, stop - each.start) for imu, each in named.items()}


def _without_shocks(imu: str, recording: Recording, names: Collection[str]) -> Recording:
    """A recording without shocks and spikes, if its channels can be compared."""
    found = screened(recording, ("events",))
    for each in found.notices:
        if each.severity == "bad" and each.where in names:
            raise InputError(f"{imu}, {each.where}: {each.text}: leave out this IMU")
    return found.recording


def _steps(channel: Channel, name: str) -> list[Notice]:
    """Departures that pass for slow noise of a channel whose name is that of its IMU."""
    data = wavelet_variance(channel)
    fitted = estimate("N + K", data)
    found = departure_notices(fitted, departures(fitted), (), data, data, removing=True)
    where = f"{channel.name}, {name}"
    return [replace(each, where=where) for each in found if each.severity == "bad"]


def _parts(blocks: float) -> int:
    """Number of Gauss-Markov parts: one an octave of correlation times."""
    return max(int(np.log2(blocks / 8.0)) + 1, 2)


def _means(channel: Channel, step: float, count: int) -> FloatArray:
    """Means of the samples of each step of time; NaN where less than half of them exist."""
    edges = np.rint(np.arange(count) * (step / channel.dt)).astype(np.int64)
    stop = round(count * step / channel.dt)
    values = np.asarray(channel.values[:stop], dtype=float)
    there = np.add.reduceat((~np.isnan(values)).astype(float), edges)
    total = np.add.reduceat(np.nan_to_num(values), edges)
    enough = 2.0 * there >= np.diff(edges, append=stop)
    return np.where(enough, total / np.maximum(there, 1.0), np.nan)


def _axis(
    name: str, quantity: str, own: Sequence[Channel], parts: Sequence[Process], horizon: float
) -> ArrayAxis:
    """The weights of one axis."""
    shared = fit_shared(parts, wavelet_covariance(own), refine=False)
    step = own[0].dt
    growth = [integral_rms(each, [horizon], step, known_start=True)[0, 0] ** 2 for each in parts]
    total, covariance = shared.matrix(np.array(growth))
    size, (first, second) = len(own), np.triu_indices(len(own))
    inverse = np.linalg.inv(total)
    variance = 1.0 / np.sum(inverse)
    weights = variance * np.sum(inverse, axis=0)
    # Derivatives of the weights by the elements a <= b of the matrix.
    turned = -(inverse - variance * np.outer(np.sum(inverse, axis=0), np.sum(inverse, axis=0)))
    slope = turned[:, first] * weights[second]
    slope += np.where(first == second, 0.0, turned[:, second] * weights[first])
    spread = slope @ covariance @ slope.T
    reach = _Z * np.sqrt(np.diag(spread))
    plain = 1.0 / np.diag(shared.matrices[0])
    plain /= np.sum(plain)
    mean, away = np.full(size, 1.0 / size), weights - 1.0 / size
    deviation = np.sqrt(np.diag(total))
    statistic = float(away @ np.linalg.pinv(spread, hermitian=True) @ away)
    cost = float(np.sum(total * spread) / variance)
    return ArrayAxis(
        channel=name,
        quantity=quantity,
        weights=weights,
        lower=weights - reach,
        upper=weights + reach,
        alone=deviation,
        best=float(np.sqrt(variance * (1.0 + 2.0 * cost))),  # of the fit's own sample, and the cost
        mean=float(np.sqrt(mean @ total @ mean)),
        inverse=float(np.sqrt(plain @ total @ plain)),
        cost=cost,
        p_value=float(chi2.sf(statistic, size - 1)),
        correlation=total / np.outer(deviation, deviation),
    )
