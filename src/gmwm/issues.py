"""The catalogue of everything that can be reported, and the notices that refer to it.

A reader, a diagnosis, a fit, a selection or a filter reports a `Notice`: a code, a place and
values. The catalogue says once for each code how severe it is, what it does to a fit, and the
sentence and the hint that people read. Programs decide by codes, values and the attributes of an
`Issue`, never by text.

To add an issue, add its entry to the section of its room in issues.toml and report it by `notice`.
"""

import math
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from string import Formatter
from typing import Any, Literal, Self

from gmwm.errors import MissingNameError, printable

Severity = Literal["good", "note", "warning", "bad"]

SEVERITIES: tuple[Severity, ...] = ("bad", "warning", "note", "good")
"""Worst first."""

Topic = Literal[
    "reading", "clock", "recording", "samples", "departure", "fit", "selection", "filter",
    "navigation", "population",
]  # fmt: skip


@dataclass(frozen=True)
class Issue:
    """What is known of a code, wherever it is reported.

    code: Words joined by hyphens.
    sentence: Text of the notice, a template of its values and words (see `notice`); or several, by
        the name of the variant, which is empty for the usual one.
    hint: What to do next, a template too.
    severity: Usual severity; "note": nothing is to be done; "warning": estimates may be off;
        "bad": what it concerns should not be used as it is.
    topic: What it is about.
    lacks: Property of a valid fit (a key of ``Fit.reasons``) that a fit with this issue lacks,
        where it is bad.
    reason: Why the fit is not valid, in about five words.
    spoils: Sensors whose fits a bad issue of the whole recording makes invalid; ("channel",) where
        it makes that of its own channel invalid.
    masks: Whether samples are left out for it.
    user_only: Whether only the user can follow the hint.
    repeats: "reader": notices of the reader, or reasons to skip a channel, say the same;
        "diagnosis": findings of the examination have the same numbers.
    """

    code: str
    sentence: str | Mapping[str, str]
    hint: str = ""
    severity: Severity = "note"
    topic: Topic = "recording"
    lacks: str = ""
    reason: str = ""
    spoils: tuple[str, ...] = ()
    masks: bool = False
    user_only: bool = False
    repeats: Literal["", "reader", "diagnosis"] = ""


class _Stored(dict[str, Any]):
    """Values of a notice from a file, some of which may be missing."""

    def __missing__(self, name: str) -> Any:
        raise MissingNameError(f"a notice has no {name!r}: make the result again")


@dataclass(frozen=True)
class Notice:
    """One thing that people should know. Programs read ``code`` and ``values``, never ``text``.

    code: Key of the catalogue, e.g. ``"redundant-term"``.
    severity: {"good", "note", "warning", "bad"}.
    where: The channel, parameter or file that it concerns; empty if it concerns the whole.
    text: The report, with numbers and units, without the place.
    values: The numbers, in SI units, and the names that ``text`` mentions.
    hint: What was done about it, or what to do.
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
    def issue(self) -> Issue:
        """The entry of the catalogue; one without attributes for a code of the user's own."""
        return CATALOGUE.get(self.code) or Issue(self.code, "{text}")

    @property
    def sentence(self) -> str:
        """The place and the text as a sentence."""
        text = str(self)
        return f"{text if self.source or self.where else text[:1].upper() + text[1:]}."

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        """Schema of a notice in a document."""
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(
            cls.from_dict,
            serialization=core_schema.plain_serializer_function_ser_schema(cls.to_dict),
        )

    def to_dict(self) -> dict[str, Any]:
        """Everything in JSON types; numbers that are not finite are ``None``."""
        values = {name: _plain(value) for name, value in self.values.items()}
        return {**vars(self), "values": values}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """Inverse of `to_dict`.

        Raises ValueError if the content is not a notice.
        """
        own = {each.name for each in fields(cls)}
        if not isinstance(content, Mapping) or own - {*content}:
            raise ValueError("not a notice")
        if content["severity"] not in SEVERITIES:
            raise ValueError(f"severity = {str(content['severity'])[:20]!r}")
        found: dict[str, Any] = {name: str(content[name])[:10_000] for name in own}
        for each in content["values"].values():
            if not isinstance(each, float | int | str | None) or (
                isinstance(each, int) and abs(each) >= 1 << 64
            ):
                raise ValueError("values that are neither numbers nor text")
        found["values"] = _Stored(
            (str(name), float("nan") if value is None else value)
            for name, value in content["values"].items()
        )
        return cls(**found)


def notice(
    code: str,
    where: str = "",
    values: Mapping[str, Any] | None = None,
    *,
    severity: Severity | None = None,
    variant: str = "",
    hint: str | None = None,
    **words: Any,
) -> Notice:
    """A notice with the sentence and the hint of the catalogue.

    The templates are those of `str.format`; two formats are added: ``{share:.2g%}`` writes a
    share in per cent, and ``sample{count:s?}`` an s unless the count is one.

    values: Numbers in SI units, and names; kept in the notice.
    hint: Where it is not that of the catalogue; empty for none.
    words: Phrases of the templates that are no values, e.g. a number in a reader's unit.
    Raises KeyError if the code, the variant or a word of the template is unknown.
    """
    issue = CATALOGUE[code]
    known = {**(values or {}), "where": where, **words}
    sentence = issue.sentence if isinstance(issue.sentence, str) else issue.sentence[variant]
    return Notice(
        code,
        severity or issue.severity,
        where,
        _TEXT.format(sentence, **known),
        values or {},
        _TEXT.format(issue.hint if hint is None else hint, **known),
    )


def failure(code: str, where: str, text: str) -> Notice:
    """A bad notice of what could not be done, by the code and the sentence of an `InputError`."""
    return Notice(code, "bad", where, text)


class _Text(Formatter):
    """`str.format` with shares in per cent and plurals."""

    def format_field(self, value: Any, spec: str) -> str:
        if spec == "s?":
            return "" if value == 1 else "s"
        if spec.endswith("g%"):
            return f"{100.0 * value:{spec[:-1]}} %"
        return format(value, spec)


_TEXT = _Text()


def worst_first(notices: Iterable[Notice]) -> list[Notice]:
    """Sort by severity; equal ones stay in their order."""
    return sorted(notices, key=lambda each: SEVERITIES.index(each.severity))


def cause(notices: Iterable[Notice]) -> Notice | None:
    """The bad one that explains the others: a wrong unit, else a departure from noise."""
    rank = {"units_agree": 0, "stationary": 1}
    bad = (n for n in notices if n.severity == "bad")
    return min(bad, key=lambda n: rank.get(n.issue.lacks, 2), default=None)


def codes(**attributes: Any) -> frozenset[str]:
    """Codes of the issues that have these values of attributes, e.g. ``topic="clock"``."""
    return frozenset(
        issue.code
        for issue in CATALOGUE.values()
        if all(getattr(issue, name) == value for name, value in attributes.items())
    )


def _plain(value: Any) -> Any:
    if isinstance(value, bool | str) or value is None:
        return value
    return float(value) if math.isfinite(value) else None


_CONTENT = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))

CATALOGUE: Mapping[str, Issue] = {
    code: Issue(code, **{**each, "spoils": tuple(each.get("spoils", ()))})
    for code, each in _CONTENT.items()
}
"""Code -> issue."""
