"""Each time without position fixes: the track, and how far off the next fix was."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gmwm.ins import tuning
from gmwm.ins.field.navigated import Navigated
from gmwm.ins.filter import KINDS
from gmwm.ins.geometry import ned_difference

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def position_outages(navigated: Navigated) -> list[tuple[float, float]]:
    """Times without position fixes, s since the filter's start; the longest first.

    Those of at least five usual intervals between fixes and five seconds; at most
    `gmwm.ins.tuning.OUTAGES_SHOWN`.
    """
    innovations = navigated.solution.innovations
    time = innovations.time[innovations.kind == KINDS["position"]]
    time = np.concatenate([[0.0], time])
    steps = np.diff(time)
    if not steps.size:
        return []
    long = np.flatnonzero(steps > max(5.0 * float(np.median(steps)), 5.0))
    long = long[np.argsort(-steps[long], kind="stable")][: tuning.OUTAGES_SHOWN]
    return [(float(time[i]), float(time[i + 1])) for i in long]


def outage_pictures(navigated: Navigated) -> list[tuple[str, Figure]]:
    """A title and a figure of each outage: the track, and errors with their bands.

    The truth is not known: the error is what fixes show, the difference of each from where it was
    expected, and the band is the standard deviation that the filter predicted, which grows until
    the next fix.
    """
    from gmwm import plotting

    solution, innovations = navigated.solution, navigated.solution.innovations
    positions = innovations.kind == KINDS["position"]
    fix_time, error = innovations.time[positions], innovations.value[positions]
    early = navigated.alignment.epoch * navigated.measured.imu.dt
    fixes = next(each for each in navigated.measured.aiding.fixes if each.kind == "position")
    pictures = []
    for start, end in position_outages(navigated):
        margin = max(0.25 * (end - start), 5.0)
        shown = (solution.time >= start - margin) & (solution.time <= end + margin)
        # At the end of the longest one, the state before the fix comes first.
        if np.count_nonzero(shown) < 2:
            continue
        origin = solution.lla[shown][0]
        near = (fixes.time - early >= start - margin) & (fixes.time - early <= end + margin)
        seen = (fix_time >= start - margin) & (fix_time <= end + margin)
        inside = shown & (solution.time >= start) & (solution.time <= end)
        title = (
            f"{end - start:.4g} s without position fixes, from "
            f"{navigated.clock(np.array([start]))[0]:.10g} s"
        )
        figure = plotting.measured_outage(
            track=ned_difference(solution.lla[shown], origin)[:, 1::-1],
            without=ned_difference(solution.lla[inside], origin)[:, 1::-1],
            fixes=ned_difference(fixes.value[near], origin)[:, 1::-1],
            time=solution.time[shown] - start,
            sd=solution.sd[shown, :3],
            fix_time=fix_time[seen] - start,
            error=error[seen],
        )
        pictures.append((title, figure))
    return pictures
