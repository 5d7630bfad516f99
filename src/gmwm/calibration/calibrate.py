"""The main job: a recording in, an error model for every channel out."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from gmwm._core import jobs as workers
from gmwm._core.jobs import PROCESSES, one_blas_thread
from gmwm._core.spool import is_spooled
from gmwm._core.typing import Progress
from gmwm.calibration import tuning
from gmwm.calibration.calibration import Calibration
from gmwm.calibration.channel import (
    ChannelModel,
    GivenModels,
    advise_cut,
    channel_model,
    model_of,
    with_validity,
)
from gmwm.calibration.removal import variance_without
from gmwm.calibration.screening import (
    SCREENING,
    Screened,
    screened,
    stretches_at_rest,
    with_outcomes,
)
from gmwm.calibration.stages import Stopwatch, current, stage
from gmwm.calibration.summary import unresolved_notice
from gmwm.diagnosis import first_in_common, thinned
from gmwm.errors import InputError
from gmwm.estimate import compile_steps
from gmwm.issues import Notice, notice
from gmwm.process import Model, Process
from gmwm.readers import Channel, Recording, is_frame, read, require_recording
from gmwm.selection import Selection, wider_ranges
from gmwm.variance import MIN_SAMPLES

AMBIGUITY = "ambiguity"
"""Code of the notice that several models describe a channel equally well."""


@one_blas_thread()
def calibrate(
    recording: Recording | Sequence[Recording] | Any,
    model: GivenModels = None,
    *,
    screening: Collection[str] = SCREENING,
    still: bool = True,
    remove_departures: bool = False,
    jobs: int = PROCESSES,
    progress: Progress | None = None,
) -> Calibration:
    """Error model of every channel of a static recording, or of several of one sensor.

    The recording is examined first: samples of shocks and spikes are left out, periodic lines and
    resonances are terms that a selected model may have, and the wavelet variances of a channel
    with outliers all over the record are robust; a channel of which each sample is written several
    times is taken at its own rate. Fits of a recording that was not static, or whose rate changed,
    are not valid, nor those of an accelerometer that was tilted. Notices report what was found and
    done. A channel that is constant, or of which more than half of the samples are missing, is
    skipped; auxiliary channels (temperature, voltage, clock) have no model. After the fit, steps,
    transients at the start and slow periods are looked for beside its noise
    (`gmwm.calibration.departures`); a fit of which they make more than a tenth of the deviation at
    some averaging time is not valid.

    Parameters
    ----------
    recording : Recording or sequence of Recording
        At rest, or with stretches at rest. Several of one sensor have one model, fitted jointly;
        see `gmwm.JointFit`. A DataFrame or an Arrow table is read with `gmwm.read`, which needs a
        column of time stamps and units in the names of the others.
    model : Process, Model or mapping, optional
        Fitted to every channel, or by name of the channel or the sensor ("gyro", "accel"); by
        default the model of each channel is selected.
    screening : collection of str, optional
        Some of "events", "lines", "resonances" and "outliers"; none leaves the recording as it is,
        unexamined.
    still : bool, optional
        Whether only the stretches at rest of a log that is not static are used, as several
        recordings of one sensor (`gmwm.find_still`); else everything is taken as static.
    remove_departures : bool, optional
        Whether evident steps, transients at the start and slow periods are subtracted, the samples
        at which a step may be left out, and what is left is fitted again, three times at most; what
        their estimated sizes take of the noise is given back to the wavelet variances.
    jobs : int, optional
        Processes that share the work at most, by default two, -1 one per core; there are never
        more than cores or channels, and short recordings are worked on by this one alone.
    progress : callable, optional
        Called as ``progress(done, total, channel)`` when work on a channel begins, and at the end.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If no channel can be calibrated, a mapping has no model for one, or a log that is not static
        has no stretch of ten seconds at rest.
    """
    alone = isinstance(recording, Recording | str | os.PathLike) or is_frame(recording)
    parts: list[Any] = [recording] if alone else list(recording)
    given: list[Recording] = [read(each) if is_frame(each) else each for each in parts]
    _check_together(given)
    size = sum(each.n * len(each.inertial) for each in given)
    others = workers.extra_workers(jobs, max(len(each.inertial) for each in given))
    on_disk = any(is_spooled(c.values) for each in given for c in each.inertial)
    is_worth = size > tuning.WORTH_PROCESSES and not on_disk  # memory for one channel at a time
    with workers.worker_pool(others if is_worth else 0, "gmwm.estimate:compile_search"):
        return _calibrated(given, model, screening, still, remove_departures, progress)


def _calibrated(
    given: list[Recording],
    model: GivenModels,
    screening: Collection[str],
    still: bool,
    remove_departures: bool,
    progress: Progress | None,
) -> Calibration:
    with stage("health"):
        if still and screening:
            given = [part for each in given for part in stretches_at_rest(each)]
        treated = [screened(part, screening) for each in given for part in each.by_rate()]
    recordings = [each.recording for each in treated]
    alive, dead, sources = _usable(treated)
    models = {name: model_of(name, model) for name in alive}
    if not alive:
        which = "; ".join(f"{name}: {why.text}" for name, why in dead.items())
        if dead and all(why.code == "constant" for why in dead.values()):
            which = "every channel is constant"
        raise InputError(
            f"{recordings[0].source or 'the recording'}: {which or 'only auxiliary channels'}, "
            "nothing to calibrate: check the sensor and the columns"
        )
    for each in recordings:
        if each.n < MIN_SAMPLES:
            raise InputError(f"{each.n} samples are too few: record at least {MIN_SAMPLES}")

    offered = {
        name: next((e.extra[name] for e in treated if e.extra.get(name)), ()) for name in alive
    }
    robust = frozenset[str]().union(*(each.robust for each in treated))
    removals = tuning.REMOVALS if remove_departures else 0
    channels = [
        _Channel(name, parts, name in robust, models[name], sources[name], offered[name], removals)
        for name, parts in alive.items()
    ]
    workers.during_startup(compile_steps)
    found = _models_found(channels, progress)
    issues: list[Notice] = []  # sensors with rates of their own share those of the reader
    for one in treated:
        for issue in one.notices:
            named = replace(issue, source=one.recording.source) if len(given) > 1 else issue
            if named not in issues:
                issues.append(named)
    chosen = {name: each.fit.model for name, each in found.items() if not isinstance(each, Notice)}
    models_of, advice = advise_cut(found, given[0].n * given[0].dt if len(given) == 1 else 0.0)
    issues += advice
    return _calibration_of(
        with_validity(models_of, issues, still=still),
        dead,
        with_outcomes(issues, chosen, offered if model is None else {}),
        given,
        _left_out(given[0], recordings[0]) if len(recordings) == 1 else {},
    )


def _calibration_of(
    models: Mapping[str, ChannelModel | Notice],
    dead: Mapping[str, Notice],
    issues: Sequence[Notice],
    given: Sequence[Recording],
    left_out: Mapping[str, tuple[tuple[int, int], ...]],
) -> Calibration:
    """Put together what was found of the channels.

    models: Of each channel that was worked on.
    dead: Why others were not.
    Raises InputError if no channel has a model.
    """
    source = ", ".join(each.source for each in given)
    done = {name: each for name, each in models.items() if isinstance(each, ChannelModel)}
    skipped = {name: each for name, each in models.items() if isinstance(each, Notice)}
    skipped = {**dead, **skipped}
    if not done:
        why = "; ".join(f"{name}: {each.text}" for name, each in skipped.items())
        raise InputError(f"{source or 'the recording'}: {why}")
    rivals: dict[str, list[Model]] = {}
    tied, left_open = [], []
    for name, each in done.items():
        if each.selection is not None and each.selection.rivals:
            rivals[name] = [rival.model for rival in each.selection.rivals]
            tied.append(_ambiguity(name, each.selection))
        if each.largest is not None:
            rivals.setdefault(name, []).append(each.largest)
            left_open.append(unresolved_notice(name, each.fit, each.largest))
    return Calibration(
        fits={name: each.fit for name, each in done.items()},
        skipped=skipped,
        source=source,
        rate=given[0].rate,
        n=sum(each.n for each in given),
        notices=(*issues, *tied, *left_open),
        rivals={name: tuple(models) for name, models in rivals.items()},
        left_out=left_out,
    )


def _ambiguity(name: str, selection: Selection) -> Notice:
    """Say which models fit equally well, and which parameters that leaves less known."""
    models = [fitted.model.title() for fitted in (selection.fit, *selection.rivals)]
    better, also = selection.surpassed_by, ""
    if better is not None and better.model.title() in models:
        also = f" (best is that with bias instability, of {better.n_parameters} parameters)"
    if wider := wider_ranges(selection.fit, selection.ranges()):
        also += f". If none of them is ruled out: {', '.join(wider)}"
    values = {"models": len(models)}
    return notice(AMBIGUITY, name, values, titles="; ".join(models), also=also)


@dataclass(frozen=True, eq=False)
class _Channel:
    """A channel whose model is to be found, and how."""

    name: str
    parts: Sequence[Channel]
    robust: bool
    given: Process | Model | None
    sources: Sequence[str]
    offered: Sequence[Process]
    removals: int

    def model_found(self) -> tuple[ChannelModel | Notice, Stopwatch]:
        """The model, with the time that it took."""
        with Stopwatch().running() as watch:
            found = channel_model(
                self.name,
                lambda removed: [
                    variance_without(part, gone, robust=self.robust)
                    for part, gone in zip(self.parts, removed, strict=True)
                ],
                self.given,
                self.sources,
                extra=self.offered,
                removals=self.removals,
            )
        return found, watch


def _models_found(
    channels: Sequence[_Channel], progress: Progress | None
) -> dict[str, ChannelModel | Notice]:
    """The model of each channel, or why it has none; shared with the processes beside."""
    found: dict[str, ChannelModel | Notice] = {}

    def report(name: str) -> None:
        if progress is not None:
            progress(len(found), len(channels), name)

    def begun() -> Iterator[_Channel]:
        # Each term offered doubles the candidates: those that take longest are not begun last.
        for channel in sorted(channels, key=lambda each: -len(each.offered)):
            report(channel.name)
            yield channel

    for channel, (one, watch) in workers.shared(_Channel.model_found, begun()):
        found[channel.name] = one
        if (running := current()) is not None:
            for name, elapsed in watch.elapsed.items():
                running.add(name, elapsed, watch.worked[name])
    report("")
    return {channel.name: found[channel.name] for channel in channels}


def _left_out(given: Recording, screened_one: Recording) -> dict[str, tuple[tuple[int, int], ...]]:
    """The samples that screening took from a recording, by channel."""
    spans = {}
    for before, after in zip(given.channels, screened_one.channels, strict=True):
        gone = np.isnan(after.values) & ~np.isnan(before.values)
        edges = np.flatnonzero(np.diff(gone, prepend=False, append=False)).tolist()
        if edges:
            spans[before.name] = tuple(zip(edges[::2], edges[1::2], strict=True))
    return spans


def _check_together(recordings: Sequence[Recording]) -> None:
    if not recordings:
        raise InputError("there is no recording: give one at least")
    for each in recordings:
        require_recording(each)
    first = recordings[0]
    for other in recordings[1:]:
        for channel in other.inertial:
            known = first.get(channel.name, channel)
            if abs(known.dt / channel.dt - 1.0) > tuning.SAME_RATE:
                raise InputError(
                    f"{other.source} has {1.0 / channel.dt:g} Hz and {first.source} "
                    f"{1.0 / known.dt:g} Hz: calibrate recordings of different rates one by one"
                )
    for one, other in combinations(recordings, 2):
        if (times := first_in_common(one, other)) is not None:
            raise InputError(
                f"{one.source or 'a recording'} from {times[0]:.6g} s on and "
                f"{other.source or 'another'} from {times[1]:.6g} s on have the same samples: "
                "give each recording once, or cut off what both have"
            )


def _usable(
    treated: Sequence[Screened],
) -> tuple[dict[str, list[Channel]], dict[str, Notice], dict[str, list[str]]]:
    """Each channel in the recordings where it can be used, why others are skipped, and which."""
    interval: dict[str, float] = {}
    alive: dict[str, list[Channel]] = {}
    sources: dict[str, list[str]] = {}
    dead: dict[str, Notice] = {}
    for each in treated:
        for channel in each.recording.inertial:
            straight = (n for n in each.notices if n.code == "interpolated")
            why = next((n for n in straight if n.where == channel.name), None)
            why = why or _reason_to_skip(channel, each.notices)
            if why is not None:
                dead.setdefault(channel.name, why)
            else:
                channel = replace(channel, dt=interval.setdefault(channel.name, channel.dt))
                repeated = each.repeated.get(channel.name)
                own = thinned(channel, repeated) if repeated else channel
                alive.setdefault(channel.name, []).append(own)
                sources.setdefault(channel.name, []).append(each.recording.source)
    return alive, {name: why for name, why in dead.items() if name not in alive}, sources


def _reason_to_skip(channel: Channel, notices: Iterable[Notice]) -> Notice | None:
    """Why a channel is skipped, if it is, and what took missing samples, if that was said."""
    values = {"missing": channel.missing}
    if 2 * channel.missing > channel.n:
        code = "all-missing" if channel.missing == channel.n else "mostly-missing"
        causes = (n for n in notices if n.where in ("", channel.name) and n.issue.masks)
        why = "".join(f": {cause.text}" for cause in causes)
        return notice(code, channel.name, values, severity="bad", n=channel.n, why=why)
    if channel.is_constant:
        return notice("constant", channel.name, values, value=channel.mean, unit=channel.unit)
    return None
