"""Findings of several channels that have one cause."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from gmwm._core.notices import Notice
from gmwm.diagnosis import tuning


def gathered(notices: Iterable[Notice]) -> list[Notice]:
    """Lines and resonances that channels share, reported once: by the channel that shows it best.

    A mounting or a power supply is seen by several sensors at the same frequency.
    """
    groups: list[list[Notice]] = []
    for notice in notices:
        shared = (group for group in groups if _is_shared(group, notice))
        group = next(shared, None)
        if group is None:
            groups.append([notice])
        else:
            group.append(notice)
    return [_one(group) if len(group) > 1 else group[0] for group in groups]


def _is_shared(group: list[Notice], other: Notice) -> bool:
    first = group[0]
    if other.code not in ("line", "resonance") or "count" in other.values:
        return False
    if (first.code, first.severity, first.source) != (other.code, other.severity, other.source):
        return False
    if "count" in first.values or other.where in (each.where for each in group):
        return False
    within = tuning.SHARED_FREQUENCY * first.values["frequency"]
    return bool(abs(other.values["frequency"] - first.values["frequency"]) < within)


def _one(group: list[Notice]) -> Notice:
    best = max(group, key=lambda each: each.values["ratio"])
    text = (
        f"{best.text} (in {best.where}); {len(group)} channels have it: look at the mounting and "
        "the power supply"
    )
    where = ", ".join(each.where for each in group)
    actions = dict.fromkeys(each.hint for each in group if each.hint)
    return replace(best, where=where, text=text, hint="; ".join(actions))
