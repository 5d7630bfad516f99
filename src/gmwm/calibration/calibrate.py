"""The main job: a recording in, an error model for every channel out."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
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
    ChannelTask,
    GivenModels,
    advise_cut,
    model_of,
    unresolved_notice,
    with_validity,
)
from gmwm.calibration.covariates import Design, Wanted, designs_of, wanted
from gmwm.calibration.screening import (
    SCREENING,
    Screened,
    screened,
    stretches_at_rest,
    with_outcomes,
)
from gmwm.calibration.sharing import sharing_notices
from gmwm.diagnosis import first_in_common, health, thinned
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
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
    covariates: Mapping[str, str] | None = None,
    jobs: int = PROCESSES,
    progress: Progress | None = None,
) -> Calibration:
    """Error model of every channel of a static recording, or of several of one sensor.

    The recording is examined first. Samples of shocks and spikes are left out, and a selected model
    may have periodic lines and resonances. If outliers are spread over the record, they are left
    out or the wavelet variances are robust. A channel whose samples are each written several times
    is used at its own rate. Fits are not valid if the recording was not static or its rate changed;
    those of accelerometers are not valid if the sensor was tilted. Notices report what was found
    and done. A channel is skipped if it is constant or more than half of its samples are missing.
    Auxiliary channels (temperature, voltage, clock) have no model. After the fit, steps, transients
    at the start and slow periods are tested against its noise (`gmwm.calibration.departures`). A
    fit is not valid if one of them makes up more than a tenth of the deviation at some averaging
    time, with an evidence of 1,000 or more.

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
        recordings of one sensor (`gmwm.find_still`); else everything counts as static.
    remove_departures : bool, optional
        Whether evident steps, transients at the start and slow periods are subtracted and the rest
        is fitted again, three times at most. Samples around a step are left out. The noise that the
        estimated sizes remove is added back to the wavelet variances. Not beside covariates.
    covariates : mapping, optional
        What the bias depends on: ``{"temperature": "cubic, lag", "settling": "auto"}``. The name of
        a channel of the recording, "time" or "settling" (at switch-on, when the recording begins)
        -> words: "auto" (degree 1 to 3), "linear", "quadratic", "cubic" or a degree; "lag", or
        "lag 120 s", adds its delayed values. The curve of each channel is estimated together with
        its noise; the noise that this removes is added back (`Calibration.curves`).
    jobs : int, optional
        Largest number of processes, by default two; -1: one per core. There are never more than
        cores or channels, and short recordings use this process alone.
    progress : callable, optional
        Called as ``progress(done, total, channel)`` when work on a channel begins, and at the end.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If no channel can be calibrated, a mapping has no model for one, a log that is not static
        has no stretch of ten seconds at rest, or a covariate is missing or does not change.
    """
    alone = isinstance(recording, Recording | str | os.PathLike) or is_frame(recording)
    parts: list[Any] = list(recording) if not alone and np.iterable(recording) else [recording]
    given: list[Recording] = [read(each) if is_frame(each) else each for each in parts]
    beside = wanted(covariates)
    if beside and remove_departures:
        raise InputError(
            "steps and drifts cannot be removed together with covariates, as part of the curve "
            "would be removed too: leave out one of the two, or calibrate a part without steps"
        )
    _check_together(given)
    size = sum(each.n * len(each.inertial) for each in given)
    others = workers.extra_workers(jobs, max(len(each.inertial) for each in given))
    on_disk = any(is_spooled(c.values) for each in given for c in each.inertial)
    is_worth = size > tuning.WORTH_PROCESSES and not on_disk  # memory for one channel at a time
    with workers.worker_pool(others if is_worth else 0, "gmwm.calibration"):
        if still and screening:
            given = [part for each in given for part in stretches_at_rest(each)]
        removals = tuning.REMOVALS if remove_departures else 0
        return _calibrated(given, model, screening, removals, beside, progress, still=still)


def _without_curves(
    recordings: Sequence[Recording], covariates: tuple[Wanted, ...]
) -> tuple[list[Recording], dict[str, Design]]:
    """Recordings less the first curves of their channels, and the regressors of these."""
    designs = designs_of(recordings, covariates) if covariates else {}
    if not designs:  # of constant channels there is none
        return list(recordings), {}
    lost = [nodes.notices for nodes in next(iter(designs.values())).nodes]
    left = [
        replace(
            each,
            channels=tuple(
                c if c.is_auxiliary or c.name not in designs else designs[c.name].without(c, place)
                for c in each.channels
            ),
            notices=(*each.notices, *lost[place], *_picked(each)),
        )
        for place, each in enumerate(recordings)
    ]
    return left, designs


def _picked(recording: Recording) -> list[Notice]:
    """That samples of a slow log may be single ones of a faster sensor."""
    if recording.rate > tuning.SLOW_LOG:
        return []
    times = float(np.sqrt(tuning.USUAL_RATE / recording.rate))
    return [notice("slow-log", "", {"rate": recording.rate, "times": times})]


def _calibrated(
    given: Sequence[Recording],
    model: GivenModels,
    screening: Collection[str],
    removals: int,
    covariates: tuple[Wanted, ...],
    progress: Progress | None,
    *,
    still: bool,
) -> Calibration:
    parts = [part for each in given for part in each.by_rate()]
    parts, designs = _without_curves(parts, covariates)
    treated = [screened(part, screening) for part in parts]
    tasks, skipped = _tasks(treated, model, removals, designs)
    found = _models_found(tasks, progress)
    done = {name: each for name, each in found.items() if isinstance(each, ChannelModel)}
    skipped |= {name: each for name, each in found.items() if isinstance(each, Notice)}
    source = ", ".join(each.source for each in given)
    if not done:
        why = "; ".join(f"{name}: {each.text}" for name, each in skipped.items())
        raise InputError(f"{source or 'the recording'}: {why}")
    issues = _issues(treated, designs, done, several=len(given) > 1)
    done, advice = advise_cut(done, given[0].n * given[0].dt if len(given) == 1 else 0.0)
    issues += advice
    done = with_validity(done, issues, still=still)
    chosen = {name: each.fit.model for name, each in done.items()}
    offered = {} if model is not None else {task.name: task.extra for task in tasks}
    rivals = {name: each.rivals for name, each in done.items() if each.rivals}
    tied = [
        _ambiguity(name, each.selection)
        for name, each in done.items()
        if each.selection is not None and each.selection.rivals
    ]
    left_open = [
        unresolved_notice(name, each.fit, each.largest)
        for name, each in done.items()
        if each.largest is not None
    ]
    shared: list[Notice] = []
    for one in treated if screening else ():
        about = one.recording.source if len(treated) > 1 else ""
        shared += [replace(n, source=about) for n in sharing_notices(one, chosen)]
    return Calibration(
        fits={name: each.fit for name, each in done.items()},
        skipped=skipped,
        source=source,
        rate=given[0].rate,
        n=sum(each.n for each in given),
        notices=(*with_outcomes(issues, chosen, offered), *tied, *left_open, *shared),
        rivals=rivals,
        curves={name: each.curve for name, each in done.items() if each.curve is not None},
        left_out=_left_out(given[0], treated[0].recording) if len(treated) == 1 else {},
    )


def _issues(
    treated: Sequence[Screened],
    designs: Mapping[str, Design],
    done: Mapping[str, ChannelModel],
    *,
    several: bool,
) -> list[Notice]:
    """What was found in the recordings, without changes of noise that follow a covariate."""
    issues: list[Notice] = []  # sensors with rates of their own share those of the reader
    for place, one in enumerate(treated):
        for issue in one.notices:
            kept, model = [issue], done.get(issue.where)
            grows = model is not None and any(n.code == "noise-scales" for n in model.fit.notices)
            if issue.code == "variance" and grows and model is not None and model.curve is not None:
                own, growth = one.recording[issue.where], model.curve.scaling
                steady = designs[issue.where].evened(own, place, growth)
                again = health(replace(one.recording, channels=(steady,))).notices
                kept = [each for each in again if each.code == "variance"]
            source = one.recording.source if several else issue.source
            issues += [n for each in kept if (n := replace(each, source=source)) not in issues]
    return issues


def _tasks(
    treated: Sequence[Screened], model: GivenModels, removals: int, designs: Mapping[str, Design]
) -> tuple[list[ChannelTask], dict[str, Notice]]:
    """The channels that can be used in some recording, and why others are skipped."""
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
    robust = frozenset[str]().union(*(each.robust for each in treated))
    tasks = []
    for name, parts in alive.items():
        extra = next((e.extra[name] for e in treated if e.extra.get(name)), ())
        origin, places = zip(*sources[name], strict=True)
        about = (origin, models[name], extra, name in robust, removals)
        tasks.append(ChannelTask(name, parts, *about, designs.get(name), places))
    return tasks, dead


def _ambiguity(name: str, selection: Selection) -> Notice:
    """Say which models fit equally well, and which parameters that leaves less known."""
    models = [fitted.model.title() for fitted in (selection.fit, *selection.rivals)]
    better, also = selection.surpassed_by, ""
    if better is not None and better.model.title() in models:
        also = f" (the one with bias instability fits best, {better.n_parameters} parameters)"
    if wider := wider_ranges(selection.fit, selection.ranges()):
        also += f". Ranges over all of them: {', '.join(wider)}"
    values = {"models": len(models)}
    return notice(AMBIGUITY, name, values, titles="; ".join(models), also=also)


def _models_found(
    channels: Sequence[ChannelTask], progress: Progress | None
) -> dict[str, ChannelModel | Notice]:
    """The model of each channel, or why it has none; shared with the processes beside."""
    found: dict[str, ChannelModel | Notice] = {}

    def report(name: str) -> None:
        if progress is not None:
            progress(len(found), len(channels), name)

    def begun() -> Iterator[ChannelTask]:
        # Each term offered doubles the candidates: those that take longest are not begun last.
        for channel in sorted(channels, key=lambda each: -len(each.extra)):
            report(channel.name)
            yield channel

    for channel, one in workers.shared(ChannelTask.model_or_why, begun()):
        found[channel.name] = one
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
        raise InputError("no recordings given: give at least one")
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
                "give each recording once, or cut off the shared part"
            )


def _usable(
    treated: Sequence[Screened],
) -> tuple[dict[str, list[Channel]], dict[str, Notice], dict[str, list[tuple[str, int]]]]:
    """Each channel in the recordings where it can be used, why others are skipped, and which."""
    alive: dict[str, list[Channel]] = {}
    sources: dict[str, list[tuple[str, int]]] = {}
    dead: dict[str, Notice] = {}
    interval: dict[str, float] = {}
    for place, each in enumerate(treated):
        for channel in each.recording.inertial:
            name = channel.name
            if (why := _reason_to_skip(channel, each.notices)) is not None:
                dead.setdefault(name, why)
                continue
            channel = replace(channel, dt=interval.setdefault(name, channel.dt))
            repeated = each.repeated.get(name)
            alive.setdefault(name, []).append(thinned(channel, repeated) if repeated else channel)
            sources.setdefault(name, []).append((each.recording.source, place))
    return alive, {name: why for name, why in dead.items() if name not in alive}, sources


def _reason_to_skip(channel: Channel, notices: Iterable[Notice]) -> Notice | None:
    """Why a channel is skipped, if it is, and what took missing samples, if that was said."""
    about = [each for each in notices if each.where in ("", channel.name)]
    for each in about:
        if each.code == "interpolated" and each.where:
            return each
    values = {"missing": channel.missing}
    if 2 * channel.missing > channel.n:
        code = "all-missing" if channel.missing == channel.n else "mostly-missing"
        why = "".join(f": {cause.text}" for cause in about if cause.issue.masks)
        return notice(code, channel.name, values, severity="bad", n=channel.n, why=why)
    if channel.is_constant:
        return notice("constant", channel.name, values, value=channel.mean, unit=channel.unit)
    return None
