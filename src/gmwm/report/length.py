"""Whether a recording is long enough for what a filter needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gmwm._core.text import per_cent
from gmwm.calibration import Calibration
from gmwm.estimate import Fit
from gmwm.process import Model
from gmwm.report.numbers import SHOWN
from gmwm.report.text import duration_text

_AIM = 0.1  # relative standard error of a deviation or a parameter that is well enough known


def known_at(fit: Fit, tau: float, rivals: Sequence[Model] = ()) -> float:
    """Relative standard error of the model's Allan deviation at an averaging time.

    rivals: Models that describe the data as well: as far as the farthest of them.
    """
    if not fit.keys or fit.wv.dt > tau:
        return float("nan")
    with np.errstate(all="ignore"):
        value, lower, upper = fit.deviation_interval(np.array([tau]), 0.6827, rivals)
        farthest = max(upper[0] / value[0], value[0] / lower[0]) - 1.0
    return float(farthest) if value[0] > 0.0 else float("nan")


def _known(calibration: Calibration, horizon: float) -> Mapping[str, float]:
    known = {
        name: known_at(fit, horizon, calibration.rivals.get(name, ()))
        for name, fit in calibration.items()
    }
    return {name: each for name, each in known.items() if np.isfinite(each)}


def _least(calibration: Calibration, horizon: float, error: float) -> float:
    """Length (s) at which the error of the worst curve is `_AIM`."""
    return max(calibration.duration * (error / _AIM) ** 2, 4.0 * horizon)


def length_sentence(calibration: Calibration, horizon: float) -> str:
    """Whether the recording is long enough for a horizon, and how long would do."""
    known = _known(calibration, horizon)
    if not known:
        return ""
    worst = max(known, key=lambda name: known[name])
    least = _least(calibration, horizon, known[worst])
    # A curve that ends before the horizon is known there by the model alone.
    covered = min(float(fit.wv.tau[-1]) for fit in calibration.values()) >= horizon
    share, text = per_cent(known[worst]), duration_text(least)
    if least <= calibration.duration and covered:
        return (
            f"long enough for {horizon:g} s outages: {worst} is known to +-{share} there; {text} "
            f"would give +-{100.0 * _AIM:g} %"
        )
    return (
        f"too short for {horizon:g} s outages: record {text} for +-{100.0 * _AIM:g} % "
        f"(now +-{share}, {worst})"
    )


def parameters_sentence(calibration: Calibration) -> str:
    """The length at which every parameter is well known; a filter's numbers need less."""
    lengths = [
        (seconds, f"{key} of {name}")
        for name, fit in calibration.items()
        for key, seconds in fit.needed_length(_AIM).items()
    ]
    finite = [each for each in lengths if np.isfinite(each[0])]
    if not finite:
        return ""
    longest, what = max(finite)
    if longest <= calibration.duration:
        return f"Every parameter has an error of at most {100.0 * _AIM:g} %"
    known = _known(calibration, SHOWN).values()
    is_more = bool(known) and longest > _least(calibration, SHOWN, max(known))
    aside = "; a filter needs less" if is_more else ""
    return (
        f"For {100.0 * _AIM:g} % in every parameter record {duration_text(longest)} ({what}){aside}"
    )


def part_sentence(calibration: Calibration, length: float, horizon: float) -> str:
    """Whether a part (s) of the recording is long enough too."""
    known = _known(calibration, horizon)
    if not known:
        return ""
    least = _least(calibration, horizon, max(known.values()))
    word = "long enough" if least <= length else "too short"
    return f"That part is {word} for {horizon:g} s outages."
