"""Messages of ArduPilot's binary logs (DataFlash), many at a time.

A message is two marks, the number of its kind and a body, whose length and fields a message FMT
before it states (ArduPilot, libraries/AP_Logger/README.md). Damaged bytes are passed over up to the
next marks of a kind that is known; a log of any length is read in blocks.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gmwm._core.compiled import compiled

Rows = npt.NDArray[Any]
"""Messages of a kind, a structured array of their fields."""

_FMT, _BEGIN = 0x80, 3  # number of the kind that states the others, bytes before a body
_FORM = np.dtype("u1, u1, S4, S16, S64")
_FORM.names = ("type", "length", "name", "letters", "columns")
_TYPES = {
    "a": "(32,)<i2", "b": "i1", "B": "u1", "g": "<f2", "h": "<i2", "H": "<u2", "i": "<i4",
    "I": "<u4", "f": "<f4", "n": "S4", "N": "S16", "Z": "S64", "c": "<i2", "C": "<u2", "e": "<i4",
    "E": "<u4", "L": "<i4", "d": "<f8", "M": "u1", "q": "<i8", "Q": "<u8",
}  # fmt: skip
_FACTORS = dict.fromkeys("cCeE", 0.01) | {"L": 1e-7}
_BLOCK = 1 << 22  # bytes read at a time


@compiled()
def _walk(
    data: npt.NDArray[np.uint8],
    at: int,
    end: int,
    lengths: npt.NDArray[np.int64],
    is_wanted: npt.NDArray[np.bool_],
    kinds: npt.NDArray[np.int64],
    places: npt.NDArray[np.int64],
) -> tuple[int, int, int, int]:
    """Kinds and places of wanted messages, up to an FMT or the end of what is there.

    end: Of the message before.
    Returns: count; at, where the walk goes on; between, bytes that are no messages; end of the last
        message.
    """
    count = between = 0
    while at + 3 <= data.size:
        kind = data[at + 2]
        if data[at] != 0xA3 or data[at + 1] != 0x95 or lengths[kind] < 3:
            at += 1
            continue
        if at + lengths[kind] > data.size:
            break
        if is_wanted[kind]:
            kinds[count], places[count] = kind, at
            count += 1
        between += at - end
        at += lengths[kind]
        end = at
        if kind == 0x80:
            break
    return count, at, between, end


class _Forms:
    """What the messages FMT have stated so far."""

    def __init__(self, wanted: Collection[str]):
        self.wanted = wanted
        self.names: dict[int, str] = {}
        self.types: dict[int, np.dtype[np.void]] = {}
        self.factors: dict[int, dict[str, float]] = {}
        self.lengths = np.zeros(256, np.int64)
        self.lengths[_FMT] = _BEGIN + _FORM.itemsize
        self.is_wanted = np.zeros(256, np.bool_)
        self.is_wanted[_FMT] = True

    def add(self, body: npt.NDArray[np.uint8]) -> None:
        """One more kind.

        Raises ValueError if the fields of a kind that is wanted are not those of its length.
        """
        form = np.frombuffer(body.tobytes(), _FORM)[0]
        number, name = int(form["type"]), form["name"].decode("latin-1")
        if number == _FMT:
            return
        self.lengths[number] = form["length"]
        self.is_wanted[number] = name in self.wanted
        if name not in self.wanted:
            return
        letters = form["letters"].decode("latin-1")
        fields = form["columns"].decode("latin-1").split(",")
        pairs = list(zip(fields, letters, strict=True))
        self.types[number] = np.dtype([(field, _TYPES[letter]) for field, letter in pairs])
        if self.types[number].itemsize + _BEGIN != form["length"]:
            raise ValueError(f"the fields of {name} do not have its length")
        self.names[number] = name
        self.factors[number] = {f: _FACTORS[c] for f, c in pairs if c in _FACTORS}


class Messages:
    """Messages of one kind that follow each other.

    rows: structured.
    places: Byte of the log at which each begins.
    """

    def __init__(self, kind: str, rows: Rows, places: Rows, factors: dict[str, float]):
        self.kind, self.rows, self.places, self._factors = kind, rows, places, factors

    @property
    def fields(self) -> tuple[str, ...]:
        """Their names."""
        return self.rows.dtype.names or ()

    def __getitem__(self, field: str) -> Rows:
        values = self.rows[field]
        return values * self._factors[field] if field in self._factors else values


@dataclass
class Extent:
    """How much of a log is messages, as far as it was read.

    between: Bytes between them that are none.
    end: Of the last one.
    """

    between: int = 0
    end: int = 0


def messages(
    path: Path, wanted: Collection[str], extent: Extent | None = None
) -> Iterator[Messages]:
    """Messages of some kinds, block by block.

    wanted: Names of the kinds.
    extent: Is kept up to date.
    Raises KeyError, ValueError if the statement of a wanted kind is damaged.
    """
    forms, before, rest, end = _Forms(wanted), 0, b"", 0
    extent = extent or Extent()
    with path.open("rb") as stream:
        while fresh := stream.read(_BLOCK):
            data = np.frombuffer(rest + fresh, np.uint8)
            at, count = 0, 1
            kinds, places = np.empty((2, data.size // _BEGIN + 1), np.int64)
            while count:
                count, at, between, end = _walk(
                    data, at, end, forms.lengths, forms.is_wanted, kinds, places
                )
                extent.between += between
                is_form = bool(count) and kinds[count - 1] == _FMT
                own = slice(count - is_form)
                for kind in np.unique(kinds[own]):
                    mine = places[own][kinds[own] == kind]
                    inside = _BEGIN + np.arange(forms.types[kind].itemsize)
                    rows = data[mine[:, None] + inside].view(forms.types[kind])[:, 0]
                    name = forms.names[kind]
                    yield Messages(name, rows, before + mine, forms.factors[kind])
                if is_form:
                    forms.add(data[at - _FORM.itemsize : at])
                else:
                    count = 0
            extent.end = before + end
            before += at
            end -= at
            rest = data[at:].tobytes()
