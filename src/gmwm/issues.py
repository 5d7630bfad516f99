"""The catalogue of everything that can be reported, and the notices that refer to it.

A reader, a diagnosis, a fit, a selection or a filter reports a `Notice`: a code, a place and
values. The catalogue says once for each code how severe it is, what it does to a fit, and the
sentence and the hint that people read. Programs decide by codes, values and the attributes of an
`Issue`, never by text.

To add an issue, add its entry to the section of its room below and report it by `notice`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from string import Formatter
from typing import Any, Literal

from gmwm.errors import printable

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
        the name of the variant.
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

        Raises ValueError if the content is not a notice.
        """
        names = ("code", "where", "text", "hint", "source")
        if not isinstance(content, Mapping) or {*names, "severity", "values"} - {*content}:
            raise ValueError("not a notice")
        if content["severity"] not in SEVERITIES:
            raise ValueError(f"severity = {str(content['severity'])[:20]!r}")
        texts = {name: str(content[name])[:10_000] for name in names}
        values = {
            str(name): float("nan") if value is None else value
            for name, value in content["values"].items()
        }
        return cls(**texts, severity=content["severity"], values=values)


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

    where: Channel, parameter or file.
    values: Numbers in SI units, and names; kept in the notice.
    severity: Where it is not the usual one.
    variant: Which of several sentences.
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


def _catalogue(*rooms: Sequence[Issue]) -> dict[str, Issue]:
    issues = [issue for room in rooms for issue in room]
    result = {issue.code: issue for issue in issues}
    if len(result) < len(issues):
        raise ValueError("a code stands twice in the catalogue")
    return result


_READERS = (
    Issue("clock-jumps", {
          "": "the clock jumps by {longest:.12g} s, {time:.12g} s after the start: "
              "{missing:,.0f} sample{missing:s?} missing",
          "many": "the clock jumps {count:,} times, farthest by {longest:.12g} s, {time:.12g} s "
                  "after the start: in all {missing:,.0f} samples missing"}, topic="clock"),
    Issue("clock-off-grid", "{which} not near a whole number of sampling intervals: the samples "
          "after it were placed at the nearest", topic="clock"),
    Issue("clock-wraps", "the counter of the time stamps overflowed: they were continued",
          topic="reading"),
    Issue("column-numbers", "line {line} was read as column numbers and left out", topic="reading"),
    Issue("columns-auxiliary", "auxiliary channels: {listed}", topic="reading"),
    Issue("columns-not-used", "column{count:s?} not used: {listed}", topic="reading"),
    Issue("columns-unreadable", "{what} left out", topic="reading"),
    Issue("counts", "{listed}: every sample is a whole number, with a noise of {noise:.3g}: counts "
          "of the converter, not {unit}",
          "multiply them by the size of a count from the data sheet", severity="bad",
          topic="recording", lacks="units_agree", reason="counts, not in the unit given",
          spoils=("gyro", "accel")),
    Issue("damaged", "the file {what}; the rest is used", severity="warning", topic="recording"),
    Issue("dates", "column {column!r} holds dates: they count as seconds since 1970-01-01",
          topic="recording"),
    Issue("gravity", {
          "unit": "the mean of the accelerometer is {in_file:.4g} {unit} long, which is gravity in "
                  "{likely}",
          "increments": "the accelerometer reads {usual:.4g} m/s^2, gravity over one sampling "
                        "interval: increments of velocity, not accelerations",
          "scale": "the accelerometer reads {usual:.4g} m/s^2, {ratio:.3g} times gravity: neither "
                   "gravity nor an accelerometer without it"},
          "check its scale and range, and that the numbers are not counts", severity="bad",
          topic="recording", lacks="units_agree", reason="gravity contradicts the unit",
          spoils=("gyro", "accel")),
    Issue("gravity-absent", "Sensor Logger has subtracted gravity from these accelerations, by "
          "what other sensors say", "use TotalAcceleration or AccelerometerUncalibrated",
          severity="warning", topic="reading"),
    Issue("gyro-unit", {
          "noise": "white noise of {size:.3g} deg/s/sqrt(Hz) is more than gyros at rest have",
          "mean": "a mean rate of {size:.3g} deg/s is more than gyros at rest have"},
          "check the unit and the sampling rate{explained}", severity="warning",
          topic="recording"),
    Issue("log-dropouts", "the logger dropped {count} stretches, {duration:.3g} s in all",
          topic="recording"),
    Issue("mean-rate", "a mean rate of {size:.3g} deg/s is more than the bias of most gyros: the "
          "sensor turned all the time, or is a cheap gyro that was not calibrated",
          "make sure that it was at rest", severity="warning", topic="recording"),
    Issue("missing-samples", {
          "all": "{each}all {n:,} samples missing",
          "one": "{each}{missing:,} of {n:,} samples missing, in one gap",
          "many": "{each}{missing:,} of {n:,} samples missing, in {gaps:,} gaps, the longest "
                  "{longest:,} sample{longest:s?}"}, topic="reading"),
    Issue("part", "the part from {start:.6g} to {stop:.6g} s is used; times count from its start",
          topic="reading"),
    Issue("partial-record", "the last record is cut off, {bytes} of its {size} bytes are there: "
          "left out", severity="warning", topic="reading"),
    Issue("preamble", "the lines before the header (line {line}) were left out", topic="reading"),
    Issue("rate-changes", "the sampling rate goes from {before:.4g} to {after:.4g} Hz at about "
          "{time:.4g} s, and {rate:.6g} Hz is taken for all of it",
          "use the part before or after ({row})", severity="bad", topic="clock",
          lacks="rate_constant", reason="the sampling rate changed", spoils=("gyro", "accel")),
    Issue("rate-stated", "the rate stated, {rate:g} Hz, is used", topic="reading"),
    Issue("rate-unlikely", "inertial sensors hardly have a rate of {rate:.6g} Hz",
          "check the unit of the time column", severity="warning", topic="reading"),
    Issue("rows-repeated", {"": "{count:,} row repeats a row before",
                            "many": "{count:,} rows repeat rows before"}, "left out",
          topic="clock"),
    Issue("sentinel", "{samples} {value:.10g}{alike}, {meaning}, first at {place}: taken as "
          "missing", "look at the recorder", severity="warning", topic="reading", masks=True),
    Issue("stamps-astray", "{stamps} far from the clock, at most by {largest:.3g} s ({place}): the "
          "samples were taken as evenly spaced", topic="clock"),
    Issue("stamps-in-bursts", "{rows} rows come with one stamp, usually: it is taken as that of "
          "the last of them, and the others are one sampling interval apart",
          "if the rows are of several sensors, keep those of one", topic="reading"),
    Issue("swapped", "{contradiction}", "check which column is which channel", severity="bad",
          topic="recording", lacks="units_agree", reason="gyro and accelerometer swapped",
          spoils=("gyro", "accel")),
    Issue("temperature-interpolated", "{listed}: {count:,} values, interpolated to the samples of "
          "{first}", topic="reading"),
    Issue("time-column", "time is column {used}; time= selects {others}", topic="reading"),
    Issue("time-of-day", "times of day (hhmmss) count as seconds since midnight",
          topic="recording"),
    Issue("time-stamps", "time stamps ({column}, {units}) give {rate:.6g} Hz{steps}",
          topic="reading"),
    Issue("topic", {"": "{sensors} of topic {topic}",
                    "others": "read from {topic}; there are also {listed}"}, topic="reading"),
    Issue("topics-joined", "{count} topics at {listed}: the {duration:.6g} s that they share are "
          "used", topic="reading"),
    Issue("units-contradicted", "the units given contradict {origin}: {listed}",
          severity="warning", topic="reading"),
    Issue("units-from-names", "units from {origin}: {listed}", topic="reading"),
)  # fmt: skip

