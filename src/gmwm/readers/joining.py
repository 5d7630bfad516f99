"""One recording of the parts of a log that have clocks of their own."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gmwm._core.units import AuxiliaryUnit, auxiliary_unit
from gmwm.errors import InputError
from gmwm.issues import Notice, notice
from gmwm.readers import tuning
from gmwm.readers.names import CANONICAL, TIME, bare
from gmwm.readers.recording import Channel, Recording, auxiliary_channel, notices_of_gaps
from gmwm.readers.table import Table

_SAMPLE = 0.5  # by which two clocks may part over a recording and count as one


def has_sensors(table: Table) -> bool:
    """Whether a table has columns of gyros or accelerometers, or might."""
    roles = {each.role for each in table.meanings}
    return not roles.isdisjoint(CANONICAL) or "temperature" not in roles


def shares(
    tables: Sequence[Table], channels: Mapping[str, str | int] | Iterable[str] | None
) -> list[tuple[Table, Collection[str] | None]]:
    """Which of the channels that the caller names are in which table; those without any go."""
    source = tables[0].source
    if channels is None:
        return [(table, None) for table in tables]
    if isinstance(channels, Mapping):
        text = f"{source}: columns are given for channels, and {len(tables)} topics are read"
        hint = 'name the channels alone, e.g. channels=["gyro"], or choose one topic'
        raise InputError(f"{text}: {hint}")
    wanted = [channels] if isinstance(channels, str) else list(channels)
    found: list[tuple[Table, Collection[str] | None]] = []
    known = set[str]()
    for table in tables:
        roles = {each.role for each in table.meanings if each.role in CANONICAL}
        roles |= {str(role).partition("_")[0] for role in roles}
        if own := [name for name in wanted if name in roles]:
            found.append((table, own))
            known.update(own)
    for name in wanted:
        if name not in known:
            raise InputError(f"{source} has no channel {name!r} to read", "channel-unknown")
    return found


def joined(parts: Sequence[Recording]) -> Recording:
    """Recordings of topics, cut to the time that they have in common."""
    first = parts[0]
    if len(parts) == 1:
        return first
    start = max(part.start for part in parts)
    stop = min(part.start + part.duration for part in parts)
    if not stop > start:
        text = f'{first.source}: its topics have no time in common: choose one, or clock="log"'
        raise InputError(text, "topics-apart")
    channels = [channel for part in parts for channel in _cut(part, start, stop)]
    names = [channel.name for channel in channels]
    if len(set(names)) < len(names):
        raise InputError(f"{first.source}: two topics have the same channels: choose one", "topic")
    # Clocks that are the same within half a sample get one rate and length.
    dt, n = channels[0].dt, channels[0].n
    for i, channel in enumerate(channels):
        if abs(channel.dt / dt - 1.0) * channel.n < _SAMPLE and abs(channel.n - n) <= 1:
            channels[i] = replace(channel, dt=dt, values=channel.values[:n])
    shortest = min(channel.n for channel in channels if channel.dt == dt)
    channels = [
        replace(channel, values=channel.values[:shortest]) if channel.dt == dt else channel
        for channel in channels
    ]
    notices: list[Notice] = []
    for each in (each for part in parts for each in part.notices):
        if each.code != "missing-samples" and each not in notices:
            notices.append(each)
    values = {
        "duration": stop - start,
        "lost": max(part.duration for part in parts) - (stop - start),
        "rates": len({channel.dt for channel in channels if not channel.is_auxiliary}),
    }
    rates = ", ".join(f"{part.rate:.6g} Hz" for part in parts)
    notices.append(notice("topics-joined", "", values, count=len(parts), listed=rates))
    jitter = [part.jitter for part in parts if part.jitter is not None]
    return replace(
        first,
        channels=tuple(channels),
        notices=(*notices, *notices_of_gaps(channels)),
        jitter=max(jitter, default=None),
        start=start,
    )


def _cut(recording: Recording, start: float, stop: float) -> list[Channel]:
    begin, end = (round((time - recording.start) * recording.rate) for time in (start, stop))
    rows = slice(begin, end)
    if rows.stop - rows.start < tuning.FEWEST_SAMPLES:
        common = f"{recording.source}: its topics have {stop - start:.3g} s in common"
        hint = f"fewer than {tuning.FEWEST_SAMPLES} samples: choose one, or record longer"
        raise InputError(f"{common}, {hint}", "topics-apart")
    return [replace(channel, values=channel.values[rows]) for channel in recording.channels]


def with_temperature(recording: Recording, table: Table) -> Recording:
    """A thermometer beside the sensors, interpolated at their rate between its stamps."""
    roles = [each.role for each in table.meanings]
    if TIME not in roles or "temperature" not in roles:
        return recording
    time, channels = roles.index(TIME), list[Channel]()
    try:
        arrays = table.load([i for i, role in enumerate(roles) if role == "temperature"] + [time])
    except InputError as error:
        outcome = notice("columns-unreadable", what=f"temperature ({error})")
    else:
        stamps = arrays.pop(time) * (table.meanings[time].seconds or 1.0)
        order = np.argsort(stamps, kind="stable")
        grid = recording.start + recording.dt * np.arange(recording.n)
        for column, own in arrays.items():
            values = np.interp(grid, stamps[order], own[order], left=np.nan, right=np.nan)
            name, unit = bare(table.names[column]), table.meanings[column].unit or "degC"
            unit_of = auxiliary_unit(unit) or AuxiliaryUnit("temperature", "degC")
            channels.append(auxiliary_channel(name, values, recording.dt, unit_of))
        names, first = ", ".join(channel.name for channel in channels), recording.names[0]
        count = {"count": stamps.size}
        outcome = notice("temperature-interpolated", "", count, listed=names, first=first)
    wider, notices = (*recording.channels, *channels), (*recording.notices, outcome)
    return replace(recording, channels=wider, notices=notices)


def with_thermometer(recording: Recording, table: Table) -> Recording:
    """A recording with the temperatures of another file, whose times count from its first sample.

    Raises InputError if the table has no temperatures by time, or none during the recording.
    """
    found = with_temperature(replace(recording, start=0.0), table)
    added = found.channels[len(recording.channels) :]
    if not added or all(channel.missing == channel.n for channel in added):
        raise InputError(
            f"{table.source}: no temperature falls within the recording: give columns such as "
            "'time [s]' and 'temperature [degC]', with times from its first sample"
        )
    return replace(found, start=recording.start)
