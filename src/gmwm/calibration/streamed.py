"""Error models of a recording of any length, from its streamed wavelet variances."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from gmwm._core.notices import Notice
from gmwm._core.typing import Progress
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
from gmwm.diagnosis import Health, health, joined
from gmwm.process import Process
from gmwm.readers import Recording
from gmwm.variance import StreamedRecording, WaveletVariance, stream

_OF_SAMPLES = frozenset({"repeated-samples", "interpolated"})
"""Codes of issues with which a channel of a stream is not used."""


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
    its stretches at rest, outliers are left out however many they are, and a channel of which each
    sample is written several times is skipped.

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
        why = next((n for n in issues if n.where == name and n.code in _OF_SAMPLES), None)
        missing = data.gaps.missing if data.gaps is not None else 0
        why = why or mostly_missing(name, missing, data.n)
        return why or channel_model(
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
    """Wavelet variances without the samples of shocks, and the health of all stretches."""
    parts: list[Health] = []

    def without_events(part: Recording) -> Recording:
        parts.append(health(part))
        return parts[-1].masked(part) if "events" in screening else part

    found = stream(path, prepare=without_events, **reading)
    return found, joined(parts)


def _issues(
    found: StreamedRecording, whole: Health | None, screening: Collection[str]
) -> Sequence[Notice]:
    """Those of the reader, those of the stretches, and what was not done."""
    if whole is None:
        text = "read a block at a time, unexamined"
        return (*found.notices, Notice("streamed", "warning", "", text, {"samples": found.n}))
    left_out = tuple(whole.channels) if "events" in screening else ()
    fresh = [n for n in whole.notices if all(n.code != r.code for r in found.notices)]
    text = (
        "read a stretch at a time: a slow tilt, and motion and temperature from one stretch to "
        "the next, were not looked for"
    )
    streamed = Notice("streamed", "note", "", text, {"samples": found.n})
    return (*found.notices, *with_treatment(fresh, whole, left_out), streamed)


def _left_out(
    whole: Health | None, screening: Collection[str]
) -> dict[str, tuple[tuple[int, int], ...]]:
    if whole is None or "events" not in screening:
        return {}
    return {name: each.events for name, each in whole.channels.items() if each.events}