_VARIANCE = (
    Issue("curve-shortened", "{text}", severity="warning", topic="samples"),
)  # fmt: skip

_DIAGNOSIS = (
    Issue("abrupt-end", "{text}", severity="warning", topic="samples", lacks="within_range",
          reason="samples that end abruptly", spoils=("channel",), user_only=True),
    Issue("clean", "{text}", severity="good", topic="recording"),
    Issue("clock", "{text}", severity="warning", topic="recording"),
    Issue("crosstalk", "{text}", severity="warning", topic="samples"),
    Issue("dead", "{text}", severity="bad", topic="samples", lacks="samples_change",
          spoils=("channel",)),
    Issue("drift", "{text}", topic="samples"),
    Issue("event", "{text}", severity="warning", topic="samples", masks=True),
    Issue("events-left-out", "{text}", topic="samples"),
    Issue("filled", "{text}", severity="warning", topic="samples", lacks="samples_measured",
          reason="samples put between others", spoils=("channel",), user_only=True),
    Issue("gap", "{text}", severity="bad", topic="samples"),
    Issue("heavy-tails", "{text}", topic="samples"),
    Issue("held", "{text}", severity="warning", topic="samples", lacks="samples_measured",
          reason="samples that repeat the one before", spoils=("channel",), masks=True,
          user_only=True),
    Issue("infinite", "{text}", severity="bad", topic="samples"),
    Issue("interpolated", "{text}", severity="bad", topic="samples"),
    Issue("length", "{text}", severity="good", topic="recording"),
    Issue("light-tails", "{text}", topic="samples"),
    Issue("line", "{text}", topic="samples"),
    Issue("not-static", "{text}", severity="warning", topic="recording", lacks="recording_static",
          reason="the sensor moved", spoils=("gyro", "accel")),
    Issue("outliers", "{text}", severity="warning", topic="samples", masks=True),
    Issue("repeated-samples", "{text}", topic="samples"),
    Issue("resets", "{text}", severity="warning", topic="samples", user_only=True),
    Issue("resonance", "{text}", topic="samples"),
    Issue("rounding", "{text}", severity="bad", topic="samples", lacks="resolution_fine",
          reason="steps coarser than the noise", spoils=("channel",)),
    Issue("rows-copied", "{text}", severity="warning", topic="samples", masks=True),
    Issue("saturation", "{text}", severity="warning", topic="samples", lacks="within_range",
          reason="samples cut off at range", spoils=("channel",), user_only=True),
    Issue("size", "{text}", severity="bad", topic="recording"),
    Issue("still-stretches", "{text}", severity="warning", topic="recording"),
    Issue("stuck", "{text}", severity="warning", topic="samples", lacks="samples_change",
          reason="values that stick", spoils=("channel",), user_only=True),
    Issue("temperature", "{text}", severity="warning", topic="recording", user_only=True),
    Issue("tilt", "{text}", severity="warning", topic="recording", lacks="attitude_kept",
          reason="the sensor tilted", spoils=("accel",)),
    Issue("value-repeated", "{text}", severity="warning", topic="samples",
          lacks="samples_measured", reason="one value stands for many", spoils=("channel",)),
    Issue("variance", "{text}", severity="bad", topic="samples", lacks="noise_steady",
          reason="the noise comes and goes", spoils=("channel",), user_only=True),
    Issue("vibration", "{text}", severity="warning", topic="recording"),
)  # fmt: skip

