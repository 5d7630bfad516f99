"""The catalogue of everything that can be reported, and the notices that refer to it.

A reader, a diagnosis, a fit, a selection or a filter reports a `Notice`: a code, a place and
values. The catalogue says once for each code how severe it is, what it does to a fit, and the
sentence and the hint that people read. Programs decide by codes, values and the attributes of an
`Issue`, never by text.

To add an issue, add its entry to the section of its room below and report it by `notice`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from string import Formatter
from typing import Any, Literal

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
    def from_dict(cls, content: Mapping[str, Any]) -> Notice:
        """Inverse of `to_dict`.

        Raises ValueError if the content is not a notice.
        """
        own = {each.name for each in fields(cls)}
        if not isinstance(content, Mapping) or own - {*content}:
            raise ValueError("not a notice")
        if content["severity"] not in SEVERITIES:
            raise ValueError(f"severity = {str(content['severity'])[:20]!r}")
        found: dict[str, Any] = {name: str(content[name])[:10_000] for name in own}
        if not all(isinstance(v, float | int | str | None) for v in content["values"].values()):
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


_reading = partial(Issue, topic="reading")
_channel = partial(Issue, severity="warning", topic="samples", spoils=("channel",))
_fit = partial(Issue, topic="fit", severity="bad")
_filter = partial(Issue, topic="filter")
_navigation = partial(Issue, topic="navigation")
_population = partial(Issue, topic="population", severity="warning")

_READERS = (
    _reading("clock-jumps", {
        "": "the clock jumps by {longest:.12g} s, {time:.12g} s after the start: {missing:,.0f} "
        "sample{missing:s?} missing",
        "many": "the clock jumps {count:,} times, at most by {longest:.12g} s, {time:.12g} s after "
        "the start: {missing:,.0f} samples missing in all"}, topic="clock"),
    _reading("clock-off-grid", "{which} not a whole number of sampling intervals: the samples "
        "after it were moved to the nearest interval", topic="clock"),
    _reading("clock-wraps", "the time-stamp counter overflowed: the stamps were continued"),
    _reading("column-numbers", "line {line} was read as column numbers and left out"),
    _reading("columns-auxiliary", "auxiliary channels: {listed}"),
    _reading("columns-not-used", "column{count:s?} not used: {listed}"),
    _reading("columns-unreadable", "{what} left out"),
    _reading("counts", "{listed}: every sample is a whole number, with a noise of {noise:.3g}: raw "
        "counts of the converter, not {unit}", "multiply them by the value of one count from the "
        "data sheet", severity="bad", topic="recording", lacks="units_agree",
        reason="raw counts, not the unit given", spoils=("gyro", "accel")),
    _reading("damaged", "the file {what}; the rest is used", severity="warning", topic="recording"),
    _reading("dates", {
        "": "column {column!r} holds dates: they count as seconds since 1970-01-01",
        "fixes": "dates ({scale}) are counted in seconds since 1970-01-01, without leap seconds"},
        topic="recording"),
    _reading("gravity", {
        "unit": "the mean specific force is {in_file:.4g} {unit}, which is gravity in {likely}",
        "increments": "the accelerometer reads {usual:.4g} m/s^2, gravity over one sampling "
        "interval: velocity increments, not accelerations",
        "scale": "the accelerometer reads {usual:.4g} m/s^2, {ratio:.3g} times gravity: a sensor "
        "at rest reads 1 g, or 0 with gravity removed"}, "check its scale and range, and that the "
        "numbers are not counts", severity="bad", topic="recording", lacks="units_agree",
        reason="gravity contradicts the unit", spoils=("gyro", "accel")),
    _reading("gravity-absent", "Sensor Logger has subtracted gravity from these accelerations, "
        "using other sensors", "use TotalAcceleration or AccelerometerUncalibrated",
        severity="warning"),
    _reading("gyro-unit", {
        "noise": "white noise of {size:.3g} deg/s/sqrt(Hz) is more than gyros at rest have",
        "mean": "a mean rate of {size:.3g} deg/s is more than gyros at rest have"}, "check the "
        "unit and the sampling rate{explained}", severity="warning", topic="recording",
        lacks="units_agree", reason="likely another gyro unit", spoils=("gyro",)),
    _reading("log-dropouts", "the logger dropped {count} stretches, {duration:.3g} s in all",
        topic="recording"),
    _reading("mean-rate", "a mean rate of {size:.3g} deg/s is more than the bias of most gyros: "
        "the sensor kept turning, or is an uncalibrated low-cost gyro", "make sure that it was at "
        "rest", severity="warning", topic="recording"),
    _reading("missing-samples", {
        "all": "{each}all {n:,} samples missing",
        "one": "{each}{missing:,} of {n:,} samples missing, in one gap",
        "many": "{each}{missing:,} of {n:,} samples missing, in {gaps:,} gaps, the longest "
        "{longest:,} sample{longest:s?}"}, repeats="diagnosis"),
    _reading("other-run", "{files} beside it: written with another calibration.json", "take all "
        "files of one run, or calibrate again", severity="warning"),
    _reading("part", "the part from {start:.6g} to {stop:.6g} s is used; times count from its "
        "start"),
    _reading("partial-record", "the last record is incomplete ({bytes} of {size} bytes) and left "
        "out", severity="warning"),
    _reading("preamble", "the lines before the header (line {line}) were left out"),
    _reading("rate-changes", "the sampling rate changes from {before:.4g} to {after:.4g} Hz at "
        "about {time:.4g} s; {rate:.6g} Hz is used throughout", "use the part before or after "
        "({row})", severity="bad", topic="clock", lacks="rate_constant",
        reason="the sampling rate changed", spoils=("gyro", "accel")),
    _reading("rate-ignores-stamps", "{column} has stamps of {own:.6g} Hz, with {mean:.6g} rows a "
        "second, where the given rate is {rate:.6g} Hz", "use the stamps", severity="warning",
        topic="clock"),
    _reading("rate-stated", "the given rate of {rate:g} Hz is used"),
    _reading("rate-unlikely", "{rate:.6g} Hz is an unlikely rate of an inertial sensor",
        "check the unit of the time column", severity="warning"),
    _reading("rows-repeated", {
        "": "{count:,} row repeats an earlier one",
        "many": "{count:,} rows repeat earlier ones"}, "left out", topic="clock"),
    _reading("sentinel", "{samples} {value:.10g}{alike}, {meaning}, first at {place}: treated as "
        "missing", "check the recorder", severity="warning", masks=True),
    _reading("stamps-astray", "{stamps} far from the clock, at most by {largest:.3g} s ({place}): "
        "the samples were taken as evenly spaced", topic="clock"),
    _reading("stamps-in-bursts", "usually {rows} rows share one time stamp: it is given to the "
        "last of them, and the others are spaced at the sampling interval", "if the rows are of "
        "several sensors, keep one sensor"),
    _reading("swapped", "{contradiction}", "check which column is which channel", severity="bad",
        topic="recording", lacks="units_agree", reason="gyro and accelerometer swapped",
        spoils=("gyro", "accel")),
    _reading("temperature-interpolated", "{listed}: {count:,} values, interpolated to the samples "
        "of {first}"),
    _reading("time-column", "time stamps are read from column {used}; use time= to choose "
        "{others}"),
    _reading("time-of-day", "times of day (hhmmss) count as seconds since midnight",
        topic="recording"),
    _reading("time-stamps", "time stamps ({column}, {units}) give {rate:.6g} Hz{steps}"),
    _reading("topic", {
        "": "{sensors} read from topic {topic}",
        "others": "read from {topic}; there are also {listed}"}),
    _reading("topics-joined", "{count} topics at {listed} are joined over the {duration:.6g} s "
        "that they share"),
    _reading("units-contradicted", "the units given contradict {origin}: {listed}",
        severity="warning"),
    _reading("units-from-names", "units from {origin}: {listed}"),
)  # fmt: skip

_VARIANCE = (
    Issue("curve-shortened", "missing samples shorten the curve to tau = {tau:.3g} s; a complete "
        "record would give {complete:.3g} s", severity="warning", topic="samples"),
)  # fmt: skip

_DIAGNOSIS = (
    _channel("abrupt-end", "the distribution of the samples is cut off at {ends}: they were "
        "rectified, wrapped round or sorted out", "look for what wraps, cuts or takes absolute "
        "values between the sensor and the file", lacks="within_range",
        reason="distribution cut off", user_only=True),
    Issue("clean", "nothing found that spoils the estimates", severity="good"),
    Issue("clock", "time-stamp intervals vary by {jitter:.2g%} rms", "harmless if only the stamps "
        "are delayed; otherwise sample on the sensor's own clock", severity="warning"),
    Issue("crosstalk", "the fast noise of {both} has a correlation of {correlation:.2g}",
        "each channel has its own model; a filter may need their covariance", severity="warning",
        topic="samples"),
    _channel("dead", "every sample is {shown}: the channel is dead", "check sensor and columns; "
        "the calibration skips it", severity="bad", lacks="samples_change", repeats="reader"),
    Issue("drift", {
        "": "means of {length:.3g} s wander by {shown} rms, {times} times as much as the fast "
        "noise explains",
        "ramp": "drifts by {shown[0]} over the record, with a scatter of {shown[1]} rms about the "
        "drift"}, "estimated as a random walk or a slow Gauss-Markov process", topic="samples"),
    Issue("event", {
        "": "a spike or shock {shown} at {time:.6g} s, {duration:.2g} s long",
        "many": "{count:,.0f} spikes or shocks, the largest {shown} at {time:.6g} s, "
        "{duration:.2g} s long{others}",
        "most": "{part:.2g%} of the samples jump like spikes: held, switched or synthetic values, "
        "not sensor noise"}, "masked by gmwm calibrate; in Python use Health.masked or robust=True",
        severity="warning", topic="samples", masks=True),
    Issue("events-left-out", "{samples:,} samples of {copies}spikes, shocks or lost packets left "
        "out", topic="samples", repeats="diagnosis"),
    _channel("filled", "{share:.2g%} of the samples lie exactly on lines between their neighbours: "
        "lost or removed samples were interpolated", "set the interpolated samples to NaN",
        lacks="samples_measured", reason="interpolated samples", user_only=True),
    Issue("gap", {
        "": "{missing:,.0f} of {n:,} samples missing ({share:.2g%}) in {gaps:,.0f} gap{gaps:s?}, "
        "the longest {longest:.3g} s",
        "all": "all samples missing"}, severity="bad", topic="samples", repeats="reader"),
    Issue("heavy-tails", {
        "student": "the noise has heavy tails, like Student's t with {shape:.2g} degrees of "
        "freedom: large samples are part of it",
        "power": "the noise has heavy tails, like exp(-|x|^{shape:.2g}): large samples are part of "
        "it"}, "nothing is left out; the standard error of the white noise allows for it",
        topic="samples"),
    _channel("held", "{share:.2g%} of the samples repeat the previous one ({chance:.2g%} by "
        "chance): the last sample was written again for lost packets", "set these samples to NaN",
        lacks="samples_measured", reason="held samples", masks=True, user_only=True),
    Issue("infinite", "{count:,} infinite samples", "correct them, or set them to NaN",
        severity="bad", topic="samples", repeats="reader"),
    Issue("interpolated", "{share:.2g%} of the samples lie exactly on lines between others: "
        "interpolated from about {rate:.3g} Hz, so the noise is not the sensor's", "record the "
        "sensor's own samples: in a topic of its own, or without the driver's interpolation "
        "(RealSense: unite_imu_method 0); the calibration skips the channel", severity="bad",
        topic="samples"),
    Issue("length", {
        "": "{n:,} samples at {rate:g} Hz, {duration:.6g} s",
        "short": "{n:,} samples at {rate:g} Hz, {duration:.6g} s: too short for slow errors of "
        "minutes and more",
        "few": "no run of {fewest} samples without a gap: too short for the other checks"},
        "record an hour or more", severity="good"),
    Issue("line", {
        "": "a periodic line at {frequency:.4g} Hz, amplitude {shown}, {times} times the noise "
        "around it{also}",
        "weak": "{count:.0f} weaker periodic line{count:s?}, the strongest at {frequency:.4g} Hz, "
        "amplitude {shown}"}, "gmwm calibrate models it as a Sinusoid; or remove the source (fan, "
        "motor, mains)", topic="samples"),
    Issue("not-static", "not static: {verb} {times}", severity="warning", lacks="recording_static",
        reason="the sensor moved", spoils=("gyro", "accel")),
    Issue("outliers", {
        "": "{share:.2g%} of the samples, spread over the record, are outliers beyond four "
        "standard deviations (Gaussian noise: {usual:.2g%})",
        "fixes": "{fixes} ({share})",
        "innovations": "The filter's model does not fit: innovations are {sizes} as expected, most "
        "of them not. Either some fixes are outliers, or errors between fixes grow faster than the "
        "sensor models predict."}, "masked by gmwm calibrate; in Python use Health.masked or "
        "robust=True", severity="warning", topic="samples", masks=True),
    Issue("repeated-samples", "each sample is written {times:.0f} times: the channel's own rate is "
        "{rate:.6g} Hz", "each is used once, at that rate", topic="samples"),
    Issue("resonance", "a resonance at {frequency:.3g} Hz, damping {damping:.2g}, {times} times "
        "the noise around it, {shown} rms", "gmwm calibrate models it as a Resonance if needed",
        topic="samples"),
    _channel("rounding", {
        "": "samples come in steps of {step}, {times} times the white noise of {shown}",
        "coarse": "samples come in steps of {step}, more than three times the noise"},
        severity="bad", lacks="resolution_fine", reason="steps coarser than the noise"),
    Issue("rows-copied", {
        "": "{samples:,.0f} rows from {start:.6g} s on are exact copies of the rows from "
        "{first:.6g} s on",
        "several": "{samples:,.0f} rows are exact copies of earlier rows, in {count:,.0f} "
        "stretches; the longest is {longest:.6g} s at {start:.6g} s, a copy of {first:.6g} s"},
        "look for files joined with an overlap and for buffers sent twice", severity="warning",
        topic="samples", masks=True),
    _channel("saturation", "cut off at {ends}: {samples:,.0f} samples ({share:.2g%}) at the end of "
        "the range", "use a wider range; if they are few, set these samples to NaN",
        lacks="within_range", reason="samples cut off at range", user_only=True),
    Issue("size", "varies by {spread:.1g} {unit}, which is not sensor noise", "check the unit",
        severity="bad"),
    Issue("still-stretches", "in motion or vibrating for part of its {duration:.4g} s; at rest "
        "from {listed} |{timeline}|: these {total:.4g} s are used; the longest stretch, "
        "{longest:.4g} s, limits the averaging time", "for slower errors, record longer at rest",
        severity="warning"),
    _channel("stuck", {
        "": "stuck at {shown} for {longest:,.0f} samples from {time:.6g} s on (rounding explains "
        "{chance:,})",
        "often": "stuck {count:,.0f} times, the longest at {shown} for {longest:,.0f} samples from "
        "{time:.6g} s on (rounding explains {chance:,})",
        "log": "constant for {length:.4g} s from {start:.10g} s on: the sensor is stuck"},
        "set these samples to NaN before the fit", lacks="samples_change", reason="stuck values",
        user_only=True),
    Issue("temperature", "follows {name} by {per} (correlation {correlation:.2g})", "compensate "
        "for it first; otherwise slow noise is too large", severity="warning", user_only=True),
    Issue("tilt", "tilted by {degrees:.2g} deg at {time:.4g} s{others}: gravity moves between the "
        "axes", severity="warning", lacks="attitude_kept", reason="the sensor tilted",
        spoils=("accel",)),
    _channel("value-repeated", {
        "": "{shown} occurs in {samples:,.0f} samples ({share:.2g%}), {times} times as often as "
        "neighbouring values",
        "cut": "zero occurs twice as often as neighbouring values explain ({share:.2g%}): samples "
        "were truncated, not rounded"}, "if it marks a missing answer or a dead band, set these "
        "samples to NaN", lacks="samples_measured", reason="one value too frequent"),
    _channel("variance", {
        "": "{before}the noise is not steady: {low} in the quietest tenth of its parts of "
        "{part:.3g} s, {high} in the loudest; its mean is {excess:.2g%} above the quietest quarter",
        "half": "the noise is {growth:.2g%} {word} in the second half than in the first",
        "tenth": "the noise is {growth:.2g%} larger than usual in the tenth of the record that "
        "begins at {start:.4g} s"}, "use a recording, or a part of one, without the vibration",
        severity="bad", lacks="noise_steady", reason="the noise comes and goes", user_only=True),
    Issue("vibration", "vibration for {total:.4g} s, from {listed}: samples scatter up to {times} "
        "times as much as at rest", "use the stretches at rest (gmwm.find_still)",
        severity="warning"),
)  # fmt: skip

_CALIBRATION = (
    Issue("all-missing", "all samples missing{why}", severity="bad"),
    Issue("ambiguity", "{models} models fit equally well: {titles}{also}", "the first is used",
        topic="selection"),
    Issue("constant", "constant at {value:.6g} {unit}", severity="bad"),
    Issue("departures-many", "{removed} departures were subtracted: a bias that changes so often "
        "is sensor noise", "fit a slow term instead, such as a Gauss-Markov process",
        severity="bad", lacks="stationary", reason="the bias keeps changing"),
    Issue("departures-removed", "departures were subtracted: {times} times the deviation at "
        "{tau:.4g} s if they recur", "find their cause, or fit a slow term (--model)",
        severity="warning", topic="departure", reason="what was subtracted may recur"),
    Issue("drift-at-start", "a drift by {height} from the start that ends at {when}{also}",
        "leave it out{back}", severity="bad", topic="departure", lacks="stationary",
        reason="drift after switching on"),
    Issue("fit-not-valid", {
        "": "the fit failed; do not use these numbers",
        "filter": "the fit{count:s?} {are} not valid: do not use these numbers in a filter",
        "compared": "its own fit is not valid ({reasons})"}, "read its notices first",
        severity="warning"),
    Issue("longest-part", "the longest part without the {count} steps and drifts is {kept:,.0f} s "
        "of {of:,.0f} s, from {start:.6g} s to {stop:.6g} s", "calibrate that part"),
    Issue("mostly-missing", "{missing:,} of {n:,} samples missing, more than half{why}",
        severity="bad"),
    Issue("not-estimable", "{text}", severity="bad"),
    Issue("slow-period", "a period of {when} with an amplitude of {height}{also}", "find the "
        "cause, such as the temperature{back}", severity="bad", topic="departure",
        lacks="stationary", reason="a slow period"),
    Issue("step", "a step of {height} at {when}{also}", "calibrate only the part before or after "
        "the step{back}", severity="bad", topic="departure", lacks="stationary",
        reason="the bias stepped"),
    Issue("transient", "a transient of {height} at the start with a time constant of {when}{also}",
        "leave out the first three time constants{back}", severity="bad", topic="departure",
        lacks="stationary", reason="a transient at the start"),
    Issue("unresolved-walk", "a random walk of up to K = {shown} (95 %) is possible: with it the "
        "deviation at {tau:.4g} s is {times} times the model's", "record longer to see it"),
    Issue("unsteady", "the slow noise changes during the recording: {quiet_part} it has {less} "
        "times the deviation of the whole record, {loud_part} {more} times; the model is an "
        "average", "calibrate the part that matches how the sensor is used", severity="bad",
        lacks="noise_steady", reason="slow noise not constant"),
    # Of the noise in motion.
    Issue("motion-at-rest", "the rates do not correlate: taken as at rest, nothing is mapped"),
    Issue("motion-common", "errors that all {imus} IMUs have in common are not seen"),
    Issue("motion-events", "{events} instant{events:s?} far off left out"),
    Issue("motion-filled", "{samples} missing sample{samples:s?} interpolated"),
    Issue("motion-pairs-differ", "pairs of the other IMUs disagree in {curves} of {all} curves, up "
        "to {tau:.2g} s: IMUs share errors, or the body flexes", "the least pair is without what "
        "neighbours share", severity="warning"),
    Issue("motion-two-imus", "two IMUs: the numbers are sums of the errors of both, not of one",
        "add a third IMU", severity="warning"),
    Issue("motion-unseen", "{curves} of {all} curves are not positive somewhere, from {tau:.2g} s "
        "on: too little noise to be seen"),
)  # fmt: skip

_ESTIMATE = (
    _fit("amplitude-bound", "not significantly above zero: only an upper limit is known",
        lacks="amplitudes_above_zero", reason="a term was not found"),
    _fit("confounded", "cannot be distinguished from {other} (their estimates have a correlation "
        "of {correlation:.5f})", "fix one of them", lacks="parameters_separable",
        reason="terms cannot be separated"),
    _fit("drift-in-state", "a drift that enters the {term} state is not a ramp of the signal",
        lacks="drift_is_ramp", reason="the drift is not a ramp"),
    _fit("indistinct-terms", "two {kind} terms do not differ significantly ({first} = {one:.3g} s, "
        "{second} = {other:.3g} s)", "use one fewer", lacks="terms_distinct",
        reason="two terms look alike"),
    _fit("level-missed", "at tau = {tau:.3g} s the data lie {errors} standard errors {side} the "
        "model: it lacks a term there, or the recording has a fault", lacks="describes_every_level",
        reason="the model misses one level"),
    _fit("misfit", {
        "": "predictions over {tau:.3g} s are too {scale}: there the data lie {share} {side} the "
        "model's Allan deviation, by {errors} standard errors",
        "chance": "at tau = {tau:.3g} s the data lie {share} {side} the model's Allan deviation, "
        "which may be chance: {chance:.0f} % of correct models miss by as much",
        "slight": "within {share} of the Allan deviation (largest misfit at tau = {tau:.3g} s)",
        "allowed": "within {share} of the Allan deviation (largest misfit at tau = {tau:.3g} s), "
        "which the intervals allow for",
        "lines": "the sum of the lines misses the Allan deviation by {share} at tau = {tau:.3g} s"},
        lacks="describes_data", reason="the model misses the data"),
    _fit("no-curvature", "the likelihood has no curvature in some direction: too many parameters",
        lacks="converged", reason="the search did not converge"),
    _fit("no-region", "the Allan plot has no region of slope {named}, so it is not estimated",
        lacks="regions_found", reason="no straight region found"),
    _fit("no-test", "the fit is not tested: with these gaps there is no wavelet variance, and "
        "straight lines bridge them", severity="note"),
    _fit("not-converged", {
        "": "the maximum of the likelihood was not reached",
        "em": "EM did not converge in {iterations} iterations",
        "no-maximum": "EM did not reach a maximum of the likelihood"}, lacks="converged",
        reason="the search did not converge"),
    _fit("recordings-differ", {
        "": "the recordings do not have the same parameters (p = {equality_p:.2g}): the joint "
        "values are their mean, see the spread",
        "curves": "the wavelet variances differ from the joint model (p = {curves_p:.2g}): the "
        "recordings differ, or the model is wrong"}, lacks="recordings_agree",
        reason="the recordings disagree"),
    _fit("redundant-term", "the {term} does not improve the fit significantly: it is not "
        "identifiable", "leave it out", lacks="terms_needed", reason="a term is not needed"),
    _fit("search-limit", "the {term} is at the limit of what this record can show: it is not "
        "identifiable", "leave it out", lacks="shapes_within_search",
        reason="a correlation time beyond reach"),
    _fit("sensor-bandwidth", "the sensor's {bandwidth:.3g} Hz low-pass shapes this noise ({term}, "
        "N = {size:.3g} {unit}); a filter needs no state for it", severity="note"),
    _fit("start-missed", "a search from the starting values ended at an objective of "
        "{objective:.3g}, above the minimum {least:.3g} of the grid, which was taken",
        severity="note"),
    _fit("too-few-levels", "{levels} levels cannot determine {parameters} parameters",
        "record longer or use a smaller model", lacks="enough_levels", reason="record too short"),
    _fit("undetermined", "not determined by this record (standard error {stderr:.2g})",
        lacks="shapes_determined", reason="record too short for model"),
    _fit("wrong-slope", "from {first:.4g} to {last:.4g} s the Allan plot has the slope "
        "{slope:+.2f}, not {named}", "choose another region", lacks="slopes_agree",
        reason="slopes contradict the model"),
)  # fmt: skip

_SELECTION = (
    Issue("ramp-or-walk", "this record cannot distinguish a rate ramp of {ramp} from slow noise "
        "({slow}); the model leaves out the ramp", topic="selection"),
    Issue("time-held", "held at {tau:.3g} s: this record only shows that it is longer than "
        "{shortest:.3g} s (95 %)", topic="selection"),
    Issue("tie", {
        "": "{text}",
        "wrong": "Use none of {names}: errors are equal within the resolution of this log{but}.",
        "log": "Errors of {names} are equal within the resolution of this log{but}. {resolution}"},
        topic="selection"),
)  # fmt: skip

_FILTER_NUMBERS = (
    _filter("bounded-error", "the error of a {cause} stays bounded in the first integral: an N "
        "that covers it at all times is {factor:.2g} times too large after {horizon:g} s"),
    _filter("estimate-it", "to cover {cause}, N becomes {N_factor:.3g} times and K {K_factor:.3g} "
        "times as large", "estimate it as a state, or calibrate it", severity="warning"),
    _filter("fast-peak-left-out", "only the low-frequency density{also} of the {label} counts: it "
        "lies above {fast:.3g} Hz and averages out"),
    _filter("less-white-noise", "N is {share:.3g} times that of the error model: use N and K as a "
        "pair, for outages of the given lengths"),
    _filter("line-left-out", {
        "": "the {label} at {frequency:.4g} Hz, amplitude {size}, is left out",
        "slow": "the {label} at {frequency:.4g} Hz, amplitude {size}, is left out: it is slow for "
        "this horizon, and errors are larger than the numbers say"}),
    _filter("loose-form", {
        "": "after an outage of {time:g} s predicted errors are {tightness:.3g} times the true "
        "ones; with {tightest}, {with_state:.3g} times",
        "tightest": "after an outage of {time:g} s predicted errors are {tightness:.3g} times the "
        "true ones"}),
    _filter("more-than-random-walk", {
        "": "the model has no random walk: K covers {parts}",
        "more": "K is {times:.3g} times that of the model's random walk: it also covers {parts}"}),
    _filter("more-than-white-noise", {
        "": "the model has no white noise: N covers {parts}",
        "more": "N is {times:.3g} times that of the model's white noise: it also covers {parts}"}),
    _filter("no-navigation-filter", "the filter of all axes is left out: {reason}"),
    _filter("not-predicted", "the consistency is not predicted: {reason}"),
    _filter("optimistic", {
        "bound": "overconfident: NEES {nees:.3g} {when}; the numbers leave out too much here",
        "reduce": "overconfident: NEES {nees:.3g} after an outage of {time:g} s; no such numbers "
        "are consistent at all times and on all axes that share them",
        "beyond": "overconfident: NEES {nees:.3g} after an outage of {time:g} s, longer than the "
        "numbers are for"}, "estimate it as a state, or remove it from the data",
        severity="warning"),
    _filter("other-units", "N in use is {factor:.3g} times that of the error model: it may be in "
        "other units", "give it in {unit}/sqrt(Hz)", severity="warning"),
    _filter("ramp-as-constant", "the {label} counts as a constant of standard deviation {size}: "
        "|R| times the horizon", "for longer outages add a state for it", severity="warning"),
    _filter("from-data-sheet", "a data sheet states typical values, not those of your unit",
        "record an hour at rest: gmwm calibrate"),
    _filter("unlikely-sheet", {
        "": "N is {ratio:.2g} times the {end} of usual sensors",
        "pair": "N and the lowest deviation seldom go together: N alone reaches it after "
        "{time:.2g} s, that of usual sensors after 3 to 400 s"},
        "check their units: mdeg/s for deg/s, or ug for mg, is a factor of 1,000",
        severity="warning"),
    _filter("short-horizon", "{horizon:g} s is too short: within a second N and K follow the "
        "sensor's low-pass and its vibration, not its slow errors", "give the longest outage, or "
        "60 s if there is none: it costs an aided filter little", severity="warning"),
    _filter("turn-on-left-out", "the start bias leaves out the turn-on bias, which a recording at "
        "rest cannot show", "add its variance"),
    _filter("uncertainty-not-covered", {
        "": "parameter uncertainty is not included",
        "why": "no row 'error model, to 95 %': {reason}"}),
    _filter("upper-limit", "no such term was found: {letters} is the 95 % upper limit"),
)  # fmt: skip

_INS = (
    _navigation("attitude-given", "roll, pitch and yaw as given: {degrees} deg, 1 sigma "
        "{sd_deg:.2g} deg"),
    _navigation("axis-signs", "the sign of {wrong} is wrong{unseen}", "use the same axes forward, "
        "right, down for gyros and accelerometers: reverse {reverse}. Check every gyro by hand, "
        "because a drive does not show them all: it is positive while the right side goes down "
        "(x), the front goes up (y), it turns right (z)", severity="bad"),
    _navigation("axis-up", "its mean is positive: the axis points up, and roll is near 180 deg",
        "correct if the sensor is mounted upside down. If its z axis points up, reverse gyro_z and "
        "accel_z, and gyro_y and accel_y if y points left. If its accelerometers read the force of "
        "gravity instead of the reaction to it, reverse accel_x, accel_y and accel_z, and no gyro: "
        "the verdict distinguishes these", severity="warning"),
    _navigation("barometer-set", "barometric heights are set to the first position fix, by "
        "{shift:.3g} m"),
    _navigation("better", "Use {where}: its errors after the outages are smaller{but}.",
        severity="good"),
    _navigation("biases-assumed", "turn-on biases, which a static calibration does not know, are "
        "assumed to be {sd} (1 sigma)"),
    _navigation("columns-unused", "columns not used: {columns}"),
    _navigation("consistent", "The innovations agree with the filter's model: they are as large as "
        "expected, and white.", severity="good"),
    _navigation("diverged", {
        "": "The filter diverged: check the sensor models, the initial state and the fixes.",
        "runs": "diverged in {diverged} of {runs} runs; results are from the other runs"},
        severity="bad"),
    _navigation("fewer-runs", "{runs} runs instead of {asked}: the recording has no more separate "
        "stretches of this length", severity="warning"),
    _navigation("fixes-left-out", "{count} fixes before or after the IMU's record are left out"),
    _navigation("fixes-rejected", "{count} of {of} are rejected; the farthest is {size:.3g} sigma "
        "off at {time:.10g} s", severity="warning"),
    _navigation("fixes-repeated", "{count} position{count:s?} that repeat the one before while the "
        "vehicle moves are left out", severity="warning"),
    _navigation("fixes-step", "the fixes step by {moved} at {time:.10g} s and stay there, {count} "
        "time{count:s?} in this log: another height datum or base station", "subtract the step "
        "from the later fixes, or use the part of the log before or after it", severity="bad"),
    _navigation("heading", {
        "": "{source}: {degrees:.2f} deg, 1 sigma {sd_deg:.2g} deg",
        "wrong": "the heading that the filter started with is wrong by {by:.1f} deg (standard "
        "error {error_deg:.1g} deg): the IMU is mounted rotated, or drives backwards"}),
    _navigation("judged-on-loiter", "tested on the loiter of a fixed-wing aircraft", "give your "
        "own motion, trajectory= or scenario="),
    _navigation("levelled", "levelled on {length:.3g} s {how}, from {start:.6g} s on{bias}"),
    _navigation("lever-arm", "the antenna is off the lever arm by {parts}, standard errors in "
        "brackets", severity="bad"),
    _navigation("lost", "The filter is lost: innovations are {times} times as large as expected; "
        "do not use its predicted accuracy. Look first at {first}the initial heading, then at the "
        "units of the sensors and the clock of the fixes.", severity="bad"),
    _navigation("mixed-sizes", "The filter's model does not fit: innovations are {sizes} as "
        "expected; the standard deviations of the fixes contradict each other.", severity="bad"),
    _navigation("more-honest", "Use {where}: errors are as large, but it predicts them "
        "better{but}.", severity="good"),
    _navigation("no-time-stamps", "the IMU has no time stamps: fixes are timed from its first "
        "sample"),
    _navigation("not-white", "The filter's model does not fit: innovations are as large as "
        "expected, but correlated in time; the sensor models lack a slow error.", severity="bad"),
    _navigation("outside-linearity", "at {time:g} s the attitude is off by {tilt_deg:.2g} deg in "
        "tilt and {heading_deg:.2g} deg in heading (1 sigma): products of errors count, and NEES "
        "and errors predicted there are too small", "check them by runs, as gmwm navigate does",
        severity="warning"),
    _navigation("positions-at-zero", "{count} position{count:s?} at 0, 0 are left out",
        severity="warning"),
    _navigation("resolution", "this motion would show {shown}{missing}"),
    _navigation("samples-filled", "{count:,} missing sample{count:s?}, at most {longest} in a row, "
        "are interpolated", severity="warning"),
    _navigation("sd-assumed", "the fixes have no standard deviations; {sd} (north, east, down) is "
        "assumed", "give {where}_sd"),
    _navigation("sd-not-used", "the fixes have their own standard deviations: the given ones are "
        "not used", severity="warning"),
    _navigation("standstills", "{count} standstill{count:s?} of {length:g} s are recognised"),
    _navigation("standstills-unknown", "no standstill can be recognised: the vehicle does not "
        "stand at the start", severity="warning"),
    _navigation("time-offset", "the fixes are stamped {size:.3g} s too {late} (standard error "
        "{error:.1g} s){scale}", "{change} their times", severity="bad"),
    _navigation("time-scales", "both have dates, the fixes in {scale}: if the IMU's are in UTC, "
        "GPS time is ahead of them by the leap seconds, {seconds:g} s since 2017", "shift the "
        "fixes by as much", severity="warning"),
    _navigation("too-large", {
        "": "The filter's model does not fit: innovations are {sizes} as expected; the sensors are "
        "worse than their models, or the fixes worse than their standard deviations.",
        "assumed": "Only the standard deviations assumed for the fixes do not fit: innovations are "
        "{sizes} as expected."}, severity="bad"),
    _navigation("too-small", {
        "": "The filter's model does not fit: innovations are {sizes} as expected; the sensors are "
        "better than their models, or the fixes better than their standard deviations.",
        "assumed": "Only the standard deviations assumed for the fixes do not fit: innovations are "
        "{sizes} as expected."}, severity="bad"),
)  # fmt: skip

_POPULATION = (
    _population("channel-missing", "it has no such channel"),
    _population("channel-skipped", "{reason}"),
    _population("channels-differ", "{have} no such channel: {names}"),
    _population("curves-close", "{sentence}", severity="note"),
    _population("curves-differ", "{sentence}"),
    _population("few-recordings", "from {recordings} recordings the spread is known within factors "
        "of {low:.2g} and {factor:.2g} (95 %)", severity="note"),
    _population("few-units", "{units} unit{units:s?}: a distribution-free limit needs {needed}",
        severity="note"),
    _population("left-over", "the folder also holds {units} calibration{units:s?} of other "
        "recordings: {names}", severity="note"),
    _population("no-numbers", "{error}"),
    _population("not-noise", "{bad}", "not compared: the curve is not noise alone"),
    _population("rates-differ", {
        "": "at {rate:.6g} Hz, {others} at {usual:.6g} Hz",
        "fleet": "{have} another sampling rate than {rate:g} Hz: {names}"}, "not compared level by "
        "level"),
    _population("same-recording", {
        "": "the same recording as {other}",
        "fleet": "the same recording: {names}"}, "left out"),
    _population("units-differ", "in {own}, {others} in {common}", "not compared level by level"),
)  # fmt: skip

_STUDY = (
    _navigation("no-line", "{axes}: the Allan plot has neither a flat part nor a slope of +1/2; "
        "its lowest point gives a Gauss-Markov process"),
)  # fmt: skip

_ROOMS = (
    *(_READERS, _VARIANCE, _DIAGNOSIS, _CALIBRATION, _ESTIMATE, _SELECTION, _FILTER_NUMBERS),
    *(_INS, _POPULATION, _STUDY),
)
CATALOGUE: Mapping[str, Issue] = {issue.code: issue for room in _ROOMS for issue in room}
"""Code -> issue."""
