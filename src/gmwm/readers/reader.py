"""From a file, or the parts of a log, to a `Recording`."""

import math
import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gmwm._core.spool import scaled
from gmwm._core.units import Unit
from gmwm.errors import InputError
from gmwm.issues import notice
from gmwm.readers import clock as clocks
from gmwm.readers.columns import Given, Reference, roles_of
from gmwm.readers.formats.binary import BinaryTable
from gmwm.readers.names import CANONICAL, TIME, bare
from gmwm.readers.recording import Channel, Recording, joined
from gmwm.readers.registry import NAMES, Wanted, open_tables
from gmwm.readers.rest import rest_notices
from gmwm.readers.samples import samples_of
from gmwm.readers.table import Table


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


def with_temperature(recording: Recording, table: Table, *, is_one_clock: bool = True) -> Recording:
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
        origin = table.origins.get(time, 0.0) * is_one_clock
        stamps = (arrays.pop(time) + origin) * (table.meanings[time].seconds or 1.0)
        order = np.argsort(stamps, kind="stable")
        grid = recording.start + recording.dt * np.arange(recording.n)
        for column, own in arrays.items():
            values = np.interp(grid, stamps[order], own[order], left=np.nan, right=np.nan)
            unit = table.meanings[column].unit or Unit("", "temperature", "degC")
            name = bare(table.names[column])
            values = scaled(values, unit.scale, unit.offset)
            channels.append(Channel(name, values, recording.dt, unit.quantity, unit.kept))
        names, first = ", ".join(channel.name for channel in channels), recording.names[0]
        count = {"count": stamps.size}
        outcome = notice("temperature-interpolated", "", count, listed=names, first=first)
    wider, notices = (*recording.channels, *channels), (*recording.notices, outcome)
    return replace(recording, channels=wider, notices=notices)


def with_thermometer(recording: Recording, table: Table) -> Recording:
    """A recording with the temperatures of another file alone, by time from its first sample."""
    own = tuple(each for each in recording.channels if each.quantity != "temperature")
    found = with_temperature(replace(recording, start=0.0, channels=own), table, is_one_clock=False)
    added = found.channels[len(own) :]
    if not added or any(2 * channel.missing > channel.n for channel in added):
        raise InputError(
            f"{table.source}: its temperatures do not cover half of the recording: give columns "
            "such as 'time [s]' and 'temperature [degC]', with times from its first sample"
        )
    return replace(found, start=recording.start)


def read(
    path: str | os.PathLike[str] | Any,
    rate: float | None = None,
    units: Mapping[str, str] | None = None,
    channels: Mapping[str, Reference] | Collection[str] | None = None,
    time: Reference | Literal[False] | None = None,
    layout: str | None = None,
    *,
    topic: str | Sequence[str] = (),
    clock: str = "header",
    format: str | None = None,
    damaged: bool = False,
) -> Recording:
    """Read a static recording of an inertial sensor.

    Parameters
    ----------
    path : str, path, DataFrame or Arrow table
        Delimited text (plain or gzip, with or without a header), NPY or NPZ, a bag of ROS 1 or 2,
        a log of PX4 (ULog) or ArduPilot (binary), MAT, HDF5, Parquet or Feather; or a table in
        memory of pandas, polars or Arrow. The first bytes of a file show its format.
    rate : float, optional
        Sampling rate, Hz. Not needed if the file has time stamps.
    units : mapping of str to str, optional
        Unit of ``"gyro"`` and of ``"accel"``, or of single channels, e.g.
        ``{"gyro": "deg/s", "accel": "g"}``. Not needed where the header has them.
    channels : mapping of str to (str or int), or collection of str, optional
        Channel name -> column (name, or index counted from 0), e.g. ``{"gyro_x": "col3"}``; or
        names alone, of those found by default, or ``"gyro"`` for all of them. Only these are read,
        and the auxiliary ones (temperature, voltage, clock);
        a bag or a flight log without one of the two sensors is rejected unless they are given. A
        name that begins with ``gyro`` or ``accel`` states what the column measures; for any other
        its unit does (``"temp": "T1"`` in degC or K is auxiliary). By default columns are known by
        their names; without names, six are gyro and accelerometer x, y, z, seven have time before
        them, one or three (with time: four) belong to the only sensor in ``units``.
    time : str, int or False, optional
        Column of time stamps; ``False`` ignores one that is there. Without a unit in the header
        (``time_us``, ``t [min]``), steps of 10 us to 0.5 s are seconds; others need ``rate``.
    layout : str, optional
        Of a binary file without a header: ``"IMAR"``, ``"LN200"``, ``"LN200IG"``, ``"IXSEA"``,
        ``"NAVCHIP_INT"``, ``"NAVCHIP_FLT"``, ``"KF-GINS"``, or
        ``"TYPE,GYRO_SCALE,ACCEL_SCALE[,rates][,little|big]"``: each record is a time (float64, s)
        and six numbers of a type, gyro and accelerometer x, y, z, in units of the scales (rad and
        m/s; of rates rad/s and m/s^2).
    topic : str or sequence of str, optional
        Of a bag or a flight log, the topic to read, or one of gyros and one of accelerometers;
        needed where there are several.
    clock : {"header", "log"}, optional
        Time stamps to use: those in the message headers, or the times of recording.
    format : str, optional
        What the file is, where its first bytes and its name do not show it: one of FORMATS.
    damaged : bool, optional
        Use the readable part of a text or a flight log that is cut off or damaged in places; by
        default it is rejected. Damaged files of other formats cannot be read.

    Returns
    -------
    Recording
        In rad/s and m/s^2. Topics of different rates give channels of their own rates, cut to the
        time that they share. Samples are NaN where a field is empty (or NaN, NA, null), and where
        the time stamps jump forward, as many as fit on the grid of the sampling interval. Columns
        of temperatures, voltages and further clocks are its auxiliary channels. Its
        ``notices`` report what was assumed, which columns were not used and what is missing.

    Notes
    -----
    If the columns and the arrays made from them would need more than 1 GB, they are kept in
    temporary files (in ``TMPDIR``) and mapped. Then one channel is processed at a time, and its
    wavelet variance needs at most about three times its memory. The environment variable
    ``GMWM_MEMORY`` sets another limit.

    Raises
    ------
    InputError
        If the file cannot be used. The message is one sentence: what is wrong, where, and
        how to correct it.

    Examples
    --------
    >>> rec = gmwm.read("static.csv", rate=100, units={"gyro": "deg/s"})  # doctest: +SKIP
    """
    topics = (topic,) if isinstance(topic, str) else tuple(topic)
    wanted = Wanted(topics, clock, channels is not None, damaged, layout=layout)
    tables = open_tables(path, wanted, format)
    return _recording(tables, Given(rate, units or {}, channels, time))


