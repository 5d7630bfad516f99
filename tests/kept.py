"""Answers that are kept; ``KEEP=1 pytest FILE`` writes them again: read the diff.

Nothing is judged here but change: what an answer should be is said by the tests beside these.
"""

import json
import os
import re
from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass

import numpy as np
import pytest

import gmwm
from gmwm._core.notices import Notice
from places import GOLDEN

NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d,]*\.?\d*(?:[eE][-+]?\d+)?")


def plain(value):
    """In JSON types, numbers to nine digits."""
    if isinstance(value, Notice):
        shown = {"severity": value.severity, "where": value.where, "text": value.text}
        return {"code": value.code, **shown, "action": value.action, **plain(dict(value.values))}
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, bool | np.bool_ | str | None):
        return value if isinstance(value, str | None) else bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    return float(f"{value:.9g}") if np.isfinite(value) else str(value)


def differs(found, kept, rel):
    """Where two of these are not the same, in words; nothing if they are."""
    if isinstance(kept, dict) and isinstance(found, dict) and found.keys() == kept.keys():
        places = ((f".{key}", differs(found[key], kept[key], rel)) for key in kept)
    elif isinstance(kept, list) and isinstance(found, list) and len(found) == len(kept):
        pairs = enumerate(zip(found, kept, strict=True))
        places = ((f"[{i}]", differs(a, b, rel)) for i, (a, b) in pairs)
    elif isinstance(kept, str) and isinstance(found, str):
        texts = [NUMBER.sub("0", text) for text in (found, kept)]
        numbers = [
            [float(each.replace(",", "")) for each in NUMBER.findall(t)] for t in (found, kept)
        ]
        same = texts[0] == texts[1] and numbers[0] == pytest.approx(numbers[1], rel=1e-2)
        return "" if same else f": {found!r} was {kept!r}"
    elif isinstance(kept, float) and isinstance(found, int | float):
        return "" if found == pytest.approx(kept, rel=rel, abs=1e-15) else f": {found} was {kept}"
    else:
        return "" if type(found) is type(kept) and found == kept else f": {found} was {kept}"
    return next((f"{place}{words}" for place, words in places if words), "")


def check(name, found, rel=1e-5):
    """Compare with what is kept under a name."""
    found, path = json.loads(json.dumps(plain(found))), GOLDEN / f"{name}.json"
    if os.environ.get("KEEP"):
        path.parent.mkdir(exist_ok=True)
        lines = ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in found.items())
        path.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    kept = json.loads(path.read_text(encoding="utf-8"))
    assert list(found) == list(kept)
    for key in kept:
        words = differs(found[key], kept[key], rel)
        assert not words, f"{key}{words}"


def edge(holds, low, high, tries=22):
    """Where an answer changes between two numbers, by halving their ratio; None if it stays."""
    start = bool(holds(low))
    if bool(holds(high)) == start:
        return None
    for _ in range(tries):
        middle = float(np.sqrt(low * high))
        if bool(holds(middle)) == start:
            low = middle
        else:
            high = middle
    return high


def first(holds, numbers):
    """The first whole number of a range from which on something holds, by halving it."""
    found = bisect_left(numbers, True, key=lambda number: bool(holds(number)))
    return numbers[found] if found < len(numbers) else None


def reading(path, **options):
    """What comes of reading a file: the recording in a few numbers, or the message."""
    try:
        found = gmwm.read(path, **options)
    except gmwm.InputError as error:
        return [str(error).replace(str(path), "FILE"), error.code, dict(error.values)]
    channels = {
        channel.name: [
            channel.quantity, channel.unit, channel.n, channel.missing, channel.dt,
            float(np.nansum(channel.values * np.cos(np.arange(channel.n)))),
        ]
        for channel in found.channels
    }  # fmt: skip
    return {"rate": found.rate, "jitter": found.jitter and round(found.jitter, 9),
            "channels": channels, "notices": found.notices}  # fmt: skip
