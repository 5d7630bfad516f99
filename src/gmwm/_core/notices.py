"""What a reader, a diagnosis, a fit or a selection reports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from gmwm.errors import printable

Severity = Literal["good", "note", "warning", "bad"]

SEVERITIES: tuple[Severity, ...] = ("bad", "warning", "note", "good")
"""Worst first."""


@dataclass(frozen=True)
class Notice:
    """One thing that people should know. Programs read ``code`` and ``values``, never ``text``.

    code: What kind of thing it is, in words joined by hyphens, e.g. ``"redundant-term"``.
    severity: {"good", "note", "warning", "bad"}, "note": nothing is to be done; "warning":
        estimates may be off; "bad": what it is about should not be used as it is.
    where: The channel, parameter or file that it concerns; empty if it concerns the whole.
    text: The report, with numbers and units, without the place.
    values: The numbers, in SI units, and the names that ``text`` mentions.
    hint: What is done about it, or should be.
    source: The recording, where there are several.
    """

    code: str
    severity: Severity
    where: str
    text: str
    values: Mapping[str, Any] = field(default_factory=dict)
    hint: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        for name in ("code", "where", "text", "hint", "source"):
            object.__setattr__(self, name, printable(getattr(self, name)))

    def __str__(self) -> str:
        place = "".join(f"{part}: " for part in (self.source, self.where) if part)
        return f"{place}{self.text}" + (f" ({self.hint})" if self.hint else "")

    @property
    def sentence(self) -> str:
        """The place and the text as a sentence."""
        text = str(self)
        return f"{text if self.source or self.where else text[:1].upper() + text[1:]}."

    def to_dict(self) -> dict[str, Any]:
        """In JSON types; numbers that are not finite are ``None``."""
        return {
            "code": self.code,
            "severity": self.severity,
            "where": self.where,
            "text": self.text,
            "values": {name: _plain(value) for name, value in self.values.items()},
            "hint": self.hint,
            "source": self.source,
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Notice:
        """Inverse of `to_dict`.

        Raises KeyError, TypeError, ValueError if the content is not a notice.
        """
        if content["severity"] not in SEVERITIES:
            raise ValueError(f"severity = {content['severity']!r}")
        names = ("code", "where", "text", "hint", "source")
        texts = {name: str(content[name]) for name in names}
        values = {
            str(name): float("nan") if value is None else value
            for name, value in content["values"].items()
        }
        return cls(**texts, severity=content["severity"], values=values)


def worst_first(notices: list[Notice]) -> list[Notice]:
    """Sort by severity; equal ones stay in their order."""
    return sorted(notices, key=lambda notice: SEVERITIES.index(notice.severity))


def _plain(value: Any) -> Any:
    if isinstance(value, bool | str) or value is None:
        return value
    return float(value) if np.isfinite(value) else None
