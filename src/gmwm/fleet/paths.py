"""Which recordings a fleet has, and what their units are called."""

from __future__ import annotations

import glob
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import count
from pathlib import Path
from typing import Any

from gmwm._core import checks
from gmwm.errors import InputError, printable
from gmwm.fleet.unit import Item

_LONGEST = 100  # characters of a name, which file systems have with an ending

Paths = str | os.PathLike[str] | Iterable[str | os.PathLike[str]]


def recordings(paths: Paths, folder: Path | None) -> list[Item]:
    """Every recording that paths and patterns name, once, in their order.

    paths: What exists is taken as it is, brackets and all; ``**`` in a pattern stands for any
        folders.
    folder: Of the outputs, which are no recordings.
    Raises InputError if there are none, or a pattern matches nothing.
    """
    given = [paths] if isinstance(paths, str | os.PathLike) else _listed(paths)
    found: dict[str, str] = {}
    for each in given:
        if not isinstance(each, str | os.PathLike):
            raise InputError(f"{checks.shown(each)} is no path: give paths of recordings")
        for path in _matching(os.fspath(each), folder):
            found.setdefault(os.path.realpath(path), path)
    if not found:
        raise InputError("there is no recording: give one path at least")
    kept = list(found.values())
    return [Item(path, name) for path, name in zip(kept, _names(kept), strict=True)]


def _listed(paths: Any) -> list[Any]:
    try:
        return list(paths)
    except TypeError:
        raise InputError(f"{checks.shown(paths)} is no path: give paths of recordings") from None


def _matching(text: str, folder: Path | None) -> list[str]:
    if not isinstance(text, str) or "\0" in text:
        raise InputError(f"{checks.shown(text)} is no path: give paths of recordings as text")
    if not glob.has_magic(text) or os.path.lexists(text):
        return [text]
    found = [path for path in sorted(glob.glob(text, recursive=True)) if not _is_own(path, folder)]
    # ``**`` names the folders on the way too; that of a bag is a recording.
    on_the_way = {str(above) for path in found for above in Path(path).parents}
    found = [path for path in found if path.rstrip(os.sep) not in on_the_way or _is_bag(path)]
    if not found:
        raise InputError(f"no file matches {printable(text)[:200]!r}: check the pattern")
    return found


def _is_bag(path: str) -> bool:
    return os.path.isfile(os.path.join(path, "metadata.yaml"))


def _is_own(path: str, folder: Path | None) -> bool:
    """Whether it is something that fleets write into their folder, or the folder."""
    if folder is None:
        return False
    place, own = Path(os.path.realpath(path)), Path(os.path.realpath(folder))
    if place == own:
        return True
    inside = place.relative_to(own).parts if place.is_relative_to(own) else ("",)
    return inside[0] in OUTPUTS


OUTPUTS = ("calibrations", "fleet.parquet", "fleet.html", "fleet.json")
"""What a fleet writes into its folder."""


def _names(paths: Sequence[str]) -> list[str]:
    """Short names, all different also where the case of letters does not count.

    The name of the file without its ending; where that is not enough, with its ending and folders.
    """
    whole = [Path(os.path.abspath(path)).parts for path in paths]
    names = [Path(parts[-1].removesuffix(".gz")).stem for parts in whole]
    for depth in range(1, max(map(len, whole)) + 1):
        twice = _repeated(names)
        names = [
            "-".join(part.strip(os.sep) for part in parts[-depth:]) if repeated else name
            for name, parts, repeated in zip(names, whole, twice, strict=True)
        ]
    names = [_short(name) for name in names]
    taken = {name.lower() for name in names}
    for i, repeated in enumerate(_repeated(names)):
        if repeated:
            numbered = (f"{names[i]}-{k}" for k in count(i + 1))
            names[i] = next(each for each in numbered if each.lower() not in taken)
            taken.add(names[i].lower())
    return names


def _repeated(names: Sequence[str]) -> list[bool]:
    counts = Counter(name.lower() for name in names)
    return [counts[name.lower()] > 1 for name in names]


def _short(name: str) -> str:
    """A name that is one of a file everywhere and fits into a line."""
    plain = "".join(each if each.isprintable() and each not in '/\\:*?"<>|' else "_"
                    for each in name)  # fmt: skip
    return plain.strip(" .")[-_LONGEST:] or "unit"
