"""Wavelet variances of a recording that is read a block at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.units import SI_UNIT
from gmwm.readers import Missing, Recording, notices_of_blocks, read_blocks
from gmwm.variance.streaming.streaming import StreamingVariance
from gmwm.variance.wavelet import WaveletVariance


@dataclass(frozen=True)
class StreamedRecording:
    """What is left of a recording that was read a block at a time.

    Attributes
    ----------
    variances : dict of str to WaveletVariance
        By channel.
    skipped : dict of str to Notice
        Channels that have none, and why.
    source : str
    dt : float
        Sampling interval, s.
    n : int
        Samples per channel, missing ones included.
    notices : tuple of Notice
        The first of each kind that the reader noticed, and what is missing in all blocks.
    """

    variances: Mapping[str, WaveletVariance]
    skipped: Mapping[str, Notice]
    source: str
    dt: float
    n: int
    notices: tuple[Notice, ...]


def stream(
    path: Any, *, prepare: Callable[[Recording], Recording] | None = None, **reading: Any
) -> StreamedRecording:
    """Wavelet variances of a file of any length, read once, a block at a time.

    Parameters
    ----------
    path : str, path or table
        Delimited text, NPY, Parquet, Feather, a topic of a bag, `IMU` of ArduPilot or a binary
        layout; or a table in memory.
    prepare : callable, optional
        Called with each block: gives the samples of it that count, as `Health.masked` does.
    **reading
        The arguments of `gmwm.read`; ``rows`` of a block.

    Raises
    ------
    InputError
        If the file cannot be used, or not a block at a time.

    Examples
    --------
    >>> wv = gmwm.stream("static.csv", units={"gyro": "deg/s"}).variances  # doctest: +SKIP
    >>> gmwm.select(wv["gyro_x"])  # doctest: +SKIP
    """
    parts = read_blocks(path, **reading)
    first = next(parts)
    names = [channel.name for channel in first.inertial]
    units = {c.name: c.unit if c.unit in SI_UNIT.values() else "" for c in first.inertial}
    variance = StreamingVariance(first.dt, units)
    missing = dict.fromkeys(names, Missing())
    noticed: list[Notice] = []
    for part in chain([first], parts):
        noticed += part.notices
        for name in names:
            missing[name] = missing[name].and_then(part[name].values)
        used = part if prepare is None else prepare(part)
        variance.update(np.stack([used[name].values for name in names], axis=1))
    results = variance.results()
    return StreamedRecording(
        variances={k: v for k, v in results.items() if isinstance(v, WaveletVariance)},
        skipped={
            name: Notice(error.code or "not-estimable", "bad", name, str(error))
            for name, error in results.items()
            if not isinstance(error, WaveletVariance)
        },
        source=first.source,
        dt=first.dt,
        n=variance.n,
        notices=notices_of_blocks(noticed, missing),
    )
