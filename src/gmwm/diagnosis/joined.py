"""The health of a recording from that of its stretches, for recordings longer than memory."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gmwm._core.notices import SEVERITIES, Notice, Severity, worst_first
from gmwm._core.text import brief, per_cent
from gmwm.diagnosis import tuning
from gmwm.diagnosis.check import health
from gmwm.diagnosis.result import ChannelHealth, Health, Repetition
from gmwm.diagnosis.samples import Lost, length_notice, lost_notices
from gmwm.errors import InputError
from gmwm.readers import CLOCK_CODES, jumps_of_all, read_blocks

_LARGEST = {"event": "height", "line": "amplitude", "resonance": "sigma"}
"""The number by which one notice stands for those of its code in all stretches."""

_ADDED = ("count", "samples")
"""Numbers of these notices that are sums over stretches."""

_IN_SOME = {
    "dead": "use the other stretches",  # such a channel is not skipped
    "interpolated": "use the other stretches",
    "repeated-samples": "one of each is used",
}
"""What is advised where some stretches only are so."""

_SUMS = frozenset({"event", "saturation", *CLOCK_CODES})

_AT_REST = ("not-static", "tilt")


@dataclass(frozen=True)
class _Noticed:
    """A notice, and the sample at which its stretch begins."""

    notice: Notice
    start: int


def health_stream(path: Any, **reading: Any) -> Health:
    """Find what is wrong with a recording that is longer than memory, read a stretch at a time.

    Each stretch, of 260,000 samples, is examined as `gmwm.health` does, and the levels of their
    noise are compared; a notice stands for those of one kind in all of them. A line or resonance is
    one of the channel if half of the stretches have it. What changes from one stretch to the next
    only is not seen, as the notice "streamed" says: slow drift, tilt and temperature, for which
    `gmwm.calibrate_stream` looks beside the noise.

    Parameters
    ----------
    path : str, path or table
        As in `gmwm.stream`.
    **reading
        The arguments of `gmwm.read`; ``rows`` of a stretch.

    Returns
    -------
    Health

    Raises
    ------
    InputError
        If the file cannot be used, or not a block at a time.
    """
    return joined([health(part) for part in read_blocks(path, **reading)])


def joined(found: Sequence[Health]) -> Health:
    """The health of a recording from that of its consecutive stretches.

    Returns: itself, of one stretch.
    Raises InputError if there is none.
    """
    if not found:
        raise InputError("there is no stretch to join: give one at least")
    if len(found) == 1:
        return found[0]
    ends = np.cumsum([each.n for each in found]).tolist()
    starts = [0, *ends[:-1]]
    rate, names = found[0].rate, tuple(found[0].channels)
    groups = _groups(found, starts)
    unsteady = [
        one for name in names if (one := _unsteady(name, [h.channels[name] for h in found]))
    ]
    spoilt = {one.where for one in unsteady}
    notices = [
        *unsteady,
        *(_one_of(group, len(found), rate) for group in groups if not _falls(group, found, spoilt)),
        *lost_notices({name: _lost(found, name) for name in names}),
    ]
    whole = [
        length_notice(ends[-1], rate),
        _streamed(len(found), found[0].n / rate),
        *(each for each in notices if not each.where),
    ]
    own = [each for name in names for each in worst_first([n for n in notices if n.where == name])]
    return Health(
        notices=(*worst_first(whole), *own),
        channels={name: _facts([each.channels[name] for each in found], starts) for name in names},
        source=found[0].source,
        rate=rate,
        n=ends[-1],
    )


def _streamed(stretches: int, length: float) -> Notice:
    """What is less than of a whole recording; a line stands out of a periodogram by its length."""
    text = (
        f"read in {stretches} stretches of {length:.4g} s: drift, tilt, motion and temperature "
        "from one to the next were not looked for, and lines are found from about "
        f"{brief(np.sqrt(stretches))} times the amplitude on"
    )
    return Notice("streamed", "note", "", text, {"stretches": stretches})


def _groups(found: Sequence[Health], starts: Sequence[int]) -> list[list[_Noticed]]:
    """Notices of one kind and place, in the order in which they are first made."""
    groups: list[list[_Noticed]] = []
    for each, start in zip(found, starts, strict=True):
        for notice in each.notices:
            group = next((group for group in groups if _alike(group[0].notice, notice)), None)
            if group is None:
                groups.append(group := [])
            group.append(_Noticed(notice, start))
    return groups


def _alike(one: Notice, other: Notice) -> bool:
    if (one.code, one.where) != (other.code, other.where):
        return False
    # Others than the strongest lines are counted together.
    if one.code not in ("line", "resonance") or ("count" in one.values) != (
        "count" in other.values
    ):
        return one.values.get("channels") == other.values.get("channels")
    return "count" in one.values or _same(one.values["frequency"], other.values["frequency"])


def _same(one: float, other: float) -> bool:
    return abs(one / other - 1.0) < tuning.SAME_PEAK


def _falls(group: Sequence[_Noticed], found: Sequence[Health], spoilt: Collection[str]) -> bool:
    """Whether it is told for the whole, or of a channel that is not clean in all stretches."""
    one = group[0].notice
    is_clean = len(group) == len(found) and one.where not in spoilt
    return one.code in ("gap", "length") or (one.code == "clean" and not is_clean)


def _lost(found: Sequence[Health], name: str) -> Lost:
    """What a channel lacks in all stretches, whether others lack the same or not.

    A gap across the end of a stretch counts twice.
    """
    gaps = [
        notice.values
        for each in found
        for notice in each.of(code="gap")
        if notice.where in ("", name)
    ]
    return Lost(
        n=sum(each.n for each in found),
        missing=sum(int(each["missing"]) for each in gaps),
        gaps=sum(int(each["gaps"]) for each in gaps),
        longest=max((float(each["longest"]) for each in gaps), default=0.0),
    )


def _one_of(group: Sequence[_Noticed], stretches: int, rate: float) -> Notice:
    """The worst notice of a group, with how many stretches have one."""
    first = group[0].notice
    if first.code == "clock-jumps":
        return jumps_of_all([each.notice for each in group])
    at = len({each.start for each in group})
    if at == stretches and all(each.notice.text == first.text for each in group):
        return first
    key = _LARGEST.get(first.code)

    def rank(each: _Noticed) -> tuple[int, float]:
        size = abs(float(each.notice.values.get(key, 0.0))) if key else 0.0
        return SEVERITIES.index(each.notice.severity), -size

    worst = min(group, key=rank)
    start = worst.start / rate
    values, where = dict(worst.notice.values), ""
    if first.code not in CLOCK_CODES:
        where = f"stretch from {start:.6g} s, from which times count; "
        values["stretch_start"] = start
    values["stretches"] = float(at)
    if first.code in _SUMS:
        known = [name for name in _ADDED if name in values]
        values |= {
            name: sum(float(each.notice.values.get(name, 0.0)) for each in group) for name in known
        }
    text = f"{worst.notice.text} ({where}{at} of {stretches} stretches have such"
    if first.code in CLOCK_CODES and values.get("count", 0.0) != worst.notice.values.get(
        "count", 0.0
    ):
        text += f", {values['count']:,.0f} in all"
    hint = _IN_SOME.get(first.code, worst.notice.hint)
    if first.code in _AT_REST and "start" in values:
        ends = [start + values.pop(end) for end in ("start", "stop")]
        hint = f"cut a part at rest from the file, such as {ends[0]:.6g} to {ends[1]:.6g} s"
    return replace(worst.notice, text=f"{text})", values=values, hint=hint)


def _unsteady(name: str, parts: Sequence[ChannelHealth]) -> Notice | None:
    """Whether the noise differs between stretches, each of which may be steady in itself."""
    levels = np.array([part.noise for part in parts if part.noise > 0.5 * part.lsb])
    if levels.size < 2:
        return None
    excess = float(np.sqrt(np.mean(levels**2)) / np.quantile(levels, 0.25, method="lower")) - 1.0
    ratio = float(np.max(levels) / np.min(levels))
    if ratio < 1.0 + tuning.UNSTEADY:
        return None
    text = (
        f"the noise is {ratio:.3g} times as large in the loudest stretch as in the quietest, so "
        f"that its mean is {per_cent(excess)} above that of the quiet quarter"
    )
    values = {"ratio": ratio, "excess": excess}
    severity: Severity = "bad" if excess > tuning.UNSTEADY else "warning"
    hint = "use a part without what vibrates"
    return Notice("variance", severity, name, text, values, hint)


def _facts(parts: Sequence[ChannelHealth], starts: Sequence[int]) -> ChannelHealth:
    steps = [part.lsb for part in parts if part.lsb > 0.0]
    times = [
        Repetition(part.repetition.times, (start + part.repetition.first) % part.repetition.times)
        for part, start in zip(parts, starts, strict=True)
        if part.repetition is not None
    ]
    known = sum(part.noise > 0.0 for part in parts)
    return ChannelHealth(
        lines=tuple(_lasting([part.lines for part in parts])),
        resonances=tuple(_lasting([part.resonances for part in parts])),
        events=tuple(
            (start + first, start + stop)
            for part, start in zip(parts, starts, strict=True)
            for first, stop in part.events
        ),
        lsb=min(steps, default=0.0),
        outliers=float(np.mean([part.outliers for part in parts])),
        held=float(np.mean([part.held for part in parts])),
        noise=float(np.median([part.noise for part in parts])),
        repetition=times[0] if len(times) >= known > 0 and len({*times}) == 1 else None,
    )


def _lasting(parts: Sequence[Sequence[tuple[float, float]]]) -> Iterator[tuple[float, float]]:
    """Peaks of half of the stretches at least, with their mean frequency and second number."""
    left = [[*peaks] for peaks in parts]
    for peaks in left:
        while peaks:
            frequency, _ = peaks[0]
            group = []
            for others in left:
                near = next((each for each in others if _same(each[0], frequency)), None)
                if near is not None:
                    others.remove(near)
                    group.append(near)
            if 2 * len(group) >= len(parts):
                yield tuple(np.mean(group, axis=0).tolist())
