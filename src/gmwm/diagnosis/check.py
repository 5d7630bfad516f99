"""Examine a recording.

Every check is one function: of a channel in `CHECKS`, of the whole recording in `OF_RECORDING`. To
add one, write it in the file of what it looks for, name it in one of these, and describe its
notices in `gmwm.issues`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from gmwm._core.jobs import one_blas_thread, shared
from gmwm._core.spool import moved, release, scaled
from gmwm._core.text import readable
from gmwm._core.typing import Progress, known_of
from gmwm.diagnosis import repeats, samples, tuning
from gmwm.diagnosis.drift import drift, temperature_notices, variance
from gmwm.diagnosis.events import (
    contamination,
    event,
    find_events,
    heavy_tails,
    outliers_or_tails,
    with_single_outliers,
)
from gmwm.diagnosis.health import ChannelHealth, Health
from gmwm.diagnosis.innovations import Examined, crosstalk_notices, innovations
from gmwm.diagnosis.lines import line_notices
from gmwm.diagnosis.motion import Motion, find_motion, runs_of
from gmwm.diagnosis.repeats import Copy, copied_rows, find_copies, rounding, step_size, widest_step
from gmwm.diagnosis.resonances import peaks, resonance_notice
from gmwm.diagnosis.still import moves, vibration
from gmwm.issues import Notice, Severity, notice, worst_first
from gmwm.readers import Channel, Recording, require_recording


def clock(recording: Recording) -> Iterator[Notice]:
    """Say that time stamps come unevenly; for small jitter the notice of the reader is enough."""
    jitter = recording.jitter
    if jitter is not None and jitter >= tuning.JITTER:
        severity: Severity = "warning" if jitter > tuning.LARGE_JITTER else "note"
        yield notice("clock", "", {"jitter": jitter}, severity=severity)


OF_RECORDING = (samples.length, moves, clock, copied_rows, vibration)
"""Checks of a whole recording of one rate."""

_OF_SAMPLES = (repeats.held_or_stuck, samples.cut_off_or_abrupt_end, samples.repeated_value)

CHECKS = (*_OF_SAMPLES, event, outliers_or_tails, rounding, variance, drift)
"""Checks of a channel; those of its spectrum come last."""


@dataclass(frozen=True, eq=False)
class _Found:
    """Notices and numbers of a channel, and its prediction errors in standard deviations."""

    notices: list[Notice]
    facts: ChannelHealth = field(default_factory=ChannelHealth)
    errors: npt.NDArray[np.float32] | None = None


@one_blas_thread()
def health(recording: Recording, *, progress: Progress | None = None) -> Health:
    """Find what is wrong with a static recording, or needs a term of its own in the model.

    Motion, gaps, dead and stuck channels, saturation, spikes and shocks, outliers spread over the
    record, rounding, periodic lines, resonances, drift, changes of the noise, an uneven clock,
    dependence on temperature and between channels. Each kind of notice is made in at most about
    one of a thousand channels of clean Gaussian noise.

    Parameters
    ----------
    recording : Recording
    progress : callable, optional
        Called as ``progress(done, total, channel)`` when work on a channel begins, and at the end.

    Returns
    -------
    Health

    Examples
    --------
    >>> import numpy as np, gmwm
    >>> noise = np.random.default_rng(1).normal(size=(5000))
    >>> noise[3000] = 40.0
    >>> rec = gmwm.Recording.from_arrays({"gyro_x": noise}, 100.0, {"gyro": "deg/s"})
    >>> found = gmwm.health(rec)
    >>> [start <= 3000 < stop for start, stop in found.events("gyro_x")]
    [True]
    >>> found.masked(rec)["gyro_x"].is_complete
    False
    """
    require_recording(recording)
    if len(parts := recording.by_rate()) > 1:
        return _joined(recording, [health(part, progress=progress) for part in parts])
    # What is missing is counted anew, channel by channel.
    notices = [one for one in recording.notices if one.code != "missing-samples"]
    notices += [one for check in OF_RECORDING for one in check(recording)]
    found = _channels_found(recording, progress)
    errors = {name: one.errors for name, one in found.items() if one.errors is not None}
    between = samples.gap_notices(recording.inertial, recording.dt)
    between += crosstalk_notices(errors) + temperature_notices(recording)
    notices = worst_first(notices + [one for one in between if not one.where])
    is_static = not find_motion(recording).moves
    for name, one in found.items():
        own = one.notices + [each for each in between if each.where == name]
        if is_static and not any(each.severity in ("warning", "bad") for each in own):
            own.append(notice("clean", name))
        notices += worst_first(own)
    facts = {name: one.facts for name, one in found.items()}
    return Health(tuple(notices), facts, recording.source, recording.rate, recording.n)


def _joined(recording: Recording, found: Sequence[Health]) -> Health:
    """Join what was found of sensors with rates of their own."""
    notices: list[Notice] = []
    for one in found:
        notices += [each for each in one.notices if each not in notices]
    whole = worst_first([each for each in notices if not each.where])
    own = [each for each in notices if each.where]
    facts = {name: channel for one in found for name, channel in one.channels.items()}
    in_order = {channel.name: facts[channel.name] for channel in recording.inertial}
    return Health((*whole, *own), in_order, recording.source, recording.rate, recording.n)


def _channels_found(recording: Recording, progress: Progress | None) -> dict[str, _Found]:
    """Examine the channels side by side."""
    channels = recording.inertial
    found: dict[str, _Found] = {}

    progress = progress or (lambda done, total, name: None)

    def begun() -> Iterator[Channel]:
        for channel in channels:
            progress(len(found), len(channels), channel.name)
            yield channel

    work = partial(_without_copies, copies=find_copies(recording), motion=find_motion(recording))
    for channel, one in shared(work, begun()):
        found[channel.name] = one
        release(channel.values)
    progress(len(channels), len(channels), "")
    return {channel.name: found[channel.name] for channel in channels}


def _without_copies(channel: Channel, copies: Sequence[Copy], motion: Motion) -> _Found:
    """Examine a channel without rows that are copies, which are left out like events."""
    if not copies:
        return _at_own_rate(channel, motion)
    values = scaled(channel.values, 1.0)
    for each in copies:
        values[each.start : each.stop] = np.nan
    one = _at_own_rate(replace(channel, values=values), motion)
    gone = np.zeros(channel.n, dtype=bool)
    for start, stop in (*one.facts.events, *((each.start, each.stop) for each in copies)):
        gone[start:stop] = True
    return replace(one, facts=replace(one.facts, events=tuple(runs_of(gone))))


def _at_own_rate(channel: Channel, motion: Motion) -> _Found:
    """Examine a channel at its own rate, where each sample is written several times."""
    found = repeats.repetition(channel)
    if found is None:
        straight = repeats.interpolation_notice(channel) if channel.is_of_a_sensor else None
        if straight is None:
            return _examined(channel, motion)
        if straight.code == "interpolated":
            return _Found([straight])
        one = _examined(channel, motion)
        return replace(one, notices=[straight, *one.notices])
    one = _examined(repeats.thinned(channel, found), motion)
    events = tuple(
        (found.first + start * found.times, min(found.first + stop * found.times, channel.n))
        for start, stop in one.facts.events
    )
    facts = replace(one.facts, events=events, repetition=found, held=0.0)
    values = {"times": float(found.times), "rate": 1.0 / (channel.dt * found.times)}
    # Its prediction errors have no partners of the same time in other channels.
    return _Found([notice("repeated-samples", channel.name, values), *one.notices], facts)


def _examined(channel: Channel, motion: Motion) -> _Found:
    """Run all checks of a channel."""
    name, values = channel.name, np.asarray(channel.values, dtype=float)
    if channel.missing == channel.n:
        return _Found([])
    if channel.is_constant:
        shown = readable(channel.mean, channel.unit, digits=6)
        return _Found([notice("dead", name, {"value": channel.mean}, shown=shown)])
    if infinite := int(np.count_nonzero(np.isinf(values))):
        return _Found([notice("infinite", name, count=infinite)])
    if not channel.is_of_a_sensor:
        return _Found([notice("size", name, {"spread": channel.spread}, unit=channel.unit)])
    present = known_of(values)
    smallest = step_size(present)
    step = widest_step(present, smallest)
    del present
    examined = _with_errors(channel, values, step, smallest, motion)
    if examined is None:
        hint, fewest = "record longer", tuning.FEWEST_KNOWN
        few = notice("length", name, severity="warning", variant="few", hint=hint, fewest=fewest)
        return _Found([few], ChannelHealth(lsb=step))
    notices = [one for check in CHECKS for one in check(examined)]
    held, events, level = examined.held, examined.events, examined.scatter
    outliers, quiet = examined.outliers, examined.quiet
    standardized = _standardized(examined)
    del examined  # the spectrum needs as much memory
    lines, bumps = peaks(quiet, channel.dt)
    if any(one.code == "rounding" and one.severity == "bad" for one in notices):
        bumps = ()  # steps that come and go as the level passes them make bumps of their own
    notices += line_notices(name, channel.unit, lines)
    notices += [resonance_notice(name, channel.unit, bump) for bump in bumps]
    facts = ChannelHealth(
        lines=tuple((line.frequency, line.amplitude) for line in lines),
        resonances=tuple((bump.frequency, bump.damping) for bump in bumps),
        events=events,
        lsb=step,
        outliers=outliers,
        held=held.share if held.chance <= tuning.CHANCE_OF_HELD and not held.is_even else 0.0,
        noise=level,
    )
    return _Found(notices, facts, standardized)


def _with_errors(
    channel: Channel, values: npt.NDArray[np.float64], step: float, smallest: float, motion: Motion
) -> Examined | None:
    """A channel with its prediction errors, events and outliers; None if it is too short."""
    errors = innovations(values, step)
    if errors is None:
        return None
    events = find_events(errors)
    outliers = contamination(errors, events)
    tails = heavy_tails(errors) if outliers > 0.0 else None
    if tails is not None:
        events, outliers = find_events(errors, tails), 0.0
    elif outliers > 0.0:
        events = with_single_outliers(events, errors, values, step)
    events = motion.joined(events, channel.dt)
    usable, quiet = errors.known.copy(), scaled(values, 1.0) if events else values
    for start, stop in events:
        usable[start:stop] = False
        quiet[start:stop] = np.nan
    found = Examined(
        name=channel.name,
        unit=channel.unit,
        dt=channel.dt,
        values=values,
        step=step,
        smallest=smallest,
        errors=errors,
        events=events,
        shocks=motion.outside(events, channel.dt),
        outliers=outliers,
        tails=tails,
        usable=usable,
        quiet=quiet,
    )
    return replace(found, held=repeats.held_samples(found))


def _standardized(channel: Examined) -> npt.NDArray[np.float32] | None:
    """Prediction errors in standard deviations, clipped; 0 where there are none."""
    errors = channel.errors
    if not errors.level > 0.0:
        return None
    result = np.where(errors.scale > 0.0, errors.scale, errors.level)
    np.divide(errors.values, result, out=result)
    np.clip(result, -tuning.CLIP, tuning.CLIP, out=result)
    result[~channel.usable] = 0.0
    return moved(result.astype(np.float32), channel.values)  # those of all channels are kept
