"""Notices about a recording that moved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.text import readable
from gmwm.diagnosis import tuning
from gmwm.diagnosis.motion.motion import Motion

_LISTED = 3


def motion_notices(motion: Motion) -> list[Notice]:
    """Say when the recording moves, and which stretches are static.

    A move between two static attitudes is a tilt, which spoils the accelerometers only.
    """
    moves = [move for move in motion.moves if not move.is_tilt]
    tilts = [move for move in motion.moves if move.is_tilt]
    notices = []
    if moves:
        rate, tilt = max(move.rate for move in moves), max(move.tilt for move in moves)
        verb = "it moves"
        if rate > tuning.TURNS:
            most = "" if motion.turns_steadily else "up to "
            verb = f"it turns at {most}{readable(rate, 'rad/s')}"
        elif tilt > tuning.TILTS:
            verb = f"it tilts by {np.degrees(tilt):.2g} deg"
        text = f"not static: {verb} {_times([(m.start, m.stop) for m in moves])}"
        notices.append(
            _notice("not-static", text, motion, {"moves": len(moves), "rate": rate, "angle": tilt})
        )
    if tilts:
        largest = max(tilts, key=lambda move: move.tilt)
        angle, when = np.degrees(largest.tilt), 0.5 * (largest.start + largest.stop)
        others = f", the largest of {len(tilts)} tilts" if len(tilts) > 1 else ""
        text = f"tilted by {angle:.2g} deg at {when:.4g} s{others}: gravity moves between the axes"
        values = {"tilts": len(tilts), "angle": largest.tilt, "time": when}
        notices.append(_notice("tilt", text, motion, values))
    return notices


def _notice(code: str, text: str, motion: Motion, values: dict[str, float]) -> Notice:
    if not motion.static:
        hint = f"no stretch of {tuning.SHORTEST_STATIC:g} s is static: record again, at rest"
        return Notice(code, "bad", "", text, values, hint)
    start, stop = max(motion.static, key=lambda each: each[1] - each[0])
    values = values | {"start": start, "stop": stop}
    hint = f"use one static stretch: {_times(motion.static)}"
    return Notice(code, "bad", "", text, values, hint)


def _times(stretches: Sequence[tuple[float, float]]) -> str:
    """Some stretches, the longest ones of many."""
    longest = sorted(stretches, key=lambda each: each[0] - each[1])[:_LISTED]
    parts = [f"{start:.4g} to {stop:.4g} s" for start, stop in sorted(longest)]
    rest = len(stretches) - _LISTED
    more = f", and {rest} shorter one{'s' if rest > 1 else ''}" if rest > 0 else ""
    return f"from {', '.join(parts)}{more}"
