"""What was found in the recording, in the order in which people want to read it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from gmwm._core.notices import Notice, worst_first
from gmwm.calibration import AMBIGUITY, DEPARTURES, LONGEST_PART, Calibration
from gmwm.diagnosis import gathered

_COUNTED = (("bad", "severe issue"), ("warning", "warning"), ("note", "note"))
_LABELS = {"bad": "severe"}
_COUNTED_ELSEWHERE = ("missing-samples", "events-left-out")
"""Of an examined recording, notices of gaps and events have the same numbers."""


def health(calibration: Calibration) -> dict[str, Any]:
    """Content of the section: notices, worst first, and the good ones apart."""
    examined = calibration.is_examined
    notices = [
        notice
        for notice in gathered(calibration.notices)
        if notice.code not in (AMBIGUITY, LONGEST_PART)
        and not (examined and notice.code in _COUNTED_ELSEWHERE)
    ]
    found = findings_of_fits(calibration)
    found += [notice for notice in notices if examined and notice.severity != "good"]
    return {
        "examined": examined,
        "advice": [
            f"{_begun(n.text)}: {n.action}." for n in calibration.notices if n.code == LONGEST_PART
        ],
        "unexamined": () if examined else list(map(str, notices)),
        "summary": _summary(found),
        "severe": any(notice.severity == "bad" for notice in found),
        "rows": _rows(found),
        "good": _rows([notice for notice in notices if notice.severity == "good"]),
    }


def findings_of_fits(calibration: Calibration) -> list[Notice]:
    """Departures from noise, and what makes a fit not valid but is no finding of the recording."""
    known = {notice.code for notice in calibration.notices if notice.severity == "bad"}
    return [
        replace(notice, where=" ".join(part for part in (name, notice.where) if part))
        for name, fit in calibration.items()
        for notice in fit.notices
        if notice.code in DEPARTURES or (notice.severity == "bad" and notice.code not in known)
    ]


def ambiguity(calibration: Calibration, channel: str) -> list[str]:
    """Which models describe a channel equally well."""
    return [
        f"{notice.text} ({notice.action})"
        for notice in calibration.notices
        if notice.code == AMBIGUITY and notice.where == channel
    ]


def _rows(notices: list[Notice]) -> list[dict[str, Any]]:
    """Worst first; of equal ones, those of the whole recording before those of a channel."""
    return [
        {
            "severity": notice.severity,
            "label": _LABELS.get(notice.severity, notice.severity),
            "where": ", ".join(part for part in (notice.where, notice.source) if part),
            "text": _begun(notice.text),
            "action": _begun(notice.action),
            "done": notice.action,
        }
        for notice in worst_first(sorted(notices, key=lambda notice: bool(notice.where)))
    ]


def _summary(notices: list[Notice]) -> str:
    counts = {
        words: sum(notice.severity == severity for notice in notices)
        for severity, words in _COUNTED
    }
    parts = [f"{n} {words}{'s' if n > 1 else ''}" for words, n in counts.items() if n]
    if counts["severe issue"] or counts["warning"]:
        return f"{' and '.join([', '.join(parts[:-1]), parts[-1]] if parts[1:] else parts)}."
    return "Nothing was found that spoils the estimates."


def _begun(text: str) -> str:
    """With a capital at the beginning; units and names keep theirs."""
    return text[:1].upper() + text[1:]
