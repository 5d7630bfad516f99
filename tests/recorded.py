"""Whole results of small inputs against those that the code gave before: they notice changes.

What a result holds, however nested, is compared by its path. Of long arrays a few projections are
kept, which no change of any element leaves as they are. ``RECORD=1 pytest ...`` records anew.
"""

import json
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from places import GOLDEN

LONGEST = 16
"""Elements that are recorded one by one."""


def parts(found: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers, texts and arrays of what was found, each with its path."""
    if is_dataclass(found) and not isinstance(found, type):
        found = {each.name: getattr(found, each.name) for each in fields(found)}
    if isinstance(found, Mapping):
        for name, each in found.items():
            yield from parts(each, f"{path}/{name}")
    elif isinstance(found, tuple | list) and any(
        isinstance(each, str | Mapping | tuple | list | np.ndarray | None) or is_dataclass(each)
        for each in found
    ):
        for place, each in enumerate(found):
            yield from parts(each, f"{path}/{place}")
    elif found is None or isinstance(found, str | bool):
        yield path, found
    elif isinstance(found, slice):
        yield path, [found.start, found.stop]
    else:
        yield path, _short(np.asarray(found, dtype=float))


def _short(array: np.ndarray) -> Any:
    flat = array.ravel()
    if array.ndim == 0 or flat.size <= LONGEST:
        return _rounded(flat)
    there = np.isfinite(flat)
    own, place = np.where(there, flat, 0.0), np.arange(1.0, flat.size + 1.0)
    waves = (np.ones(flat.size), np.cos(place), np.sin(math.sqrt(2.0) * place))
    return {
        "shape": list(array.shape),
        "finite": int(np.sum(there)),
        "sums": _rounded(np.array([np.sum(np.abs(own)), *(own @ wave for wave in waves)])),
    }


def _rounded(values: np.ndarray) -> list[float]:
    return [float(f"{value:.10g}") for value in values.tolist()]


def _close(found: Any, expected: Any, rtol: float) -> bool:
    if isinstance(expected, dict):
        same = [found[key] == expected[key] for key in ("shape", "finite")]
        return all(same) and _close(found["sums"], expected["sums"], rtol)
    if not isinstance(expected, list) or not isinstance(found, list):
        return bool(found == expected)
    a, b = np.array(found, dtype=float), np.array(expected, dtype=float)
    largest = np.max(np.abs(b[np.isfinite(b)]), initial=0.0)
    return a.shape == b.shape and np.allclose(a, b, rtol, 1e-3 * rtol * largest, equal_nan=True)


def assert_as_recorded(name: str, found: Any, rtol: float = 1e-6) -> None:
    """Compare with ``golden/recorded/NAME.json``, element by element."""
    file = GOLDEN / "recorded" / f"{name}.json"
    now = dict(parts(found))
    if os.environ.get("RECORD"):
        file.parent.mkdir(exist_ok=True)
        lines = ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in now.items())
        file.write_text("{\n" + lines + "\n}\n", encoding="utf-8")
    then = json.loads(file.read_text(encoding="utf-8"))
    assert list(now) == list(then)
    wrong = {k: (now[k], then[k]) for k in then if not _close(now[k], then[k], rtol)}
    assert not wrong, wrong


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
