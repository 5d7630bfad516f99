"""Whole results of small inputs against those that were recorded when they were checked.

Nothing is judged here but change: what an answer should be is said by the tests beside these.
``RECORD=1 pytest FILE`` records anew: read the difference.
"""

import json
import math
import os
import re
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

import gmwm
from gmwm._core.notices import Notice
from places import GOLDEN

LONGEST = 8
"""Elements that are recorded one by one; of more, two sums that any change of one of them moves."""
LONGEST_TEXT = 60
"""Letters that are recorded; of more, how many words and which numbers."""

_NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d,]*\.?\d*(?:[eE][-+]?\d+)?")
_SAME = "as "


def assert_as_recorded(name: str, found: Any, rtol: float = 1e-5) -> None:
    """Compare with ``golden/recorded/NAME.json``: counts exactly, numbers in texts to 1 %.

    found: A mapping, a dataclass or a list.
    """
    file = GOLDEN / "recorded" / f"{name}.json"
    if isinstance(found, list):
        found = dict(enumerate(found))
    now = json.loads(json.dumps(_plain(found)))
    if os.environ.get("RECORD"):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("{" + ",\n".join(_lines(_entries(now))) + "}\n", encoding="utf-8")
    then = json.loads(file.read_text(encoding="utf-8"))
    for key, each in then.items():
        if isinstance(each, str) and each.startswith(_SAME) and each[len(_SAME) :] in then:
            then[key] = then[each[len(_SAME) :]]
    wrong = list(_differences(now, then, rtol, name))
    assert not wrong, "\n".join(wrong)


def _lines(entries: Iterator[str]) -> Iterator[str]:
    """As many in each as it has room for."""
    line = next(entries, "")
    for each in entries:
        if len(line) + len(each) > 98:
            yield line
            line = each
        else:
            line += f", {each}"
    yield line


def _entries(found: dict[str, Any]) -> Iterator[str]:
    """Keys with answers; where one is that of an earlier key, its name."""
    known: dict[str, str] = {}
    for key, each in found.items():
        text = json.dumps(each)
        first = known.setdefault(text, key)
        is_short = first == key or len(text) < len(first) + 20
        yield f"{json.dumps(key)}: {text if is_short else json.dumps(_SAME + first)}"


def said(text: str) -> str:
    """A long text in a few words: its length and its numbers."""
    if len(text) <= LONGEST_TEXT:
        return text
    return f"{len(text.split())} words: {' '.join(_NUMBER.findall(text))}"


def summed(found: Any) -> Any:
    """All numbers of a nested result as those of one array."""
    return np.array([*_numbers_of(found)], dtype=float)


def _numbers_of(found: Any) -> Iterator[float]:
    if is_dataclass(found) and not isinstance(found, type):
        found = {each.name: getattr(found, each.name) for each in fields(found)}
    if isinstance(found, Mapping):
        found = [*found.values()]
    if isinstance(found, tuple | list):
        for each in found:
            yield from _numbers_of(each)
    elif found is not None and not isinstance(found, str):
        yield from np.ravel(np.asarray(found, dtype=float)).tolist()


def _plain(found: Any) -> Any:
    """In the types of JSON, numbers to eight digits."""
    if isinstance(found, Notice):
        head = f"{found.severity} {found.code} {found.where}".rstrip()
        return [head, said(f"{found.text}; {found.hint}"), _plain(dict(found.values))]
    if is_dataclass(found) and not isinstance(found, type):
        found = {each.name: getattr(found, each.name) for each in fields(found)}
    if isinstance(found, Mapping):
        return {str(key): _plain(each) for key, each in found.items()}
    if isinstance(found, bool | np.bool_):
        return bool(found)
    if found is None or isinstance(found, str):
        return found and said(found)
    if isinstance(found, slice):
        return [found.start, found.stop]
    if isinstance(found, set | frozenset):
        found = sorted(found)
    if isinstance(found, np.ndarray) and found.dtype.kind not in "biuf":
        found = found.tolist()
    if isinstance(found, tuple | list) and not _are_numbers(found):
        return [_plain(each) for each in found]
    try:
        array = np.asarray(found)
    except ValueError:  # of unequal lengths
        return [_plain(each) for each in found]
    if array.size > LONGEST:
        return _short(array)
    return [_rounded(each) for each in array.ravel()] if array.ndim else _rounded(array)


def _are_numbers(found: Any) -> bool:
    if isinstance(found, tuple | list):
        return all(map(_are_numbers, found))
    if isinstance(found, np.ndarray):
        return found.dtype.kind in "biuf"
    return isinstance(found, int | float | np.number) and not isinstance(found, bool)


def _short(array: np.ndarray) -> dict[str, Any]:
    flat = array.astype(float).ravel()
    there = np.isfinite(flat)
    own, wave = np.where(there, flat, 0.0), np.cos(math.sqrt(2.0) * np.arange(1, flat.size + 1))
    missing = "" if there.all() else f", {np.sum(~there)} missing"
    shape = "x".join(map(str, array.shape))
    return {"of": shape + missing, "sums": [_rounded(np.sum(np.abs(own))), _rounded(own @ wave)]}


