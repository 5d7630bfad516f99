"""What was found in the recording, in the order in which people want to hear it."""

from __future__ import annotations

from typing import Any

from gmwm.calibration import Calibration
from gmwm.diagnosis import Finding

_OF_MODEL = "choice"
_COUNTED = (("bad", "bad finding"), ("warning", "warning"), ("note", "note"))


def health(calibration: Calibration) -> dict[str, Any]:
    """Content of the section: findings by channel, worst first, and the good ones apart."""
    findings = [found for found in calibration.findings if found.kind != _OF_MODEL]
    return {
        "examined": bool(findings),
        "summary": _summary(findings),
        "groups": _groups([found for found in findings if found.severity != "good"]),
        "good": _groups([found for found in findings if found.severity == "good"]),
        # Of an examined recording the findings tell all that the notes do.
        "notes": () if findings else calibration.notes,
    }


def choice(calibration: Calibration, channel: str) -> list[Finding]:
    """What is said of the choice of a channel's model."""
    return [f for f in calibration.findings if f.kind == _OF_MODEL and f.channel == channel]


def _groups(findings: list[Finding]) -> list[dict[str, Any]]:
    """Findings by recording and channel, those of the whole recording first."""
    by_place: dict[tuple[str, str], list[Finding]] = {}
    for found in findings:
        by_place.setdefault((found.channel, found.recording), []).append(found)
    return [
        {
            "name": ", ".join(part for part in (channel or "whole recording", recording) if part),
            "rows": [
                {
                    "severity": found.severity,
                    "sentence": _begun(found.sentence),
                    "action": _begun(found.action),
                }
                for found in group
            ],
        }
        for (channel, recording), group in sorted(
            by_place.items(), key=lambda item: _place(findings, item[0][0])
        )
    ]


def _place(findings: list[Finding], channel: str) -> int:
    """Where a channel stands: the whole recording first, then as they come."""
    return -1 if not channel else [found.channel for found in findings].index(channel)


def _summary(findings: list[Finding]) -> str:
    counts = {
        words: sum(found.severity == severity for found in findings) for severity, words in _COUNTED
    }
    told = [f"{n} {words}{'s' if n > 1 else ''}" for words, n in counts.items() if n]
    if counts["bad finding"] or counts["warning"]:
        return f"{' and '.join([', '.join(told[:-1]), told[-1]] if told[1:] else told)}."
    return "Nothing was found that spoils the estimates."


def _begun(text: str) -> str:
    """With a capital at the beginning; units and names keep theirs."""
    return text[:1].upper() + text[1:]
