"""Whether recording and fits are healthy: verdict, findings worst first, length for a filter."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gmwm._core.pages import page_of
from gmwm._core.text import brief, per_cent
from gmwm.calibration import AMBIGUITY, LONGEST_PART, Calibration
from gmwm.diagnosis import gathered
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.filter_numbers import bound
from gmwm.issues import Notice, cause, worst_first
from gmwm.process import Model
from gmwm.report.numbers import SHOWN
from gmwm.report.page import begun, duration_text

_AIM = 0.1  # relative standard error of a deviation or a parameter that is well enough known
_COUNTED = {"bad": "severe issue", "warning": "warning", "note": "note"}
_LEAST_CHANGE = 1e-3


def health(calibration: Calibration) -> dict[str, Any]:
    """Content of the section: notices, worst first, and the good ones apart."""
    examined, notices = calibration.is_examined, _of_recording(calibration)
    found = findings(calibration)
    _, _, least = _worst(calibration, SHOWN) or ("", 0.0, np.inf)
    words = [
        f"There, a deviation at {SHOWN:g} s is known less well than to +-{100.0 * _AIM:g} %.",
        f"That part is long enough for {SHOWN:g} s outages.",
    ]
    return {
        "examined": examined,
        "advice": [
            f"{begun(n.text)}: {n.hint}. {words[least <= n.values['stop'] - n.values['start']]}"
            for n in calibration.notices
            if n.code == LONGEST_PART
        ],
        "unexamined": () if examined else list(map(str, notices)),
        "summary": _summary(found),
        "length": length_sentence(calibration, SHOWN),
        "severe": any(notice.severity == "bad" for notice in found),
        # Of equal ones, those of the whole recording before those of a channel.
        "rows": worst_first(sorted(found, key=lambda notice: bool(notice.where))),
        "good": [notice for notice in notices if notice.severity == "good"],
    }


def findings(calibration: Calibration) -> list[Notice]:
    """Departures, defects of fits, and, if it was examined, what the recording has."""
    known = {notice.code for notice in calibration.notices if notice.severity == "bad"}
    found = [
        replace(notice, where=" ".join(part for part in (name, notice.where) if part))
        for name, fit in calibration.items()
        for notice in fit.notices
        if notice.issue.topic == "departure"
        or notice.code in ("noise-scales", "curve-lags")
        or (notice.severity == "bad" and notice.code not in known)
    ]
    if calibration.is_examined:
        found += [each for each in _of_recording(calibration) if each.severity != "good"]
    return found


def counted(notices: Sequence[Notice], severity: str) -> str:
    """How many notices have a severity, in words; empty if none has."""
    count, word = sum(notice.severity == severity for notice in notices), _COUNTED[severity]
    return f"{count} {word}{'s' if count > 1 else ''}" if count else ""


def _of_recording(calibration: Calibration) -> list[Notice]:
    return [
        notice
        for notice in gathered(calibration.notices)
        if notice.code not in (AMBIGUITY, LONGEST_PART)
        and not (calibration.is_examined and notice.issue.repeats == "diagnosis")
    ]


@page_of(Calibration, "verdict")
def verdict(calibration: Calibration) -> dict[str, str]:
    """The health of sensor and recording in one line."""
    found = findings(calibration)
    is_severe = any(n.severity == "bad" for n in gathered(calibration.notices))
    removed = dict.fromkeys(n.where for n in found if n.values.get("removed"))
    causes: dict[str, list[str]] = {}  # why fits are not valid -> their channels
    for name, fit in calibration.items():
        if not fit.valid:
            causes.setdefault(trust(name, fit, calibration)[1], []).append(name)
    parts = [f"{', '.join(names)} not valid: {cause}" for cause, names in causes.items()]
    parts += [f"{', '.join(calibration.skipped)} have no model"] if calibration.skipped else []
    parts += [counted(found, severity) for severity in ("bad", "warning")]
    if removed:
        parts.append(f"departures from noise subtracted ({', '.join(removed)})")
    text = "; ".join(filter(None, parts))
    if is_severe or causes or calibration.skipped:
        all_out = not any(fit.valid for fit in calibration.values())
        state, word = ("bad", "Not healthy") if all_out or is_severe else ("care", "Usable in part")
        return {"state": state, "word": word, "text": text}
    if not calibration.is_examined:
        return {"state": "care", "word": "Not examined", "text": "the fits are valid"}
    if text:
        return {"state": "care", "word": "Healthy, with care", "text": text}
    return {"state": "good", "word": "Healthy", "text": "no defect found"}


def trust(name: str, fit: Fit, calibration: Calibration) -> tuple[bool, str]:
    """Whether the numbers of a channel can be used, and why, in about five words."""
    if (bad := cause(fit.notices)) is not None:
        return False, bad.issue.reason or bad.code.replace("-", " ")
    at = fit.goodness
    fits = "fits the data"
    if at.worst is not None:
        share = per_cent(abs(at.worst[0]))
        fits = f"within {share} of the data up to {brief(at.known_to, 2)} s"
    tied = next((n for n in calibration.notices if n.code == AMBIGUITY and n.where == name), None)
    return (
        True,
        f"{fits}, {tied.values.get('models', 2):g} models fit equally well" if tied else fits,
    )


def ambiguity(calibration: Calibration, channel: str) -> list[str]:
    """Models that fit a channel equally well, and their effect on filter numbers."""
    fit, rivals = calibration[channel], calibration.rivals.get(channel, ())
    return [
        f"{notice.text} ({notice.hint}){_effect(fit, rivals)}"
        for notice in calibration.notices
        if notice.code == AMBIGUITY and notice.where == channel
    ]


def _effect(fit: Fit, rivals: Sequence[Model]) -> str:
    """Change of the filter numbers between models that fit equally well."""
    if not rivals:
        return ""
    try:
        found = [bound(each, horizon=SHOWN, dt=fit.wv.dt) for each in (fit.model, *rivals)]
    except InputError:
        return ""
    pairs = np.array([[each.N, each.K] for each in found])
    with np.errstate(divide="ignore", invalid="ignore"):
        change = float(np.nanmax(np.max(pairs, axis=0) / np.min(pairs, axis=0))) - 1.0
    size = f"at most {per_cent(change)}" if change > _LEAST_CHANGE else "less than 0.1 %"
    text = f"Filter N and K for {SHOWN:g} s change by {size} with another of these models"
    return f". {text}" if np.isfinite(change) else ""


def _summary(notices: list[Notice]) -> str:
    if all(notice.severity not in ("bad", "warning") for notice in notices):
        return "No defect found."
    parts = [part for each in _COUNTED if (part := counted(notices, each))]
    return f"{' and '.join([', '.join(parts[:-1]), parts[-1]] if parts[1:] else parts)}."


# -- length ----------------------------------------------------------------------------------------


def is_short(fits: Iterable[Fit], horizon: float) -> bool:
    """Whether a curve ends before the horizon, and is known there by the model alone."""
    return any(fit.wv.tau[-1] < horizon for fit in fits)


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


def _worst(calibration: Calibration, horizon: float) -> tuple[str, float, float] | None:
    """Valid channel that is known worst at a horizon, its error, and the length (s) for `_AIM`."""
    errors = {
        name: known_at(fit, horizon, calibration.rivals.get(name, ()))
        for name, fit in calibration.items()
        if fit.valid
    }
    known = {name: each for name, each in errors.items() if np.isfinite(each)}
    if not known:
        return None
    worst = max(known, key=known.__getitem__)
    least = max(calibration.duration * (known[worst] / _AIM) ** 2, 4.0 * horizon)
    return worst, known[worst], least


def length_sentence(calibration: Calibration, horizon: float) -> str:
    """Whether the recording is long enough for a horizon, and how long would do."""
    found = _worst(calibration, horizon)
    if found is None:
        return ""
    worst, error, least = found
    if is_short(calibration.values(), horizon):  # what is beyond the curve tells no length
        return f"too short for {horizon:g} s outages: record an hour or more"
    share, text = f"{100.0 * error:.3g} %", duration_text(least)
    if least <= calibration.duration:
        return (
            f"long enough for {horizon:g} s outages: {worst} is known to +-{share} there; {text} "
            f"would give +-{100.0 * _AIM:g} %"
        )
    if error > _AIM:
        aim = f"for +-{100.0 * _AIM:g} % record {text} in all"
        return f"{worst}'s deviation at {horizon:g} s is known to +-{share}; {aim}"
    return f"too short for {horizon:g} s outages: record {text}"