_CALIBRATION = (
    Issue("all-missing", "{text}", severity="warning", topic="recording"),
    Issue("constant", "{text}", severity="bad", topic="recording"),
    Issue("departures-many", "{text}", severity="bad", topic="recording", lacks="stationary",
          reason="the bias steps to and fro"),
    Issue("departures-removed", "{text}", severity="warning", topic="recording"),
    Issue("drift-at-start", "{text}", severity="bad", topic="departure", lacks="stationary",
          reason="drift after switching on"),
    Issue("fit-not-valid", "{text}", topic="recording"),
    Issue("longest-part", "{text}", topic="recording"),
    Issue("mostly-missing", "{text}", severity="bad", topic="recording"),
    Issue("not-estimable", "{text}", severity="bad", topic="recording"),
    Issue("slow-period", "{text}", severity="bad", topic="departure", lacks="stationary",
          reason="a slow period stands out"),
    Issue("step", "{text}", severity="bad", topic="departure", lacks="stationary",
          reason="the bias stepped"),
    Issue("transient", "{text}", severity="bad", topic="departure", lacks="stationary",
          reason="a transient at the start"),
    Issue("unresolved-walk", "{text}", topic="recording"),
    Issue("unsteady", "{text}", severity="bad", topic="recording", lacks="noise_steady",
          reason="slow noise changes its size"),
)  # fmt: skip

_ESTIMATE = (
    Issue("amplitude-bound", "{text}", severity="bad", topic="fit", lacks="amplitudes_above_zero",
          reason="a term was not found"),
    Issue("confounded", "{text}", severity="bad", topic="fit", lacks="parameters_separable",
          reason="terms cannot be separated"),
    Issue("drift-in-state", "{text}", severity="bad", topic="fit", lacks="drift_is_ramp",
          reason="the drift is no ramp"),
    Issue("indistinct-terms", "{text}", severity="bad", topic="fit", lacks="terms_distinct",
          reason="two terms look alike"),
    Issue("level-missed", "{text}", severity="bad", topic="fit", lacks="describes_every_level",
          reason="the model misses one level"),
    Issue("misfit", "{text}", severity="bad", topic="fit", lacks="describes_data",
          reason="the model misses the data"),
    Issue("no-curvature", "{text}", severity="bad", topic="fit", lacks="converged",
          reason="the search did not converge"),
    Issue("no-region", "{text}", severity="bad", topic="fit", lacks="regions_found",
          reason="no straight region found"),
    Issue("no-test", "{text}", topic="fit"),
    Issue("not-converged", "{text}", severity="bad", topic="fit", lacks="converged",
          reason="the search did not converge"),
    Issue("recordings-differ", "{text}", severity="bad", topic="fit", lacks="recordings_agree",
          reason="the recordings disagree"),
    Issue("redundant-term", "{text}", severity="bad", topic="fit", lacks="terms_needed",
          reason="a term is not needed"),
    Issue("search-limit", "{text}", severity="bad", topic="fit", lacks="shapes_within_search",
          reason="a correlation time beyond reach"),
    Issue("sensor-bandwidth", "{text}", topic="fit"),
    Issue("too-few-levels", "{text}", severity="bad", topic="fit", lacks="enough_levels",
          reason="record too short"),
    Issue("undetermined", "{text}", severity="bad", topic="fit", lacks="shapes_determined",
          reason="record too short for model"),
    Issue("wrong-slope", "{text}", severity="bad", topic="fit", lacks="slopes_agree",
          reason="slopes contradict the model"),
)  # fmt: skip