read.__doc__ = str(read.__doc__).replace("FORMATS", ", ".join(f'``"{name}"``' for name in NAMES))


def read_imus(
    path: str | os.PathLike[str],
    topic: Sequence[str] = (),
    *,
    clock: str = "header",
    format: str | None = None,
    damaged: bool = False,
    **given: Any,
) -> dict[str, Recording]:
    """The recordings of all IMUs of a bag or a flight log, by instance or topic; see `read`.

    topic: Those to read; by default all of the first kind that several IMUs have.
    """
    wanted = Wanted(tuple(topic), clock, "channels" in given, damaged, every_imu=True)
    by_imu: dict[str, list[Table]] = {}
    for table in open_tables(path, wanted, format):
        if has_sensors(table):
            by_imu.setdefault(table.imu, []).append(table)
    if len(by_imu) == 1:
        raise InputError(f"{Path(path).name} has one IMU: give a file of each IMU")
    reading = Given(
        given.get("rate"), given.get("units", {}), given.get("channels"), given.get("time")
    )
    names = by_imu if topic else sorted(by_imu)
    return {name: _recording(by_imu[name], reading) for name in names}


def _recording(tables: Sequence[Table], given: Given) -> Recording:
    """One recording of the tables of an IMU."""
    if len(tables) == 1:
        return recording_of(tables[0], given)
    own = [table for table in tables if has_sensors(table)]
    chosen = [(own[0], given.channels)] if len(own) == 1 else shares(own, given.channels)
    parts = [recording_of(table, replace(given, channels=only)) for table, only in chosen]
    for table in tables:
        if table not in own:
            parts[0] = with_temperature(parts[0], table)
    return joined(parts)


def recording_of(table: Table, given: Given) -> Recording:
    """The recording of a table: one stage after another, each of which hands on what it found."""
    stated = _stated_rate(table, given.rate)
    roles = roles_of(table, replace(given, rate=stated))
    clocks.ask_for_unknown(table, roles, stated)
    samples = samples_of(table, roles)
    timing = clocks.timing_in(table, roles, samples, stated)
    rate = stated or (timing.rate if timing else 0.0)  # or it was asked for with the units
    contradicted = clocks.contradicted(table, samples.ignored, rate)
    series = samples.series
    if timing is not None:
        # One at a time: its short form goes before the next one is made longer.
        series = {name: timing.jumps.spread(series.pop(name)) for name in list(series)}
    of_columns = (*table.notices, *roles.notices, *samples.unreadable, *roles.units.notices)
    of_rows = (*(timing.notices if timing else ()), *samples.masked, *contradicted)
    sensors = ((name, series[name], unit) for name, unit in roles.units.known.items())
    recording = Recording.of_series(sensors, rate, table.source, (*of_columns, *of_rows))
    further = [
        Channel(each.name, series[each.name], 1.0 / rate, each.unit.quantity, each.unit.kept)
        for each in samples.auxiliary
    ]
    has_layout = isinstance(table, BinaryTable)
    at_rest = rest_notices(recording, roles.units.known, given, has_layout=has_layout)
    channels, notices = (*recording.channels, *further), (*at_rest, *recording.notices)
    jitter, start = (timing.jitter, timing.start) if timing else (None, 0.0)
    return Recording(channels, table.source, notices, jitter, start)


def _stated_rate(table: Table, rate: float | None) -> float | None:
    """The rate that the caller or else the file states, if they do not contradict each other."""
    if rate is None:
        return table.rate
    rate = float(rate)
    if not (0.0 < rate < math.inf and 1.0 / rate < math.inf):
        raise InputError(f"rate = {rate!r}: give a positive sampling rate in Hz", "rate")
    if table.rate is not None and not clocks.agree(rate, table.rate):
        text = f"{table.source} states a rate of {table.rate:.6g} Hz, not {rate:.6g} Hz"
        raise InputError(f"{text}: leave out the rate to use the file's")
    return rate
