"""Error models of a recording of any length, from its streamed wavelet variances."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gmwm._core.notices import Notice
from gmwm._core.typing import Progress
from gmwm.calibration.calibration import Calibration, ambiguity, model_of
from gmwm.calibration.departure_notices import with_departures
from gmwm.calibration.departures import departures
from gmwm.errors import InputError
from gmwm.estimate import Fit, estimate
from gmwm.process import Model, Process
from gmwm.selection import Selection, select
from gmwm.variance import stream


def calibrate_stream(
    path: Any,
    model: Process | Model | Mapping[str, Process | Model] | None = None,
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
    fits: dict[str, Fit] = {}
    tied: dict[str, Selection] = {}
    skipped = dict(found.skipped)
    for done, (name, data) in enumerate(found.variances.items()):
        if progress is not None:
            progress(done, len(found.variances), name)
        given = model_of(name, model)
        try:
            if data.gaps is not None and data.gaps.missing > data.n / 2:
                raise InputError(
                    f"{data.gaps.missing:,} of {data.n:,} samples missing, more than half",
                    "mostly-missing",
                )
            if given is not None:
                fit = estimate(given, data)
            else:
                chosen = select(data)
                fit = chosen.fit
                if chosen.rivals:
                    tied[name] = chosen
            fits[name] = with_departures(fit, [found.source], [departures(fit)], [()])
        except InputError as error:  # of this channel; the others go on
            skipped[name] = Notice(error.code or "not-estimable", "bad", name, str(error))
    if progress is not None:
        progress(len(found.variances), len(found.variances), "")
    if not fits:
        why = "; ".join(f"{name}: {each.text}" for name, each in skipped.items())
        raise InputError(f"{found.source}: {why}")
    return Calibration(
        fits=fits,
        skipped=skipped,
        source=found.source,
        rate=1.0 / found.dt,
        n=found.n,
        notices=(
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
            *(ambiguity(name, each) for name, each in tied.items()),
        ),
        rivals={name: tuple(rival.model for rival in each.rivals) for name, each in tied.items()},
    )
