"""Error models of a recording of any length, from its streamed wavelet variances."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.runs import one_blas_thread
from gmwm._core.typing import Progress
from gmwm._core.units import SI_UNIT
from gmwm.calibration.calibration import Calibration
from gmwm.calibration.channel import (
    ChannelModel,
    GivenModels,
    calibration_of,
    channel_model,
    model_of,
    mostly_missing,
)
from gmwm.calibration.judgement import judged
from gmwm.calibration.screening import (
    SCREENING,
    check_screening,
    terms_of,
    with_outcomes,
    with_treatment,
)
from gmwm.calibration.stages import stage
from gmwm.diagnosis import Health, Repetition, health, joined
from gmwm.process import Process
from gmwm.readers import Channel, Recording
from gmwm.variance import StreamedRecording, StreamingVariance, WaveletVariance, stream

_NOT_DONE = (
    "read a stretch at a time: stretches at rest of a recording that moves are not used, and "
    "outliers are left out however many they are, where robust wavelet variances would keep them"
)


@one_blas_thread()
def calibrate_stream(
    path: Any,
    model: GivenModels = None,
    *,
    screening: Collection[str] = SCREENING,
    still: bool = True,
    progress: Progress | None = None,
    **reading: Any,
) -> Calibration:
    """Error model of every channel of a file that is longer than memory, read a stretch at a time.

    Each stretch is examined and screened as `gmwm.calibrate` does (see `gmwm.health_stream`), and
    departures are looked for beside the noise. What needs all samples is not done, as the notice
    "streamed" says: a recording that is not static is not valid where `gmwm.calibrate` would use
    its stretches at rest, and outliers are left out however many they are. Where samples are
    written several times in some stretches only, one of each is used, at the rate of the clock;
    stretches that are interpolated are left out.

    Parameters
    ----------
    path : str, path or table
        As in `gmwm.stream`.
    model : Process, Model or mapping, optional
        As in `gmwm.calibrate`.
    screening : collection of str, optional
        As in `gmwm.calibrate`; none takes the samples as they are, in a tenth of the time.
    still : bool, optional
        Whether a recording that is not static has fits that are not valid.
    progress : callable, optional
        As in `gmwm.calibrate`, when the file is read.
    **reading
        The arguments of `gmwm.read`; ``rows`` of a stretch.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If the file cannot be used, or no channel of it can be calibrated.
    """
    check_screening(screening)
    whole: Health | None = None
    if screening:
        with stage("health"):
            found, whole = _examined(path, screening, reading)
    else:
        with stage("variance"):
            found = stream(path, **reading)
    issues = _issues(found, whole, screening)
    offered: dict[str, tuple[Process, ...]] = {
        name: terms_of(whole, name, screening) if whole is not None else ()
        for name in found.variances
    }

    def one(name: str, data: WaveletVariance) -> ChannelModel | Notice:
        given = model_of(name, model)
        missing = data.gaps.missing if data.gaps is not None else 0
        return mostly_missing(name, missing, data.n) or channel_model(
            name, lambda _: [data], given, [found.source], extra=offered[name]
        )

    models: dict[str, ChannelModel | Notice] = {}
    for done, (name, data) in enumerate(found.variances.items()):
        if progress is not None:
            progress(done, len(found.variances), name)
        models[name] = one(name, data)
    if progress is not None:
        progress(len(found.variances), len(found.variances), "")
    chosen = {name: each.fit.model for name, each in models.items() if not isinstance(each, Notice)}
    return calibration_of(
        judged(models, issues, still=still),
        found.skipped,
        with_outcomes(issues, chosen, offered if model is None else {}),
        source=found.source,
        rate=1.0 / found.dt,
        n=found.n,
        left_out=_left_out(whole, screening),
    )


def _examined(
    path: Any, screening: Collection[str], reading: dict[str, Any]
) -> tuple[StreamedRecording, Health]:
    """Wavelet variances of the samples that count, and the health of all stretches."""
    parts: list[Health] = []
    # Channels of which samples are written several times, at their own rate.
    own: dict[str, tuple[Repetition, StreamingVariance]] = {}

    def prepared(part: Recording) -> Recording:
        start = sum(each.n for each in parts)
        parts.append(found := health(part))
        used = found.masked(part) if "events" in screening else part
        return replace(used, channels=tuple(counted(c, found, start) for c in used.channels))

    def counted(channel: Channel, found: Health, start: int) -> Channel:
        name, values = channel.name, np.full(channel.n, np.nan)
        if found.of(name, "interpolated"):
            channel = replace(channel, values=values)
        each = None if channel.is_auxiliary else found.repetition(name)
        if each is not None and name not in own:
            since = Repetition(each.times, (start + each.first) % each.times)
            unit = {name: SI_UNIT.get(channel.quantity or "", "")}
            own[name] = since, StreamingVariance(channel.dt * each.times, unit)
        if name in own:
            since, series = own[name]
            series.update(channel.values[(since.first - start) % since.times :: since.times])
        if each is None:
            return channel
        values[each.first :: each.times] = channel.values[each.first :: each.times]
        return replace(channel, values=values)

    found = stream(path, prepare=prepared, **reading)
    whole = joined(parts)
    results = {**found.variances, **found.skipped}
    for name, each in whole.channels.items():
        if each.repetition is not None:
            results |= own[name][1].result()
        elif name in found.skipped and (straight := whole.of(name, "interpolated")):
            results[name] = straight[0]
    variances = {k: v for k in whole.channels if isinstance(v := results[k], WaveletVariance)}
    skipped = {k: v for k in whole.channels if isinstance(v := results[k], Notice)}
    return replace(found, variances=variances, skipped=skipped), whole


def _issues(
    found: StreamedRecording, whole: Health | None, screening: Collection[str]
) -> Sequence[Notice]:
    """Those of the reader, those of the stretches, and what was not done."""
    if whole is None:
        text = "read a block at a time, unexamined"
        return (*found.notices, Notice("streamed", "warning", "", text, {"samples": found.n}))
    left_out = tuple(whole.channels) if "events" in screening else ()
    severe = {notice.code for notice in whole.notices if notice.severity in ("warning", "bad")}
    read = [notice for notice in found.notices if notice.code not in severe]
    fresh = [n for n in whole.notices if all(n.code != r.code for r in read)]
    streamed = Notice("streamed", "note", "", _NOT_DONE, {"samples": found.n})
    return (*read, *with_treatment(fresh, whole, left_out), streamed)


def _left_out(
    whole: Health | None, screening: Collection[str]
) -> dict[str, tuple[tuple[int, int], ...]]:
    if whole is None or "events" not in screening:
        return {}
    return {name: each.events for name, each in whole.channels.items() if each.events}
