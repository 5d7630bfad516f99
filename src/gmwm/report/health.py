"""Findings of the recording, worst first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gmwm._core.text import per_cent
from gmwm.calibration import AMBIGUITY, LONGEST_PART, Calibration
from gmwm.diagnosis import gathered
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.filter_numbers import bound
from gmwm.issues import Notice, worst_first
from gmwm.process import Model
from gmwm.report.length import part_sentence
from gmwm.report.numbers import SHOWN

_COUNTED = {"bad": "severe issue", "warning": "warning", "note": "note"}
_LEAST_CHANGE = 1e-3
_LABELS = {"bad": "severe"}


def health(calibration: Calibration) -> dict[str, Any]:
    """Content of the section: notices, worst first, and the good ones apart."""
    examined, notices = calibration.is_examined, _of_recording(calibration)
    found = findings(calibration)
    return {
        "examined": examined,
        "advice": [
            f"{_begun(n.text)}: {n.hint}. "
            + part_sentence(calibration, n.values["stop"] - n.values["start"], SHOWN)
            for n in calibration.notices
            if n.code == LONGEST_PART
        ],
        "unexamined": () if examined else list(map(str, notices)),
        "summary": _summary(found),
        "severe": any(notice.severity == "bad" for notice in found),
        "rows": _rows(found),
        "good": _rows([notice for notice in notices if notice.severity == "good"]),
    }


def findings(calibration: Calibration) -> list[Notice]:
    """What the section counts and lists, and the line above the page counts."""
    found = findings_of_fits(calibration)
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


def findings_of_fits(calibration: Calibration) -> list[Notice]:
    """Departures, and defects of fits that the recording's findings do not include."""
    known = {notice.code for notice in calibration.notices if notice.severity == "bad"}
    return [
        replace(notice, where=" ".join(part for part in (name, notice.where) if part))
        for name, fit in calibration.items()
        for notice in fit.notices
        if notice.issue.topic == "departure"
        or (notice.severity == "bad" and notice.code not in known)
    ]


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


def _rows(notices: list[Notice]) -> list[dict[str, Any]]:
    """Worst first; of equal ones, those of the whole recording before those of a channel."""
    return [
        {
            "severity": notice.severity,
            "label": _LABELS.get(notice.severity, notice.severity),
            "where": ", ".join(part for part in (notice.where, notice.source) if part),
            "text": _begun(notice.text),
            "hint": _begun(notice.hint),
            "done": notice.hint,
        }
        for notice in worst_first(sorted(notices, key=lambda notice: bool(notice.where)))
    ]


def _summary(notices: list[Notice]) -> str:
    if all(notice.severity not in ("bad", "warning") for notice in notices):
        return "No defect found."
    parts = [part for severity in _COUNTED if (part := counted(notices, severity))]
    return f"{' and '.join([', '.join(parts[:-1]), parts[-1]] if parts[1:] else parts)}."


def _begun(text: str) -> str:
    """With a capital at the beginning; units and names keep theirs."""
    return text[:1].upper() + text[1:]