_SELECTION = (
    Issue("ramp-or-walk", "{text}", topic="selection"),
    Issue("tie", "{text}", topic="selection"),
)  # fmt: skip

_FILTER_NUMBERS = (
    Issue("bounded-error", "{text}", topic="filter"),
    Issue("estimate-it", "{text}", severity="warning", topic="filter"),
    Issue("fast-peak-left-out", "{text}", topic="filter"),
    Issue("less-white-noise", "{text}", topic="filter"),
    Issue("line-left-out", "{text}", severity="warning", topic="filter"),
    Issue("loose-form", "{text}", topic="filter"),
    Issue("more-than-random-walk", "{text}", topic="filter"),
    Issue("more-than-white-noise", "{text}", topic="filter"),
    Issue("no-navigation-filter", "{text}", topic="filter"),
    Issue("not-predicted", "{text}", topic="filter"),
    Issue("optimistic", "{text}", topic="filter"),
    Issue("other-units", "{text}", severity="warning", topic="filter"),
    Issue("ramp-as-constant", "{text}", severity="warning", topic="filter"),
    Issue("turn-on-left-out", "{text}", topic="filter"),
    Issue("uncertainty-not-covered", "{text}", topic="filter"),
)  # fmt: skip

_INS = (
    Issue("aligned-in-motion", "{text}", topic="navigation"),
    Issue("attitude-given", "{text}", topic="navigation"),
    Issue("axis-up", "{text}", severity="warning", topic="navigation"),
    Issue("barometer-set", "{text}", topic="navigation"),
    Issue("biases-assumed", "{text}", topic="navigation"),
    Issue("columns-unused", "{text}", topic="navigation"),
    Issue("consistent", "{text}", severity="good", topic="navigation"),
    Issue("diverged", "{text}", severity="bad", topic="navigation"),
    Issue("fewer-runs", "{text}", severity="warning", topic="navigation"),
    Issue("fixes-left-out", "{text}", topic="navigation"),
    Issue("fixes-rejected", "{text}", severity="warning", topic="navigation"),
    Issue("heading", "{text}", topic="navigation"),
    Issue("judged-on-loiter", "{text}", topic="navigation"),
    Issue("levelled", "{text}", topic="navigation"),
    Issue("lost", "{text}", severity="bad", topic="navigation"),
    Issue("no-time-stamps", "{text}", topic="navigation"),
    Issue("not-white", "{text}", severity="bad", topic="navigation"),
    Issue("outside-linearity", "{text}", severity="warning", topic="navigation"),
    Issue("positions-at-zero", "{text}", severity="warning", topic="navigation"),
    Issue("resolution", "{text}", topic="navigation"),
    Issue("samples-filled", "{text}", severity="warning", topic="navigation"),
    Issue("sd-assumed", "{text}", topic="navigation"),
    Issue("sd-not-used", "{text}", severity="warning", topic="navigation"),
    Issue("standstills", "{text}", topic="navigation"),
    Issue("standstills-unknown", "{text}", severity="warning", topic="navigation"),
    Issue("time-scales", "{text}", severity="warning", topic="navigation"),
)  # fmt: skip

_POPULATION = (
    Issue("channel-missing", "{text}", severity="warning", topic="population"),
    Issue("channel-skipped", "{text}", severity="warning", topic="population"),
    Issue("channels-differ", "{text}", severity="warning", topic="population"),
    Issue("clock-ratio", "{text}", severity="warning", topic="population"),
    Issue("few-recordings", "{text}", topic="population"),
    Issue("few-units", "{text}", topic="population"),
    Issue("left-over", "{text}", topic="population"),
    Issue("lengths-differ", "{text}", topic="population"),
    Issue("no-joint-model", "{text}", severity="warning", topic="population"),
    Issue("no-numbers", "{text}", severity="warning", topic="population"),
    Issue("not-noise", "{text}", severity="warning", topic="population"),
    Issue("rates-differ", "{text}", severity="warning", topic="population"),
    Issue("same-recording", "{text}", severity="warning", topic="population"),
)  # fmt: skip

_STUDY = (
    Issue("no-line", "{text}", topic="navigation"),
)  # fmt: skip

CATALOGUE: Mapping[str, Issue] = _catalogue(
    _READERS, _VARIANCE, _DIAGNOSIS, _CALIBRATION, _ESTIMATE, _SELECTION, _FILTER_NUMBERS, _INS,
    _POPULATION, _STUDY,
)  # fmt: skip
"""Code -> issue."""
