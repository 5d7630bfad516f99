"""Issues of the data that make fits invalid, and one cut that avoids several departures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from gmwm.calibration.channel import ChannelModel
from gmwm.issues import Notice, notice

LONGEST_PART = "longest-part"
"""Code of the advice for a recording with several departures from noise."""

Found = Mapping[str, ChannelModel | Notice]
"""Channel name -> its model, or why it has none."""


def with_validity(found: Found, issues: Sequence[Notice], *, still: bool) -> Found:
    """Models of channels, with fits that are not valid where the data were not fit for them.

    issues: Of the recordings and their channels.
    still: Whether a recording that was not static is an issue.
    """

    def spoils(issue: Notice, name: str, sensor: str) -> bool:
        if issue.severity != "bad" or (issue.code == "not-static" and not still):
            return False
        if "channel" in issue.issue.spoils:
            return issue.where == name
        return sensor in issue.issue.spoils and issue.where in ("", sensor)

    marked: dict[str, ChannelModel | Notice] = {}
    for name, each in found.items():
        marked[name] = each
        if isinstance(each, Notice):
            continue
        sensor = each.fit.wv.quantity or "gyro"
        spoiling = [issue for issue in issues if spoils(issue, name, sensor)]
        # Those of the sensor first; of one code and place, the last one.
        spoiling.sort(key=lambda issue: "channel" in issue.issue.spoils)
        own = {(issue.code, issue.where): replace(issue, where="", source="") for issue in spoiling}
        fit = replace(each.fit, notices=(*own.values(), *each.fit.notices))
        marked[name] = replace(each, fit=fit)
    return marked


def advise_cut(found: Found, length: float) -> tuple[Found, list[Notice]]:
    """Where several departures can be cut off, name the longest part without any of them.

    length: Of a single recording, s; 0 for several.
    Returns: the models, whose departures refer to that advice, and the advice.
    """
    spans = []
    departed: list[Notice] = []
    for each in found.values():
        for issue in () if isinstance(each, Notice) else each.fit.notices:
            if issue.severity == "note":
                continue
            if issue.code == "step":
                spans.append((issue.values["time_lower"], issue.values["time_upper"]))
            elif issue.code == "transient":
                spans.append((0.0, 3.0 * issue.values["time_upper"]))
            elif issue.code == "drift-at-start":
                spans.append((0.0, issue.values["time_upper"]))
            else:
                continue
            departed.append(issue)
    if not length or len(departed) < 2:
        return found, []
    parts, free = [], 0.0
    for start, stop in [*sorted(spans), (length, length)]:
        parts.append((start - free, free, start))
        free = max(free, stop)
    kept, start, stop = max(parts)
    removable = all(each.values["removable"] for each in departed)
    values = {"start": start, "stop": stop, "of": length, "removable": removable}
    also = ", or subtract them (remove_departures=True)" if removable else ""
    advice = notice(LONGEST_PART, "", values, count=len(departed), kept=kept, also=also)

    def together(issue: Notice) -> Notice:
        if issue not in departed:
            return issue
        hint = "leave it out with the others, or subtract them"
        return replace(issue, values={**issue.values, "together": True}, hint=hint)

    return {
        name: each
        if isinstance(each, Notice)
        else replace(each, fit=replace(each.fit, notices=tuple(map(together, each.fit.notices))))
        for name, each in found.items()
    }, [advice]
