"""Error models of a recording of any length, from its streamed wavelet variances."""

from __future__ import annotations

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
from gmwm.variance import WaveletVariance, stream


def calibrate_stream(
    path: Any,
    model: GivenModels = None,
    *,
    progress: Progress | None = None,
    **reading: Any,
) -> Calibration:
    """Error model of every channel of a file that is longer than memory, read a block at a time.

    The file is taken as static. Shocks, outliers, lines, resonances, repeated samples, tilt and
    stretches at rest are not looked for, as `gmwm.calibrate` does: the notice "streamed" says so.
    Departures (steps, transients, slow periods) are.

    Parameters
    ----------
    path : str, path or table
        As in `gmwm.stream`.
    model : Process, Model or mapping, optional
        As in `gmwm.calibrate`.
    progress : callable, optional
        As in `gmwm.calibrate`, when the file is read.
    **reading
        The arguments of `gmwm.read`; ``rows`` of a block.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If the file cannot be used, or no channel of it can be calibrated.
    """
    found = stream(path, **reading)

    def one(name: str, data: WaveletVariance) -> ChannelModel | Notice:
        given = model_of(name, model)
        missing = data.gaps.missing if data.gaps is not None else 0
        dead = mostly_missing(name, missing, data.n)
        return dead or channel_model(name, lambda _: [data], given, [found.source])

    models: dict[str, ChannelModel | Notice] = {}
    for done, (name, data) in enumerate(found.variances.items()):
        if progress is not None:
            progress(done, len(found.variances), name)
        models[name] = one(name, data)
    if progress is not None:
        progress(len(found.variances), len(found.variances), "")
    return calibration_of(
        models,
        found.skipped,
        (
            *found.notices,
            Notice(
                "streamed",
                "warning",
                "",
                "read a block at a time: shocks, outliers, lines, resonances, repeated samples, "
                "tilt and motion were not looked for",
                {"samples": found.n},
                action="gmwm health of a part of it looks for them",
            ),
        ),
        source=found.source,
        rate=1.0 / found.dt,
        n=found.n,
    )