def _rounded(value: Any) -> float | int | str:
    if np.asarray(value).dtype.kind in "biu":
        return int(value)
    return float(f"{float(value):.8g}") if np.isfinite(value) else str(float(value))


def _differences(found: Any, expected: Any, rtol: float, path: str) -> Iterator[str]:
    """Where the two are not the same, in words."""
    if isinstance(expected, dict) and isinstance(found, dict):
        shared = [key for key in expected if key in found]
        if [*found] != [*expected]:
            gone, new = ([key for key in each if key not in shared] for each in (expected, found))
            yield f"{path}: {new} are new, {gone} are gone, or their order is another"
        for key in shared:
            yield from _differences(found[key], expected[key], rtol, f"{path}/{key}")
    elif (
        isinstance(expected, list)
        and isinstance(found, list)
        and len(found) == len(expected)
        and any(isinstance(each, str | list | dict | bool | None) for each in (*found, *expected))
    ):
        for place, each in enumerate(expected):
            yield from _differences(found[place], each, rtol, f"{path}/{place}")
    elif not _is_close(found, expected, rtol, (1.0 if path.endswith("/sums") else 1e-3) * rtol):
        yield f"{path}: {found!r} was {expected!r}"


def _is_close(found: Any, expected: Any, rtol: float, of_largest: float) -> bool:
    """Whether two texts, numbers or lists of numbers are the same.

    of_largest: Error of an element, over the largest one.
    """
    if isinstance(expected, str) and isinstance(found, str):
        numbers = [
            [float(each.replace(",", "")) for each in _NUMBER.findall(text)]
            for text in (found, expected)
        ]
        same = _NUMBER.sub("0", found) == _NUMBER.sub("0", expected)
        return same and _is_close(*numbers, 1e-2, 0.0)
    if not _are_numbers(found) or not _are_numbers(expected):
        return type(found) is type(expected) and bool(found == expected)
    a, b = np.atleast_1d(found), np.atleast_1d(expected)
    if b.dtype.kind == "i":
        return bool(np.array_equal(a, b))
    largest = np.max(np.abs(b[np.isfinite(b)]), initial=0.0)
    return a.shape == b.shape and np.allclose(a, b, rtol, max(of_largest * largest, 1e-13))


def edge(holds: Callable[[float], Any], low: float, high: float, tries: int = 12) -> float | None:
    """Where an answer changes between two numbers, by halving their ratio; None if it stays."""
    start = bool(holds(low))
    if bool(holds(high)) == start:
        return None
    for _ in range(tries):
        middle = math.sqrt(low * high)
        if bool(holds(middle)) == start:
            low = middle
        else:
            high = middle
    return high


def first(holds: Callable[[int], Any], numbers: range) -> int | None:
    """The first whole number of a range from which on something holds, by halving it."""
    found = bisect_left(numbers, True, key=lambda number: bool(holds(number)))
    return numbers[found] if found < len(numbers) else None


def refused(act: Callable[[], Any]) -> Any:
    """What comes of an act, or the message that refuses it."""
    try:
        return act()
    except (gmwm.InputError, ValueError) as error:
        return [str(error), getattr(error, "code", ""), dict(getattr(error, "values", {}))]


def reading(path: Any, **options: Any) -> Any:
    """What comes of reading a file: the recording in a few numbers, or the message."""
    found = refused(lambda: gmwm.read(path, **options))
    if isinstance(found, list):
        return [found[0].replace(str(path), "FILE"), *found[1:]]
    of_unit: dict[str, str] = {}
    for channel in found.channels:
        of_unit[channel.unit] = f"{of_unit.get(channel.unit, '')} {channel.name}".lstrip()
    all_axes = (f"{sensor}_x {sensor}_y {sensor}_z" for sensor in ("gyro", "accel"))
    if list(of_unit.values()) == [*all_axes]:
        of_unit = dict.fromkeys(of_unit, "all")
    return {
        "rate": found.rate, "jitter": found.jitter and round(found.jitter, 9), "of": of_unit,
        "n": sorted({(c.n, c.dt) for c in found.channels}),
        "missing": sum(channel.missing for channel in found.channels),
        "sums": [sum(k * float(np.nansum(channel.values * np.cos(np.arange(channel.n))))
                     for k, channel in enumerate(found.channels, 1))],
        "notices": to_nine_places(found.notices),
    }  # fmt: skip


def to_nine_places(notices: Iterable[Notice]) -> list[Notice]:
    """Notices of clocks without what rounding leaves of a jitter that is zero."""
    return [
        replace(notice, values={
            key: round(value, 9) if isinstance(value, float) else value
            for key, value in notice.values.items()
        })
        for notice in notices
    ]  # fmt: skip


class Pictures:
    """What is asked of `gmwm.plotting`, in place of drawing it."""

    def __init__(self, monkeypatch: Any) -> None:
        from gmwm import plotting

        self.asked: list[Any] = []
        for name, each in vars(plotting).items():
            if callable(each) and not name.startswith("_") and not isinstance(each, type):
                monkeypatch.setattr(plotting, name, self._asked_for(name))

    def _asked_for(self, name: str) -> Any:
        def ask(*args: Any, **named: Any) -> str:
            self.asked.append([name, list(args), named])
            return name

        return ask
