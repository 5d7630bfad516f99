"""Issues of the data that make the fits of channels invalid."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from gmwm._core.notices import Notice
from gmwm.calibration.channel import ChannelModel

_SPOILING = {
    "not-static": ("gyro", "accel"),
    "tilt": ("accel",),
    "rate-changes": ("gyro", "accel"),
}
"""Codes of issues of a whole recording that make the fits of some sensors invalid."""

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


def judged(
    found: Mapping[str, ChannelModel | Notice], issues: Sequence[Notice], *, still: bool
) -> dict[str, ChannelModel | Notice]:
    """Models of channels, with fits that are not valid where the data were not fit for them.

    issues: Of the recordings and their channels.
    still: Whether a recording that was not static is an issue.
    """
    spoiling = {issue.code: issue for issue in issues if issue.code in _SPOILING}
    if not still:
        spoiling.pop("not-static", None)  # as the caller says
    return {
        name: each
        if isinstance(each, Notice)
        else _judged(each, (*_of_sensor(each, spoiling.values()), *_of_channel(name, issues)))
        for name, each in found.items()
    }


def _of_sensor(found: ChannelModel, spoiling: Iterable[Notice]) -> list[Notice]:
    """Those issues of the whole recording that concern its sensor."""
    sensor = found.fit.wv.quantity or "gyro"
    return [issue for issue in spoiling if sensor in _SPOILING[issue.code]]


def _of_channel(name: str, issues: Iterable[Notice]) -> list[Notice]:
    """The issues of a channel that make its numbers wrong, once each."""
    bad = (each for each in issues if each.where == name and each.severity == "bad")
    return list({each.code: each for each in bad if each.code in _SPOILING_CHANNEL}.values())


def _judged(found: ChannelModel, spoiling: Iterable[Notice]) -> ChannelModel:
    """With a fit that is not valid where an issue of its data makes its numbers wrong."""
    notices = [Notice(e.code, "bad", "", e.text, e.values, e.action) for e in spoiling]
    return replace(found, fit=replace(found.fit, notices=(*notices, *found.fit.notices)))
