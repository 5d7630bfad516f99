"""Issues of the data that make the fits of channels invalid."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from gmwm._core.notices import Notice
from gmwm.calibration.channel import ChannelModel

_SPOILING = {
    "not-static": ("gyro", "accel"),
    "tilt": ("accel",),
    "rate-changes": ("gyro", "accel"),
    "counts": ("gyro", "accel"),
    "gravity": ("gyro", "accel"),
    "swapped": ("gyro", "accel"),
}
"""Codes of issues of a recording, or of a sensor, that make fits invalid where bad, and of which
sensors."""

_SPOILING_CHANNEL = frozenset(
    {
        "abrupt-end",
        "dead",
        "filled",
        "held",
        "rounding",
        "saturation",
        "stuck",
        "value-repeated",
        "variance",
    }
)
"""Codes of issues of a channel that make its fit invalid where they are bad."""


LONGEST_PART = "longest-part"
"""Code of the advice for a recording with several departures from noise."""


def with_one_remedy(
    found: Mapping[str, ChannelModel | Notice], length: float
) -> tuple[dict[str, ChannelModel | Notice], list[Notice]]:
    """Models whose departures have one remedy together, where there are several, and that.

    length: Of a single recording, s; 0 for several.
    """
    models = [each for each in found.values() if not isinstance(each, Notice)]
    departed = [n for each in models for n in each.fit.notices if n.code in _CUT and _is_cut(n)]
    if not length or len(departed) < 2:
        return {**found}, []
    spans = sorted(_CUT[each.code](each.values) for each in departed)
    parts, free = [], 0.0
    for start, stop in [*spans, (length, length)]:
        parts.append((start - free, free, start))
        free = max(free, stop)
    kept, start, stop = max(parts)
    removable = all(each.values["removable"] for each in departed)
    values = {"start": start, "stop": stop, "of": length, "removable": removable}
    text = (
        f"the longest part without the {len(departed)} steps and drifts is {kept:,.0f} s of "
        f"{length:,.0f} s, from {start:.6g} s to {stop:.6g} s"
    )
    hint = "calibrate that part"
    if removable:
        hint += ", or subtract them (remove_departures=True)"

    def together(notice: Notice) -> Notice:
        if notice not in departed:
            return notice
        values = {**notice.values, "together": True}
        return replace(
            notice,
            values=values,
            hint="leave it out with the others, or subtract them",
        )

    alike = {
        name: each
        if isinstance(each, Notice)
        else replace(each, fit=replace(each.fit, notices=tuple(map(together, each.fit.notices))))
        for name, each in found.items()
    }
    return alike, [Notice(LONGEST_PART, "note", "", text, values, hint)]


_CUT: dict[str, Callable[[Mapping[str, Any]], tuple[float, float]]] = {
    "step": lambda values: (values["time_lower"], values["time_upper"]),
    "transient": lambda values: (0.0, 3.0 * values["time_upper"]),
    "drift-at-start": lambda values: (0.0, values["time_upper"]),
}
"""Code of a departure -> what a part without it leaves out, s."""


def _is_cut(notice: Notice) -> bool:
    return bool(notice.severity != "note" and notice.values["evident"])


def judged(
    found: Mapping[str, ChannelModel | Notice], issues: Sequence[Notice], *, still: bool
) -> dict[str, ChannelModel | Notice]:
    """Models of channels, with fits that are not valid where the data were not fit for them.

    issues: Of the recordings and their channels.
    still: Whether a recording that was not static is an issue.
    """
    spoiling = {
        (issue.code, issue.where): issue
        for issue in issues
        if issue.code in _SPOILING and issue.severity == "bad"
    }
    if not still:
        spoiling.pop(("not-static", ""), None)  # as the caller says
    return {
        name: each
        if isinstance(each, Notice)
        else _judged(each, (*_of_sensor(each, spoiling.values()), *_of_channel(name, issues)))
        for name, each in found.items()
    }


def _of_sensor(found: ChannelModel, spoiling: Iterable[Notice]) -> list[Notice]:
    """Those issues of the whole recording that concern its sensor."""
    sensor = found.fit.wv.quantity or "gyro"
    return [e for e in spoiling if sensor in _SPOILING[e.code] and e.where in ("", sensor)]


def _of_channel(name: str, issues: Iterable[Notice]) -> list[Notice]:
    """The issues of a channel that make its numbers wrong, once each."""
    bad = (each for each in issues if each.where == name and each.severity == "bad")
    return list({each.code: each for each in bad if each.code in _SPOILING_CHANNEL}.values())


def _judged(found: ChannelModel, spoiling: Iterable[Notice]) -> ChannelModel:
    """With a fit that is not valid where an issue of its data makes its numbers wrong."""
    notices = [Notice(e.code, "bad", "", e.text, e.values, e.hint) for e in spoiling]
    return replace(found, fit=replace(found.fit, notices=(*notices, *found.fit.notices)))
