"""Examine a recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from gmwm._core.jobs import one_blas_thread, shared
from gmwm._core.notices import Notice, Severity, worst_first
from gmwm._core.text import per_cent
from gmwm._core.typing import BoolArray, FloatArray, Progress, known_of
from gmwm.diagnosis import tuning
from gmwm.diagnosis.contamination import (
    Tails,
    contamination,
    contamination_notice,
    heavy_tails,
    tails_notice,
)
from gmwm.diagnosis.drift import drift_notice, variance_notice
from gmwm.diagnosis.events import event_notice, find_events, with_single_outliers
from gmwm.diagnosis.innovations import Innovations, Signal, innovations
from gmwm.diagnosis.motion import Motion, find_motion, motion_notices
from gmwm.diagnosis.pairs import crosstalk_notices, temperature_notices
from gmwm.diagnosis.resolution import rounding_notice, step_size, widest_step
from gmwm.diagnosis.result import ChannelHealth, Health
from gmwm.diagnosis.samples import (
    abrupt_end_notice,
    dead_notice,
    gap_notices,
    length_notice,
    repeated_value_notice,
    saturation_notice,
    stuck_notice,
)
from gmwm.diagnosis.spectral import line_notices, peaks, resonance_notice
from gmwm.diagnosis.still import vibration_notice
from gmwm.diagnosis.unmeasured import (
    Copy,
    copies_notice,
    find_copies,
    held_notice,
    held_share,
    interpolation_notice,
    leaves_runs,
    repetition,
    repetition_notice,
    thinned,
)
from gmwm.readers import Channel, Recording, require_recording

_SEVERE = ("warning", "bad")


@dataclass(frozen=True, eq=False)
class _Examined:
    """A channel: its notices, its numbers, and its prediction errors in standard deviations."""

    notices: list[Notice]
    facts: ChannelHealth
    errors: npt.NDArray[np.float32] | None


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
    parts = recording.by_rate()
    if len(parts) > 1:
        return _together(recording, [health(part, progress=progress) for part in parts])
    # What is missing is counted anew, channel by channel.
    read = [notice for notice in recording.notices if notice.code != "missing-samples"]
    motion = find_motion(recording)
    whole = [
        length_notice(recording.n, recording.rate),
        *motion_notices(motion),
        *read,
        *_clock(recording),
    ]
    copies = find_copies(recording)
    if (again := copies_notice(copies, recording.dt)) is not None:
        whole.append(again)
    if not motion.moves and (vibration := vibration_notice(recording)) is not None:
        whole.append(vibration)
    examined: dict[str, _Examined] = {}
    channels = recording.inertial

    def begun() -> Iterator[Channel]:
        for channel in channels:
            if progress is not None:
                progress(len(examined), len(channels), channel.name)
            yield channel

    for channel, one in shared(partial(_once, copies=copies, motion=motion), begun()):
        examined[channel.name] = one
    examined = {channel.name: examined[channel.name] for channel in channels}
    if progress is not None:
        progress(len(channels), len(channels), "")
    between = gap_notices(channels, recording.dt)
    between += crosstalk_notices(
        {name: one.errors for name, one in examined.items() if one.errors is not None}
    )
    between += temperature_notices(recording)
    notices = worst_first(whole + [found for found in between if not found.where])
    for name, one in examined.items():
        own = one.notices + [found for found in between if found.where == name]
        if not motion.moves and not any(found.severity in _SEVERE for found in own):
            own.append(_clean(name))
        notices += worst_first(own)
    return Health(
        notices=tuple(notices),
        channels={name: one.facts for name, one in examined.items()},
        source=recording.source,
        rate=recording.rate,
        n=recording.n,
    )


def _together(recording: Recording, found: Sequence[Health]) -> Health:
    """Of sensors with rates of their own, each examined for itself."""
    notices: list[Notice] = []
    for one in found:
        notices += [notice for notice in one.notices if notice not in notices]
    whole = worst_first([notice for notice in notices if not notice.where])
    facts = {name: channel for one in found for name, channel in one.channels.items()}
    return Health(
        notices=(*whole, *(notice for notice in notices if notice.where)),
        channels={channel.name: facts[channel.name] for channel in recording.inertial},
        source=recording.source,
        rate=recording.rate,
        n=recording.n,
    )


def _clock(recording: Recording) -> list[Notice]:
    """Time stamps that come unevenly; for small jitter the notice of the reader is enough."""
    jitter = recording.jitter
    if jitter is None or jitter < tuning.JITTER:
        return []
    severity: Severity = "warning" if jitter > tuning.LARGE_JITTER else "note"
    text = f"the steps of the time stamps vary by {per_cent(jitter)} rms"
    hint = "harmless if only the stamps are late; else let the sensor's own clock trigger it"
    return [Notice("clock", severity, "", text, {"jitter": jitter}, hint)]


def _clean(name: str) -> Notice:
    text = "nothing found that spoils the estimates"
    return Notice("clean", "good", name, text)


def _once(channel: Channel, copies: Sequence[Copy], motion: Motion) -> _Examined:
    """A channel without rows that are copies, which are to be left out."""
    if not copies:
        return _unrepeated(channel, motion)
    values = np.array(channel.values, dtype=float)
    for each in copies:
        values[each.start : each.stop] = np.nan
    one = _unrepeated(replace(channel, values=values), motion)
    spans = [*one.facts.events, *((each.start, each.stop) for each in copies)]
    return replace(one, facts=replace(one.facts, events=_united(spans)))


def _united(spans: Sequence[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    found: list[tuple[int, int]] = []
    for start, stop in sorted(spans):
        if found and start <= found[-1][1]:
            start, before = found.pop()
            stop = max(stop, before)
        found.append((start, stop))
    return tuple(found)


def _unrepeated(channel: Channel, motion: Motion) -> _Examined:
    """A channel at its own rate, if each sample of it is written several times."""
    found = repetition(channel)
    straight = interpolation_notice(channel) if found is None and channel.is_of_a_sensor else None
    if straight is not None:
        if straight.code == "interpolated":
            return _Examined([straight], ChannelHealth(), None)
        some = _examined(channel, motion)
        return replace(some, notices=[straight, *some.notices])
    if found is None:
        return _examined(channel, motion)
    one = _examined(thinned(channel, found), motion)
    events = tuple(
        (found.first + start * found.times, min(found.first + stop * found.times, channel.n))
        for start, stop in one.facts.events
    )
    facts = replace(one.facts, events=events, repetition=found, held=0.0)
    # Its prediction errors have no partners of the same time in other channels.
    return _Examined([repetition_notice(channel, found), *one.notices], facts, None)


def _examined(channel: Channel, motion: Motion) -> _Examined:
    name, unit, dt = channel.name, channel.unit, channel.dt
    values = np.asarray(channel.values, dtype=float)
    dead = dead_notice(channel)
    if dead is not None or channel.missing == channel.n:
        return _Examined([dead] if dead else [], ChannelHealth(), None)
    unusable = _unusable(channel)
    if unusable is not None:
        return _Examined([unusable], ChannelHealth(), None)
    present = known_of(values)
    smallest = step_size(present)
    step = widest_step(present, smallest)
    errors = innovations(values, step)
    if errors is None:
        text = f"fewer than {tuning.FEWEST_KNOWN} samples in a row, too few for any other check"
        short = Notice("length", "warning", name, text, hint="record longer")
        return _Examined([short], ChannelHealth(lsb=step), None)
    events, outliers, tails = _events(errors, values, step)
    events = motion.joined(events, dt)
    usable = errors.known.copy()
    quiet = values.copy() if events else values
    for start, stop in events:
        usable[start:stop] = False
        quiet[start:stop] = np.nan
    # Where steps are wide in a part of the values, neighbours are equal by chance in that part.
    held, chance = (
        held_share(values, step, errors.level)
        if step == smallest or 2.0 * step < errors.level
        else (0.0, 0.0)
    )
    signal = Signal(name, unit, dt, step, errors.level)
    stuck = stuck_notice(signal, values, errors)
    if stuck is not None and 2.0 * stuck.values["samples"] > held * present.size:
        held = 0.0  # most of what is held is held in a few places
    is_even = held > 0.0 and not leaves_runs(values)
    noise = known_of(quiet)
    found = [
        held_notice(name, held, chance, is_even=is_even) if held > 0.0 else stuck,
        saturation_notice(signal, present, noise) or abrupt_end_notice(signal, noise),
        repeated_value_notice(signal, present),
        event_notice(signal, values, motion.outside(events, dt)),
        contamination_notice(name, outliers),
        tails_notice(name, errors, tails),
        rounding_notice(signal, noise, smallest),
        variance_notice(signal, errors, usable, is_heavy=tails is not None),
        drift_notice(signal, quiet),
    ]
    notices = [one for one in found if one is not None]
    standardized = _standardized(errors, usable)
    level = errors.level
    del present, noise, errors  # the spectrum needs as much memory
    lines, bumps = peaks(quiet, dt)
    if any(one.code == "rounding" and one.severity == "bad" for one in notices):
        bumps = ()  # steps that come and go as the level passes them make bumps of their own
    notices += line_notices(name, unit, lines)
    notices += [resonance_notice(name, unit, bump) for bump in bumps]
    facts = ChannelHealth(
        lines=tuple((line.frequency, line.amplitude) for line in lines),
        resonances=tuple((bump.frequency, bump.damping) for bump in bumps),
        events=events,
        lsb=step,
        outliers=outliers,
        held=held if chance <= tuning.CHANCE_OF_HELD and not is_even else 0.0,
        noise=level,
    )
    return _Examined(notices, facts, standardized)


def _unusable(channel: Channel) -> Notice | None:
    """Why there is nothing to examine in a channel, if so."""
    name, unit = channel.name, channel.unit
    infinite = int(np.count_nonzero(np.isinf(channel.values)))
    if infinite:
        text = f"{infinite:,} infinite samples"
        return Notice(
            "infinite", "bad", name, text, hint="repair them, or set them to NaN for missing"
        )
    if not channel.is_of_a_sensor:
        text = f"varies by {channel.spread:.1g} {unit}, as no sensor does"
        return Notice("size", "bad", name, text, {"spread": channel.spread}, "check the unit")
    return None


def _events(
    errors: Innovations, values: FloatArray, step: float
) -> tuple[tuple[tuple[int, int], ...], float, Tails | None]:
    """Shocks and spikes, the share of outliers all over the record, and tails if heavy."""
    events = find_events(errors)
    outliers = contamination(errors, events)
    tails = heavy_tails(errors) if outliers > 0.0 else None
    if tails is not None:
        return find_events(errors, tails), 0.0, tails
    if outliers > 0.0:
        events = with_single_outliers(events, errors, values, step)
    return events, outliers, None


def _standardized(errors: Innovations, usable: BoolArray) -> npt.NDArray[np.float32] | None:
    if not errors.level > 0.0:
        return None
    result = np.where(errors.scale > 0.0, errors.scale, errors.level)
    np.divide(errors.values, result, out=result)
    np.clip(result, -tuning.CLIP, tuning.CLIP, out=result)
    result[~usable] = 0.0
    return result.astype(np.float32)  # those of all channels are kept
