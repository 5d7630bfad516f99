"""The stretches at rest of a field log, as recordings of their own."""

from __future__ import annotations

from dataclasses import replace

from gmwm.calibration import tuning
from gmwm.diagnosis import rest_of
from gmwm.errors import InputError
from gmwm.readers import Recording


def stretches_at_rest(recording: Recording) -> tuple[Recording, ...]:
    """The recording itself if it is static, else its longest stretches at rest.

    The first of them has the notices of the recording, with one on which stretches are used.

    Raises
    ------
    InputError
        If it is not static and has no stretch at rest.
    """
    if any(notice.code == "rate-changes" for notice in recording.notices):
        return (recording,)  # times of its parts are not known
    found = rest_of(recording)
    if found is None:
        return (recording,)
    if not found.stretches:
        raise InputError(
            f"{recording.source or 'the recording'} is not static, and its longest stretch at rest "
            f"has {found.longest:.3g} s |{found.timeline}| where 10 s are needed",
            "no-rest",
            "record at rest, or give still=False to take everything as static",
        )
    longest = sorted(found.stretches, key=lambda each: each[0] - each[1])
    used = sorted(longest[: tuning.MOST_STRETCHES])
    parts = [recording.part(start, stop) for start, stop in used]
    named = [
        replace(
            part,
            source=f"{recording.source or 'recording'} from {start:.4g} to {stop:.4g} s",
            # What was noticed of the recording is not noticed of each part.
            notices=tuple(n for n in part.notices if n not in recording.notices),
        )
        for part, (start, stop) in zip(parts, used, strict=True)
    ]
    whole = [notice for notice in recording.notices if notice.code != "missing-samples"]
    first = replace(named[0], notices=(*whole, found.notice(), *named[0].notices))
    return (first, *named[1:])
